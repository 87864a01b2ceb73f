"""Steps and trends of a parameter over a robot's runs: a likelihood-ratio test of every split, and of a slope, of every
beginning of the runs; and where one is beyond its limit, the pieces, constant or linear, that explain all runs best.

An unchanged robot gets no more than FALSE_ALARMS alarms a year in all its parameters together, of both kinds.
docs/theory/fleet.md, eq. 5 to 8; [Siegmund 1985; Naiman & Priebe 2001; Jackson et al. 2005].
"""

from __future__ import annotations

import functools
from typing import NamedTuple, Union

import numpy

from .distributions import Array, normal_cdf, normal_quantile, t_upper

FALSE_ALARMS = 0.01  # a robot-year
_DRAWS = 400


class Piece(NamedTuple):
    """Runs between two steps: a constant or a line."""

    first: int  # run
    mean: float
    variance: float
    time: float  # of the mean [years]
    slope: float  # a year; 0 of a constant
    slope_variance: float

    @property
    def is_trend(self) -> bool:
        return self.slope_variance > 0.0

    def at(self, time: float) -> tuple[float, float]:
        """Value and variance."""
        return self.mean + self.slope * (time - self.time), self.variance + self.slope_variance * (time - self.time) ** 2


class Step(NamedTuple):
    first: int  # the first run after it
    step: float
    sigma: float


class Trend(NamedTuple):
    first: int  # its first run
    slope: float  # a year
    sigma: float
    start: float  # value at its first run


Change = Union[Step, Trend]


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


def _days(time: Array) -> Array:
    """The number of each run's day among the robot's."""
    return numpy.cumsum(numpy.diff(time, axis=-1, prepend=time[..., :1]) > 0.0, axis=-1)


def _slope_z(x: Array, variance: Array, time: Array) -> Array:
    """Z[..., n] of the slope of the first n runs. 0 where they are of fewer than three days: of two it is that of a split."""
    weight = 1.0 / variance
    counts = weight > 0.0
    x, time = (numpy.where(counts, some, 0.0) for some in (x, time - time[..., :1]))
    first = x - x[..., :1]
    w, t, y, tt, ty = (numpy.cumsum(weight * of, axis=-1) for of in (numpy.ones_like(x), time, first, time**2, time * first))
    with numpy.errstate(divide="ignore", invalid="ignore"):
        square = tt - t * t / w
        return numpy.where(counts & (_days(time) >= 2) & (square > 0.0), (ty - t * y / w) / numpy.sqrt(square), 0.0)


def _alternatives(runs: int) -> list[tuple[int, int]]:
    """Each (k, n) of a split after run k of the first n, and (0, n) of a slope of the first n."""
    return [(k, n) for n in range(2, runs + 1) for k in range(1, n)] + [(0, n) for n in range(3, runs + 1)]


def _direction(k: int, n: int, runs: int) -> Array:
    """What Z is the product of runs of variance 1 with, evenly spaced."""
    along = numpy.arange(n) if k == 0 else (numpy.arange(n) >= k)
    centred = along - along.mean()
    return numpy.pad(centred / numpy.sqrt((centred**2).sum()), (0, runs - n))


@functools.lru_cache(maxsize=None)
def _clump(runs: int, limit: float) -> float:
    """E[1 / number of alternatives beyond the limit | one, drawn evenly, is beyond it], for evenly spaced runs of equal weight."""
    draw = numpy.random.Generator(numpy.random.Philox(runs))
    alternatives = _alternatives(runs)
    ones, time = numpy.ones(runs), numpy.arange(float(runs))
    total = 0.0
    tail = float(normal_cdf(-limit))
    for _ in range(_DRAWS):
        direction = _direction(*alternatives[draw.integers(len(alternatives))], runs)
        x = draw.standard_normal(runs)
        beyond = -normal_quantile(tail * (1.0 - draw.random()))  # a normal beyond the limit
        x += (beyond - direction @ x) * direction
        number = (numpy.abs(_z(x, ones)) >= limit).sum() + (numpy.abs(_slope_z(x, ones, time)) >= limit).sum()
        total += 1.0 / max(1, int(number))
    return total / _DRAWS


def limit_for(runs: int, probability: float) -> float:
    """What the largest |Z| over all alternatives of so many unchanged runs exceeds with this probability.

    P(any beyond) = sum over alternatives of P(it is beyond) E[1 / number beyond | it is] exactly.
    """
    limit = 3.0
    for _ in range(4):
        expected = _worth(runs, round(4.0 * limit) / 4.0)
        limit = -normal_quantile(min(0.5 * probability / expected, 0.49))
    return limit


_TABLE = (2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128)


def _worth(runs: int, limit: float) -> float:
    """As many independent alternatives as all of them are worth; between the table's numbers of runs by a power law."""
    above = next((i for i, size in enumerate(_TABLE) if size >= runs), len(_TABLE) - 1)
    low, high = _TABLE[max(above - 1, 0)], _TABLE[above]
    worth = [len(_alternatives(size)) * _clump(size, limit) for size in (low, high)]
    if low == high:
        return worth[0]
    return float(worth[0] * (worth[1] / worth[0]) ** (numpy.log(runs / low) / numpy.log(high / low)))


def with_degrees(limit: float, degrees: float) -> float:
    """The same for a sigma that was estimated with so many degrees of freedom."""
    return t_upper(float(normal_cdf(-limit)), degrees) if 0.0 < degrees < 1e4 else limit


def suspects(x: Array, variance: Array, time: Array, limit: Array) -> Array:
    """Of many robots, x[robot, run], those with any |Z| beyond their limit."""
    if x.shape[1] < 2:
        return numpy.zeros(len(x), bool)
    chunk = max(1, 2_000_000 // x.shape[1] ** 2)
    parts = [numpy.abs(_z(x[i : i + chunk], variance[i : i + chunk])).max(axis=(1, 2)) for i in range(0, len(x), chunk)]
    slopes = numpy.abs(_slope_z(x, variance, time)).max(axis=1)
    return numpy.asarray(numpy.maximum(numpy.concatenate(parts), slopes) > limit)


def pieces(x: Array, variance: Array, time: Array, limit: float) -> list[Piece]:
    """One robot's runs, by date, in the pieces that explain them best. time: of each run [years].

    A single run that differs from those before and after it is no piece: without it they are looked for again.
    """
    kept = numpy.flatnonzero(numpy.isfinite(variance))
    while True:
        bounds = _bounds(x[kept], 1.0 / variance[kept], time[kept], limit)
        alone = [start for start, end in bounds[1:-1] if end == start + 1]
        if not alone:
            return [_piece(int(kept[start]), x[kept[start:end]], 1.0 / variance[kept[start:end]], time[kept[start:end]], limit)
                    for start, end in bounds]
        kept = numpy.delete(kept, alone)


def _bounds(x: Array, weight: Array, time: Array, limit: float) -> list[tuple[int, int]]:
    """The division into pieces that minimises chi-squared + limit^2 (steps + trends), by dynamic programming over the end of
    the last piece."""
    runs, price = len(x), limit**2
    x, time, days = x - x.mean(), time - time.mean(), _days(time)
    terms = weight * numpy.stack([numpy.ones(runs), time, x, time**2, time * x, x**2])
    least, begins = numpy.full(runs + 1, -price), numpy.zeros(runs + 1, int)
    for end in range(1, runs + 1):
        w, t, y, tt, ty, yy = numpy.cumsum(terms[:, end - 1 :: -1], axis=1)[:, ::-1]  # from each run on
        square = tt - t * t / w
        with numpy.errstate(divide="ignore", invalid="ignore"):
            slope2 = numpy.where((days[end - 1] - days[:end] >= 2) & (square > 0.0), (ty - t * y / w) ** 2 / square, 0.0)  # its Z^2
        cost = least[:end] + price + yy - y * y / w - numpy.maximum(slope2 - price, 0.0)
        begins[end] = cost.argmin()
        least[end] = cost[begins[end]]
    bounds, end = [], runs
    while end > 0:
        bounds.append((int(begins[end]), end))
        end = int(begins[end])
    return bounds[::-1]


def _piece(first: int, x: Array, weight: Array, time: Array, limit: float) -> Piece:
    whole = weight.sum()
    mean, middle = (weight * x).sum() / whole, (weight * time).sum() / whole
    is_trend = abs(_slope_z(x, 1.0 / weight, time)[-1]) > limit
    square = (weight * (time - middle) ** 2).sum() if is_trend else numpy.inf
    slope = (weight * (time - middle) * (x - mean)).sum() / square
    return Piece(first, float(mean), float(1.0 / whole), float(middle), float(slope), float(1.0 / square))


def changes(found: list[Piece], time: Array) -> list[Change]:
    """Steps from each piece to the next, at the date of its first run; and trends."""
    told: list[Change] = []
    for i, piece in enumerate(found):
        since = float(time[piece.first])
        start, variance = piece.at(since)
        if i > 0:
            before, variance_before = found[i - 1].at(since)
            told.append(Step(piece.first, start - before, float(numpy.sqrt(variance + variance_before))))
        if piece.is_trend:
            told.append(Trend(piece.first, piece.slope, float(numpy.sqrt(piece.slope_variance)), start))
    return told
