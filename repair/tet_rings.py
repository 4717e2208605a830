"""The tets that take the place of an edge: the best triangulation of the ring of points around it.

Found by dynamic programming (Klincsek, Annals of Discrete Math. 9, 1980; for tets Shewchuk, "Two discrete optimization
algorithms for the topological improvement of tetrahedral meshes", 2002).
"""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.tet_shape import both, cost_of, quality_floor, quality_of

__all__ = ["LARGEST_RING", "allowed", "hurts", "row_cost", "sum_of", "without_edge"]

LARGEST_RING = 12
_LEAST = 1e-6
"""Relative gain below which a swap is not worth making: it keeps rounding from swapping to and fro."""


@inner
def _least_cost(
    points: Floats, a: int, b: int, ring: Ints, m: int, most: float, value: Floats, pick: Ints
) -> float:  # fmt: skip
    """Cost of the cheapest triangulation of the ring, inf where none is under `most`; `pick` says which it is.

    value[i, j]: cost of the cheapest triangulation of ring i to j. No tet costs less than 1.
    """
    for i in range(m - 1):
        value[i, i + 1] = 0.0
    for span in range(2, m):
        for i in range(m - span):
            j = i + span
            rest = 2.0 * (m - 1 - span)
            value[i, j] = np.inf
            pick[i, j] = -1
            for k in range(i + 1, j):
                before = value[i, k] + value[k, j]
                bound = min(value[i, j], most - rest)
                if before + 2.0 >= bound:
                    continue
                c = before + cost_of(points, a, ring[i], ring[k], ring[j])
                if c + 1.0 >= bound:
                    continue
                c += cost_of(points, ring[i], ring[k], ring[j], b)
                if c < bound:
                    value[i, j] = c
                    pick[i, j] = k
    return value[0, m - 1]


@inner
def _most_fit(
    points: Floats, a: int, b: int, ring: Ints, m: int, least: float, low: Floats, pick: Ints
) -> float:  # fmt: skip
    """The largest smallest fitness of a triangulation of the ring, under 0 where none is over `least`; `pick` says
    which it is.

    low[i, j]: largest smallest fitness of a triangulation of ring i to j.
    """
    for i in range(m - 1):
        low[i, i + 1] = np.inf
    for span in range(2, m):
        for i in range(m - span):
            j = i + span
            low[i, j] = -np.inf
            pick[i, j] = -1
            for k in range(i + 1, j):
                f = min(low[i, k], low[k, j])
                if not f > max(least, low[i, j]):
                    continue
                f = min(f, both(points, a, ring[i], ring[k], ring[j])[0])
                if not f > max(least, low[i, j]):
                    continue
                f = min(f, both(points, ring[i], ring[k], ring[j], b)[0])
                if f > max(least, low[i, j]):
                    low[i, j] = f
                    pick[i, j] = k
    return low[0, m - 1]


@inner
def _build(a: int, b: int, ring: Ints, m: int, pick: Ints, new: Ints, stack: Ints) -> int:
    """Write the tets of the picked triangulation into `new`; their number."""
    n = 0
    top = 1
    stack[0, 0], stack[0, 1] = 0, m - 1
    while top:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        if j - i < 2:
            continue
        k = pick[i, j]
        new[n, 0], new[n, 1], new[n, 2], new[n, 3] = a, ring[i], ring[k], ring[j]
        new[n + 1, 0], new[n + 1, 1], new[n + 1, 2], new[n + 1, 3] = ring[i], ring[k], ring[j], b
        n += 2
        stack[top, 0], stack[top, 1] = i, k
        stack[top + 1, 0], stack[top + 1, 1] = k, j
        top += 2
    return n


@inner
def sum_of(points: Floats, new: Ints, n: int) -> tuple[float, float]:
    """(summed cost, smallest fitness) of these tets."""
    total, low = 0.0, np.inf
    for i in range(n):
        f, c = both(points, new[i, 0], new[i, 1], new[i, 2], new[i, 3])
        total += c
        low = min(low, f)
    return total, low


@inner
def allowed(
    old_fit: float, old_cost: float, fit: float, total: float, by_fitness: bool, floor: float, give: float
) -> bool:
    """Whether a swap from (old_fit, old_cost) to (fit, total) is an improvement that hurts nothing."""
    if fit <= 0.0:
        return False
    if by_fitness:
        return fit > old_fit * (1.0 + _LEAST) + 1e-12
    return total < old_cost * (1.0 + give) and fit >= min(old_fit, floor)


@inner
def row_cost(points: Floats, tets: Ints, t: int) -> float:
    """Cost of tet t."""
    return cost_of(points, tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3])


@inner
def hurts(points: Floats, new: Ints, n: int, least: Floats, fit: float) -> bool:
    """Whether one of these tets is worse than a point of it may have. fit: none has a fitness under that."""
    sure = quality_floor(fit)
    for i in range(n):
        a, b, c, d = new[i, 0], new[i, 1], new[i, 2], new[i, 3]
        bound = max(least[a], least[b], least[c], least[d])
        if sure < bound and quality_of(points, a, b, c, d) < bound:
            return True
    return False


@inner
def without_edge(
    points: Floats, tets: Ints, fit: Floats, a: int, b: int, ring: Ints, m: int, old: Ints, n_old: int,
    least: Floats, by_fitness: bool, floor: float, give: float, table: Floats, pick: Ints, new: Ints, stack: Ints,
) -> int:  # fmt: skip
    """Write the tets that are best to take the place of old[:n_old], those around the edge a-b, into `new`.

    ring[:m]: the points around the edge. Returns their number; 0 where none are an improvement that hurts nothing. The
    rest as of `tet_swaps.swap`; table, pick, stack: scratch.
    """
    old_fit, old_cost = np.inf, 0.0
    for i in range(n_old):
        old_fit = min(old_fit, fit[old[i]])
        old_cost += row_cost(points, tets, old[i])
    if by_fitness:
        if not _most_fit(points, a, b, ring, m, old_fit, table, pick) > old_fit:
            return 0
    else:
        most = old_cost * (1.0 + give)
        if 2.0 * (m - 2) >= most or not _least_cost(points, a, b, ring, m, most, table, pick) < most:
            return 0
    n = _build(a, b, ring, m, pick, new, stack)
    total, low_fit = sum_of(points, new, n)
    if not allowed(old_fit, old_cost, low_fit, total, by_fitness, floor, give):
        return 0
    return 0 if hurts(points, new, n, least, low_fit) else n
