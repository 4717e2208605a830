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
from meshwright.audit.mesh import Floats
from meshwright.audit.metrics.stages import corner, degrees, degrees_from_cotangent, widen
from meshwright.audit.metrics.tile import LANES

__all__ = [
    "FIELDS",
    "DualTables",
    "dual_tables",
    "finish",
    "gather_block",
    "gather_polytopes",
    "gather_surface",
    "new_fields",
]

FIELDS = 15
(
    _COUNT, _SECTOR_MIN, _SECTOR_MAX, _AREA, _AREA_ANGLE, _AREA_COSINE, _ANGLE_MIN, _AREA_MIN, _AREA_MAX, _CELL_MIN,
    _CELL_MAX, _CORNER_SMALL, _CORNER_LARGE, _CORNER_REFLEX, _EDGES,
) = range(FIELDS)  # fmt: skip
"""Columns of a point's row: cells around it; extremes of its sectors; sums over dual faces of area, area times angle and
area times cosine; smallest angle and extreme areas of dual faces; extremes of the cells' volumes; extremes of the corner
angles as signed squares of cotangents; largest squared ratio of two edges at a corner."""


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


def new_fields(n_points: int) -> Floats:
    """(n_points, FIELDS) rows of points that no cell has touched yet."""
    fields = np.zeros((n_points, FIELDS))
    fields[:, [_SECTOR_MIN, _ANGLE_MIN, _AREA_MIN, _CELL_MIN, _CORNER_LARGE]] = np.inf
    fields[:, [_SECTOR_MAX, _CELL_MAX, _CORNER_SMALL, _CORNER_REFLEX]] = -np.inf
    return fields


@inner
def _corner_fields(x, tables, cell):  # type: ignore[no-untyped-def]
    """Corner angles and edge ratios of 192 cells into cell[fields, corner, lane]."""
    table = tables.corners
    for r in range(len(table)):
        o, a, b, c = table[r, 0], table[r, 1], table[r, 2], table[r, 3]
        small, large = cell[_CORNER_SMALL, o], cell[_CORNER_LARGE, o]
        reflex, ratio = cell[_CORNER_REFLEX, o], cell[_EDGES, o]
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
            cell[_SECTOR_MIN, p, i] += dot / 6.0
            cell[_SECTOR_MIN, q, i] += dot / 6.0
        for end in range(2):
            at = edges[r, end]
            for i in range(LANES):
                size, angle = work[3, i], work[4, i]
                cell[_AREA, at, i] += size
                cell[_AREA_ANGLE, at, i] += size * angle
                cell[_AREA_COSINE, at, i] += size * work[5, i]
                cell[_AREA_MIN, at, i] = min(cell[_AREA_MIN, at, i], size)
                cell[_AREA_MAX, at, i] = max(cell[_AREA_MAX, at, i], size)
                lowest = cell[_ANGLE_MIN, at, i]
                cell[_ANGLE_MIN, at, i] = angle if size > 0.0 and angle < lowest else lowest


@inner
def _reset(cell):  # type: ignore[no-untyped-def]
    """Start values of the fields of a cell's corners; its sectors are sums, kept where their minimum will be."""
    for j in range(cell.shape[1]):
        for field in range(FIELDS):
            start = 0.0
            if field in (_ANGLE_MIN, _AREA_MIN, _CORNER_LARGE):
                start = np.inf
            elif field in (_CORNER_SMALL, _CORNER_REFLEX):
                start = -np.inf
            for i in range(LANES):
                cell[field, j, i] = start


@inner
def _scatter(fields, p, cell, j, i, volume):  # type: ignore[no-untyped-def]
    """Add what lane i of corner j knows to the row of its point. Angles that are undefined make a sum nan."""
    row = fields[p]
    row[_COUNT] += 1.0
    row[_SECTOR_MIN] = min(row[_SECTOR_MIN], cell[_SECTOR_MIN, j, i])
    row[_SECTOR_MAX] = max(row[_SECTOR_MAX], cell[_SECTOR_MIN, j, i])
    row[_AREA] += cell[_AREA, j, i]
    row[_AREA_ANGLE] += cell[_AREA_ANGLE, j, i]
    row[_AREA_COSINE] += cell[_AREA_COSINE, j, i]
    row[_ANGLE_MIN] = min(row[_ANGLE_MIN], cell[_ANGLE_MIN, j, i])
    row[_AREA_MIN] = min(row[_AREA_MIN], cell[_AREA_MIN, j, i])
    row[_AREA_MAX] = max(row[_AREA_MAX], cell[_AREA_MAX, j, i])
    row[_CELL_MIN] = min(row[_CELL_MIN], volume)
    row[_CELL_MAX] = max(row[_CELL_MAX], volume)
    row[_CORNER_SMALL] = max(row[_CORNER_SMALL], cell[_CORNER_SMALL, j, i])
    row[_CORNER_LARGE] = min(row[_CORNER_LARGE], cell[_CORNER_LARGE, j, i])
    row[_CORNER_REFLEX] = max(row[_CORNER_REFLEX], cell[_CORNER_REFLEX, j, i])
    row[_EDGES] = max(row[_EDGES], cell[_EDGES, j, i])


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
                    fields[p, _COUNT] = np.nan
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
                    fields[p, _COUNT] = np.nan
                else:
                    _scatter(fields, p, cell, j, i, 0.0)


@inner
def _corner_of_loop(points, row, o, a, b, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Add the corner o of a face of normal n, between a (next) and b (before), to the row of its point."""
    ux, uy, uz = points[a, 0] - points[o, 0], points[a, 1] - points[o, 1], points[a, 2] - points[o, 2]
    vx, vy, vz = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1], points[b, 2] - points[o, 2]
    square, mx, my, mz = corner(ux, uy, uz, vx, vy, vz)
    turned = nx * mx + ny * my + nz * mz < 0.0
    row[_CORNER_SMALL], row[_CORNER_LARGE], row[_CORNER_REFLEX] = widen(
        row[_CORNER_SMALL], row[_CORNER_LARGE], row[_CORNER_REFLEX], square, turned
    )
    u2, v2 = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    low, high = min(u2, v2), max(u2, v2)
    row[_EDGES] = max(row[_EDGES], high / low if low > 0.0 else np.inf)


@inner
def _normal_of_loop(points, nodes, start, end):  # type: ignore[no-untyped-def]
    """Area vector of a face, seen from its first node."""
    o = nodes[start]
    nx = ny = nz = 0.0
    for k in range(start + 1, end - 1):
        p, q = nodes[k], nodes[k + 1]
        ux, uy, uz = points[p, 0] - points[o, 0], points[p, 1] - points[o, 1], points[p, 2] - points[o, 2]
        vx, vy, vz = points[q, 0] - points[o, 0], points[q, 1] - points[o, 1], points[q, 2] - points[o, 2]
        nx, ny, nz = nx + uy * vz - uz * vy, ny + uz * vx - ux * vz, nz + ux * vy - uy * vx
    return nx, ny, nz


@kernel
def gather_polytopes(points, rows, starts, items, offsets, nodes, owner, cells, solid, fields):  # type: ignore[no-untyped-def]
    """Add polyhedra, or polygons (cells of one face each), to the rows of their corners.

    starts, items: faces of each; offsets, nodes: points around each face, whose normal leaves the cell row `owner`.
    cells (offsets, nodes): the distinct points of each cell, by its place.
    """
    most_edges = most_nodes = 0
    for c in range(rows.size):
        total = 0
        for k in range(starts[c], starts[c + 1]):
            total += offsets[items[k] + 1] - offsets[items[k]]
        most_edges = max(most_edges, total)
        most_nodes = max(most_nodes, cells[0][c + 1] - cells[0][c])
    # one row an edge of the cell: ends and dual area vector; edges are found by comparison, cells have few
    ends, dual = np.empty((most_edges, 2), np.int64), np.empty((most_edges, 3))
    sector = np.empty(most_nodes)
    for c in range(rows.size):
        first, last = cells[0][c], cells[0][c + 1]
        o = cells[1][first]
        mx = my = mz = 0.0
        for k in range(first, last):
            p = cells[1][k]
            mx, my, mz = (
                mx + points[p, 0] - points[o, 0],
                my + points[p, 1] - points[o, 1],
                mz + points[p, 2] - points[o, 2],
            )
        mx, my, mz = mx / (last - first), my / (last - first), mz / (last - first)
        sector[: last - first] = 0.0
        n_edges = 0
        for k in range(starts[c], starts[c + 1]):
            f = items[k]
            begin, end = offsets[f], offsets[f + 1]
            outward = 1.0 if owner[f] == rows[c] else -1.0
            fx = fy = fz = 0.0
            for j in range(begin, end):
                p = nodes[j]
                fx, fy, fz = (
                    fx + points[p, 0] - points[o, 0],
                    fy + points[p, 1] - points[o, 1],
                    fz + points[p, 2] - points[o, 2],
                )
            fx, fy, fz = fx / (end - begin), fy / (end - begin), fz / (end - begin)
            normal = _normal_of_loop(points, nodes, begin, end)
            for j in range(begin, end):
                a, b = nodes[j], nodes[j + 1 if j + 1 < end else begin]
                before = nodes[j - 1 if j > begin else end - 1]
                _corner_of_loop(points, fields[a], a, b, before, normal[0], normal[1], normal[2])
                if not solid:
                    continue
                low, high = min(a, b), max(a, b)
                e = 0
                while e < n_edges and (ends[e, 0] != low or ends[e, 1] != high):
                    e += 1
                if e == n_edges:
                    ends[e, 0], ends[e, 1] = low, high
                    dual[e, 0] = dual[e, 1] = dual[e, 2] = 0.0
                    n_edges += 1
                # (M - F) x (C - M) / 2 for the face that runs along the edge, the opposite for the one against it
                sign = 0.5 * outward if a == low else -0.5 * outward
                ax = 0.5 * (points[a, 0] + points[b, 0]) - points[o, 0]
                ay = 0.5 * (points[a, 1] + points[b, 1]) - points[o, 1]
                az = 0.5 * (points[a, 2] + points[b, 2]) - points[o, 2]
                ux, uy, uz = ax - fx, ay - fy, az - fz
                vx, vy, vz = mx - ax, my - ay, mz - az
                dual[e, 0] += sign * (uy * vz - uz * vy)
                dual[e, 1] += sign * (uz * vx - ux * vz)
                dual[e, 2] += sign * (ux * vy - uy * vx)
        volume = 0.0
        for e in range(n_edges):
            a, b = ends[e, 0], ends[e, 1]
            for d in range(3):
                volume += dual[e, d] * (points[b, d] - points[a, d]) / 3.0
        broken = not abs(volume + mx + my + mz) < np.inf
        mirrored = -1.0 if volume < 0.0 else 1.0
        for e in range(n_edges):
            a, b = ends[e, 0], ends[e, 1]
            nx, ny, nz = dual[e, 0], dual[e, 1], dual[e, 2]
            sx, sy, sz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
            dot = mirrored * (nx * sx + ny * sy + nz * sz)
            cx, cy, cz = ny * sz - nz * sy, nz * sx - nx * sz, nx * sy - ny * sx
            cross = math.sqrt(cx * cx + cy * cy + cz * cz)
            size = math.sqrt(nx * nx + ny * ny + nz * nz)
            angle = 90.0 - degrees_from_cotangent(dot / cross) if size > 0.0 else 0.0
            cosine = dot / math.sqrt(dot * dot + cross * cross) if size > 0.0 else 0.0
            for p in (a, b):
                row = fields[p]
                row[_AREA] += size
                row[_AREA_ANGLE] += size * angle
                row[_AREA_COSINE] += size * cosine
                row[_AREA_MIN] = min(row[_AREA_MIN], size)
                row[_AREA_MAX] = max(row[_AREA_MAX], size)
                row[_ANGLE_MIN] = angle if size > 0.0 and angle < row[_ANGLE_MIN] else row[_ANGLE_MIN]
                k = first
                while cells[1][k] != p:
                    k += 1
                sector[k - first] += dot / 6.0
        for k in range(first, last):
            row = fields[cells[1][k]]
            if broken:
                row[_COUNT] = np.nan
                continue
            row[_COUNT] += 1.0
            row[_SECTOR_MIN] = min(row[_SECTOR_MIN], sector[k - first])
            row[_SECTOR_MAX] = max(row[_SECTOR_MAX], sector[k - first])
            row[_CELL_MIN] = min(row[_CELL_MIN], abs(volume))
            row[_CELL_MAX] = max(row[_CELL_MAX], abs(volume))


@kernel
def finish(fields, column, out):  # type: ignore[no-untyped-def]
    """out (n,): the metric of that number (the order of `points.Columns`) from the rows; nan at a point without cells."""
    for p in range(out.size):
        row = fields[p]
        if not row[_COUNT] > 0.0:
            out[p] = np.nan
        elif column == 0:
            out[p] = row[_SECTOR_MAX] / row[_SECTOR_MIN] if row[_SECTOR_MIN] > 0.0 else np.inf
        elif column == 1:
            out[p] = row[_AREA_ANGLE] / row[_AREA]
        elif column == 2:
            out[p] = row[_ANGLE_MIN] if row[_ANGLE_MIN] < np.inf and row[_AREA_ANGLE] == row[_AREA_ANGLE] else np.nan
        elif column == 3:
            out[p] = row[_AREA_COSINE] / row[_AREA]
        elif column == 4:
            out[p] = row[_AREA_MAX] / row[_AREA_MIN] if row[_AREA_MIN] > 0.0 else np.inf
        elif column == 5:
            out[p] = row[_COUNT]
        elif column == 6:
            out[p] = math.sqrt(row[_EDGES])
        elif column == 7:
            out[p] = row[_CELL_MAX] / row[_CELL_MIN] if row[_CELL_MIN] > 0.0 else np.inf
        elif column == 8:
            out[p] = _smallest_angle(row)
        else:
            out[p] = _largest_angle(row)


@inner
def _smallest_angle(row):  # type: ignore[no-untyped-def]
    """Smallest corner angle of a point's row; nan where an edge there has no length."""
    if not row[_EDGES] < np.inf:
        return np.nan
    if row[_CORNER_SMALL] == -np.inf and row[_CORNER_LARGE] == np.inf:  # no corner but reflex ones
        return 360.0 - degrees(row[_CORNER_REFLEX])
    return degrees(row[_CORNER_SMALL])


@inner
def _largest_angle(row):  # type: ignore[no-untyped-def]
    """Largest corner angle of a point's row; nan where an edge there has no length."""
    if not row[_EDGES] < np.inf:
        return np.nan
    if row[_CORNER_REFLEX] > -np.inf:
        return 360.0 - degrees(row[_CORNER_REFLEX])
    return degrees(row[_CORNER_LARGE])
