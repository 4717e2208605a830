"""Delaunay insertion: a point deletes the tets whose circumspheres hold it and is joined to the faces around them.

After Bowyer and Watson (Computer Journal 24, 1981). Where the mesh is Delaunay it stays so. Signs are taken from
doubles where a bound of the error allows it, else from pairs of doubles, of 106 bits; what those leave open is a tie,
and a tie is not inside. Nothing is deleted through a wall: the boundary, faces between zones, listed faces.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.doubles import Pair, minus, plus, times, two_sum
from meshwright.audit.errors import MeshError
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.carrying import with_cells, with_more_points
from meshwright.repair.held import held_points, zone_walls
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.refine import chosen_cells
from meshwright.repair.split import linear_only
from meshwright.repair.tet_swaps import outward
from meshwright.repair.tet_tables import TetTables
from meshwright.repair.tet_topology import replace_cavity
from meshwright.repair.tri_delaunay import refine_triangles

__all__ = ["in_sphere", "insert_delaunay"]

Mask = NDArray[np.bool_]

_RATIO = 2.0
"""Circumradius over shortest edge above which a tet is cut: the bound that refinement by circumcentres can reach."""
_CLOSE = 0.5
"""Part of the shortest edge of the tet under which a new point would stand too near to another."""
_ROOM = 0.05
"""New points of a round, as a part of those there are: what the spare rows of the tets can take."""
_LARGEST_CAVITY = 200
_MOST_ROUNDS = 30
_MOST_STEPS = 2000
_FILTER = 1e-14
_PAIR_FILTER = 1e-29


@inner
def _lift(x: float, y: float, z: float, px: float, py: float, pz: float) -> tuple[Pair, Pair, Pair, Pair]:
    """Differences to a point and their summed squares."""
    u, v, w = two_sum(x, -px), two_sum(y, -py), two_sum(z, -pz)
    return u, v, w, plus(plus(times(u, u), times(v, v)), times(w, w))


@inner
def _det3(a: tuple[Pair, Pair, Pair, Pair], b: tuple[Pair, Pair, Pair, Pair], c: tuple[Pair, Pair, Pair, Pair]) -> Pair:
    one = times(a[0], minus(times(b[1], c[2]), times(b[2], c[1])))
    two = times(a[1], minus(times(b[2], c[0]), times(b[0], c[2])))
    three = times(a[2], minus(times(b[0], c[1]), times(b[1], c[0])))
    return plus(plus(one, two), three)


@inner
def in_sphere(points: Floats, a: int, b: int, c: int, d: int, x: float, y: float, z: float) -> int:
    """1 where x, y, z lies inside the circumsphere of the positive tet a, b, c, d; -1 outside, 0 on it."""
    e = np.empty((4, 4))
    size = 0.0
    for i, p in enumerate((a, b, c, d)):
        e[i, 0], e[i, 1], e[i, 2] = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
        e[i, 3] = e[i, 0] * e[i, 0] + e[i, 1] * e[i, 1] + e[i, 2] * e[i, 2]
    total = 0.0
    for i in range(4):
        j, k, m = (i + 1) % 4, (i + 2) % 4, (i + 3) % 4
        yz, zy = e[k, 1] * e[m, 2], e[k, 2] * e[m, 1]
        zx, xz = e[k, 2] * e[m, 0], e[k, 0] * e[m, 2]
        xy, yx = e[k, 0] * e[m, 1], e[k, 1] * e[m, 0]
        det = e[j, 0] * (yz - zy) + e[j, 1] * (zx - xz) + e[j, 2] * (xy - yx)
        most = abs(e[j, 0]) * (abs(yz) + abs(zy)) + abs(e[j, 1]) * (abs(zx) + abs(xz))
        most += abs(e[j, 2]) * (abs(xy) + abs(yx))
        total += (-1.0 if i % 2 else 1.0) * e[i, 3] * det
        size += e[i, 3] * most
    if total > _FILTER * size:
        return 1
    if total < -_FILTER * size:
        return -1
    ta = _lift(points[a, 0], points[a, 1], points[a, 2], x, y, z)
    tb = _lift(points[b, 0], points[b, 1], points[b, 2], x, y, z)
    tc = _lift(points[c, 0], points[c, 1], points[c, 2], x, y, z)
    td = _lift(points[d, 0], points[d, 1], points[d, 2], x, y, z)
    whole = minus(times(ta[3], _det3(tb, tc, td)), times(tb[3], _det3(tc, td, ta)))
    whole = plus(whole, minus(times(tc[3], _det3(td, ta, tb)), times(td[3], _det3(ta, tb, tc))))
    if whole[0] > _PAIR_FILTER * size:
        return 1
    return -1 if whole[0] < -_PAIR_FILTER * size else 0


@inner
def _volume(points: Floats, a: int, b: int, c: int, x: float, y: float, z: float) -> float:
    """Six times the volume of x, y, z and the triangle a, b, c seen from it, 0 where rounding decides its sign."""
    ux, uy, uz = points[a, 0] - x, points[a, 1] - y, points[a, 2] - z
    vx, vy, vz = points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
    wx, wy, wz = points[c, 0] - x, points[c, 1] - y, points[c, 2] - z
    yz, zy, zx, xz, xy, yx = vy * wz, vz * wy, vz * wx, vx * wz, vx * wy, vy * wx
    det = ux * (yz - zy) + uy * (zx - xz) + uz * (xy - yx)
    size = abs(ux) * (abs(yz) + abs(zy)) + abs(uy) * (abs(zx) + abs(xz)) + abs(uz) * (abs(xy) + abs(yx))
    return det if abs(det) > _FILTER * size else 0.0


@inner
def _sphere_of(points: Floats, t: Ints) -> tuple[float, float, float, float, float]:
    """(centre, squared radius, squared shortest edge) of a tet; the radius is inf for a flat one."""
    ux, uy, uz = points[t[1], 0] - points[t[0], 0], points[t[1], 1] - points[t[0], 1], points[t[1], 2] - points[t[0], 2]
    vx, vy, vz = points[t[2], 0] - points[t[0], 0], points[t[2], 1] - points[t[0], 1], points[t[2], 2] - points[t[0], 2]
    wx, wy, wz = points[t[3], 0] - points[t[0], 0], points[t[3], 1] - points[t[0], 1], points[t[3], 2] - points[t[0], 2]
    uu, vv, ww = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    ax, ay, az = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
    bx, by, bz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    twice = 2.0 * (ux * ax + uy * ay + uz * az)
    short = min(uu, vv, ww)
    for i in range(1, 4):
        for j in range(i + 1, 4):
            gap = 0.0
            for k in range(3):
                gap += (points[t[i], k] - points[t[j], k]) ** 2
            short = min(short, gap)
    if twice == 0.0:
        return 0.0, 0.0, 0.0, np.inf, short
    x = (uu * ax + vv * bx + ww * cx) / twice
    y = (uu * ay + vv * by + ww * cy) / twice
    z = (uu * az + vv * bz + ww * cz) / twice
    return points[t[0], 0] + x, points[t[0], 1] + y, points[t[0], 2] + z, x * x + y * y + z * z, short


@inner
def _locate(points: Floats, tets: Ints, across: Ints, t: int, x: float, y: float, z: float) -> int:
    """The tet that holds x, y, z, walking from t; -1 where a wall lies between."""
    for step in range(_MOST_STEPS):
        left = -1
        for k in range(4):
            f = (k + step) % 4
            a, b, c = outward(tets, t, f)
            if _volume(points, a, b, c, x, y, z) < 0.0:
                left = f
                break
        if left < 0:
            return t
        o = across[t, left]
        if o < 0:
            return -1
        t = o // 4
    return -1


@kernel
def _insert(
    points: Floats, count: Ints, tets: Ints, across: Ints, origin: Ints, free: Ints, chosen: Mask,
    ratio: float, longest: float,
) -> int:  # fmt: skip
    """Insert the circumcentres of chosen tets that are too long for their shortest edge or have too long an edge.

    chosen (cells,): by the cell that a tet descends from. Returns how many were put in.
    """
    cavity = np.empty(_LARGEST_CAVITY, np.int64)
    rim = np.empty((4 * _LARGEST_CAVITY, 4), np.int64)
    scratch = np.empty((4 * _LARGEST_CAVITY, 4), np.int64)
    new = np.empty((4 * _LARGEST_CAVITY, 4), np.int64)
    rows = np.empty(4 * _LARGEST_CAVITY, np.int64)
    made = 0
    for t in range(tets.shape[0]):
        if tets[t, 0] < 0 or not chosen[origin[t]] or count[0] >= points.shape[0]:
            continue
        x, y, z, radius, short = _sphere_of(points, tets[t])
        long = 0.0
        for i in range(4):
            for j in range(i + 1, 4):
                gap = 0.0
                for k in range(3):
                    gap += (points[tets[t, i], k] - points[tets[t, j], k]) ** 2
                long = max(long, gap)
        if not (radius > ratio * ratio * short or long > longest * longest) or not radius < np.inf:
            continue
        home = _locate(points, tets, across, t, x, y, z)
        if home < 0:
            continue
        cavity[0] = home
        n, at = 1, 0
        fits = True
        while at < n and fits:
            here = cavity[at]
            at += 1
            for f in range(4):
                o = across[here, f]
                if o < 0:
                    continue
                u = o // 4
                known = False
                for i in range(n):
                    known = known or cavity[i] == u
                if not known and in_sphere(points, tets[u, 0], tets[u, 1], tets[u, 2], tets[u, 3], x, y, z) > 0:
                    if n == _LARGEST_CAVITY:
                        fits = False
                        break
                    cavity[n] = u
                    n += 1
        if not fits:
            continue
        m = 0
        for i in range(n):
            for f in range(4):
                o = across[cavity[i], f]
                inside = False
                if o >= 0:
                    for j in range(n):
                        inside = inside or cavity[j] == o // 4
                if not inside:
                    rim[m, 0], rim[m, 1], rim[m, 2] = outward(tets, cavity[i], f)
                    m += 1
        p = count[0]
        least = _CLOSE * _CLOSE * short
        for r in range(m):
            a, b, c = rim[r, 0], rim[r, 1], rim[r, 2]
            if not _volume(points, a, b, c, x, y, z) > 0.0:
                fits = False  # a wall hides this face, or the point lies on it
                break
            for k in range(3):
                gap = (points[rim[r, k], 0] - x) ** 2 + (points[rim[r, k], 1] - y) ** 2
                if gap + (points[rim[r, k], 2] - z) ** 2 < least:
                    fits = False
            new[r, 0], new[r, 1], new[r, 2], new[r, 3] = p, a, b, c
        if not fits:
            continue
        points[p, 0], points[p, 1], points[p, 2] = x, y, z
        rows[:n] = cavity[:n]
        if replace_cavity(tets, across, rows, n, new, m, free, scratch, origin):
            count[0] += 1
            made += 1
    return made


def insert_delaunay(mesh: Mesh, options: Options) -> Outcome:
    """Put points at the circumcentres of chosen tets, by Delaunay cavities, until none is left that can be cut.

    A tet is cut whose circumradius is over twice its shortest edge or, with `max_edge`, that has a longer edge; not
    where its circumcentre lies beyond a wall or within half its shortest edge of another point. Triangles of flat
    meshes: see `refine_triangles`.
    """
    linear_only(mesh)
    if {block.type for block in mesh.blocks} == {"tri"}:
        return refine_triangles(mesh, options, _MOST_ROUNDS)
    if {block.type for block in mesh.blocks} != {"tet"}:
        raise MeshError(
            "only a mesh of tets, or of triangles, alone can be refined by Delaunay insertion; split-to-tets makes one"
        )
    longest = math.inf if options.max_edge is None else options.max_edge
    current, cells_from, made = mesh, np.arange(mesh.n_cells), 0
    chosen = chosen_cells(mesh, options)
    for turn in range(_MOST_ROUNDS):
        options.tell("insert", turn, _MOST_ROUNDS)
        block = current.block("tet")
        tables = TetTables.of(
            current.points, block.nodes, zone_walls(current), held_points(current, options), room=_ROOM
        )
        now = int(
            _insert(
                tables.points, tables.count, tables.tets, tables.across, tables.origin, tables.free,
                chosen[cells_from[block.rows]], _RATIO, longest,
            )
        )  # fmt: skip
        if not now:
            break
        points, tets, origin = tables.result()
        wider = with_more_points(current, points[len(current.points) :])
        current, of = with_cells(wider, {"tet": (tets, block.rows[origin])})
        cells_from = cells_from[of]
        made += now
    n = len(mesh.points)
    points_from = np.concatenate([np.arange(n), np.full(made, -1)])
    note = f"points put in: {mesh.n_cells:,} tets became {current.n_cells:,}"
    return Outcome(current, made, note, points_from=points_from, cells_from=cells_from) if made else Outcome(mesh, 0)
