"""Kernels of the median dual: what vertex-centred solvers see of the cells around each point.

A cell is cut into one sector a corner by the faces through the middles of its edges, the means of its faces and its own
mean. The dual face of edge ab is A = (F1 - F2) x (C - M) / 2, with F1 and F2 the means of the two faces at the edge, M
its middle and C the mean of the cell; the sector of a corner is the sum of A.s / 6 over its edges s.
Points gather sums and extremes in rows of an array, cell after cell, so the order of the sums is that of the cells.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.jit import inner, kernel
from meshwright.audit.metrics.dual_fields import (
    ANGLE_MIN,
    AREA,
    AREA_ANGLE,
    AREA_COSINE,
    AREA_MAX,
    AREA_MIN,
    CELL_MAX,
    CELL_MIN,
    CORNER_LARGE,
    CORNER_REFLEX,
    CORNER_SMALL,
    COUNT,
    EDGES,
    FIELDS,
    SECTOR_MAX,
    SECTOR_MIN,
)
from meshwright.audit.metrics.stages import corner, degrees_from_cotangent, widen
from meshwright.audit.metrics.tile import LANES

__all__ = ["DualTables", "dual_tables", "gather_block", "gather_surface"]


class DualTables(NamedTuple):
    """Tables of a cell type. edges (m, 4): ends a, b, faces F1, F2 with A along ab in a positive cell.

    corners (k, 5): corner, the next and the one before on a face, the one across (-1 on a triangle), the face.
    sizes (f,), faces (f, 4): corners of the faces.
    """

    edges: NDArray[np.int64]
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    faces: NDArray[np.int64]


def dual_tables(type_name: str) -> DualTables:
    """The tables of a linear solid, or of a triangle or quadrilateral, whose one face gives corners alone."""
    cell = CELL_TYPES[type_name]
    sides = cell.faces
    directed = {(f[i], f[(i + 1) % len(f)]): row for row, f in enumerate(sides) for i in range(len(f))}
    edges = [(a, b, directed[b, a], directed[a, b]) for a, b in cell.edges] if cell.dimension == 3 else []
    corners = [
        (f[i], f[(i + 1) % len(f)], f[i - 1], f[(i + 2) % 4] if len(f) == 4 else -1, row)
        for row, f in enumerate(sides)
        for i in range(len(f))
    ]
    return DualTables(
        np.array(edges, dtype=np.int64).reshape(-1, 4),
        np.array(corners, dtype=np.int64),
        np.array([len(f) for f in sides], dtype=np.int64),
        np.array([(*f, *[f[0]] * (4 - len(f))) for f in sides], dtype=np.int64),
    )


@inner
def _corner_fields(x, tables, cell):  # type: ignore[no-untyped-def]
    """Corner angles and edge ratios of 192 cells into cell[fields, corner, lane]."""
    table = tables.corners
    for r in range(len(table)):
        o, a, b, c = table[r, 0], table[r, 1], table[r, 2], table[r, 3]
        small, large = cell[CORNER_SMALL, o], cell[CORNER_LARGE, o]
        reflex, ratio = cell[CORNER_REFLEX, o], cell[EDGES, o]
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[o, 0, i], x[a, 1, i] - x[o, 1, i], x[a, 2, i] - x[o, 2, i]
            vx, vy, vz = x[b, 0, i] - x[o, 0, i], x[b, 1, i] - x[o, 1, i], x[b, 2, i] - x[o, 2, i]
            square, nx, ny, nz = corner(ux, uy, uz, vx, vy, vz)
            turned = False
            if c >= 0:
                wx, wy, wz = x[c, 0, i] - x[o, 0, i], x[c, 1, i] - x[o, 1, i], x[c, 2, i] - x[o, 2, i]
                px, py, pz = vx - ux, vy - uy, vz - uz
                # the other diagonal times this one is twice the area vector of the face
                turned = nx * (wy * pz - wz * py) + ny * (wz * px - wx * pz) + nz * (wx * py - wy * px) < 0.0
            small[i], large[i], reflex[i] = widen(small[i], large[i], reflex[i], square, turned)
            u2, v2 = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
            low, high = min(u2, v2), max(u2, v2)
            ratio[i] = max(ratio[i], high / low if low > 0.0 else np.inf)


@inner
def _dual_fields(x, tables, cell, face, work):  # type: ignore[no-untyped-def]
    """Dual faces and sectors of 192 solids into cell[fields, corner, lane]; work[6] ends as the volume."""
    n, edges = len(x), tables.edges
    for d in range(3):
        for i in range(LANES):
            work[d, i] = 0.0
        for j in range(n):
            for i in range(LANES):
                work[d, i] += x[j, d, i] / n
    for f in range(len(tables.sizes)):
        for d in range(3):
            for i in range(LANES):
                face[f, d, i] = 0.0
            for k in range(tables.sizes[f]):
                p = x[tables.faces[f, k], d]
                for i in range(LANES):
                    face[f, d, i] += p[i] / tables.sizes[f]
    for i in range(LANES):
        work[6, i] = 0.0
    for r in range(len(edges)):
        a, b, f, g = x[edges[r, 0]], x[edges[r, 1]], face[edges[r, 2]], face[edges[r, 3]]
        for i in range(LANES):
            ax, ay, az = f[0, i] - g[0, i], f[1, i] - g[1, i], f[2, i] - g[2, i]
            bx = work[0, i] - 0.5 * (a[0, i] + b[0, i])
            by = work[1, i] - 0.5 * (a[1, i] + b[1, i])
            bz = work[2, i] - 0.5 * (a[2, i] + b[2, i])
            nx, ny, nz = 0.5 * (ay * bz - az * by), 0.5 * (az * bx - ax * bz), 0.5 * (ax * by - ay * bx)
            work[6, i] += (nx * (b[0, i] - a[0, i]) + ny * (b[1, i] - a[1, i]) + nz * (b[2, i] - a[2, i])) / 3.0
    for i in range(LANES):
        work[7, i] = -1.0 if work[6, i] < 0.0 else 1.0  # a mirrored cell scores what the cell scores
    for r in range(len(edges)):
        p, q = edges[r, 0], edges[r, 1]
        a, b, f, g = x[p], x[q], face[edges[r, 2]], face[edges[r, 3]]
        for i in range(LANES):
            ax, ay, az = f[0, i] - g[0, i], f[1, i] - g[1, i], f[2, i] - g[2, i]
            bx = work[0, i] - 0.5 * (a[0, i] + b[0, i])
            by = work[1, i] - 0.5 * (a[1, i] + b[1, i])
            bz = work[2, i] - 0.5 * (a[2, i] + b[2, i])
            nx, ny, nz = 0.5 * (ay * bz - az * by), 0.5 * (az * bx - ax * bz), 0.5 * (ax * by - ay * bx)
            sx, sy, sz = b[0, i] - a[0, i], b[1, i] - a[1, i], b[2, i] - a[2, i]
            dot = work[7, i] * (nx * sx + ny * sy + nz * sz)
            cx, cy, cz = ny * sz - nz * sy, nz * sx - nx * sz, nx * sy - ny * sx
            cross = math.sqrt(cx * cx + cy * cy + cz * cz)
            size = math.sqrt(nx * nx + ny * ny + nz * nz)
            work[3, i] = size
            work[4, i] = 90.0 - degrees_from_cotangent(dot / cross) if size > 0.0 else 0.0
            work[5, i] = dot / math.sqrt(dot * dot + cross * cross) if size > 0.0 else 0.0
            cell[SECTOR_MIN, p, i] += dot / 6.0
            cell[SECTOR_MIN, q, i] += dot / 6.0
        for end in range(2):
            at = edges[r, end]
            for i in range(LANES):
                size, angle = work[3, i], work[4, i]
                cell[AREA, at, i] += size
                cell[AREA_ANGLE, at, i] += size * angle
                cell[AREA_COSINE, at, i] += size * work[5, i]
                cell[AREA_MIN, at, i] = min(cell[AREA_MIN, at, i], size)
                cell[AREA_MAX, at, i] = max(cell[AREA_MAX, at, i], size)
                lowest = cell[ANGLE_MIN, at, i]
                cell[ANGLE_MIN, at, i] = angle if size > 0.0 and angle < lowest else lowest


@inner
def _reset(cell):  # type: ignore[no-untyped-def]
    """Start values of the fields of a cell's corners; its sectors are sums, kept where their minimum will be."""
    for j in range(cell.shape[1]):
        for field in range(FIELDS):
            start = 0.0
            if field in (ANGLE_MIN, AREA_MIN, CORNER_LARGE):
                start = np.inf
            elif field in (CORNER_SMALL, CORNER_REFLEX):
                start = -np.inf
            for i in range(LANES):
                cell[field, j, i] = start


@inner
def _scatter(fields, p, cell, j, i, volume):  # type: ignore[no-untyped-def]
    """Add what lane i of corner j knows to the row of its point. Angles that are undefined make a sum nan."""
    row = fields[p]
    row[COUNT] += 1.0
    row[SECTOR_MIN] = min(row[SECTOR_MIN], cell[SECTOR_MIN, j, i])
    row[SECTOR_MAX] = max(row[SECTOR_MAX], cell[SECTOR_MIN, j, i])
    row[AREA] += cell[AREA, j, i]
    row[AREA_ANGLE] += cell[AREA_ANGLE, j, i]
    row[AREA_COSINE] += cell[AREA_COSINE, j, i]
    row[ANGLE_MIN] = min(row[ANGLE_MIN], cell[ANGLE_MIN, j, i])
    row[AREA_MIN] = min(row[AREA_MIN], cell[AREA_MIN, j, i])
    row[AREA_MAX] = max(row[AREA_MAX], cell[AREA_MAX, j, i])
    row[CELL_MIN] = min(row[CELL_MIN], volume)
    row[CELL_MAX] = max(row[CELL_MAX], volume)
    row[CORNER_SMALL] = max(row[CORNER_SMALL], cell[CORNER_SMALL, j, i])
    row[CORNER_LARGE] = min(row[CORNER_LARGE], cell[CORNER_LARGE, j, i])
    row[CORNER_REFLEX] = max(row[CORNER_REFLEX], cell[CORNER_REFLEX, j, i])
    row[EDGES] = max(row[EDGES], cell[EDGES, j, i])


@inner
def _gather(points, nodes, first, x):  # type: ignore[no-untyped-def]
    """Corners of 192 cells from row `first` on, relative to the first of each; lanes past the last repeat it."""
    last = nodes.shape[0] - 1
    for i in range(LANES):
        row = min(first + i, last)
        o = nodes[row, 0]
        for j in range(x.shape[0]):
            p = nodes[row, j]
            for d in range(3):
                x[j, d, i] = points[p, d] - points[o, d]


@kernel
def gather_block(points, nodes, tables, fields):  # type: ignore[no-untyped-def]
    """Add the solids `nodes` (n, at least k) of one type to the rows of their corners."""
    n = 0
    for k in range(len(tables.corners)):
        n = max(n, tables.corners[k, 0] + 1)
    x, cell = np.empty((n, 3, LANES)), np.empty((FIELDS, n, LANES))
    face, work = np.empty((len(tables.sizes), 3, LANES)), np.empty((8, LANES))
    for first in range(0, nodes.shape[0], LANES):
        _gather(points, nodes, first, x)
        _reset(cell)
        _dual_fields(x, tables, cell, face, work)
        _corner_fields(x, tables, cell)
        for i in range(min(LANES, nodes.shape[0] - first)):
            broken = not abs(work[6, i]) < np.inf
            for j in range(n):
                p = nodes[first + i, j]
                if broken:
                    fields[p, COUNT] = np.nan
                else:
                    _scatter(fields, p, cell, j, i, abs(work[6, i]))


@kernel
def gather_surface(points, nodes, tables, fields):  # type: ignore[no-untyped-def]
    """The same for triangles and quadrilaterals: corner angles, edge ratios and counts, no dual."""
    n = tables.sizes[0]
    x, cell = np.empty((n, 3, LANES)), np.empty((FIELDS, n, LANES))
    for first in range(0, nodes.shape[0], LANES):
        _gather(points, nodes, first, x)
        _reset(cell)
        _corner_fields(x, tables, cell)
        for i in range(min(LANES, nodes.shape[0] - first)):
            total = 0.0
            for j in range(n):
                total += x[j, 0, i] + x[j, 1, i] + x[j, 2, i]
            for j in range(n):
                p = nodes[first + i, j]
                if not abs(total) < np.inf:
                    fields[p, COUNT] = np.nan
                else:
                    _scatter(fields, p, cell, j, i, 0.0)
