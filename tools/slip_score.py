#!/usr/bin/env python3
"""Compares found slips with injected ones.

usage: tools/slip_score.py FOLDER...

Each FOLDER holds truth_slip.csv, slip.csv, and errors.txt: position errors of the wheels
alone, of wheels and gyro without a slip test, and with correction [m], on one line.
"""
import csv
import sys
from pathlib import Path
from statistics import median


def slips_of(path):
    with open(path, newline="") as lines:
        return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def overlap(a, b):
    return float(a["start_s"]) < float(b["end_s"]) and float(b["start_s"]) < float(a["end_s"])


def main():
    injected = detected = right = ambiguous = wrong = false_alarms = 0
    wheels, before, after = [], [], []
    for folder in map(Path, sys.argv[1:]):
        truth, found = slips_of(folder / "truth_slip.csv"), slips_of(folder / "slip.csv")
        injected += len(truth)
        for slip in truth:
            hits = [f for f in found if overlap(f, slip)]
            if not hits:
                continue
            detected += 1
            hit = max(hits, key=lambda f: float(f["confidence"]))
            if hit["wheel"] == "ambiguous":
                ambiguous += 1
            elif hit["wheel"] == slip["wheel"]:
                right += 1
            else:
                wrong += 1
        false_alarms += sum(not any(overlap(f, slip) for slip in truth) for f in found)
        errors = [float(cell) for cell in (folder / "errors.txt").read_text().split()]
        for values, error in zip((wheels, before, after), errors):
            values.append(error)
    print(f"{len(before)} runs, {injected} slips: {detected} detected; of these {right} the right wheel, {ambiguous} "
          f"ambiguous, {wrong} wrong; {false_alarms} other events")
    print(f"position error, median over the runs: wheels alone {median(wheels):.4f} m, wheels and gyro without a slip "
          f"test {median(before):.4f} m, corrected {median(after):.4f} m")
    for name, baseline in (("wheels alone", wheels), ("wheels and gyro", before)):
        better = median(b / a for b, a in zip(baseline, after))
        print(f"median ratio to {name}: {better:.2f}; made worse: {sum(a > b for b, a in zip(baseline, after))}")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main()
