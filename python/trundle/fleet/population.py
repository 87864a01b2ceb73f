"""Robots of one type as draws from a population: y_i ~ N(theta_i, v_i), theta_i ~ N(mu, tau^2).

The last axis of arrays runs over robots, the first over what the variance between runs may be, equally probable values
(see series.py) that y and v are computed with; axes between over independent fleets. A robot without an estimate has
v = inf. docs/theory/fleet.md, eq. 3, 4; [Hartung & Knapp 2001; Viechtbauer 2007; Weerahandi 1993; Morris 1983; Huber 1981].
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy

from .distributions import Array, chi2_quantile, normal_cdf, t_upper

_GRID = 97  # values of the spread to find where its posterior is
_FINE = 21  # and to integrate over there
_HALVINGS = 60


class Population(NamedTuple):
    robots: Array
    mean: Array
    mean_low: Array  # 95 %
    mean_high: Array
    spread: Array
    spread_low: Array
    spread_high: Array


class Shrunken(NamedTuple):
    value: Array
    sigma: Array
    low: Array  # 95 %
    high: Array


def _weighted(y: Array, total: Array) -> tuple[Array, Array, Array]:
    """Weights 1 / total, their sum, and the mean of y under them."""
    weight = 1.0 / total
    whole = weight.sum(axis=-1)
    return weight, whole, (weight * y).sum(axis=-1) / whole


def _falling_root(f: Callable[[Array], Array], high: Array) -> Array:
    """Where a falling f crosses zero above 0; 0 where it starts below."""
    low = numpy.zeros_like(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        positive = f(middle) > 0.0
        low, high = numpy.where(positive, middle, low), numpy.where(positive, high, middle)
    return numpy.asarray(numpy.where(f(numpy.zeros_like(high)) > 0.0, 0.5 * (low + high), 0.0))


def _largest_square(y: Array, v: Array) -> Array:
    """A square of the spread above any that is asked for."""
    seen = numpy.isfinite(v)
    middle = _weighted(y, v)[2]
    largest = numpy.where(seen, (y - middle[..., None]) ** 2, 0.0).max(axis=-1) + numpy.where(seen, v, 0.0).max(axis=-1)
    return numpy.asarray(1e4 * largest + 1e-300)


def _q(y: Array, v: Array, square: Array) -> Array:
    """Generalised Q: chi-squared with k - 1 degrees of freedom at the true spread."""
    weight, _, mean = _weighted(y, v + square[..., None])
    return numpy.asarray((weight * (y - mean[..., None]) ** 2).sum(axis=-1))


def _reml_score(y: Array, v: Array, square: Array) -> Array:
    """Derivative of the restricted likelihood by tau^2: y'PPy - tr P."""
    weight, whole, mean = _weighted(y, v + square[..., None])
    squares = (weight**2).sum(axis=-1)
    return numpy.asarray((weight**2 * (y - mean[..., None]) ** 2).sum(axis=-1) - (whole - squares / whole))


def _usable(y: Array, v: Array) -> tuple[Array, Array, Array]:
    y, v = numpy.broadcast_arrays(numpy.asarray(y, float), numpy.asarray(v, float))
    seen = numpy.isfinite(v)
    return numpy.where(seen, y, 0.0), v, seen.sum(axis=-1)


def _probability_of_q(q: Array, degrees: Array) -> Array:
    """Chi-squared by Wilson and Hilferty: to 0.002 from three robots on."""
    part = 2.0 / (9.0 * degrees)
    return normal_cdf((numpy.cbrt(q / degrees) - 1.0 + part) / numpy.sqrt(part))


def fit(y: Array, v: Array) -> Population:
    """Mean with the interval of Knapp and Hartung, spread by REML; three robots or more. The interval of the spread is
    that of its Q profile, whose probability is averaged over what the variance between runs may be."""
    y, v, counted = _usable(y, v)
    robots, middle = counted[0], len(y) // 2
    high = _largest_square(y, v).max(axis=0)
    square = _falling_root(lambda s: _reml_score(y[middle], v[middle], s), high)
    _, whole, mean = _weighted(y[middle], v[middle] + square[..., None])
    scale = numpy.sqrt(_q(y[middle], v[middle], square) / (robots - 1) / whole)
    t_of = {int(k): t_upper(0.025, k - 1.0) for k in numpy.unique(robots)}
    t = numpy.vectorize(t_of.__getitem__)(robots)

    def reached(probability: float) -> Array:
        def excess(s: Array) -> Array:
            return numpy.asarray(_probability_of_q(_q(y, v, numpy.broadcast_to(s, y.shape[:-1])), robots - 1).mean(axis=0) - probability)

        return numpy.sqrt(_falling_root(excess, high))

    return Population(robots, mean, mean - t * scale, mean + t * scale, numpy.sqrt(square), reached(0.975), reached(0.025))


def _log_posterior(y: Array, v: Array, tau: Array) -> Array:
    """Of the spread under a flat prior, mean integrated out. tau: (..., grid)."""
    values = []
    for i in range(tau.shape[-1]):  # not one array: robots times grid would be large
        weight, whole, mean = _weighted(y, v + tau[..., i, None] ** 2)
        logs = numpy.log(numpy.where(weight > 0.0, weight, 1.0)).sum(axis=-1)
        values.append(0.5 * (logs - numpy.log(whole) - (weight * (y - mean[..., None]) ** 2).sum(axis=-1)))
    return numpy.stack(values, axis=-1)


def _spread_posterior(y: Array, v: Array) -> tuple[Array, Array]:
    """Values of tau, and their probabilities together with those of the first axis."""
    seen = numpy.isfinite(v)
    middle = _weighted(y, v)[2]
    scale = numpy.sqrt(numpy.where(seen, (y - middle[..., None]) ** 2, 0.0).sum(axis=-1) / seen.sum(axis=-1)) + 1e-300
    part = numpy.linspace(0.0, 0.98, _GRID)
    tau = scale[..., None] * part / (1.0 - part)
    density = _log_posterior(y, v, tau)
    counts = density > density.max(axis=-1, keepdims=True) - 12.0
    first = numpy.maximum(counts.argmax(axis=-1) - 1, 0)
    last = numpy.minimum(_GRID - counts[..., ::-1].argmax(axis=-1), _GRID - 1)
    low = numpy.take_along_axis(tau, first[..., None], -1)
    high = numpy.take_along_axis(tau, last[..., None], -1)
    fine = low + (high - low) * numpy.linspace(0.0, 1.0, _FINE) ** 2  # denser where it is narrow: at small spreads
    density = _log_posterior(y, v, fine)
    weight = numpy.exp(density - density.max(axis=(0, -1), keepdims=True)) * numpy.gradient(fine, axis=-1)
    return fine, weight / weight.sum(axis=(0, -1), keepdims=True)


def _mixture_quantile(means: Array, sigmas: Array, weights: Array, probability: float) -> Array:
    """Of a mixture of normals along the first axis, to a thousandth of a sigma."""
    low, high = (means - 6.0 * sigmas).min(axis=0), (means + 6.0 * sigmas).max(axis=0)
    for _ in range(16):
        middle = 0.5 * (low + high)
        below = sum(w * normal_cdf((middle - m) / s) for w, m, s in zip(weights, means, sigmas)) < probability
        low, high = numpy.where(below, middle, low), numpy.where(below, high, middle)
    return numpy.asarray(0.5 * (low + high))


def _components(y: Array, v: Array) -> tuple[Array, Array, Array]:
    """Means, sigmas and weights of a robot's value for each spread and each variance between runs."""
    tau, probability = _spread_posterior(y, v)
    means, sigmas, weights = [], [], []
    for j in range(tau.shape[0]):
        for i in range(tau.shape[-1]):
            square = tau[j, ..., i, None] ** 2
            weight, whole, mean = _weighted(y[j], v[j] + square)
            own = square * weight  # share of the robot's own estimate
            with numpy.errstate(invalid="ignore"):
                variance = numpy.where(numpy.isfinite(v[j]), v[j] * own, square) + (1.0 - own) ** 2 / whole[..., None]
            means.append(mean[..., None] + own * (y[j] - mean[..., None]))
            sigmas.append(numpy.sqrt(numpy.maximum(variance, 1e-300)))
            weights.append(numpy.broadcast_to(probability[j, ..., i, None], y[j].shape))
    return numpy.stack(means), numpy.stack(sigmas), numpy.stack(weights)


def shrink(y: Array, v: Array) -> Shrunken:
    """Each robot's value given all robots', averaged over what mean, spread and variance between runs may be. Three robots
    or more."""
    y, v, _ = _usable(y, v)
    m, s, w = _components(y, v)
    value = (w * m).sum(axis=0)
    sigma = numpy.sqrt((w * (s**2 + (m - value) ** 2)).sum(axis=0))
    return Shrunken(value, sigma, _mixture_quantile(m, s, w, 0.025), _mixture_quantile(m, s, w, 0.975))


_HUBER = 1.5  # sigmas from which a residual counts as this many: 96 % efficient, bears 10 % of outliers
_CLIPPED = 0.7784652  # E min(z^2, 1.5^2) of a normal z


def robust_fit(y: Array, v: Array) -> tuple[Array, Array]:
    """Mean and spread that a few outlying robots hardly move: Huber's proposal 2. For tests of outliers, not for intervals."""
    y, v, robots = _usable(y, v)
    seen = numpy.isfinite(v)

    median = numpy.nanmedian(numpy.where(seen, y, numpy.nan), axis=-1)

    def centre(square: Array) -> Array:
        weight, mean = 1.0 / (v + square[..., None]), median
        for _ in range(8):
            z = (y - mean[..., None]) * numpy.sqrt(weight)
            trust = weight * _HUBER / numpy.maximum(numpy.abs(z), _HUBER)
            mean = (trust * y).sum(axis=-1) / trust.sum(axis=-1)
        return numpy.asarray(mean)

    def excess(square: Array) -> Array:
        z2 = (y - centre(square)[..., None]) ** 2 / (v + square[..., None])
        return numpy.asarray(numpy.minimum(z2, _HUBER**2).sum(axis=-1) - _CLIPPED * (robots - 1))

    square = _falling_root(excess, _largest_square(y, v))
    return centre(square), numpy.sqrt(square)
