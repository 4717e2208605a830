"""The tets around a point: their table, colours of points that share none, and how good they are wherever it goes."""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.tet_shape import both, measures, quality, quality_of

__all__ = [
    "LARGEST_STAR", "colours", "fit_at", "rate", "star_hurts", "star_of", "star_quality", "stars", "worst_at_points",
]  # fmt: skip

LARGEST_STAR = 512


@kernel
def stars(tets: Ints, n_points: int) -> tuple[Ints, Ints]:
    """(offsets, items): the rows of the living tets at each point, ascending."""
    begin = np.zeros(n_points + 1, tets.dtype)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            for k in range(4):
                begin[tets[t, k] + 1] += 1
    for p in range(n_points):
        begin[p + 1] += begin[p]
    items = np.empty(begin[n_points], tets.dtype)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            for k in range(4):
                items[begin[tets[t, k]]] = t
                begin[tets[t, k]] += 1
    # each offset has moved on to where the next one was
    for p in range(n_points, 0, -1):
        begin[p] = begin[p - 1]
    begin[0] = 0
    return begin, items


@kernel
def colours(cells: Ints, begin: Ints, items: Ints, moving: Ints) -> tuple[Ints, Ints]:
    """(order, stops): the moving points grouped by colour; no two of one colour share a cell.

    cells: (m, k) point rows; begin, items: cells at each point; moving: point rows, ascending. Greedy.
    """
    n = begin.size - 1
    colour = np.full(n, -1, np.int16)
    taken = np.full(256, -1, np.int64)
    most = 0
    for i in range(moving.size):
        p = moving[i]
        for j in range(begin[p], begin[p + 1]):
            for k in range(cells.shape[1]):
                c = colour[cells[items[j], k]]
                if c >= 0:
                    taken[c] = p
        c = 0
        while c < 255 and taken[c] == p:
            c += 1
        colour[p] = c
        most = max(most, c + 1)
    stops = np.zeros(most + 1, np.int64)
    for i in range(moving.size):
        stops[colour[moving[i]] + 1] += 1
    for c in range(most):
        stops[c + 1] += stops[c]
    cursor = stops[:-1].copy()
    order = np.empty(moving.size, moving.dtype)
    for i in range(moving.size):
        c = colour[moving[i]]
        order[cursor[c]] = moving[i]
        cursor[c] += 1
    return order, stops


@inner
def star_of(points: Floats, tets: Ints, begin: Ints, items: Ints, least: Floats, p: int, base: Floats) -> int:
    """Write the three other points of each tet of the star, turned so that p comes first; the number of tets.

    base[i, 9]: the quality that tet i may not fall under.
    """
    n = 0
    for i in range(begin[p], begin[p + 1]):
        t = items[i]
        a, b, c, d = tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3]
        if b == p:
            a, b, c, d = b, a, d, c
        elif c == p:
            a, b, c, d = c, a, b, d
        elif d == p:
            a, b, c, d = d, a, c, b
        for k in range(3):
            base[n, k] = points[b, k]
            base[n, 3 + k] = points[c, k]
            base[n, 6 + k] = points[d, k]
        base[n, 9] = max(least[a], least[b], least[c], least[d])
        n += 1
    return n


@inner
def fit_at(base: Floats, i: int, x: float, y: float, z: float) -> tuple[float, float]:
    """(fitness, cost) of tet i of the star with its point at x, y, z."""
    return measures(
        x,
        y,
        z,
        base[i, 0],
        base[i, 1],
        base[i, 2],
        base[i, 3],
        base[i, 4],
        base[i, 5],
        base[i, 6],
        base[i, 7],
        base[i, 8],
    )


@inner
def star_quality(base: Floats, i: int, x: float, y: float, z: float) -> float:
    """Quality of tet i of the star with its point at x, y, z."""
    return quality(
        x, y, z, base[i, 0], base[i, 1], base[i, 2], base[i, 3], base[i, 4], base[i, 5], base[i, 6], base[i, 7],
        base[i, 8],
    )  # fmt: skip


@inner
def star_hurts(base: Floats, n: int, x: float, y: float, z: float) -> bool:
    """Whether a tet of the star is worse, with its point at x, y, z, than one of its points may have."""
    for i in range(n):
        if star_quality(base, i, x, y, z) < base[i, 9]:
            return True
    return False


@kernel
def rate(points: Floats, tets: Ints, fit: Floats) -> None:
    """Fill in the fitness of every tet, inf in rows that are free."""
    for t in range(tets.shape[0]):
        fit[t] = np.inf
        if tets[t, 0] >= 0:
            fit[t] = both(points, tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3])[0]


@kernel
def worst_at_points(points: Floats, tets: Ints, n_points: int) -> Floats:
    """(n,) quality of the worst tet at each point, inf where there is none."""
    out = np.full(n_points, np.inf)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            q = quality_of(points, tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3])
            for k in range(4):
                out[tets[t, k]] = min(out[tets[t, k]], q)
    return out
