"""Taking points of a triangle mesh away and putting new ones in, where that raises the worst triangles around.

The moves of `tet_nodes`, one dimension down. A sweep decides for parts of the mesh that do not touch; the neighbour
table is made anew after it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.tri_tables import shape_of

__all__ = ["contract", "insert"]

Mask = NDArray[np.bool_]

_GAIN = 1.0 + 1e-3
_LARGEST_STAR = 32
_LARGEST_CAVITY = 24


@inner
def _worst(points: Floats, a: int, b: int, c: int, nx: float, ny: float, nz: float, turn: float) -> float:
    """Fitness of a triangle; -1 where its normal turns too far from nx, ny, nz."""
    f, _, x, y, z = shape_of(points, a, b, c)
    return f if x * nx + y * ny + z * nz >= turn else -1.0


@inner
def _is_free(touched: Mask, tris: Ints, begin: Ints, items: Ints, p: int) -> bool:
    for i in range(begin[p], begin[p + 1]):
        if touched[items[i]]:
            return False
    return True


@inner
def _common(tris: Ints, begin: Ints, items: Ints, p: int, q: int) -> int:
    """How many points are joined to both ends of an edge."""
    n = 0
    seen = np.empty(2 * _LARGEST_STAR, np.int64)
    m = 0
    for i in range(begin[p], begin[p + 1]):
        for k in range(3):
            v = tris[items[i], k]
            known = v in (p, q)
            for j in range(m):
                known = known or seen[j] == v
            if not known and m < seen.size:
                seen[m] = v
                m += 1
    for j in range(m):
        found = False
        for i in range(begin[q], begin[q + 1]):
            for k in range(3):
                found = found or tris[items[i], k] == seen[j]
        n += found
    return n


@kernel
def contract(
    points: Floats, tris: Ints, begin: Ints, items: Ints, held: Mask, least: Floats, below: float, turn: float,
    gone: Mask,
) -> int:  # fmt: skip
    """Contract edges of triangles of fitness under `below` into one of their ends where the worst around rises.

    tris changes in place; gone (m,): triangles that vanish. begin, items: triangles at each point. held (n,): points
    that stay. least (n,): fitness that no triangle at a point may fall under. turn: smallest cosine between the normals
    before and after. Returns how many were made.
    """
    touched = np.zeros(tris.shape[0], np.bool_)
    made = 0
    for t in range(tris.shape[0]):
        if touched[t]:
            continue
        fit = shape_of(points, tris[t, 0], tris[t, 1], tris[t, 2])[0]
        if fit >= below or fit <= 0.0:
            continue
        best, best_p, best_q = 0.0, -1, -1
        for k in range(3):
            p = tris[t, k]
            n = begin[p + 1] - begin[p]
            if held[p] or n > _LARGEST_STAR or not _is_free(touched, tris, begin, items, p):
                continue
            old = np.inf
            for i in range(begin[p], begin[p + 1]):
                u = items[i]
                old = min(old, shape_of(points, tris[u, 0], tris[u, 1], tris[u, 2])[0])
            for j in range(1, 3):
                q = tris[t, (k + j) % 3]
                if begin[q + 1] - begin[q] > _LARGEST_STAR or _common(tris, begin, items, p, q) != 2:
                    continue
                low = np.inf
                for i in range(begin[p], begin[p + 1]):
                    u = items[i]
                    a, b, c = tris[u, 0], tris[u, 1], tris[u, 2]
                    if q in (a, b, c):
                        continue
                    _, _, nx, ny, nz = shape_of(points, a, b, c)
                    a, b, c = (q if a == p else a), (q if b == p else b), (q if c == p else c)
                    f = _worst(points, a, b, c, nx, ny, nz, turn)
                    if f < max(least[a], least[b], least[c]):
                        f = -1.0
                    low = min(low, f)
                if low > old * _GAIN and low - old > best:
                    best, best_p, best_q = low - old, p, q
        if best_p < 0:
            continue
        for i in range(begin[best_p], begin[best_p + 1]):
            u = items[i]
            both = best_q in (tris[u, 0], tris[u, 1], tris[u, 2])
            # what is beside must wait for the next sweep, when the tables know of this
            for k in range(3):
                v = tris[u, k]
                for j in range(begin[v], begin[v + 1]):
                    touched[items[j]] = True
            if both:
                gone[u] = True
            else:
                for k in range(3):
                    if tris[u, k] == best_p:
                        tris[u, k] = best_q
        made += 1
    return made


@inner
def _fan(
    points: Floats, tris: Ints, across: Ints, cavity: Ints, n: int, rim: Ints, x: float, y: float, z: float,
    nx: float, ny: float, nz: float, turn: float, least: Floats, spot: int,
) -> tuple[int, float, int]:  # fmt: skip
    """(edges of the rim, smallest fitness of the fan over x, y, z, edge where it is); rim (k, 3): ends, and what lies
    across. spot: a spare row of points."""
    points[spot, 0], points[spot, 1], points[spot, 2] = x, y, z
    m, low, at = 0, np.inf, -1
    for i in range(n):
        t = cavity[i]
        for k in range(3):
            o = across[t, k]
            inside = False
            if o >= 0:
                for j in range(n):
                    inside = inside or cavity[j] == o // 3
            if not inside:
                a, b = tris[t, (k + 1) % 3], tris[t, (k + 2) % 3]
                f = _worst(points, spot, a, b, nx, ny, nz, turn)
                if f < max(least[a], least[b]):
                    f = min(f, 0.0)
                rim[m, 0], rim[m, 1], rim[m, 2] = a, b, o
                if f < low:
                    low, at = f, m
                m += 1
    return m, low, at


@kernel
def insert(
    points: Floats, count: Ints, tris: Ints, across: Ints, least: Floats, below: float, turn: float, flat: bool,
    gone: Mask, fresh: Ints, parent: Ints,
) -> int:  # fmt: skip
    """Put points into cavities around triangles of fitness under `below` where the worst of what is there rises.

    points (room, 3), count[0] in use, the last row spare. gone (m,): triangles that vanish; fresh (k, 3), parent (k,):
    room for those that come, and the triangle that each stands for. On surfaces that are not flat the cavity has to lie
    in one plane. Returns how many rows of fresh are used.
    """
    cavity = np.empty(_LARGEST_CAVITY, np.int64)
    rim = np.empty((3 * _LARGEST_CAVITY, 3), np.int64)
    touched = np.zeros(tris.shape[0], np.bool_)
    spot = points.shape[0] - 1
    made = 0
    for t in range(tris.shape[0]):
        if touched[t] or gone[t] or count[0] >= spot:
            continue
        fit, _, nx, ny, nz = shape_of(points, tris[t, 0], tris[t, 1], tris[t, 2])
        if fit >= below or fit <= 0.0:
            continue
        level = turn if flat else 1.0 - 1e-12
        x = y = z = 0.0
        for k in range(3):
            x += points[tris[t, k], 0] / 3.0
            y += points[tris[t, k], 1] / 3.0
            z += points[tris[t, k], 2] / 3.0
        cavity[0] = t
        n, best_n, top, old = 1, 0, 0.0, fit
        while True:
            m, low, at = _fan(points, tris, across, cavity, n, rim, x, y, z, nx, ny, nz, level, least, spot)
            if low > 0.0 and low / old > top and m == n + 2:  # else a point would be lost inside
                top, best_n = low / old, n
            o = rim[at, 2]
            if o < 0 or n >= _LARGEST_CAVITY or touched[o // 3] or gone[o // 3]:
                break
            u = o // 3
            f, _, ux, uy, uz = shape_of(points, tris[u, 0], tris[u, 1], tris[u, 2])
            if ux * nx + uy * ny + uz * nz < level or f <= 0.0:
                break
            cavity[n] = u
            old = min(old, f)
            n += 1
        if best_n == 0:
            continue
        n, old = best_n, np.inf
        reach = 0.0
        for i in range(n):
            u = cavity[i]
            old = min(old, shape_of(points, tris[u, 0], tris[u, 1], tris[u, 2])[0])
        for k in range(3):
            gap = 0.0
            for j in range(3):
                gap += (points[tris[t, k], j] - points[tris[t, (k + 1) % 3], j]) ** 2
            reach = max(reach, math.sqrt(gap))
        m, low, at = _fan(points, tris, across, cavity, n, rim, x, y, z, nx, ny, nz, level, least, spot)
        # two directions in the plane of the triangle
        ux, uy, uz = points[tris[t, 1], 0] - points[tris[t, 0], 0], points[tris[t, 1], 1] - points[tris[t, 0], 1], 0.0
        uz = points[tris[t, 1], 2] - points[tris[t, 0], 2]
        size = math.sqrt(ux * ux + uy * uy + uz * uz)
        ux, uy, uz = ux / size, uy / size, uz / size
        vx, vy, vz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
        step = 0.2 * reach
        for _ in range(24):
            better = False
            for way in range(8):
                cu, cv = step * math.cos(0.25 * math.pi * way), step * math.sin(0.25 * math.pi * way)
                tx, ty, tz = x + cu * ux + cv * vx, y + cu * uy + cv * vy, z + cu * uz + cv * vz
                _, f, _ = _fan(points, tris, across, cavity, n, rim, tx, ty, tz, nx, ny, nz, level, least, spot)
                if f > low:
                    x, y, z, low, better = tx, ty, tz, f, True
                    break
            if not better:
                step *= 0.5
        if not low > old * _GAIN or made + m > fresh.shape[0]:
            continue
        p = count[0]
        points[p, 0], points[p, 1], points[p, 2] = x, y, z
        count[0] += 1
        for i in range(n):
            gone[cavity[i]] = True
        for r in range(m):
            fresh[made, 0], fresh[made, 1], fresh[made, 2] = p, rim[r, 0], rim[r, 1]
            parent[made] = cavity[min(r, n - 1)]
            made += 1
            if rim[r, 2] >= 0:
                touched[rim[r, 2] // 3] = True
    return made
