#!/usr/bin/env python3
"""Root mean square distance [m] of the landmarks of a map from where they are.

usage: tools/map_error.py MAP TRUTH [--align]

MAP and TRUTH are tables with landmark,x_m,y_m; landmarks that only one of them has do not count. --align first moves and
turns the map as a whole to where it fits best.
"""
import csv
import math
import sys


def read(path):
    with open(path, newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return {row["landmark"]: complex(float(row["x_m"]), float(row["y_m"])) for row in rows}


def aligned(points, truth):
    """Complex numbers: a turn is a factor of length 1."""
    middle = sum(points) / len(points)
    true_middle = sum(truth) / len(truth)
    turn = sum((p - middle).conjugate() * (t - true_middle) for p, t in zip(points, truth))
    turn /= abs(turn)
    return [true_middle + turn * (p - middle) for p in points]


def main():
    estimate, truth = read(sys.argv[1]), read(sys.argv[2])
    names = sorted(estimate.keys() & truth.keys())
    points, places = [estimate[n] for n in names], [truth[n] for n in names]
    if "--align" in sys.argv:
        points = aligned(points, places)
    print(f"{math.sqrt(sum(abs(p - t) ** 2 for p, t in zip(points, places)) / len(names)):.4f}")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main()
