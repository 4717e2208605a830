"""The median dual of polyhedra, and the corners of polygons: the same as `dual` for cells of any number of faces."""

from __future__ import annotations

import math

import numpy as np

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
    SECTOR_MAX,
    SECTOR_MIN,
)
from meshwright.audit.metrics.stages import corner, degrees_from_cotangent, widen

__all__ = ["gather_polytopes"]


@inner
def _corner_of_loop(points, row, o, a, b, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Add the corner o of a face of normal n, between a (next) and b (before), to the row of its point."""
    ux, uy, uz = points[a, 0] - points[o, 0], points[a, 1] - points[o, 1], points[a, 2] - points[o, 2]
    vx, vy, vz = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1], points[b, 2] - points[o, 2]
    square, mx, my, mz = corner(ux, uy, uz, vx, vy, vz)
    turned = nx * mx + ny * my + nz * mz < 0.0
    row[CORNER_SMALL], row[CORNER_LARGE], row[CORNER_REFLEX] = widen(
        row[CORNER_SMALL], row[CORNER_LARGE], row[CORNER_REFLEX], square, turned
    )
    u2, v2 = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    low, high = min(u2, v2), max(u2, v2)
    row[EDGES] = max(row[EDGES], high / low if low > 0.0 else np.inf)


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
                row[AREA] += size
                row[AREA_ANGLE] += size * angle
                row[AREA_COSINE] += size * cosine
                row[AREA_MIN] = min(row[AREA_MIN], size)
                row[AREA_MAX] = max(row[AREA_MAX], size)
                row[ANGLE_MIN] = angle if size > 0.0 and angle < row[ANGLE_MIN] else row[ANGLE_MIN]
                k = first
                while cells[1][k] != p:
                    k += 1
                sector[k - first] += dot / 6.0
        for k in range(first, last):
            row = fields[cells[1][k]]
            if broken:
                row[COUNT] = np.nan
                continue
            row[COUNT] += 1.0
            row[SECTOR_MIN] = min(row[SECTOR_MIN], sector[k - first])
            row[SECTOR_MAX] = max(row[SECTOR_MAX], sector[k - first])
            row[CELL_MIN] = min(row[CELL_MIN], abs(volume))
            row[CELL_MAX] = max(row[CELL_MAX], abs(volume))
