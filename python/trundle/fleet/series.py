"""Runs of robots over dates as arrays: x[robot, run] with variance of its own s2[robot, run]; inf where there is no run.

x_ij ~ N(theta_i, s2_ij + omega^2): omega is what runs of one unchanged robot differ by beyond their own uncertainty.
A robot with a trend has a line in place of theta_i: `time` is then that of its runs [years] from the one at which its value
is asked for, and 0 of robots without. docs/theory/fleet.md, eq. 1, 2, 9.
"""

from __future__ import annotations

import functools
from typing import Union

import numpy

from .distributions import Array, chi2_quantile
from .population import _falling_root

_HUBER = 1.5
_CLIPPED = 0.7784652


Times = Union[Array, float]


def _lines(x: Array, weight: Array, time: Times) -> tuple[Array, Array, Array]:
    """Values at time 0 by weighted least squares over the last axis, slopes, and variances of the values; inf where a robot
    has no run. Runs of one time have no slope."""
    whole = weight.sum(axis=-1)
    with numpy.errstate(divide="ignore", invalid="ignore"):
        mean = numpy.where(whole > 0.0, (weight * x).sum(axis=-1) / whole, 0.0)
        if not numpy.any(time):
            return mean, numpy.zeros_like(mean), 1.0 / whole
        middle = numpy.where(whole > 0.0, (weight * time).sum(axis=-1) / whole, 0.0)
        from_middle = time - middle[..., None]
        square = (weight * from_middle**2).sum(axis=-1)
        square = numpy.where(square > 1e-9 * (weight * numpy.square(time)).sum(axis=-1), square, numpy.inf)
        slope = (weight * from_middle * x).sum(axis=-1) / square
        return mean - slope * middle, slope, 1.0 / whole + middle**2 / square


def robot_values(x: Array, s2: Array, omega2: Array, time: Times = 0.0) -> tuple[Array, Array]:
    """By a robot's runs alone, and their variances; inf where it has no run."""
    value, _, variance = _lines(x, 1.0 / (s2 + omega2[..., None, None]), time)
    return value, variance


_PROBABLE = 9  # values that stand for what omega^2 may be; odd, so that the one in the middle is the median


def run_spreads(x: Array, s2: Array, time: Times = 0.0) -> Array:
    """Equally probable values of omega^2 of all robots together, first axis, rising. Runs about their robots' means or lines:
    the sum of squares in units of s2 + omega^2 is chi-squared with as many degrees of freedom as there are runs more than
    means and slopes. Where no robot has two runs omega is 0: it is then a part of the spread between robots."""
    seen = numpy.isfinite(s2)
    slopes = (seen & (numpy.asarray(time) != 0.0)).any(axis=-1)
    degrees = numpy.maximum(seen.sum(axis=-1) - 1 - slopes, 0).sum(axis=-1)
    x = numpy.where(seen, x, 0.0)

    def squares(omega2: Array) -> Array:
        weight = 1.0 / (s2 + omega2[..., None, None])
        value, slope, _ = _lines(x, weight, time)
        return numpy.asarray(((x - value[..., None] - slope[..., None] * time) ** 2 * weight).sum(axis=(-2, -1)))

    mean, _ = robot_values(x, s2, numpy.zeros(x.shape[:-2]))
    largest = 1e4 * (numpy.where(seen, (x - mean[..., None]) ** 2, 0.0).max(axis=(-2, -1)) + numpy.where(seen, s2, 0.0).max(axis=(-2, -1)))
    def excess(wanted: Array, omega2: Array) -> Array:
        return squares(omega2) - wanted

    values = []
    for j in range(_PROBABLE):
        tail = 1.0 - (j + 0.5) / _PROBABLE
        wanted_of = {int(k): chi2_quantile(tail, float(k)) if k else 0.0 for k in numpy.unique(degrees)}
        wanted = numpy.vectorize(wanted_of.__getitem__)(degrees)
        root = _falling_root(functools.partial(excess, wanted), largest + 1e-300)
        values.append(numpy.where(degrees > 0, root, 0.0))
    return numpy.stack(values)


def robust_run_spread(x: Array, s2: Array) -> tuple[float, float]:
    """The same of one fleet by differences of successive runs, each of which counts at most 1.5 sigma: neither runs nor
    changes that stand out move it far. Degrees of freedom: a third less than differences, as neighbours share a run."""
    seen = numpy.isfinite(s2)
    both = seen[:, 1:] & seen[:, :-1]
    difference2 = numpy.where(both, numpy.diff(numpy.where(seen, x, 0.0), axis=1), 0.0)[both] ** 2
    own = (s2[:, 1:] + s2[:, :-1])[both] if both.any() else numpy.zeros(0)
    if len(difference2) == 0:
        return 0.0, 0.0

    def excess(omega2: Array) -> Array:
        return numpy.asarray(numpy.minimum(difference2 / (own + 2.0 * omega2), _HUBER**2).sum() - _CLIPPED * len(difference2))

    largest = numpy.asarray(difference2.max() + own.max())
    return float(_falling_root(excess, largest)), 2.0 / 3.0 * len(difference2)
