"""Triangles of a surface that run through one another: found, and cut out where the hole can be closed."""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.bvh import Tree
from meshwright.repair.carrying import with_cells
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.surface import fill_holes, open_sides, triangles_of

__all__ = ["intersecting", "untie"]

_MOST_ROUNDS = 6
_ROUNDING = 8.0 * 2.0**-53
"""Relative error of a determinant of three differences, over the product of sizes that bounds it (Shewchuk, 1997)."""


def intersecting(points: Floats, tris: Ints) -> Ints:
    """(k, 2) pairs of triangles (m, 3) that cross: an edge of one goes through the inside of the other.

    Triangles that touch, lie in one plane, or share an edge do not cross; what rounding leaves undecided counts as
    touching.
    """
    tree = Tree.of(points, tris)
    pairs = tree.meeting()
    shared = (tris[pairs[:, 0]][:, :, None] == tris[pairs[:, 1]][:, None, :]).sum(axis=(1, 2))
    pairs = pairs[shared < 2]
    return pairs[_crossing(np.ascontiguousarray(points), tris, pairs)]


@inner
def _side(p: Floats, a: int, b: int, c: int, d: int) -> int:
    """On which side of the plane of a, b, c the point d lies: -1, 1, or 0 where rounding does not tell."""
    ux, uy, uz = p[a, 0] - p[d, 0], p[a, 1] - p[d, 1], p[a, 2] - p[d, 2]
    vx, vy, vz = p[b, 0] - p[d, 0], p[b, 1] - p[d, 1], p[b, 2] - p[d, 2]
    wx, wy, wz = p[c, 0] - p[d, 0], p[c, 1] - p[d, 1], p[c, 2] - p[d, 2]
    yz, zy, zx, xz, xy, yx = vy * wz, vz * wy, vz * wx, vx * wz, vx * wy, vy * wx
    det = ux * (yz - zy) + uy * (zx - xz) + uz * (xy - yx)
    size = abs(ux) * (abs(yz) + abs(zy)) + abs(uy) * (abs(zx) + abs(xz)) + abs(uz) * (abs(xy) + abs(yx))
    if det > _ROUNDING * size:
        return 1
    if det < -_ROUNDING * size:
        return -1
    return 0


@inner
def _goes_through(p: Floats, q: int, r: int, a: int, b: int, c: int) -> bool:
    """Whether the segment q-r goes through the inside of the triangle a, b, c."""
    if q in (a, b, c) or r in (a, b, c):
        return False
    one, two = _side(p, a, b, c, q), _side(p, a, b, c, r)
    if one * two >= 0:
        return False
    s = _side(p, q, r, a, b)
    return s != 0 and _side(p, q, r, b, c) == s and _side(p, q, r, c, a) == s


@kernel
def _crossing(points: Floats, tris: Ints, pairs: Ints) -> Ints:
    """Rows of the pairs that cross."""
    out = np.empty(pairs.shape[0], np.int64)
    n = 0
    for i in range(pairs.shape[0]):
        found = False
        for turn in range(2):
            t, u = pairs[i, turn], pairs[i, 1 - turn]
            for k in range(3):
                q, r = tris[t, k], tris[t, (k + 1) % 3]
                if not found and _goes_through(points, q, r, tris[u, 0], tris[u, 1], tris[u, 2]):
                    found = True
        if found:
            out[n] = i
            n += 1
    return out[:n]


def untie(mesh: Mesh, options: Options) -> Outcome:
    """Cut out the triangles that cross and close the holes, as long as fewer cross and no side is left open.

    What cannot be untied so is told, with a place.
    """
    tris = triangles_of(mesh)
    if tris is None:
        return Outcome(mesh, 0)
    pairs = intersecting(mesh.points, tris)
    if not len(pairs):
        return Outcome(mesh, 0)
    open_before, gone = open_sides(tris), 0
    best: Outcome | None = None
    current, left = mesh, len(pairs)
    origin, parents = np.arange(len(mesh.points)), np.arange(mesh.n_cells)
    for _ in range(_MOST_ROUNDS):
        now = triangles_of(current)
        if now is None or not len(pairs):
            break
        keep = np.ones(len(now), np.bool_)
        keep[pairs.ravel()] = False
        if not keep.any():
            break
        rows = np.flatnonzero(keep)
        current, of = with_cells(current, {"tri": (now[rows], rows)})
        parents = parents[of]
        closed = fill_holes(current, options)
        if closed.mesh is not current:
            assert closed.cells_from is not None  # noqa: S101 - fill_holes gives both
            assert closed.points_from is not None  # noqa: S101
            parents = parents[closed.cells_from]
            origin = np.where(closed.points_from >= 0, origin[closed.points_from], -1)
            current = closed.mesh
        gone += int(np.count_nonzero(~keep))
        after = triangles_of(current)
        if after is None or open_sides(after) > open_before:
            break
        pairs = intersecting(current.points, after)
        if len(pairs) >= left:
            break
        left = len(pairs)
        best = Outcome(current, gone, "crossing triangles cut out and closed", points_from=origin, cells_from=parents)
    if not left:
        assert best is not None  # noqa: S101 - what brought it to nothing
        return best
    final = mesh if best is None else best.mesh
    rest = triangles_of(final)
    assert rest is not None  # noqa: S101 - a shell of triangles stays one
    x, y, z = final.points[rest[intersecting(final.points, rest)[0, 0]]].mean(axis=0)
    told = f"{left} pairs of triangles cross, one at ({x:.5g}, {y:.5g}, {z:.5g}), and cutting them out does not mend it"
    if best is None:
        return Outcome(mesh, 0, refused=(told,))
    return Outcome(best.mesh, best.changed, best.note, best.points_from, best.cells_from, (told,))
