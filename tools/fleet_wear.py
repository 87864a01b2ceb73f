#!/usr/bin/env python3
"""How simulated wear and steps are told, how often the present values of robots that wear hold, and how soon steps are told
where the spread between runs is not known but estimated from the fleet, with its false alarms; by TRIALS series each.

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


def summarised(x: Array, sigma: Array) -> list[summary.TypeParameter]:
    """Of weekly runs, [robot, run, parameter]."""
    def run(robot: str, i: int, j: int) -> summary.Run:
        date = (datetime.date(2026, 1, 1) + datetime.timedelta(7 * j)).isoformat()
        rows = {f"parameter_{k}": Row(x[i, j, k], sigma[i, j, k]) for k in range(x.shape[2])}
        return summary.Run(f"/{robot}/{date}", robot, "type", date, "done", "", 0, {}, rows)

    return summary.summarise({name: [run(name, i, j) for j in range(x.shape[1])] for i, name in
                              enumerate(f"robot_{i:03}" for i in range(x.shape[0]))}).parameters["type"]


def unchanged(rng: numpy.random.Generator, robots: int, runs: int, sigma: float) -> tuple[Array, Array]:
    """Runs of which a parameter is known to `sigma` in all: half of the variance each knows, the other is the spread between
    runs. [robot, run, parameter], and the sigmas that are known."""
    stated = numpy.sqrt(0.5) * sigma * rng.uniform(0.8, 1.2, (robots, runs, TESTED))
    truth = 1.0 + 0.002 * rng.standard_normal((robots, 1, TESTED))
    return truth + numpy.hypot(stated, numpy.sqrt(0.5) * sigma) * rng.standard_normal(stated.shape), stated


def steps_told(sigma: float, after: int, fleets: int, robots: int = 100, changed: int = 20) -> Array:
    """Of robots that change by 1 % in one of five parameters after so many runs, which have that step told, by its date and
    size and nothing else of this parameter, three runs later."""
    rng, told = numpy.random.Generator(numpy.random.Philox([after, round(1e5 * sigma)])), []
    for _ in range(fleets):
        x, stated = unchanged(rng, robots, after + 3, sigma)
        x[:changed, after:, 0] += 0.01 * rng.choice([-1.0, 1.0], changed)[:, None]
        changes = collections.defaultdict(list)
        first = summarised(x, stated)[0]
        for robot, run, change in first.changes:
            changes[robot].append(isinstance(change, drift.Step) and change.first == after and abs(abs(change.step) - 0.01) < 4.0 * change.sigma)
        told += [changes[robot] == [True] for robot in first.robots[:changed]]
    return numpy.array(told)


def alarms_in_a_year(robots: int, fleets: int) -> tuple[Array, Array]:
    """Of unchanged robots, looked at every week of a year by what `summarise` looks at: which have had a change told, and which
    have it when the year has ended. What they are known to is all the same: limits are in units of it."""
    rng, ever, in_the_end = numpy.random.Generator(numpy.random.Philox(robots)), [], []
    for _ in range(fleets):
        x, stated = unchanged(rng, robots, 53, 0.002)
        named = numpy.zeros((54, robots), bool)
        for runs in range(2, 54):
            years = numpy.tile(WEEK * numpy.arange(runs), (robots, 1))
            for k in range(TESTED):
                pieces = summary._pieces(x[:, :runs, k], stated[:, :runs, k] ** 2, years, TESTED)
                named[runs, [i for i, some in pieces.items() if drift.changes(some, years[i])]] = True
        ever += named.any(axis=0).tolist()
        in_the_end += named[-1].tolist()
    return numpy.array(ever), numpy.array(in_the_end)


def share(of: Array) -> str:
    """In per cent, with its sigma, which is not 0 of all or of none."""
    beside = (of.sum() + 1.0) / (len(of) + 2.0)
    return f"{100 * of.mean():.2f} ± {100 * numpy.sqrt(beside * (1.0 - beside) / len(of)):.2f} % of {len(of)}"


def present_values(wear: float, runs: int, fleets: int, robots: int = 20, worn: int = 4) -> tuple[float, float, float]:
    """Of the robots that wear the share that is told as one trend, and of which the present value's interval holds; of the
    others, too."""
    rng, wears, weeks = numpy.random.Generator(numpy.random.Philox(runs)), numpy.arange(robots) < worn, numpy.arange(runs)
    found, held = [], []
    for _ in range(fleets):
        now = 1.0 + 0.002 * rng.standard_normal(robots)
        slope = numpy.where(wears, -wear * rng.uniform(0.8, 1.5, robots), 0.0)
        sigma = rng.uniform(0.001, 0.002, (robots, runs))
        x = now[:, None] + WEEK * slope[:, None] * (weeks - runs + 1) + numpy.hypot(sigma, 0.001) * rng.standard_normal(sigma.shape)
        [diameter] = summarised(x[..., None], sigma[..., None])
        kinds = collections.defaultdict(list)
        for robot, _, change in diameter.changes:
            kinds[robot].append(type(change))
        found.append([kinds[robot] == [drift.Trend] for robot in diameter.robots])
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
    print("by the fleet's own spread between runs, of 100 robots with five parameters:")
    for sigma in (0.001, 0.0015, 0.002, 0.003, 0.005):
        for after in (5, 10):
            print(f"a step of 1 % after {after} runs known to {100 * sigma:g} %: three runs later told in {share(steps_told(sigma, after, max(1, trials // 40)))}")
    for robots in (4, 20, 100):
        ever, then = alarms_in_a_year(robots, max(1, 2 * trials // robots))
        print(f"unchanged robots in fleets of {robots}: in a year a change is told of {share(ever)}, in the end of {share(then)}")


if __name__ == "__main__":
    main()
