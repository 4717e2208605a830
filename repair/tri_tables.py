"""Kernels on triangle meshes: neighbour table, edge swaps, and moving points, all decided by the angles of triangles.

In the plane and on curved surfaces alike: angles are measured in space, and a swap or a move is refused where a normal
would turn by more than a limit. A point of a curved surface slides on the triangles that were around it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.pairing import WALL, pair_sides

__all__ = [
    "cost_sum", "flip", "held_by_borders", "neighbours_of", "relax", "shape_of", "smallest_angles", "worst_at_points",
]  # fmt: skip

Mask = NDArray[np.bool_]

_WALL = -1
_SIDES = np.array([[1, 2], [2, 0], [0, 1]], dtype=np.int64)
_LEAST = 1e-6
"""Gain, of fitness or relative of cost, below which a swap is not worth making: rounding must not swap to and fro."""
_SOUND = 0.25
"""Fitness that swaps for valence leave: angles of 15 to 150 degrees, which smoothing then makes good."""
_LARGEST_STAR = 64


def neighbours_of(tris: Ints, walls: Ints) -> Ints:
    """(m, 3): 3 * neighbour + its side, for the side opposite each corner; WALL at borders, walls (k, 2), sides of more
    than two triangles, and between two that walk the side alike: a swap would turn one of them over."""
    partner = pair_sides(tris, _SIDES, walls)
    begins = tris[:, _SIDES[:, 0]]
    partner[(partner != WALL) & (begins == begins.ravel()[partner])] = WALL
    return partner


@kernel
def held_by_borders(tris: Ints, across: Ints, n_points: int) -> Mask:
    """(n,) whether a border or a wall meets the point."""
    held = np.zeros(n_points, np.bool_)
    for t in range(tris.shape[0]):
        for k in range(3):
            if across[t, k] < 0:
                held[tris[t, (k + 1) % 3]] = True
                held[tris[t, (k + 2) % 3]] = True
    return held


@inner
def _measures(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float, cx: float, cy: float, cz: float
) -> tuple[float, float, float, float, float]:
    """(fitness, cost, normal) of a triangle: fitness is the smaller of the smallest angle over 60 degrees and the room
    of the largest one to 180, over 120; the cost a power of the inverse mean ratio."""
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = cx - ax, cy - ay, cz - az
    wx, wy, wz = cx - bx, cy - by, cz - bz
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    twice = math.sqrt(nx * nx + ny * ny + nz * nz)
    total = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
    if not twice > 1e-14 * total:
        return -1.0, np.inf, 0.0, 0.0, 0.0
    one = math.atan2(twice, ux * vx + uy * vy + uz * vz)
    two = math.atan2(twice, -(ux * wx + uy * wy + uz * wz))
    three = math.pi - one - two
    low, high = min(one, two, three), max(one, two, three)
    fit = min(low * (3.0 / math.pi), (math.pi - high) * (1.5 / math.pi))
    ratio = total / (3.4641016151377544 * twice)
    return fit, ratio * ratio * math.sqrt(ratio), nx / twice, ny / twice, nz / twice


@inner
def shape_of(points: Floats, a: int, b: int, c: int) -> tuple[float, float, float, float, float]:
    """(fitness, cost, unit normal) of a triangle by its point rows; see `_measures`."""
    return _measures(
        points[a, 0], points[a, 1], points[a, 2], points[b, 0], points[b, 1], points[b, 2],
        points[c, 0], points[c, 1], points[c, 2],
    )  # fmt: skip


@kernel
def smallest_angles(points: Floats, tris: Ints) -> Floats:
    """(m,) fitness of each triangle."""
    out = np.empty(tris.shape[0])
    for t in range(tris.shape[0]):
        out[t] = shape_of(points, tris[t, 0], tris[t, 1], tris[t, 2])[0]
    return out


@kernel
def worst_at_points(points: Floats, tris: Ints, n_points: int) -> Floats:
    """(n,) fitness of the worst triangle at each point, inf where there is none.

    It is the quality of the driver too: the scaled Jacobian of a triangle is never smaller.
    """
    out = np.full(n_points, np.inf)
    for t in range(tris.shape[0]):
        f = shape_of(points, tris[t, 0], tris[t, 1], tris[t, 2])[0]
        for k in range(3):
            out[tris[t, k]] = min(out[tris[t, k]], f)
    return out


@kernel
def cost_sum(points: Floats, tris: Ints) -> float:
    """Summed cost of all triangles."""
    total = 0.0
    for t in range(tris.shape[0]):
        total += shape_of(points, tris[t, 0], tris[t, 1], tris[t, 2])[1]
    return total


@inner
def _joined(tris: Ints, across: Ints, t: int, a: int, b: int) -> bool:
    """Whether an edge a-b is there already at a, going round from triangle t; borders end the walk both ways."""
    for way in range(2):
        here = t
        for _ in range(_LARGEST_STAR):
            k = 0
            while tris[here, k] != a:
                k += 1
            if tris[here, (k + 1) % 3] == b or tris[here, (k + 2) % 3] == b:
                return True
            o = across[here, (k + 1 + way) % 3]
            if o < 0:
                break
            here = o // 3
            if here == t:
                return False
    return False


@inner
def _flip(tris: Ints, across: Ints, t: int, k: int) -> None:
    """Swap the side k of triangle t: (a, b, c), (a, d, b) with a-b in common become (c, a, d), (d, b, c)."""
    o = across[t, k]
    u, j = o // 3, o % 3
    c, a, b, d = tris[t, k], tris[t, (k + 1) % 3], tris[t, (k + 2) % 3], tris[u, j]
    # sides: of t opposite a (b-c) and b (c-a); of u opposite b (a-d) and a (d-b)
    bc, ca = across[t, (k + 1) % 3], across[t, (k + 2) % 3]
    ub = 0
    while tris[u, ub] != b:
        ub += 1
    ua = 0
    while tris[u, ua] != a:
        ua += 1
    ad, db = across[u, ub], across[u, ua]
    tris[t, 0], tris[t, 1], tris[t, 2] = c, a, d
    tris[u, 0], tris[u, 1], tris[u, 2] = d, b, c
    across[t, 0], across[t, 1], across[t, 2] = ad, 3 * u + 1, ca
    across[u, 0], across[u, 1], across[u, 2] = bc, 3 * t + 1, db
    if ad >= 0:
        across[ad // 3, ad % 3] = 3 * t
    if ca >= 0:
        across[ca // 3, ca % 3] = 3 * t + 2
    if bc >= 0:
        across[bc // 3, bc % 3] = 3 * u
    if db >= 0:
        across[db // 3, db % 3] = 3 * u + 2


@inner
def _swapped(
    points: Floats, tris: Ints, across: Ints, least: Floats, t: int, k: int, turn: float
) -> tuple[bool, float, float, float, float, int, int, int, int]:
    """(allowed, old fitness, new fitness, old cost, new cost, a, b, c, d) of swapping side k of triangle t.

    turn: smallest cosine between the old normals and the new ones.
    """
    o = across[t, k]
    u, j = o // 3, o % 3
    c, a, b, d = tris[t, k], tris[t, (k + 1) % 3], tris[t, (k + 2) % 3], tris[u, j]
    if c == d:
        return False, 0.0, 0.0, 0.0, 0.0, a, b, c, d
    f1, c1, px, py, pz = shape_of(points, c, a, d)
    f2, c2, qx, qy, qz = shape_of(points, d, b, c)
    e1, b1, rx, ry, rz = shape_of(points, a, b, c)
    e2, b2, sx, sy, sz = shape_of(points, a, d, b)
    ok = f1 > 0.0 and f2 > 0.0
    ok = ok and f1 >= max(least[c], least[a], least[d]) and f2 >= max(least[d], least[b], least[c])
    for x, y, z in ((px, py, pz), (qx, qy, qz)):
        if e1 > 0.0 and x * rx + y * ry + z * rz < turn:
            ok = False
        if e2 > 0.0 and x * sx + y * sy + z * sz < turn:
            ok = False
    return ok, min(e1, e2), min(f1, f2), b1 + b2, c1 + c2, a, b, c, d


@kernel
def flip(
    points: Floats, tris: Ints, across: Ints, least: Floats, degree: Ints, ideal: Ints, by_valence: bool, turn: float
) -> int:
    """One sweep of swaps; the number made.

    A swap raises the smaller fitness of a pair of triangles; by_valence, it brings the numbers of edges at the four
    points nearer to `ideal`, and where they are as near lowers the cost, with a fitness of _SOUND or what there was.
    degree (n,) is kept up to date. least (n,): fitness that no triangle at a point may fall under.
    """
    made = 0
    for t in range(tris.shape[0]):
        for k in range(3):
            if across[t, k] < 0:
                continue
            ok, old, new, before, after, a, b, c, d = _swapped(points, tris, across, least, t, k, turn)
            if not ok:
                continue
            if by_valence:
                da, db = degree[a] - ideal[a], degree[b] - ideal[b]
                dc, dd = degree[c] - ideal[c], degree[d] - ideal[d]
                gain = da + db - dc - dd - 2
                better = gain > 0 or (gain == 0 and after < before * (1.0 - _LEAST))
                better = better and new >= min(old, _SOUND)
            else:
                better = new > old + _LEAST
            if better and not _joined(tris, across, t, c, d):
                _flip(tris, across, t, k)
                degree[a] -= 1
                degree[b] -= 1
                degree[c] += 1
                degree[d] += 1
                made += 1
                break
    return made


@inner
def _ring(points: Floats, tris: Ints, begin: Ints, items: Ints, least: Floats, p: int, base: Floats) -> int:
    """Write the two other points of each triangle at p, in its direction of walk; the number of triangles.

    base[i, 6]: fitness that triangle i may not fall under.
    """
    n = 0
    for i in range(begin[p], begin[p + 1]):
        t = items[i]
        k = 0
        while tris[t, k] != p:
            k += 1
        for x in range(3):
            base[n, x] = points[tris[t, (k + 1) % 3], x]
            base[n, 3 + x] = points[tris[t, (k + 2) % 3], x]
        base[n, 6] = max(least[p], least[tris[t, (k + 1) % 3]], least[tris[t, (k + 2) % 3]])
        n += 1
    return n


@inner
def _state(base: Floats, normals: Floats, n: int, x: float, y: float, z: float, turn: float) -> tuple[float, float]:
    """(smallest fitness, summed cost) of the star with its point there; (-1, inf) where a normal turns too far or a
    triangle falls under what it may."""
    low, total = np.inf, 0.0
    for i in range(n):
        f, c, nx, ny, nz = _measures(x, y, z, base[i, 0], base[i, 1], base[i, 2], base[i, 3], base[i, 4], base[i, 5])
        if f < max(base[i, 6], 0.0) or f == 0.0 or nx * normals[i, 0] + ny * normals[i, 1] + nz * normals[i, 2] < turn:
            return -1.0, np.inf
        low = min(low, f)
        total += c
    return low, total


@kernel
def relax(
    points: Floats,
    tris: Ints,
    begin: Ints,
    items: Ints,
    least: Floats,
    rows: Ints,
    below: float,
    floor: float,
    turn: float,
    flat: bool,
) -> int:
    """Move each point of `rows` by a search along shrinking steps; the number that moved.

    Stars of a smallest fitness under `below` are moved to raise it, others to lower their cost with the fitness kept
    above `floor`. On a curved surface (not flat) points are taken back to the plane of their triangles.
    """
    base = np.empty((_LARGEST_STAR, 7))
    normals = np.empty((_LARGEST_STAR, 3))
    moved = 0
    for r in range(rows.size):
        p = rows[r]
        n = begin[p + 1] - begin[p]
        if n > _LARGEST_STAR or n < 3:
            continue
        _ring(points, tris, begin, items, least, p, base)
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        mx = my = mz = 0.0
        reach = 0.0
        sound = True
        for i in range(n):
            f, _, nx, ny, nz = _measures(
                x, y, z, base[i, 0], base[i, 1], base[i, 2], base[i, 3], base[i, 4], base[i, 5]
            )
            sound = sound and f > 0.0
            normals[i, 0], normals[i, 1], normals[i, 2] = nx, ny, nz
            mx, my, mz = mx + nx, my + ny, mz + nz
            dx, dy, dz = base[i, 0] - x, base[i, 1] - y, base[i, 2] - z
            reach += math.sqrt(dx * dx + dy * dy + dz * dz)
        size = math.sqrt(mx * mx + my * my + mz * mz)
        if not (sound and size > 0.0):
            continue
        mx, my, mz = mx / size, my / size, mz / size
        if flat:
            ux, uy, uz, vx, vy, vz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0
        else:
            # a star that is not flat would change the surface if its point moved
            level = True
            for i in range(n):
                if normals[i, 0] * mx + normals[i, 1] * my + normals[i, 2] * mz < 1.0 - 1e-12:
                    level = False
            if not level:
                continue
            if abs(mx) < 0.6:
                ux, uy, uz = 0.0, mz, -my
            else:
                ux, uy, uz = -mz, 0.0, mx
            size = math.sqrt(ux * ux + uy * uy + uz * uz)
            ux, uy, uz = ux / size, uy / size, uz / size
            vx, vy, vz = my * uz - mz * uy, mz * ux - mx * uz, mx * uy - my * ux
        low, total = _state(base, normals, n, x, y, z, turn)
        started_low, started = low, total
        worst_first = low < below
        step = 0.15 * reach / n
        for _ in range(24 if worst_first else 5):
            best_x, best_y, best_z, best_low, best_total = x, y, z, low, total
            for way in range(8):
                cu, cv = math.cos(0.25 * math.pi * way), math.sin(0.25 * math.pi * way)
                tx, ty, tz = (
                    x + step * (cu * ux + cv * vx),
                    y + step * (cu * uy + cv * vy),
                    z + step * (cu * uz + cv * vz),
                )
                f, c = _state(base, normals, n, tx, ty, tz, turn)
                better = f > best_low if worst_first else c < best_total and f >= min(started_low, floor)
                if better:
                    best_x, best_y, best_z, best_low, best_total = tx, ty, tz, f, c
            if best_x == x and best_y == y and best_z == z:
                step *= 0.5
                if step < 1e-4 * reach / n:
                    break
            else:
                x, y, z, low, total = best_x, best_y, best_z, best_low, best_total
        gained = low > started_low + 1e-6 if worst_first else total < started * (1.0 - 1e-6)
        if gained:
            points[p, 0], points[p, 1], points[p, 2] = x, y, z
            moved += 1
    return moved
