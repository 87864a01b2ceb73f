#!/usr/bin/env python3
"""Writes a folder of results as an hour at 200 Hz leaves it: four trajectories of 720 000 poses with covariance, and the
statistics of as many intervals of slip and steps of a filter. tools/page_speed.py FOLDER"""
import json
import math
import random
import sys
from pathlib import Path

RATE_HZ, DURATION_S = 200, 3600


def pose(time_s, drift):
    """On a slowly turning flower, seen by odometry that drifts."""
    angle = time_s / 40.0 + 1e-5 * drift * time_s
    radius = 8.0 + 4.0 * math.sin(time_s / 23.0)
    return radius * math.cos(angle) + 1e-4 * drift * time_s, radius * math.sin(angle), angle + math.pi / 2


def write_trajectory(path, drift, noise):
    with open(path, "w") as file:
        print("time_s,x_m,y_m,heading_rad,var_xx,var_xy,var_xh,var_yy,var_yh,var_hh", file=file)
        for i in range(RATE_HZ * DURATION_S):
            time_s = i / RATE_HZ
            x, y, heading = pose(time_s, drift)
            var = 1e-4 + 2e-5 * drift * time_s
            print(f"{time_s},{x + random.gauss(0, noise):.5f},{y + random.gauss(0, noise):.5f},{heading:.6f},"
                  f"{var:.3e},0,0,{var:.3e},0,{0.1 * var:.3e}", file=file)


def write_reference(path):
    with open(path, "w") as file:
        print("time_s,x_m,y_m,heading_rad", file=file)
        for i in range(RATE_HZ * DURATION_S):
            x, y, heading = pose(i / RATE_HZ, 0)
            print(f"{i / RATE_HZ},{x:.5f},{y:.5f},{heading:.6f}", file=file)


def write_slip(path):
    count = RATE_HZ * DURATION_S
    events = [{"start_s": s, "end_s": s + 1.0, "wheel": "left", "kind": "spin", "excess_m": 0.05, "confidence": 0.99, "excess_sigma_m": 0.002}
              for s in range(100, DURATION_S, 300)]
    slipping = [any(e["start_s"] <= i / RATE_HZ <= e["end_s"] for e in events) for i in range(count)]
    timeline = {"statistic": "chi2", "limit": 7.9, "end_s": [i / RATE_HZ for i in range(count)],
                "value": [round(random.expovariate(0.5) + 100 * s, 3) for s in slipping], "slipping": slipping}
    path.write_text(json.dumps({"events": events, "intervals": {}, "learned": None, "timeline": timeline}))


def write_steps(path):
    with open(path, "w") as file:
        print("time_s,sightings,effective_particles,resampled", file=file)
        for i in range(RATE_HZ * DURATION_S):
            print(f"{i / RATE_HZ},1,{40 + 60 * random.random():.2f},{int(i % 997 == 0)}", file=file)


def main():
    random.seed(1)
    folder = Path(sys.argv[1])
    (folder / "slam").mkdir(parents=True, exist_ok=True)
    write_reference(folder / "reference.csv")
    write_trajectory(folder / "odometry.csv", 8, 0.002)
    write_trajectory(folder / "trajectory.csv", 2, 0.002)
    write_trajectory(folder / "slam" / "trajectory.csv", 0.1, 0.005)
    write_slip(folder / "slip.json")
    write_steps(folder / "slam" / "steps.csv")


if __name__ == "__main__":
    main()
