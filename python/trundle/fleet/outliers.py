"""Robots and runs that stand out, by the procedure of Benjamini and Hochberg [1995]: of those that are named, at most RATE
in the mean are named wrongly, however many parameters each has."""

from __future__ import annotations

import numpy

from .distributions import Array, normal_quantile, normal_tails, t_tail
from .population import robust_fit

RATE = 0.05


def rejected(p: Array, rate: float = RATE) -> Array:
    """Which of the hypotheses, along the last axis, are rejected. p: their probabilities; NaN: not tested."""
    p = numpy.where(numpy.isnan(p), numpy.inf, p)
    tested = numpy.isfinite(p).sum(axis=-1, keepdims=True)
    order = numpy.argsort(p, axis=-1)
    rising = numpy.take_along_axis(p, order, -1)
    rank = numpy.arange(1, p.shape[-1] + 1)
    under = rising <= rate * rank / numpy.maximum(tested, 1)
    last = numpy.where(under, rank, 0).max(axis=-1, keepdims=True)
    threshold = numpy.where(last > 0, numpy.take_along_axis(rising, numpy.maximum(last - 1, 0), -1), -1.0)
    return numpy.asarray(p <= threshold)


def told(p: Array) -> Array:
    """Of what a thing is told: p[thing, parameter], NaN: not tested.

    A thing is judged by the least of its probabilities times their number, and told of each parameter that would have named
    it by itself [Benjamini & Bogomolov 2014].
    """
    corrected = numpy.where(numpy.isnan(p), numpy.inf, p) * numpy.maximum(numpy.isfinite(p).sum(axis=1, keepdims=True), 1)
    least = corrected.min(axis=1, initial=numpy.inf)
    named = least[rejected(numpy.where(numpy.isinf(least), numpy.nan, least))]
    return numpy.asarray(corrected <= named.max(initial=-1.0))


def tails(z: Array, degrees: float) -> Array:
    """Both tails of Student's t, by each value of z."""
    if degrees > 1000.0:
        return normal_tails(z)
    flat = numpy.abs(z).ravel()
    return numpy.array([2.0 * t_tail(min(value, 1e8), degrees) for value in flat]).reshape(z.shape)


_PASSES = 4


def robot_scores(y: Array, v: Array) -> tuple[Array, Array]:
    """z of each robot in the population, and its probability; NaN where it has no estimate. One fleet; four robots or more.

    Robots that stand out widen what all are measured with, so it is measured again without them.
    """
    seen = numpy.isfinite(v)
    z = p = numpy.full(y.shape, numpy.nan)
    counted = seen.copy()
    for _ in range(_PASSES):
        mean, spread = robust_fit(y, numpy.where(counted, v, numpy.inf))
        z = numpy.where(seen, (numpy.where(seen, y, 0.0) - mean) / numpy.sqrt(v + spread**2), numpy.nan)
        p = numpy.full(y.shape, numpy.nan)
        # Huber's spread has 0.75 of the information of the squares; the mean takes one degree.
        p[seen] = tails(z[seen], 0.75 * (counted.sum() - 1))
        without = seen & ~rejected(p)
        if without.sum() < 4 or (without == counted).all():
            break
        counted = without
    return z, p


def run_scores(x: Array, s2: Array, omega2: float, mean: float, spread: float, segment: Array, time: Array) -> Array:
    """z of each run given the robot's other runs between the same steps (segment[robot, run]) and the population.

    Where runs have a trend the others let expect a line over time[robot, run], whose value at time 0 is the population's as
    one of a robot without a trend is; of these all times are 0.

    A bad run makes the others look bad, so of each robot's runs only the worst is judged at a time: it keeps its z, is
    left out, and the others are judged without it while it is beyond what the largest of them would be.
    """
    robots, runs = x.shape
    z = numpy.full(x.shape, numpy.nan)
    kept = numpy.isfinite(s2)
    limit = -normal_quantile(0.5 * RATE / max(1, runs))
    for _ in range(runs):
        score = numpy.full(x.shape, numpy.nan)
        for j in range(runs):
            others = kept & (segment == segment[:, j, None])
            others[:, j] = False
            weight = numpy.where(others, 1.0 / (s2 + omega2), 0.0)
            prior = 1.0 / max(spread**2, 1e-300)
            known = numpy.where(others, x, 0.0)
            whole = prior + weight.sum(axis=1)
            value = (prior * mean + (weight * known).sum(axis=1)) / whole
            middle = (weight * time).sum(axis=1) / whole
            from_middle = time - middle[:, None]
            square = prior * middle**2 + (weight * from_middle**2).sum(axis=1)
            square = numpy.where(square > 0.0, square, numpy.inf)
            slope = ((weight * from_middle * known).sum(axis=1) - prior * middle * mean) / square
            expected = value + slope * from_middle[:, j]
            variance = 1.0 / whole + from_middle[:, j] ** 2 / square
            judged = kept[:, j] & others.any(axis=1)  # a run alone is judged as the robot
            score[:, j] = numpy.where(judged, (x[:, j] - expected) / numpy.sqrt(s2[:, j] + omega2 + variance), numpy.nan)
        size = numpy.nan_to_num(numpy.abs(score), nan=-1.0)
        worst = size.argmax(axis=1)
        stands_out = size[numpy.arange(robots), worst] > limit
        z = numpy.where(kept, score, z)
        if not stands_out.any():
            break
        kept[stands_out, worst[stands_out]] = False
    return z
