"""Tets over a face, turns of its edges and the twist of its triangles, in one pass over the faces of a solid mesh."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.connectivity import faces
from meshwright.audit.geometry import cell_geometry, face_geometry, in_safe_units
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Mesh
from meshwright.audit.parallel import in_parallel

__all__ = ["CONCAVITY", "TETS", "TWIST", "face_shapes"]

TETS, CONCAVITY, TWIST = range(3)
"""Columns of `face_shapes`."""

_CHUNK = 1 << 16
_EQUILATERAL = 8.0 / (9.0 * math.sqrt(3.0))
"""Volume of a regular tetrahedron over the cube of its circumradius."""


@inner
def _quality(a, b, c, d):  # type: ignore[no-untyped-def]
    """Signed volume of the tet over that of the regular one with the same circumsphere; 0 for a flat one."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    six = wx * nx + wy * ny + wz * nz
    if six == 0.0:
        return 0.0
    mx, my, mz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    lam = wx * wx + wy * wy + wz * wz - (ux * wx + uy * wy + uz * wz)
    mu = vx * vx + vy * vy + vz * vz - (ux * vx + uy * vy + uz * vz)
    x = 0.5 * (ux + (lam * nx + mu * mx) / six)
    y = 0.5 * (uy + (lam * ny + mu * my) / six)
    z = 0.5 * (uz + (lam * nz + mu * mz) / six)
    radius = math.sqrt(x * x + y * y + z * z)
    return six / 6.0 / (_EQUILATERAL * radius * radius * radius)


@inner
def _tets(x, n, centre, apex, turned, based):  # type: ignore[no-untyped-def]
    """Worst tet over the triangles about the centre; based[i]: lowered to the worst of the cut from node i."""
    worst = np.inf
    for i in range(n):
        p, q = x[i], x[i + 1 if i + 1 < n else 0]
        worst = min(worst, _quality(p, q, centre, apex) if turned else _quality(p, q, apex, centre))
        for k in range(1, n - 1):
            a, b = x[(i + k) % n], x[(i + k + 1) % n]
            cut = _quality(apex, x[i], b, a) if turned else _quality(apex, x[i], a, b)
            based[i] = min(based[i], cut)
    return worst


@inner
def _concavity(x, n, area):  # type: ignore[no-untyped-def]
    """Largest angle in degrees, folded to 90, by which consecutive edges turn against the normal; 0 for none."""
    worst = 0.0
    for i in range(n):
        p, q, r = x[i - 1 if i else n - 1], x[i], x[i + 1 if i + 1 < n else 0]
        ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        vx, vy, vz = r[0] - q[0], r[1] - q[1], r[2] - q[2]
        cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        size = math.sqrt(cx * cx + cy * cy + cz * cz)
        along = cx * area[0] + cy * area[1] + cz * area[2]
        length = math.sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2])
        if size > 0.0 and along < 1e-15 * size * length:
            worst = max(worst, math.degrees(math.atan2(size, abs(ux * vx + uy * vy + uz * vz))))
    return worst


@inner
def _twist(x, n, centre):  # type: ignore[no-untyped-def]
    """Smallest cosine between consecutive triangles about the centre, no more than 0 where one has no area."""
    worst, known = np.inf, False
    px, py, pz = 0.0, 0.0, 0.0
    for j in range(2 * n):  # the second round meets the first triangle again
        i = j % n
        p, q = x[i], x[i + 1 if i + 1 < n else 0]
        ux, uy, uz = p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]
        vx, vy, vz = q[0] - centre[0], q[1] - centre[1], q[2] - centre[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        size = math.sqrt(nx * nx + ny * ny + nz * nz)
        if size == 0.0:
            worst = min(worst, 0.0)  # fails any limit above 0, as in OpenFOAM
            continue
        nx, ny, nz = nx / size, ny / size, nz / size
        if known:
            worst = min(worst, px * nx + py * ny + pz * nz)
        px, py, pz, known = nx, ny, nz, True
    return worst if known else np.nan


@kernel
def _measure(points, offsets, nodes, owner, neighbour, areas, centres, cells, start, stop, most, out):  # type: ignore[no-untyped-def]
    """Fill rows start to stop of out (n, 3)."""
    x, based = np.empty((most, 3)), np.empty(most)
    centre, apex = np.empty(3), np.empty(3)
    for f in range(start, stop):
        n = offsets[f + 1] - offsets[f]
        first = nodes[offsets[f]]
        check = 0.0
        for d in range(3):
            for i in range(n):
                x[i, d] = points[nodes[offsets[f] + i], d] - points[first, d]
                check += x[i, d]
            centre[d] = centres[f, d] - points[first, d]
            apex[d] = cells[owner[f], d] - points[first, d]
            check += centre[d] + apex[d]
        if not abs(check) < np.inf:
            out[f, TETS] = out[f, CONCAVITY] = out[f, TWIST] = np.nan
            continue
        for i in range(n):
            based[i] = np.inf
        worst = _tets(x, n, centre, apex, False, based)
        if neighbour[f] >= 0:
            for d in range(3):
                apex[d] = cells[neighbour[f], d] - points[first, d]
            worst = min(worst, _tets(x, n, centre, apex, True, based))
        best = based[0]
        for i in range(1, n):
            best = max(best, based[i])
        out[f, TETS] = min(worst, best)
        out[f, CONCAVITY] = _concavity(x, n, areas[f])
        out[f, TWIST] = _twist(x, n, centre) if n > 3 else np.nan


@once_per_mesh
def face_shapes(mesh: Mesh) -> Floats:
    """(n, 3) for the faces of `connectivity.faces` of a solid mesh: columns TETS, CONCAVITY, TWIST.

    nan around a point that is not finite, and for the twist of a triangle. The same bits for any number of threads.
    """
    scaled, _ = in_safe_units(mesh)
    table, of_faces = faces(scaled), face_geometry(scaled)
    n = len(table)
    out = np.empty((n, 3))
    most = int(np.diff(table.offsets).max(initial=3))
    parts = (scaled.points, table.offsets, table.nodes, table.owner, table.neighbour)
    shapes = (of_faces.area, of_faces.centre, cell_geometry(scaled).centre)

    def work(start: int) -> None:
        _measure(*parts, *shapes, start, min(start + _CHUNK, n), most, out)

    starts = range(0, n, _CHUNK)
    if n:
        work(0)  # compiles before the threads ask for it
        for _ in in_parallel(work, starts[1:]):
            pass
    out.flags.writeable = False
    return out
