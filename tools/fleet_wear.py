#!/usr/bin/env python3
"""How simulated wear and steps are told, and how often the present values of robots that wear hold, by TRIALS series each.

PYTHONPATH=build/python /usr/bin/python3 tools/fleet_wear.py [TRIALS]"""

from __future__ import annotations

import collections
import datetime
import sys
from typing import NamedTuple

import numpy
from trundle.fleet import drift, summary
from trundle.fleet.distributions import Array

WEEK = 7.0 / 365.25
TESTED = 5  # parameters


class Row(NamedTuple):
    """As of the database's table `parameter`."""

    value: float
    sigma: float
    observable: bool = True
    unit: str = "m"
    nominal: float = 1.0


def false_alarms(batches: int) -> tuple[int, int, int]:
    """Of unchanged series of 52 runs in a year, of unequal sigmas and dates: how many there are, have an alarm, and have it told
    when the year has ended."""
    rng, size, alarms, in_the_end = numpy.random.Generator(numpy.random.Philox(1)), 10000, 0, 0
    limit = drift.limit_for(52, drift.FALSE_ALARMS / TESTED)
    for _ in range(batches):
        time, variance = numpy.sort(rng.random((size, 52)), axis=1), rng.uniform(0.5, 2.0, (size, 52))
        x = numpy.sqrt(variance) * rng.standard_normal((size, 52))
        suspects = numpy.flatnonzero(drift.suspects(x, variance, time, numpy.full(size, limit)))
        alarms += len(suspects)
        in_the_end += sum(len(drift.changes(drift.pieces(x[i], variance[i], time[i], limit), time[i])) > 0 for i in suspects)
    return size * batches, alarms, in_the_end


def told(truth: Array, seed: int, trials: int) -> tuple[collections.Counter[str], list[float]]:
    """How often weekly runs known to 0.1 to 0.2 % are told as which pieces, c: constant, t: trend; slopes of single trends."""
    rng, time = numpy.random.Generator(numpy.random.Philox(seed)), WEEK * numpy.arange(len(truth))
    limit = drift.limit_for(len(truth), drift.FALSE_ALARMS * len(truth) / 52 / TESTED)
    kinds: collections.Counter[str] = collections.Counter()
    slopes = []
    for _ in range(trials):
        sigma = rng.uniform(0.001, 0.002, len(truth))
        pieces = drift.pieces(truth + sigma * rng.standard_normal(len(truth)), sigma**2, time, limit)
        kinds["".join("t" if piece.is_trend else "c" for piece in pieces)] += 1
        if len(pieces) == 1 and pieces[0].is_trend:
            slopes.append(pieces[0].slope)
    return kinds, slopes


def present_values(wear: float, runs: int, fleets: int, robots: int = 20, worn: int = 4) -> tuple[float, float, float]:
    """Of the robots that wear the share that is told as one trend, and of which the present value's interval holds; of the
    others, too."""
    rng, wears = numpy.random.Generator(numpy.random.Philox(runs)), numpy.arange(robots) < worn
    weeks, names = numpy.arange(runs), [f"robot_{i:02}" for i in range(robots)]
    found, held = [], []
    for _ in range(fleets):
        now = 1.0 + 0.002 * rng.standard_normal(robots)
        slope = numpy.where(wears, -wear * rng.uniform(0.8, 1.5, robots), 0.0)
        sigma = rng.uniform(0.001, 0.002, (robots, runs))
        x = now[:, None] + WEEK * slope[:, None] * (weeks - runs + 1) + numpy.hypot(sigma, 0.001) * rng.standard_normal(sigma.shape)

        def run(i: int, j: int) -> summary.Run:
            date = (datetime.date(2026, 1, 1) + datetime.timedelta(7 * j)).isoformat()
            return summary.Run(f"/{names[i]}/{date}", names[i], "type", date, "done", "", 0, {}, {"left.diameter": Row(x[i, j], sigma[i, j])})

        [diameter] = summary.summarise({names[i]: [run(i, j) for j in range(runs)] for i in range(robots)}).parameters["type"]
        kinds = collections.defaultdict(list)
        for robot, _, change in diameter.changes:
            kinds[robot].append(type(change))
        found.append([kinds[robot] == [drift.Trend] for robot in names])
        held.append([one.low <= value <= one.high for one, value in zip(diameter.estimates, now)])
    of_worn, of_others = numpy.array(held)[:, wears], numpy.array(held)[:, ~wears]
    return float(numpy.array(found)[:, wears].mean()), float(of_worn.mean()), float(of_others.mean())


def main() -> None:
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    series, alarms, in_the_end = false_alarms(max(1, trials // 25))
    print(f"unchanged: of {series} series {alarms} have an alarm ({100 * alarms / series:.3f} %, stated {100 * drift.FALSE_ALARMS / TESTED:g} %), "
          f"{in_the_end} in the end")
    for runs in (20, 26, 32, 39, 52, 104):
        kinds, slopes = told(-0.01 * WEEK * numpy.arange(runs), runs, trials)
        print(f"wear of 1 % a year, {runs} weeks: {dict(kinds.most_common(4))}, slope {numpy.mean(slopes) / -0.01:.2f} of the true one")
    for step in (0.01, 0.005):
        for runs in (13, 20, 26):
            kinds, _ = told(-step * (numpy.arange(runs) >= runs // 2), runs, trials)
            print(f"a step of {100 * step:g} % in the middle of {runs} weeks: {dict(kinds.most_common(4))}")
    weeks = numpy.arange(104)
    wear = -0.01 * WEEK * weeks
    for name, truth in (("a tyre changed in the middle of two years", wear + 0.01 * (weeks >= 52)), ("wear that begins there", numpy.minimum(wear - wear[52], 0.0)),
                        ("wear that ends there", numpy.maximum(wear, wear[52]))):
        print(f"{name}: {dict(told(truth, 104, trials)[0].most_common(4))}")
    for per_year, runs in ((0.01, 52), (0.01, 26), (0.005, 52), (0.002, 52)):
        found, worn, others = present_values(per_year, runs, max(1, trials // 25))
        print(f"wear of {80 * per_year:g} to {150 * per_year:g} % a year, {runs} weeks: {100 * found:.0f} % told as one trend; intervals hold: "
              f"{100 * worn:.0f} % of those that wear, {100 * others:.0f} % of the others")


if __name__ == "__main__":
    main()
