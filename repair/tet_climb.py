"""Raising the worst tet at a point by the active-set method of Freitag and Ollivier-Gooch (Int. J. Numer. Meth. Engng.
40, 1997): step along the shortest vector of the convex hull of the gradients of the tets that are nearly worst. No tet
gets worse than its points may have (`least`).
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.sliding import normal_of, settle
from meshwright.repair.tet_stars import LARGEST_STAR, fit_at, star_hurts, star_of

__all__ = ["climb", "raise_worst", "shortest_in_hull"]

_MOST_ASCENTS = 12
_ACTIVE = 0.04
"""Tets whose fitness is within this part of the smallest one count as worst."""
_LEAST = 1e-5


@inner
def shortest_in_hull(g: Floats, n: int, out: Floats) -> float:
    """The shortest vector of the convex hull of the rows of g, by Wolfe-like pairwise steps; its length."""
    weight = np.zeros(n)
    best = 0
    for i in range(n):
        if _dot(g, i, i) < _dot(g, best, best):
            best = i
    weight[best] = 1.0
    for k in range(3):
        out[k] = g[best, k]
    for _ in range(60):
        near, far = -1, -1
        low, high = np.inf, -np.inf
        for i in range(n):
            d = g[i, 0] * out[0] + g[i, 1] * out[1] + g[i, 2] * out[2]
            if d < low:
                low, near = d, i
            if weight[i] > 0.0 and d > high:
                high, far = d, i
        if high - low <= 1e-6 * (out[0] * out[0] + out[1] * out[1] + out[2] * out[2]):
            break
        dx, dy, dz = g[near, 0] - g[far, 0], g[near, 1] - g[far, 1], g[near, 2] - g[far, 2]
        dd = dx * dx + dy * dy + dz * dz
        if not dd > 0.0:
            break
        s = min(weight[far], (high - low) / dd)
        weight[near] += s
        weight[far] -= s
        out[0] += s * dx
        out[1] += s * dy
        out[2] += s * dz
    return math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])


@inner
def _dot(g: Floats, i: int, j: int) -> float:
    return g[i, 0] * g[j, 0] + g[i, 1] * g[j, 1] + g[i, 2] * g[j, 2]


@inner
def _least_at(base: Floats, n: int, x: float, y: float, z: float, least: float) -> float:
    """Smallest fitness of the star with its point at x, y, z, cut short once it is not above `least`."""
    low = np.inf
    for i in range(n):
        low = min(low, fit_at(base, i, x, y, z)[0])
        if low <= least:
            return low
    return low


@inner
def climb(
    base: Floats, n: int, x: float, y: float, z: float, fits: Floats, slopes: Floats, g: Floats,
    sits: int, corners: Floats, beyond: Ints,
) -> tuple[float, float, float, float, int]:  # fmt: skip
    """(x, y, z, smallest fitness, seat) at the top that steps of the active-set method reach from x, y, z.

    base: the star, see `tet_stars.star_of`. fits (n,), slopes (n, 3), g (3,): scratch; fits holds the fitness of each
    tet at x, y, z. sits: triangle of the sheet that the point keeps to, -1 for one that is free.
    """
    reach = np.inf
    low = np.inf
    for i in range(n):
        low = min(low, fits[i])
        for k in range(0, 9, 3):
            dx, dy, dz = base[i, k] - x, base[i, k + 1] - y, base[i, k + 2] - z
            reach = min(reach, dx * dx + dy * dy + dz * dz)
    reach = math.sqrt(reach)
    if not reach > 0.0:
        return x, y, z, low, sits
    mx = my = mz = 0.0
    step = 0.2 * reach
    h = 1e-5 * reach
    for _ in range(_MOST_ASCENTS):
        if sits >= 0:
            mx, my, mz = normal_of(corners, sits)
        active = 0
        for i in range(n):
            if fits[i] <= low + _ACTIVE * abs(low) + 1e-6:
                slopes[active, 0] = (fit_at(base, i, x + h, y, z)[0] - fit_at(base, i, x - h, y, z)[0]) / (2.0 * h)
                slopes[active, 1] = (fit_at(base, i, x, y + h, z)[0] - fit_at(base, i, x, y - h, z)[0]) / (2.0 * h)
                slopes[active, 2] = (fit_at(base, i, x, y, z + h)[0] - fit_at(base, i, x, y, z - h)[0]) / (2.0 * h)
                out = slopes[active, 0] * mx + slopes[active, 1] * my + slopes[active, 2] * mz
                slopes[active, 0] -= out * mx
                slopes[active, 1] -= out * my
                slopes[active, 2] -= out * mz
                active += 1
        size = shortest_in_hull(slopes, active, g)
        if not size * reach > 1e-4:
            break
        better = False
        for _ in range(7):
            s = step / size
            tx, ty, tz, on = x + s * g[0], y + s * g[1], z + s * g[2], sits
            if sits >= 0:
                tx, ty, tz, on, _gap = settle(corners, beyond, sits, tx, ty, tz)
            new = _least_at(base, n, tx, ty, tz, low)
            if new > low and not star_hurts(base, n, tx, ty, tz):
                better = True
                break
            step *= 0.45
        if not better:
            break
        gain = new - low
        x, y, z, sits = tx, ty, tz, on
        low = np.inf
        for i in range(n):
            fits[i] = fit_at(base, i, x, y, z)[0]
            low = min(low, fits[i])
        if gain < 1e-4 * abs(low):
            break
        step *= 1.6
    return x, y, z, low, sits


@kernel
def raise_worst(
    points: Floats, tets: Ints, begin: Ints, items: Ints, least: Floats, rows: Ints, below: float,
    seat: Ints, corners: Floats, beyond: Ints,
) -> int:  # fmt: skip
    """Raise the smallest fitness of the star of each point of `rows` where it is under `below`; points that moved.

    least, seat, corners, beyond: as of `smooth`.
    """
    base = np.empty((LARGEST_STAR, 10))
    fits = np.empty(LARGEST_STAR)
    slopes = np.empty((LARGEST_STAR, 3))
    g = np.empty(3)
    moved = 0
    for r in range(rows.size):
        p = rows[r]
        if begin[p + 1] - begin[p] > LARGEST_STAR:
            continue
        n = star_of(points, tets, begin, items, least, p, base)
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        started = np.inf
        for i in range(n):
            fits[i] = fit_at(base, i, x, y, z)[0]
            started = min(started, fits[i])
        if not started < below:
            continue
        x, y, z, low, sits = climb(base, n, x, y, z, fits, slopes, g, seat[p], corners, beyond)
        if low > started + _LEAST * abs(started):
            points[p, 0], points[p, 1], points[p, 2] = x, y, z
            seat[p] = sits
            moved += 1
    return moved
