"""Thickness and centre of polyhedra and polygons in plain floats, with the cells whose sign that leaves open."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["face_vector", "polygons", "polyhedra"]

Floats = NDArray[np.float64]

_UNIT_ERROR = 128 * 2.0**-53
"""Error of one fan triangle's share of a volume (or area), over the extent cubed (squared): see `polyhedra`."""


@inner
def face_vector(
    points: Floats, nodes: Ints, first: int, last: int, ox: float, oy: float, oz: float, scale: float
) -> tuple[float, float, float, float, float, float, float]:
    """(area vector, centre, signed volume under the face) of nodes[first:last], seen from o, lengths times `scale`.

    Fanned about the vertex mean; the centre weighs the fan's triangles by their area.
    """
    n = last - first
    gx = gy = gz = 0.0
    for i in range(first, last):
        p = nodes[i]
        gx += scale * (points[p, 0] - ox)
        gy += scale * (points[p, 1] - oy)
        gz += scale * (points[p, 2] - oz)
    gx, gy, gz = gx / n, gy / n, gz / n
    ax = ay = az = cx = cy = cz = weight = under = 0.0
    p = nodes[last - 1]
    px, py, pz = scale * (points[p, 0] - ox), scale * (points[p, 1] - oy), scale * (points[p, 2] - oz)
    for i in range(first, last):
        q = nodes[i]
        qx, qy, qz = scale * (points[q, 0] - ox), scale * (points[q, 1] - oy), scale * (points[q, 2] - oz)
        ux, uy, uz = px - gx, py - gy, pz - gz
        vx, vy, vz = qx - gx, qy - gy, qz - gz
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        w = math.sqrt(nx * nx + ny * ny + nz * nz)
        ax, ay, az = ax + nx, ay + ny, az + nz
        cx, cy, cz = cx + w * (ux + vx), cy + w * (uy + vy), cz + w * (uz + vz)
        weight += w
        under += gx * nx + gy * ny + gz * nz
        px, py, pz = qx, qy, qz
    if weight > 0.0:
        third = 1.0 / (3.0 * weight)
        gx, gy, gz = gx + cx * third, gy + cy * third, gz + cz * third
    return 0.5 * ax, 0.5 * ay, 0.5 * az, gx, gy, gz, under / 6.0


@inner
def _scale_of(
    points: Floats, nodes: Ints, first: int, last: int, origin: int, extent: float, edge: float
) -> tuple[float, float]:
    """Extent seen from the origin and square of the longest edge, both grown by one face."""
    p = nodes[last - 1]
    for i in range(first, last):
        q = nodes[i]
        square = 0.0
        for d in range(3):
            extent = max(extent, abs(points[q, d] - points[origin, d]))
            square += (points[q, d] - points[p, d]) ** 2
        edge = max(edge, square)
        p = q
    return extent, edge


@kernel
def polyhedra(
    points: Floats,
    rows: Ints,
    starts: Ints,
    items: Ints,
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    relative: Floats,
    centre: Floats,
) -> NDArray[np.bool_]:
    """relative[row] = V / Lmax**3 and centre[row] of every polyhedron; returns (n,) where the sign is open.

    starts, items: faces of each; offsets, nodes, owner: of the faces, whose normals leave the owner.

    Error: with M the extent of the cell from its first node, every local coordinate is at most M and off by at most
    M u (u = 2**-53). The share g.(u x v)/6 of a fan triangle is six products of three numbers below M, 2 M and 2 M,
    each off by fewer than 16 u of that; so 6 * 4 * 16 / 6 = 64 u M**3, doubled for the sums and for
    the area vectors, whose sum is 0 but for the like error.
    """
    most = 0
    for k in range(rows.size):
        most = max(most, starts[k + 1] - starts[k])
    face = np.empty((most, 6))
    unsure = np.zeros(rows.size, np.bool_)
    for k in range(rows.size):
        n = starts[k + 1] - starts[k]
        origin = nodes[offsets[items[starts[k]]]]
        extent = edge = 0.0
        triangles = 0
        for j in range(n):
            f = items[starts[k] + j]
            extent, edge = _scale_of(points, nodes, offsets[f], offsets[f + 1], origin, extent, edge)
            triangles += offsets[f + 1] - offsets[f]
        ox, oy, oz = points[origin, 0], points[origin, 1], points[origin, 2]
        scale = 1.0 if 1e-60 < extent < 1e60 or extent == 0.0 else 1.0 / extent
        volume = ex = ey = ez = gap_x = gap_y = gap_z = 0.0
        for j in range(n):
            f = items[starts[k] + j]
            outward = 1.0 if owner[f] == rows[k] else -1.0
            ax, ay, az, cx, cy, cz, under = face_vector(points, nodes, offsets[f], offsets[f + 1], ox, oy, oz, scale)
            face[j, 0], face[j, 1], face[j, 2], face[j, 3], face[j, 4], face[j, 5] = ax, ay, az, cx, cy, cz
            volume += outward * under
            gap_x, gap_y, gap_z = gap_x + outward * ax, gap_y + outward * ay, gap_z + outward * az
            ex, ey, ez = ex + cx / n, ey + cy / n, ez + cz / n
        # Seen from the middle, so that a reversed face or a missing one costs its own share and no more.
        volume -= (gap_x * ex + gap_y * ey + gap_z * ez) / 3.0
        weight = sx = sy = sz = 0.0
        for j in range(n):
            dx, dy, dz = face[j, 3] - ex, face[j, 4] - ey, face[j, 5] - ez
            w = abs(face[j, 0] * dx + face[j, 1] * dy + face[j, 2] * dz)
            weight += w
            sx, sy, sz = sx + w * dx, sy + w * dy, sz + w * dz
        w = 0.75 / weight if weight > 0.0 else 0.0
        row = rows[k]
        centre[row, 0] = ox + (ex + w * sx) / scale
        centre[row, 1] = oy + (ey + w * sy) / scale
        centre[row, 2] = oz + (ez + w * sz) / scale
        extent, edge = extent * scale, edge * scale * scale
        relative[row] = volume / (edge * math.sqrt(edge)) if edge > 0.0 else volume
        unsure[k] = not abs(volume) > _UNIT_ERROR * triangles * extent * extent * extent  # or overflowed
    return unsure


@kernel
def polygons(
    points: Floats, rows: Ints, starts: Ints, nodes: Ints, flat: bool, relative: Floats, centre: Floats
) -> NDArray[np.bool_]:
    """relative[row] = A / Lmax**2 and centre[row] of every polygon; signed in the x-y plane (`flat`), else |A|."""
    unsure = np.zeros(rows.size, np.bool_)
    for k in range(rows.size):
        first, last = starts[k], starts[k + 1]
        origin = nodes[first]
        ox, oy, oz = points[origin, 0], points[origin, 1], points[origin, 2]
        extent, edge = _scale_of(points, nodes, first, last, origin, 0.0, 0.0)
        scale = 1.0 if 1e-60 < extent < 1e60 or extent == 0.0 else 1.0 / extent
        ax, ay, az, cx, cy, cz, _ = face_vector(points, nodes, first, last, ox, oy, oz, scale)
        row = rows[k]
        centre[row, 0], centre[row, 1], centre[row, 2] = ox + cx / scale, oy + cy / scale, oz + cz / scale
        extent, edge = extent * scale, edge * scale * scale
        area = az if flat else math.sqrt(ax * ax + ay * ay + az * az)
        relative[row] = area / edge if edge > 0.0 else area
        unsure[k] = not abs(area) > _UNIT_ERROR * (last - first) * extent * extent
    return unsure
