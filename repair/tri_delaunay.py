"""Delaunay insertion into flat meshes of triangles: the moves of `delaunay`, one dimension down.

Circumcentres are put in after Chew and Ruppert (A Delaunay refinement algorithm for quality 2-dimensional mesh
generation, J. Algorithms 18, 1995); the boundary stays as it is, so that a centre that would stand in the circle over
an edge of it is left out. A sweep decides for parts of the mesh that do not touch; the neighbours are found anew after
it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.doubles import minus, plus, times, two_sum
from meshwright.audit.errors import MeshError
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.carrying import with_cells, with_more_points
from meshwright.repair.held import edge_walls
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.refine import chosen_cells
from meshwright.repair.sizes import signed_sizes
from meshwright.repair.tri_tables import neighbours_of

__all__ = ["in_circle", "refine_triangles"]

Mask = NDArray[np.bool_]

_RATIO = math.sqrt(2.0)
"""Circumradius over shortest edge above which a triangle is cut: its smallest angle is under 20.7 degrees then."""
_CLOSE = 0.5
"""Part of the shortest edge of the triangle under which a new point would stand too near to another."""
_LARGEST_CAVITY = 100
_MOST_STEPS = 2000
_FILTER = 1e-14
_PAIR_FILTER = 1e-29


@inner
def in_circle(points: Floats, a: int, b: int, c: int, x: float, y: float) -> int:
    """1 where x, y lies inside the circle through the counter-clockwise a, b, c; -1 outside, 0 on it."""
    ax, ay, bx, by = points[a, 0] - x, points[a, 1] - y, points[b, 0] - x, points[b, 1] - y
    cx, cy = points[c, 0] - x, points[c, 1] - y
    aa, bb, cc = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    total = aa * (bx * cy - cx * by) + bb * (cx * ay - ax * cy) + cc * (ax * by - bx * ay)
    size = aa * (abs(bx * cy) + abs(cx * by)) + bb * (abs(cx * ay) + abs(ax * cy)) + cc * (abs(ax * by) + abs(bx * ay))
    if total > _FILTER * size:
        return 1
    if total < -_FILTER * size:
        return -1
    u, v = two_sum(points[a, 0], -x), two_sum(points[a, 1], -y)
    p, q = two_sum(points[b, 0], -x), two_sum(points[b, 1], -y)
    r, s = two_sum(points[c, 0], -x), two_sum(points[c, 1], -y)
    one = times(plus(times(u, u), times(v, v)), minus(times(p, s), times(r, q)))
    two = times(plus(times(p, p), times(q, q)), minus(times(r, v), times(u, s)))
    three = times(plus(times(r, r), times(s, s)), minus(times(u, q), times(p, v)))
    whole = plus(plus(one, two), three)
    if whole[0] > _PAIR_FILTER * size:
        return 1
    return -1 if whole[0] < -_PAIR_FILTER * size else 0


@inner
def _turn(points: Floats, a: int, b: int, x: float, y: float) -> float:
    """Twice the area of a, b and x, y, positive counter-clockwise; 0 where rounding decides its sign."""
    ax, ay, bx, by = points[a, 0] - x, points[a, 1] - y, points[b, 0] - x, points[b, 1] - y
    one, two = ax * by, bx * ay
    return one - two if abs(one - two) > _FILTER * (abs(one) + abs(two)) else 0.0


@inner
def _circle_of(points: Floats, a: int, b: int, c: int) -> tuple[float, float, float, float, float]:
    """(centre, squared radius, squared shortest and longest edge) of a triangle; the radius is inf for a flat one."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    uu, vv, ww = ux * ux + uy * uy, vx * vx + vy * vy, (vx - ux) ** 2 + (vy - uy) ** 2
    short, long = min(uu, vv, ww), max(uu, vv, ww)
    twice = 2.0 * (ux * vy - uy * vx)
    if twice == 0.0:
        return 0.0, 0.0, np.inf, short, long
    x, y = (vy * uu - uy * vv) / twice, (ux * vv - vx * uu) / twice
    return points[a, 0] + x, points[a, 1] + y, x * x + y * y, short, long


@inner
def _locate(points: Floats, tris: Ints, across: Ints, t: int, x: float, y: float) -> int:
    """The triangle that holds x, y, walking from t; -1 where a wall lies between."""
    for step in range(_MOST_STEPS):
        left = -1
        for k in range(3):
            f = (k + step) % 3
            if _turn(points, tris[t, (f + 1) % 3], tris[t, (f + 2) % 3], x, y) < 0.0:
                left = f
                break
        if left < 0:
            return t
        o = across[t, left]
        if o < 0:
            return -1
        t = o // 3
    return -1


@kernel
def _insert(
    points: Floats, count: Ints, tris: Ints, across: Ints, chosen: Mask, ratio: float, longest: float,
    gone: Mask, fresh: Ints, parent: Ints,
) -> int:  # fmt: skip
    """Insert the circumcentres of chosen triangles (m,) that are too long for their shortest edge, or over `longest`.

    points (room, 3), count[0] in use. gone (m,): triangles that vanish; fresh (k, 3), parent (k,): room for those that
    come and the triangle that each stands for. Returns how many rows of fresh are used.
    """
    cavity = np.empty(_LARGEST_CAVITY, np.int64)
    rim = np.empty((3 * _LARGEST_CAVITY, 3), np.int64)
    touched = np.zeros(tris.shape[0], np.bool_)
    made = 0
    for t in range(tris.shape[0]):
        if touched[t] or not chosen[t] or count[0] >= points.shape[0]:
            continue
        x, y, radius, short, long = _circle_of(points, tris[t, 0], tris[t, 1], tris[t, 2])
        if not (radius > ratio * ratio * short or long > longest * longest) or not radius < np.inf:
            continue
        home = _locate(points, tris, across, t, x, y)
        if home < 0 or touched[home]:
            continue
        cavity[0] = home
        n, at, m = 1, 0, 0
        fits = True
        while at < n and fits:
            here = cavity[at]
            at += 1
            for k in range(3):
                o = across[here, k]
                if o < 0:
                    continue
                u = o // 3
                known = False
                for i in range(n):
                    known = known or cavity[i] == u
                if not known and in_circle(points, tris[u, 0], tris[u, 1], tris[u, 2], x, y) > 0:
                    if n == _LARGEST_CAVITY or touched[u]:
                        fits = False
                        break
                    cavity[n] = u
                    n += 1
        if not fits:
            continue
        least = _CLOSE * _CLOSE * short
        for i in range(n):
            for k in range(3):
                o = across[cavity[i], k]
                inside = False
                if o >= 0:
                    for j in range(n):
                        inside = inside or cavity[j] == o // 3
                if inside:
                    continue
                a, b = tris[cavity[i], (k + 1) % 3], tris[cavity[i], (k + 2) % 3]
                rim[m, 0], rim[m, 1], rim[m, 2] = a, b, o
                m += 1
                ax, ay, bx, by = points[a, 0] - x, points[a, 1] - y, points[b, 0] - x, points[b, 1] - y
                # hidden by a wall or on the edge; too near to a point; in the circle over an edge that stays
                if not _turn(points, a, b, x, y) > 0.0 or ax * ax + ay * ay < least:
                    fits = False
                if o < 0 and ax * bx + ay * by < 0.0:
                    fits = False
        if not fits or m != n + 2 or made + m > fresh.shape[0]:
            continue
        p = count[0]
        points[p, 0], points[p, 1], points[p, 2] = x, y, points[tris[t, 0], 2]
        count[0] += 1
        for i in range(n):
            gone[cavity[i]] = True
            touched[cavity[i]] = True
        for r in range(m):
            fresh[made, 0], fresh[made, 1], fresh[made, 2] = p, rim[r, 0], rim[r, 1]
            parent[made] = cavity[min(r, n - 1)]
            made += 1
            if rim[r, 2] >= 0:
                touched[rim[r, 2] // 3] = True
    return made


def refine_triangles(mesh: Mesh, options: Options, rounds: int) -> Outcome:
    """Put points at the circumcentres of chosen triangles of a flat mesh until none is left that can be cut.

    A triangle is cut that has an angle under 20.7 degrees or, with `max_edge`, a longer edge; not where its
    circumcentre lies beyond a wall, in the circle over one, or within half its shortest edge of another point.
    """
    if mesh.dimension == 3:
        raise MeshError("Delaunay insertion is for tets and for triangles in the x-y plane; this is a surface in space")
    longest = math.inf if options.max_edge is None else options.max_edge
    sizes = signed_sizes(mesh)
    hand = [0, 1, 2] if float(np.sum(sizes)) > 0.0 else [0, 2, 1]
    current, cells_from, made = mesh, np.arange(mesh.n_cells), 0
    chosen = chosen_cells(mesh, options)
    for turn in range(rounds):
        options.tell("insert", turn, rounds)
        block = current.block("tri")
        tris = np.ascontiguousarray(block.nodes[:, hand])
        n = len(current.points)
        points = np.concatenate([current.points, np.zeros((max(64, n), 3))])
        count = np.array([n])
        gone = np.zeros(len(tris), np.bool_)
        fresh = np.empty((8 * (len(points) - n), 3), tris.dtype)
        parent = np.empty(len(fresh), np.int64)
        new = int(
            _insert(
                points, count, tris, neighbours_of(tris, edge_walls(current)),
                chosen[cells_from[block.rows]], _RATIO, longest, gone, fresh, parent,
            )
        )  # fmt: skip
        if not new:
            break
        keep = np.flatnonzero(~gone)
        nodes = np.concatenate([tris[keep], fresh[:new]])[:, hand]
        rows = block.rows[np.concatenate([keep, parent[:new]])]
        order = np.argsort(rows, kind="stable")
        wider = with_more_points(current, points[n : count[0]])
        current, of = with_cells(wider, {"tri": (nodes[order], rows[order])})
        cells_from = cells_from[of]
        made += int(count[0]) - n
    if not made:
        return Outcome(mesh, 0)
    points_from = np.concatenate([np.arange(len(mesh.points)), np.full(made, -1)])
    note = f"points put in: {mesh.n_cells:,} triangles became {current.n_cells:,}"
    return Outcome(current, made, note, points_from=points_from, cells_from=cells_from)
