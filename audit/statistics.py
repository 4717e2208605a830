"""Order statistics of one metric over the cells of one type: percentiles that bear infinities, and the worst cells."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["PERCENTILES", "Statistics", "statistics", "worst_first"]

PERCENTILES = (50, 95, 99)


@dataclass(frozen=True)
class Statistics:
    """count: cells with a value; undefined: cells with nan. The others are nan where count is 0.

    percentiles: at `PERCENTILES`, of the values as stored (so for a 1-is-best metric the bad tail is below p50).
    """

    count: int
    undefined: int
    min: float
    max: float
    mean: float
    percentiles: tuple[float, ...]


def statistics(values: NDArray[np.float64]) -> Statistics:
    """Statistics of (n,) values; nan is counted apart and never averaged in."""
    absent = np.isnan(values)
    undefined = int(np.count_nonzero(absent))
    known = values[~absent] if undefined else values
    if not len(known):
        return Statistics(0, undefined, math.nan, math.nan, math.nan, (math.nan,) * len(PERCENTILES))
    with np.errstate(invalid="ignore", over="ignore"):
        mean = float(known.mean())  # inf - inf is honestly nan
    return Statistics(
        len(known), undefined, float(known.min()), float(known.max()), mean, tuple(_percentiles(known, PERCENTILES))
    )


def _percentiles(known: NDArray[np.float64], percents: tuple[int, ...]) -> list[float]:
    """Linear percentiles, as numpy's default, but inf between two inf instead of nan."""
    last = len(known) - 1
    places = [(last * p // 100, last * p % 100 / 100) for p in percents]
    wanted = sorted({min(low + step, last) for low, _ in places for step in (0, 1)})
    ordered = np.partition(known, wanted)
    found = []
    for low, fraction in places:
        a, b = float(ordered[low]), float(ordered[min(low + 1, last)])
        if a == b or fraction == 0:
            found.append(a)
        elif math.isinf(a) or math.isinf(b):
            found.append(a + b)
        else:
            found.append(a + (b - a) * fraction if fraction < 0.5 else b - (b - a) * (1 - fraction))
    return found


def worst_first(values: NDArray[np.float64], n: int, *, high_is_worse: bool) -> NDArray[np.intp]:
    """Positions of the n worst values, worst first, equal ones by position; nan is never listed."""
    badness = -values if high_is_worse else values
    n = min(n, len(values) - int(np.count_nonzero(np.isnan(values))))
    if n <= 0:
        return np.empty(0, np.intp)
    limit = np.partition(badness, n - 1)[n - 1]  # nan sorts last
    better = np.flatnonzero(badness < limit)
    equal = np.flatnonzero(badness == limit)[: n - len(better)]
    listed = np.concatenate([better, equal])
    return listed[np.argsort(badness[listed], kind="stable")]
