"""Changes of a parameter from one run on: a likelihood-ratio test of every split of every beginning of a robot's runs.

Z(k, n) is the difference of the means of runs 1..k and k+1..n in its own sigma. A change is reported at the first n at
which the largest |Z(k, n)| exceeds a limit. The limit is such that an unchanged robot gets no more than FALSE_ALARMS
reports a year in all its parameters together. docs/theory/fleet.md, eq. 5, 6; [Siegmund 1985; Naiman & Priebe 2001].
"""

from __future__ import annotations

import functools
from typing import NamedTuple, Optional

import numpy

from .distributions import Array, normal_cdf, normal_quantile, t_upper

FALSE_ALARMS = 0.01  # a robot-year
_DRAWS = 400


class Change(NamedTuple):
    first: int  # the first run after it
    noticed: int  # the run at which it was found
    step: float
    sigma: float


def _z(x: Array, variance: Array) -> Array:
    """Z[..., k, n]: the first k runs against those up to and with run n. 0 where there are not both."""
    weight = 1.0 / variance
    weights, sums = numpy.cumsum(weight, axis=-1), numpy.cumsum(weight * numpy.where(weight > 0.0, x, 0.0), axis=-1)
    w1, s1 = weights[..., :-1, None], sums[..., :-1, None]
    w2, s2 = weights[..., None, :] - w1, sums[..., None, :] - s1
    runs = x.shape[-1]
    later = numpy.arange(runs)[None, :] > numpy.arange(runs - 1)[:, None]
    both = (weight[..., 1:, None] > 0.0) & (weight[..., None, :] > 0.0)  # it begins and ends with a run that counts
    usable = later & both & (w1 > 0.0)
    with numpy.errstate(divide="ignore", invalid="ignore"):
        return numpy.where(usable, (s2 / w2 - s1 / w1) / numpy.sqrt(1.0 / w1 + 1.0 / w2), 0.0)


@functools.lru_cache(maxsize=None)
def _clump(runs: int, limit: float) -> float:
    """E[1 / number of splits beyond the limit | a split, drawn evenly, is beyond it], for runs of equal weight."""
    draw = numpy.random.Generator(numpy.random.Philox(runs))
    splits = [(k, n) for n in range(1, runs) for k in range(n)]
    total = 0.0
    tail = float(normal_cdf(-limit))
    for _ in range(_DRAWS):
        k, n = splits[draw.integers(len(splits))]
        before, after = k + 1, n - k
        direction = numpy.zeros(runs)
        direction[:before], direction[before : n + 1] = -1.0 / before, 1.0 / after
        direction /= numpy.sqrt(1.0 / before + 1.0 / after)
        x = draw.standard_normal(runs)
        beyond = -normal_quantile(tail * (1.0 - draw.random()))  # a normal beyond the limit
        x += (beyond - direction @ x) * direction
        total += 1.0 / max(1, int((numpy.abs(_z(x, numpy.ones(runs))) >= limit).sum()))
    return total / _DRAWS


def limit_for(runs: int, probability: float) -> float:
    """What the largest |Z| over all splits of all beginnings of so many unchanged runs exceeds with this probability.

    P(any beyond) = sum over splits of P(it is beyond) E[1 / number beyond | it is] exactly.
    """
    limit = 3.0
    for _ in range(4):
        expected = _splits(runs, round(4.0 * limit) / 4.0)
        limit = -normal_quantile(min(0.5 * probability / expected, 0.49))
    return limit


_TABLE = (2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128)


def _splits(runs: int, limit: float) -> float:
    """As many independent splits as all of them are worth; between the table's numbers of runs by a power law."""
    above = next((i for i, size in enumerate(_TABLE) if size >= runs), len(_TABLE) - 1)
    low, high = _TABLE[max(above - 1, 0)], _TABLE[above]
    worth = [0.5 * size * (size - 1) * _clump(size, limit) for size in (low, high)]
    if low == high:
        return worth[0]
    return float(worth[0] * (worth[1] / worth[0]) ** (numpy.log(runs / low) / numpy.log(high / low)))


def with_degrees(limit: float, degrees: float) -> float:
    """The same for a sigma that was estimated with so many degrees of freedom."""
    return t_upper(float(normal_cdf(-limit)), degrees) if 0.0 < degrees < 1e4 else limit


def _first(x: Array, variance: Array, limit: float) -> Optional[Change]:
    z = numpy.abs(_z(x, variance))
    noticed = int((z.max(axis=0) > limit).argmax())
    if z[:, noticed].max() <= limit:
        return None
    split = int(z[:, noticed].argmax())
    w = 1.0 / variance
    before, after = slice(0, split + 1), slice(split + 1, noticed + 1)
    step = (w[after] * x[after]).sum() / w[after].sum() - (w[before] * x[before]).sum() / w[before].sum()
    return Change(split + 1, noticed, float(step), float(numpy.sqrt(1.0 / w[before].sum() + 1.0 / w[after].sum())))


def changes(x: Array, variance: Array, limit: float) -> list[Change]:
    """All changes of one robot's parameter, each looked for after the one before. x and variance of its runs by date.

    A single run that differs from those before and after it is no change: without it they are looked for again.
    """
    variance = variance.copy()
    while True:
        found = _all(x, variance, limit)
        alone = [one.first for one, next_one in zip(found, found[1:]) if next_one.first == one.first + 1]
        if not alone:
            return found
        variance[alone] = numpy.inf


def _all(x: Array, variance: Array, limit: float) -> list[Change]:
    found: list[Change] = []
    start = 0
    while len(x) - start >= 2:
        change = _first(x[start:], variance[start:], limit)
        if change is None:
            break
        found.append(change._replace(first=start + change.first, noticed=start + change.noticed))
        start += change.first
    return found


def suspects(x: Array, variance: Array, limit: Array) -> Array:
    """Of many robots, x[robot, run], those with any |Z| beyond their limit."""
    chunk = max(1, 2_000_000 // x.shape[1] ** 2)
    parts = [numpy.abs(_z(x[i : i + chunk], variance[i : i + chunk])).max(axis=(1, 2)) if x.shape[1] > 1 else numpy.zeros(len(x[i : i + chunk]))
             for i in range(0, len(x), chunk)]
    return numpy.asarray(numpy.concatenate(parts) > limit)
