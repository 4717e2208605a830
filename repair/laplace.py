"""Smoothing point by point, cells of all first-order types: plain Laplacian, guarded Laplacian, and guarded ODT.

The plain one (D. A. Field, Laplacian smoothing and Delaunay triangulations, Commun. Appl. Numer. Methods 4, 1988) moves
each point to the mean of its neighbours and can turn cells over near concave boundaries. The guarded ("smart") ones
(L. A. Freitag, On combining Laplacian and optimization-based mesh smoothing techniques, 1997) keep a move only where
the worst cell at the point gets better.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import edges, points_to_cells
from meshwright.audit.errors import MeshError
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.audit.parallel import in_parallel
from meshwright.repair.carrying import padded, with_points
from meshwright.repair.cell_quality import KINDS, quality_at, size_of
from meshwright.repair.held import held_points
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.quality import standing, worst_around_points, worst_at_points
from meshwright.repair.sizes import signed_sizes
from meshwright.repair.tet_stars import colours

__all__ = ["laplace", "odt", "smart_laplace"]

Mask = NDArray[np.bool_]

_PLAIN_SWEEPS = 5
_SWEEPS = 10
"""Sweeps of a turn; the driver gives more turns as long as they gain."""
_BATCH = 1024
"""Points of one colour that a thread takes at a time."""
_LEAST = 1e-6
"""Gain of the worst quality below which a move is not worth making."""
_ROUNDING = 1e-12
_LEVEL = 1e-12
"""Cosine below 1 by which normals around a point of a surface may differ for it to lie in a plane."""
_LAPLACE, _ODT = 0, 1


def laplace(mesh: Mesh, options: Options) -> Outcome:
    """Move each point to the mean of its neighbours along edges, a few times, whatever becomes of the cells."""
    rows = _free(mesh, options)
    if not len(rows):
        return Outcome(mesh, 0)
    ends = edges(mesh).astype(np.int64)
    ends = np.concatenate([ends, ends[:, ::-1]])
    free = np.zeros(len(mesh.points), bool)
    free[rows] = True
    ends = ends[free[ends[:, 0]]]
    count = np.bincount(ends[:, 0], minlength=len(free))[rows]
    points = np.array(mesh.points)
    for sweep in range(_PLAIN_SWEEPS):
        options.tell("laplace", sweep, _PLAIN_SWEEPS)
        sums = [np.bincount(ends[:, 0], points[ends[:, 1], axis], len(free))[rows] for axis in range(mesh.dimension)]
        points[rows, : mesh.dimension] = np.stack(sums, axis=1) / count[:, None]
    if mesh.cell_dimension == 2 and mesh.dimension == 3:
        over = _turned_over(mesh, points)
        if over:
            raise MeshError(f"{over} cells of the surface would be turned over")
    return _outcome(mesh, points)


def smart_laplace(mesh: Mesh, options: Options) -> Outcome:
    """Move points towards the mean of the middles of their cells, weighted by size, where the worst cell gains."""
    return _guarded(mesh, options, _free(mesh, options), _LAPLACE)


def odt(mesh: Mesh, options: Options) -> Outcome:
    """Move points of triangles and tets towards the mean of the circumcentres of their cells, weighted by size.

    That is the place of least error of a linear interpolation of |x|^2 (L. Chen, Mesh smoothing schemes based on
    optimal Delaunay triangulations, 13th International Meshing Roundtable, 2004; P. Alliez, D. Cohen-Steiner, M. Yvinec
    and M. Desbrun, Variational tetrahedral meshing, ACM Trans. Graph. 24, 2005). Guarded as `smart_laplace`.
    """
    rows = _free(mesh, options)
    other = np.zeros(len(mesh.points), bool)
    for block in mesh.blocks:
        if block.type not in ("tri", "tet") and block.items is None:
            other[block.nodes] = True
    return _guarded(mesh, options, rows[~other[rows]], _ODT)


def _turned_over(mesh: Mesh, points: Floats) -> int:
    """Cells of a surface whose normal points the other way with its points there: no quality and no volume tells."""
    over = 0
    for block in mesh.blocks:
        last = CELL_TYPES[block.type].n_corners - 1
        a, b, c, d = (block.nodes[:, k] for k in (0, 1, 2, last))
        old, new = (np.cross(x[c] - x[a], x[d] - x[b]) for x in (mesh.points, points))
        over += int(np.count_nonzero(np.einsum("ij,ij->i", old, new) < 0.0))
    return over


def _outcome(mesh: Mesh, points: Floats) -> Outcome:
    moved = int(np.count_nonzero((points != mesh.points).any(axis=1)))
    return Outcome(with_points(mesh, points), moved, "points moved")


def _free(mesh: Mesh, options: Options) -> Ints:
    """Rows of the points that may move: not held, of cells alone that move, and on surfaces in the midst of a plane."""
    if mesh.faces is not None or any(block.items is not None for block in mesh.blocks):
        return np.empty(0, np.int64)
    free = ~held_points(mesh, options) & (np.diff(points_to_cells(mesh)[0]) > 0)
    if mesh.cell_dimension == 2 and mesh.dimension == 3:
        free &= _level(mesh)
    return np.flatnonzero(free)


def _level(mesh: Mesh) -> Mask:
    """(n,) points of a surface whose cells lie in one plane and look the same way."""
    means = np.zeros((len(mesh.points), 3))
    whole, corners = [], []
    for block in mesh.blocks:
        n = CELL_TYPES[block.type].n_corners
        x = mesh.points[block.nodes]
        whole.append((block.nodes, _unit(np.cross(x[:, 2] - x[:, 0], x[:, n - 1] - x[:, 1]))))
        corners += [
            (block.nodes, _unit(np.cross(x[:, (k + 1) % n] - x[:, k], x[:, k - 1] - x[:, k]))) for k in range(n)
        ]
        np.add.at(means, block.nodes, whole[-1][1][:, None])
    means = _unit(means)
    level: Mask = np.ones(len(means), np.bool_)
    for nodes, normal in whole:
        level[nodes[np.einsum("ikx,ix->ik", means[nodes], normal) < 1.0 - _LEVEL]] = False
    for nodes, normal in corners:  # those of a reflex corner look the other way
        level[nodes[np.abs(np.einsum("ikx,ix->ik", means[nodes], normal)) < 1.0 - _LEVEL]] = False
    return level


def _unit(vectors: Floats) -> Floats:
    """Vectors (n, 3) of length 1, 0 where they have none."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)


def _guarded(mesh: Mesh, options: Options, rows: Ints, aim: int) -> Outcome:
    """Sweep over the points of `rows`, colour by colour, until none moves or the turn is over."""
    if not len(rows):
        return Outcome(mesh, 0)
    cells = np.full((mesh.n_cells, 8), -1, np.int64)
    nodes = padded(mesh)
    cells[:, : min(nodes.shape[1], 8)] = nodes[:, :8]
    kinds = np.full(mesh.n_cells, -1, np.int64)
    for block in mesh.blocks:
        if block.type in KINDS:
            kinds[block.rows] = KINDS.index(block.type)
    begin, items = points_to_cells(mesh)
    hand = 0.0
    if mesh.cell_dimension == 2 and mesh.dimension == 2:
        hand = 1.0 if float(np.sum(signed_sizes(mesh))) >= 0.0 else -1.0
    points = np.array(mesh.points)
    least = worst_around_points(nodes, worst_at_points(mesh, standing(mesh).quality)) - _ROUNDING
    filled = np.where(cells < 0, cells[:, :1], cells)  # what is filled up joins nothing
    order, stops = colours(filled, begin, items, rows)

    def one(part: Ints) -> int:
        return int(_move(points, cells, kinds, begin, items, least, part, hand, aim))

    for sweep in range(_SWEEPS):
        options.tell("smooth", sweep, _SWEEPS)
        moved = 0
        for c in range(len(stops) - 1):
            same = order[stops[c] : stops[c + 1]]
            parts = [same[i : i + _BATCH] for i in range(0, len(same), _BATCH)]
            moved += sum(in_parallel(one, parts)) if len(parts) > 1 else sum(map(one, parts))
        if not moved:
            break
    return _outcome(mesh, points)


@inner
def _normal_at(points: Floats, cells: Ints, begin: Ints, items: Ints, p: int) -> tuple[float, float, float]:
    """Sum of the area vectors of the flat cells at a point."""
    x = y = z = 0.0
    for i in range(begin[p], begin[p + 1]):
        c = items[i]
        last = 2 if cells[c, 3] < 0 else 3
        a, b, d, e = cells[c, 0], cells[c, 1], cells[c, 2], cells[c, last]
        ux, uy, uz = points[d, 0] - points[a, 0], points[d, 1] - points[a, 1], points[d, 2] - points[a, 2]
        vx, vy, vz = points[e, 0] - points[b, 0], points[e, 1] - points[b, 1], points[e, 2] - points[b, 2]
        x, y, z = x + uy * vz - uz * vy, y + uz * vx - ux * vz, z + ux * vy - uy * vx
    return x, y, z


@inner
def _middle_aim(
    points: Floats, cells: Ints, kinds: Ints, begin: Ints, items: Ints, p: int
) -> tuple[float, float, float]:
    """Mean of the middles of the cells at a point, weighted by their sizes."""
    x = y = z = total = 0.0
    for i in range(begin[p], begin[p + 1]):
        c = items[i]
        size = size_of(points, cells, c, kinds[c])
        n = 0
        cx = cy = cz = 0.0
        for k in range(8):
            q = cells[c, k]
            if q >= 0:
                cx, cy, cz, n = cx + points[q, 0], cy + points[q, 1], cz + points[q, 2], n + 1
        x, y, z, total = x + size * cx / n, y + size * cy / n, z + size * cz / n, total + size
    return x / total, y / total, z / total


@inner
def _circumcentre_aim(
    points: Floats, cells: Ints, kinds: Ints, begin: Ints, items: Ints, p: int
) -> tuple[float, float, float]:
    """Mean of the circumcentres of the triangles or tets at a point, weighted by their sizes.

    A size times its circumcentre, seen from the point, is a polynomial of the edges: no division by small volumes.
    """
    x = y = z = total = 0.0
    for i in range(begin[p], begin[p + 1]):
        c = items[i]
        n = 3 if cells[c, 3] < 0 else 4
        k = 0
        while cells[c, k] != p:
            k += 1
        a, b = cells[c, (k + 1) % n], cells[c, (k + 2) % n]
        ax, ay, az = points[a, 0] - points[p, 0], points[a, 1] - points[p, 1], points[a, 2] - points[p, 2]
        bx, by, bz = points[b, 0] - points[p, 0], points[b, 1] - points[p, 1], points[b, 2] - points[p, 2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        aa, bb = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
        size = size_of(points, cells, c, kinds[c])
        total += size
        if n == 3:
            if size > 0.0:
                ux, uy, uz = aa * bx - bb * ax, aa * by - bb * ay, aa * bz - bb * az
                share = 0.125 / size
                x += share * (uy * nz - uz * ny)
                y += share * (uz * nx - ux * nz)
                z += share * (ux * ny - uy * nx)
        else:
            d = cells[c, (k + 3) % n]
            dx, dy, dz = points[d, 0] - points[p, 0], points[d, 1] - points[p, 1], points[d, 2] - points[p, 2]
            dd = dx * dx + dy * dy + dz * dz
            share = 1.0 / 12.0 if nx * dx + ny * dy + nz * dz >= 0.0 else -1.0 / 12.0
            x += share * (aa * (by * dz - bz * dy) + bb * (dy * az - dz * ay) + dd * nx)
            y += share * (aa * (bz * dx - bx * dz) + bb * (dz * ax - dx * az) + dd * ny)
            z += share * (aa * (bx * dy - by * dx) + bb * (dx * ay - dy * ax) + dd * nz)
    return points[p, 0] + x / total, points[p, 1] + y / total, points[p, 2] + z / total


@inner
def _worst_at(
    points: Floats, cells: Ints, kinds: Ints, begin: Ints, items: Ints, least: Floats, p: int,
    normal: tuple[float, float, float], floor: float,
) -> float:  # fmt: skip
    """Worst quality of the cells at a point; -inf as soon as it is not above `floor`, or a cell is under its least."""
    low = np.inf
    for i in range(begin[p], begin[p + 1]):
        c = items[i]
        q = quality_at(points, cells, c, kinds[c], normal)
        if floor > -np.inf:
            if not q > floor:
                return -np.inf
            for k in range(8):
                if cells[c, k] >= 0 and q < least[cells[c, k]]:
                    return -np.inf
        low = min(low, q)
    return low


@kernel
def _move(
    points: Floats, cells: Ints, kinds: Ints, begin: Ints, items: Ints, least: Floats, rows: Ints, hand: float, aim: int
) -> int:
    """Move each point of `rows` to its aim, or a half, a quarter or an eighth of the way, where its worst cell gains.

    least: (n,) quality that no cell at a point may fall under. hand: the z of the normal of a flat mesh, 0 for others.
    Returns the number of moves.
    """
    moved = 0
    for r in range(rows.size):
        p = rows[r]
        normal = (0.0, 0.0, hand)
        if hand == 0.0 and kinds[items[begin[p]]] <= 1:
            normal = _normal_at(points, cells, begin, items, p)
        before = _worst_at(points, cells, kinds, begin, items, least, p, normal, -np.inf)
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        if aim == _ODT:
            tx, ty, tz = _circumcentre_aim(points, cells, kinds, begin, items, p)
        else:
            tx, ty, tz = _middle_aim(points, cells, kinds, begin, items, p)
        part = 1.0
        better = False
        for _ in range(4):
            points[p, 0], points[p, 1], points[p, 2] = x + part * (tx - x), y + part * (ty - y), z + part * (tz - z)
            better = _worst_at(points, cells, kinds, begin, items, least, p, normal, before + _LEAST) > -np.inf
            if better:
                break
            part *= 0.5
        if better:
            moved += 1
        else:
            points[p, 0], points[p, 1], points[p, 2] = x, y, z
    return moved
