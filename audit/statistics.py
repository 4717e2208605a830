"""Order statistics of one metric over the cells of one type: percentiles that bear infinities, and the worst cells."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.findings.signs.shapes import cell_shapes
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics.row import Metric
from meshwright.audit.ranks import at_ranks

__all__ = ["PERCENTILES", "Statistics", "degenerate", "statistics", "worst_first"]

PERCENTILES = (50, 95, 99)


@dataclass(frozen=True)
class Statistics:
    """count: entities with a value; undefined: with nan; degenerate: of `count`, with the value of a broken cell.

    The others are nan where count is 0. min and max are over all values, mean and percentiles over those that are not
    degenerate. percentiles: at `PERCENTILES`, of the values as stored (so for a 1-is-best metric the bad tail is
    below p50).
    """

    count: int
    undefined: int
    degenerate: int
    min: float
    max: float
    mean: float
    percentiles: tuple[float, ...]


def degenerate(
    mesh: Mesh, metric: Metric, key: str, values: NDArray[np.float64], rows: NDArray[np.intp] | None
) -> NDArray[np.bool_] | None:
    """(n,) the values that stand for "no shape" instead of measuring one; None for none.

    They equal the metric's value for a degenerate cell, on a cell without size or with an edge of no length, or are
    infinite.  key, rows: what the values belong to, as in `Measured.values`.
    """
    worst = metric.degenerate
    if math.isnan(worst):
        return None
    suspect = values == worst
    if not suspect.any():
        return None
    if math.isinf(worst):
        return suspect
    if key in CELL_TYPES:
        cells = mesh.block(key).rows
        shapes = cell_shapes(mesh)
        broken = shapes.flat | shapes.collapsed
        suspect &= broken[cells if rows is None else cells[rows]]
    else:
        return None
    return suspect if suspect.any() else None


def statistics(values: NDArray[np.float64], broken: NDArray[np.bool_] | None = None) -> Statistics:
    """Statistics of (n,) values; nan is counted apart and never averaged in, and neither are the `broken` ones."""
    absent = np.isnan(values)
    undefined = int(np.count_nonzero(absent))
    known = values[~absent] if undefined else values
    if not len(known):
        return Statistics(0, undefined, 0, math.nan, math.nan, math.nan, (math.nan,) * len(PERCENTILES))
    sound = known if broken is None else values[~absent & ~broken]
    mean, percentiles = math.nan, [math.nan] * len(PERCENTILES)
    if len(sound):
        with np.errstate(invalid="ignore", over="ignore"):
            mean = float(sound.mean())  # inf - inf is honestly nan
        percentiles = _percentiles(sound, PERCENTILES)
    broken_ones = len(known) - len(sound)
    low, high = float(known.min()), float(known.max())
    return Statistics(len(known), undefined, broken_ones, low, high, mean, tuple(percentiles))


def _percentiles(known: NDArray[np.float64], percents: tuple[int, ...]) -> list[float]:
    """Linear percentiles, as numpy's default, but inf between two inf instead of nan."""
    last = len(known) - 1
    places = [(last * p // 100, last * p % 100 / 100) for p in percents]
    ordered = at_ranks(known, {min(low + step, last) for low, _ in places for step in (0, 1)})
    found = []
    for low, fraction in places:
        a, b = ordered[low], ordered[min(low + 1, last)]
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
    if len(values) == n or np.isnan(values).any():
        limit = np.partition(badness, n - 1)[n - 1]  # nan sorts last
    else:
        limit = at_ranks(badness, (n - 1,))[n - 1]
    better = np.flatnonzero(badness < limit)
    equal = np.flatnonzero(badness == limit)[: n - len(better)]
    listed = np.concatenate([better, equal])
    return listed[np.argsort(badness[listed], kind="stable")]
