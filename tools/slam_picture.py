#!/usr/bin/env python3
"""Draws what `trundle slam` has found: path, landmarks with their 3 sigma ellipses, and a reference where there is one.

usage: tools/slam_picture.py RESULT PICTURE.svg [REFERENCE.csv]

RESULT is the folder of `trundle slam -o`: its smoothed trajectory is drawn, or else path.csv, or trajectory.csv where there
is none; landmarks where they are. The reference (time_s, x_m, y_m) is moved onto it by the best rigid motion.
"""
import csv
import math
import sys
from bisect import bisect_left
from pathlib import Path

WIDTH = 900
MOST_POINTS = 1500


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def points_of(path):
    return [(float(row["time_s"]), float(row["x_m"]), float(row["y_m"])) for row in rows_of(path)]


def at(path, times, time):
    """Where the path was, between two of its points."""
    i = bisect_left(times, time)
    if i == 0 or i == len(times):
        return None
    (t0, x0, y0), (t1, x1, y1) = path[i - 1], path[i]
    share = (time - t0) / (t1 - t0) if t1 > t0 else 0.0
    return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


def moved_onto(reference, path):
    """Least squares over rotation and translation."""
    times = [p[0] for p in path]
    pairs = [((x, y), q) for t, x, y in reference if (q := at(path, times, t))]
    count = len(pairs)
    mean = [sum(pair[k][axis] for pair in pairs) / count for k in (0, 1) for axis in (0, 1)]
    sine = cosine = 0.0
    for (x, y), (u, v) in pairs:
        a, b, c, d = x - mean[0], y - mean[1], u - mean[2], v - mean[3]
        cosine += a * c + b * d
        sine += a * d - b * c
    turn = math.atan2(sine, cosine)
    c, s = math.cos(turn), math.sin(turn)
    return [(t, mean[2] + c * (x - mean[0]) - s * (y - mean[1]), mean[3] + s * (x - mean[0]) + c * (y - mean[1]))
            for t, x, y in reference]


def ellipse(row):
    """3 sigma: half axes and the angle of the longer one."""
    xx, xy, yy = (float(row[key]) for key in ("var_xx", "var_xy", "var_yy"))
    middle, half = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
    return (3 * math.sqrt(max(middle + half, 0.0)), 3 * math.sqrt(max(middle - half, 0.0)),
            0.5 * math.degrees(math.atan2(2 * xy, xx - yy)))


def picture(path, landmarks, reference):
    xs = [p[1] for p in path + reference] + [float(row["x_m"]) for row in landmarks]
    ys = [p[2] for p in path + reference] + [float(row["y_m"]) for row in landmarks]
    left, top, width, height = min(xs), max(ys), max(xs) - min(xs), max(ys) - min(ys)
    scale = (WIDTH - 40) / width

    def to_picture(x, y):
        return f"{20 + scale * (x - left):.1f},{20 + scale * (top - y):.1f}"

    def line(points, style):
        thinned = points[::max(1, len(points) // MOST_POINTS)]
        return f'<polyline fill="none" {style} points="{" ".join(to_picture(x, y) for _, x, y in thinned)}"/>'

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {40 + scale * height:.0f}">',
             '<rect width="100%" height="100%" fill="#fff"/>']
    dots = "".join(f"M{to_picture(x, y)}h0" for _, x, y in reference[::max(1, len(reference) // MOST_POINTS)])
    parts.append(f'<path d="{dots}" stroke="#d98c2b" stroke-width="2.2" stroke-linecap="round"/>')
    parts.append(line(path, 'stroke="#1f5fa8" stroke-width="1.3"'))
    for row in landmarks:
        long, short, angle = ellipse(row)
        place = to_picture(float(row["x_m"]), float(row["y_m"]))
        cx, cy = place.split(",")
        parts.append(f'<g transform="translate({place}) rotate({-angle:.1f})"><ellipse rx="{scale * long:.1f}" '
                     f'ry="{scale * short:.1f}" fill="none" stroke="#2c8a4b" stroke-width="0.7"/></g>'
                     f'<circle cx="{cx}" cy="{cy}" r="1.8" fill="#2c8a4b"/>')
    bar = 10 ** math.floor(math.log10(width / 3))
    y = 25 + scale * height
    parts.append(f'<path d="M20 {y:.0f}h{scale * bar:.1f}" stroke="#333" stroke-width="2"/>'
                 f'<text x="{28 + scale * bar:.0f}" y="{y + 4:.0f}" font-family="sans-serif" font-size="12">{bar:g} m</text>')
    return "\n".join(parts + ["</svg>"]) + "\n"


def main():
    result, target = Path(sys.argv[1]), Path(sys.argv[2])
    is_whole = (result / "online.csv").exists() or not (result / "path.csv").exists()
    path = points_of(result / ("trajectory.csv" if is_whole else "path.csv"))
    reference = moved_onto(points_of(sys.argv[3]), path) if len(sys.argv) > 3 else []
    landmarks = result / "landmarks.csv"
    target.write_text(picture(path, rows_of(landmarks) if landmarks.exists() else [], reference))


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    main()
