"""Kernels behind `geometry`: area, volume and centre of rows begin .. end of a table, written in place."""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints

__all__ = ["cells_by_faces", "cells_by_table", "edge_rows", "face_rows", "one_cell", "one_face"]

Vector = tuple[float, float, float]


@inner
def _triangle(p: Vector, q: Vector, r: Vector) -> Vector:
    """Twice the area vector of the triangle p, q, r."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@inner
def _node(points: Floats, node: int, origin: Vector) -> Vector:
    return points[node, 0] - origin[0], points[node, 1] - origin[1], points[node, 2] - origin[2]


@inner
def one_face(points: Floats, nodes: Ints, start: int, size: int, origin: Vector) -> tuple[Vector, Vector]:
    """(area vector, centre) of one face, seen from `origin`."""
    if size == 3:
        p = _node(points, nodes[start], origin)
        q = _node(points, nodes[start + 1], origin)
        r = _node(points, nodes[start + 2], origin)
        n = _triangle(p, q, r)
        return (0.5 * n[0], 0.5 * n[1], 0.5 * n[2]), (
            (p[0] + q[0] + r[0]) / 3.0,
            (p[1] + q[1] + r[1]) / 3.0,
            (p[2] + q[2] + r[2]) / 3.0,
        )
    mx = my = mz = 0.0
    for i in range(start, start + size):
        p = _node(points, nodes[i], origin)
        mx += p[0]
        my += p[1]
        mz += p[2]
    mean = (mx / size, my / size, mz / size)
    ax = ay = az = weight = cx = cy = cz = 0.0
    p = _node(points, nodes[start + size - 1], origin)
    for i in range(start, start + size):
        q = _node(points, nodes[i], origin)
        n = _triangle(p, q, mean)
        w = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        ax += n[0]
        ay += n[1]
        az += n[2]
        weight += w
        cx += w * (p[0] + q[0] - 2.0 * mean[0])
        cy += w * (p[1] + q[1] - 2.0 * mean[1])
        cz += w * (p[2] + q[2] - 2.0 * mean[2])
        p = q
    area = (0.5 * ax, 0.5 * ay, 0.5 * az)
    if weight == 0.0:
        return area, mean
    weight *= 3.0
    return area, (mean[0] + cx / weight, mean[1] + cy / weight, mean[2] + cz / weight)


@inner
def one_cell(areas: Floats, centres: Floats, m: int) -> tuple[float, Vector]:
    """(volume, centre) from the outward areas and the centres of m faces.

    The centre is the mean of theirs where the volume is no more than rounding: weights of that would throw it anywhere.
    """
    ex = ey = ez = 0.0
    for i in range(m):
        ex += centres[i, 0]
        ey += centres[i, 1]
        ez += centres[i, 2]
    ex, ey, ez = ex / m, ey / m, ez / m
    total = scale = cx = cy = cz = 0.0
    for i in range(m):
        dx, dy, dz = centres[i, 0] - ex, centres[i, 1] - ey, centres[i, 2] - ez
        v = areas[i, 0] * dx + areas[i, 1] * dy + areas[i, 2] * dz
        total += v
        scale += (abs(areas[i, 0]) + abs(areas[i, 1]) + abs(areas[i, 2])) * (abs(dx) + abs(dy) + abs(dz))
        cx += v * dx
        cy += v * dy
        cz += v * dz
    if abs(total) > 1e-14 * scale:
        ex += 0.75 * cx / total
        ey += 0.75 * cy / total
        ez += 0.75 * cz / total
    return total / 3.0, (ex, ey, ez)


@kernel
def face_rows(
    points: Floats, offsets: Ints, nodes: Ints, begin: int, end: int, area: Floats, centre: Floats, relative: bool
) -> None:
    """area (f, 3) and centre (f, 3) of polygons; relative: the centre as seen from the first node."""
    for f in range(begin, end):
        start = offsets[f]
        o = (points[nodes[start], 0], points[nodes[start], 1], points[nodes[start], 2])
        a, c = one_face(points, nodes, start, offsets[f + 1] - start, o)
        for k in range(3):
            area[f, k] = a[k]
            centre[f, k] = c[k] if relative else o[k] + c[k]


@kernel
def edge_rows(
    points: Floats, nodes: Ints, owner: Ints, normals: Floats, begin: int, end: int, area: Floats, centre: Floats
) -> None:
    """Normal of edge length, in the plane of the owner (normals: of any length), and midpoint of edges."""
    for f in range(begin, end):
        p, q = nodes[2 * f], nodes[2 * f + 1]
        n = normals[owner[f]]
        size = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        nx, ny, nz = n[0] / size, n[1] / size, n[2] / size
        tx, ty, tz = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1], points[q, 2] - points[p, 2]
        area[f, 0] = ty * nz - tz * ny
        area[f, 1] = tz * nx - tx * nz
        area[f, 2] = tx * ny - ty * nx
        centre[f, 0] = points[p, 0] + 0.5 * tx
        centre[f, 1] = points[p, 1] + 0.5 * ty
        centre[f, 2] = points[p, 2] + 0.5 * tz


@kernel
def cells_by_table(
    points: Floats,
    rows: Ints,
    nodes: Ints,
    sizes: Ints,
    corners: Ints,
    begin: int,
    end: int,
    volume: Floats,
    first: Ints,
    arm: Floats,
) -> None:
    """Cells of one type; sizes (m,) and corners (m, 4) are its faces, outward."""
    m = sizes.size
    areas = np.empty((m, 3))
    centres = np.empty((m, 3))
    face = np.empty(4, nodes.dtype)
    for c in range(begin, end):
        origin = nodes[c, 0]
        o = (points[origin, 0], points[origin, 1], points[origin, 2])
        for i in range(m):
            for k in range(4):
                face[k] = nodes[c, corners[i, k]]
            areas[i], centres[i] = one_face(points, face, 0, sizes[i], o)
        v, g = one_cell(areas, centres, m)
        volume[rows[c]] = v
        first[rows[c]] = origin
        for k in range(3):
            arm[rows[c], k] = g[k]


@kernel
def cells_by_faces(
    points: Floats,
    rows: Ints,
    starts: Ints,
    items: Ints,
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    most: int,
    begin: int,
    end: int,
    volume: Floats,
    first: Ints,
    arm: Floats,
) -> None:
    """Cells by their faces (rows items[starts[c]:starts[c + 1]], at most `most`), outward for their owner."""
    areas = np.empty((most, 3))
    centres = np.empty((most, 3))
    for c in range(begin, end):
        origin = nodes[offsets[items[starts[c]]]]
        o = (points[origin, 0], points[origin, 1], points[origin, 2])
        m = starts[c + 1] - starts[c]
        for i in range(m):
            f = items[starts[c] + i]
            a, centres[i] = one_face(points, nodes, offsets[f], offsets[f + 1] - offsets[f], o)
            sign = 1.0 if owner[f] == rows[c] else -1.0
            for k in range(3):
                areas[i, k] = sign * a[k]
        v, g = one_cell(areas, centres, m)
        volume[rows[c]] = v
        first[rows[c]] = origin
        for k in range(3):
            arm[rows[c], k] = g[k]
