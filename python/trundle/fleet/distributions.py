"""Distribution functions and quantiles of normal, chi-squared and Student's t, in NumPy alone."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from statistics import NormalDist
from typing import Any

import numpy
from numpy.typing import NDArray

Array = NDArray[numpy.float64]

_STEPS = 500  # of a continued fraction: it ends long before


def normal_cdf(x: Any) -> Array:
    """To 1.2e-7 of the smaller tail [Press et al., Numerical Recipes, erfcc]."""
    x = numpy.asarray(x, dtype=float)
    z = numpy.abs(x) / math.sqrt(2.0)
    t = 1.0 / (1.0 + 0.5 * z)
    terms = (-1.26551223, 1.00002368, 0.37409196, 0.09678418, -0.18628806, 0.27886807, -1.13520398, 1.48851587, -0.82215223, 0.17087277)
    series = numpy.full_like(t, terms[-1])
    for term in terms[-2::-1]:
        series = term + t * series
    tail = 0.5 * t * numpy.exp(-z * z + series)
    return numpy.where(x < 0.0, tail, 1.0 - tail)


def normal_tails(z: Any) -> Array:
    """The probability of at least |z|, either side."""
    return 2.0 * normal_cdf(-numpy.abs(z))


def normal_quantile(probability: float) -> float:
    return NormalDist().inv_cdf(probability)


def _fraction(first: float, term: Callable[[int], float]) -> float:
    """first + a1 / (1 + a2 / (1 + ...)) by Lentz: terms a_i over denominators 1."""
    value, c, d = first, first, 0.0
    for i in range(1, _STEPS):
        d = 1.0 / (1.0 + term(i) * d)
        c = 1.0 + term(i) / c
        value *= c * d
        if abs(c * d - 1.0) < 1e-14:
            break
    return value


def _beta_cdf(x: float, a: float, b: float) -> float:
    """Regularised incomplete beta function [Abramowitz & Stegun 26.5.8]."""
    if x <= 0.0 or x >= 1.0:
        return float(x >= 1.0)
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - _beta_cdf(1.0 - x, b, a)

    def term(i: int) -> float:
        m = i // 2
        if i % 2 == 0:
            return m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        return -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))

    front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    return math.exp(front) / (a * _fraction(1.0, term))


def t_tail(t: float, degrees: float) -> float:
    """The probability of more than |t|, one side."""
    return 0.5 * _beta_cdf(degrees / (degrees + t * t), 0.5 * degrees, 0.5)


def chi2_cdf(x: float, degrees: float) -> float:
    """Regularised incomplete gamma function by its series [Abramowitz & Stegun 6.5.29]; by Wilson-Hilferty where that is long."""
    if x <= 0.0:
        return 0.0
    if degrees > 2000.0:
        return float(normal_cdf(((x / degrees) ** (1.0 / 3.0) - 1.0 + 2.0 / (9.0 * degrees)) / math.sqrt(2.0 / (9.0 * degrees))))
    a, half = 0.5 * degrees, 0.5 * x
    term = total = 1.0 / a
    for i in range(1, 100000):
        term *= half / (a + i)
        total += term
        if term < 1e-16 * total:
            break
    return min(1.0, math.exp(a * math.log(half) - half - math.lgamma(a)) * total)


def _rising_root(f: Callable[[float], float], low: float, high: float) -> float:
    while f(high) < 0.0:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if f(middle) < 0.0 else (low, middle)
        if high - low <= 1e-13 * high:
            break
    return high


@functools.lru_cache(maxsize=None)
def chi2_quantile(probability: float, degrees: float) -> float:
    return _rising_root(lambda x: chi2_cdf(x, degrees) - probability, 0.0, degrees + 1.0)


@functools.lru_cache(maxsize=None)
def t_upper(tail: float, degrees: float) -> float:
    """What Student's t exceeds with this probability, one side."""
    return _rising_root(lambda t: tail - t_tail(t, degrees), 0.0, 1.0)
