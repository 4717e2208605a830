"""Kernels of the Delaunay test: the in-circle and in-sphere determinants of cells on two sides of a face.

A pair violates when the determinant exceeds `band`, the most it can change when every coordinate moves by
`ROUNDINGS` half units in its last place. Four points of a lattice that lie on one circle by design are never stored
exactly there; which side of it rounding has put them says nothing about the mesh. The band is wider than the error
of plain floats (Shewchuk's bounds: 10 u and 16 u times the permanent, which Hadamard's and Carlen-Lieb-Loss's
inequalities bound by edge lengths), so the sign of every pair that is reported is certain; the few whose
determinant lies within that error of the band itself are for exact arithmetic.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints

__all__ = [
    "COCIRCULAR",
    "NO",
    "OPEN",
    "ROUNDINGS",
    "VIOLATES",
    "deepest",
    "judge_shell",
    "judge_tets",
    "judge_triangles",
]

NO, VIOLATES, OPEN, COCIRCULAR = 0, 1, 2, 3
"""What the kernels say of a face: in order, violating, for exact arithmetic, cocircular as far as coordinates tell."""

ROUNDINGS = 4.0
"""Half units in the last place that a coordinate is trusted to."""

_U = 2.0**-53

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]


@kernel
def judge_triangles(
    points: Floats,
    nodes: Ints,
    owner: Ints,
    neighbour: Ints,
    total: NDArray[np.int64],
    state: Bytes,
    value: Floats,
    band: Floats,
) -> None:
    """Edges between triangles in the x-y plane. total: sum of the corners of a triangle, -1 for cells to leave out."""
    for f in range(owner.size):
        state[f] = NO
        cell, other = owner[f], neighbour[f]
        if other < 0 or total[cell] < 0 or total[other] < 0:
            continue
        a, b = np.int64(nodes[2 * f]), np.int64(nodes[2 * f + 1])
        c, d = total[cell] - a - b, total[other] - a - b
        ox, oy = points[d, 0], points[d, 1]
        ax, ay = points[a, 0] - ox, points[a, 1] - oy
        bx, by = points[b, 0] - ox, points[b, 1] - oy
        cx, cy = points[c, 0] - ox, points[c, 1] - oy
        ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        turn = ux * (points[c, 1] - points[a, 1]) - uy * (points[c, 0] - points[a, 0])
        back = ux * (oy - points[a, 1]) - uy * (ox - points[a, 0])
        if not turn * back < 0.0:
            continue  # both on one side of the edge: the cells overlap
        sa, sb, sc = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
        det = sa * (bx * cy - by * cx) + sb * (cx * ay - cy * ax) + sc * (ax * by - ay * bx)
        if turn < 0.0:
            det = -det
        la, lb, lc = math.sqrt(sa), math.sqrt(sb), math.sqrt(sc)
        largest = max(abs(ox), abs(oy))
        for p in (a, b, c):
            largest = max(largest, abs(points[p, 0]), abs(points[p, 1]))
        move = 2.0 * math.sqrt(2.0) * ROUNDINGS * _U * largest
        limit = move * (6.0 * la * lb * lc + sa * (lb + lc) + sb * (la + lc) + sc * (la + lb))
        slack = 12.0 * _U * la * lb * lc * (la + lb + lc)
        value[f], band[f] = det, limit
        if det > limit + slack:
            state[f] = VIOLATES
        elif det > limit - slack:
            state[f] = OPEN
        elif det >= -limit:
            state[f] = COCIRCULAR


@kernel
def judge_tets(
    points: Floats,
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    neighbour: Ints,
    total: NDArray[np.int64],
    state: Bytes,
    value: Floats,
    band: Floats,
) -> None:
    """Faces between tetrahedra, likewise."""
    for f in range(owner.size):
        state[f] = NO
        cell, other = owner[f], neighbour[f]
        if other < 0 or total[cell] < 0 or total[other] < 0:
            continue
        i = offsets[f]
        a, b, c = np.int64(nodes[i]), np.int64(nodes[i + 1]), np.int64(nodes[i + 2])
        d, e = total[cell] - a - b - c, total[other] - a - b - c
        ox, oy, oz = points[e, 0], points[e, 1], points[e, 2]
        ax, ay, az = points[a, 0] - ox, points[a, 1] - oy, points[a, 2] - oz
        bx, by, bz = points[b, 0] - ox, points[b, 1] - oy, points[b, 2] - oz
        cx, cy, cz = points[c, 0] - ox, points[c, 1] - oy, points[c, 2] - oz
        dx, dy, dz = points[d, 0] - ox, points[d, 1] - oy, points[d, 2] - oz
        # the normal of the face, from differences of its own corners
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        turn = (
            nx * (points[d, 0] - points[a, 0]) + ny * (points[d, 1] - points[a, 1]) + nz * (points[d, 2] - points[a, 2])
        )
        back = -(nx * ax + ny * ay + nz * az)
        if not ((turn > 0.0 and back < 0.0) or (turn < 0.0 and back > 0.0)):
            continue
        ab, bc, cd = ax * by - ay * bx, bx * cy - by * cx, cx * dy - cy * dx
        da, ac, bd = dx * ay - dy * ax, ax * cy - ay * cx, bx * dy - by * dx
        sa, sb = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
        sc, sd = cx * cx + cy * cy + cz * cz, dx * dx + dy * dy + dz * dz
        abc, bcd = az * bc - bz * ac + cz * ab, bz * cd - cz * bd + dz * bc
        cda, dab = cz * da + dz * ac + az * cd, dz * ab + az * bd + bz * da
        det = (sd * abc - sc * dab) + (sb * cda - sa * bcd)
        if turn > 0.0:
            det = -det
        la, lb, lc, ld = math.sqrt(sa), math.sqrt(sb), math.sqrt(sc), math.sqrt(sd)
        product = la * lb * lc * ld
        slack = 20.0 * _U * product * (la + lb + lc + ld)
        largest = max(abs(ox), abs(oy), abs(oz))
        for p in (a, b, c, d):
            largest = max(largest, abs(points[p, 0]), abs(points[p, 1]), abs(points[p, 2]))
        move = 2.0 * math.sqrt(3.0) * ROUNDINGS * _U * largest
        mixed = sa * (lb * lc + lc * ld + ld * lb) + sb * (la * lc + lc * ld + ld * la)
        mixed += sc * (la * lb + lb * ld + ld * la) + sd * (la * lb + lb * lc + lc * la)
        limit = move * (8.0 * product + mixed)
        value[f], band[f] = det, limit
        if det > limit + slack:
            state[f] = VIOLATES
        elif det > limit - slack:
            state[f] = OPEN
        elif det >= -limit:
            state[f] = COCIRCULAR


@kernel
def judge_shell(
    points: Floats, nodes: Ints, owner: Ints, neighbour: Ints, total: NDArray[np.int64], state: Bytes
) -> None:
    """Edges between triangles of a surface: cot(alpha) + cot(beta) < 0, the angles opposite to the edge.

    That is alpha + beta > 180 degrees, the in-circle test of the two triangles unfolded into one plane.
    """
    for f in range(owner.size):
        state[f] = NO
        cell, other = owner[f], neighbour[f]
        if other < 0 or total[cell] < 0 or total[other] < 0:
            continue
        a, b = np.int64(nodes[2 * f]), np.int64(nodes[2 * f + 1])
        dot = np.empty(2)
        area = np.empty(2)
        sides = np.empty((2, 2))
        largest = 0.0
        for k in range(2):
            o = total[cell if k == 0 else other] - a - b
            ux, uy, uz = points[a, 0] - points[o, 0], points[a, 1] - points[o, 1], points[a, 2] - points[o, 2]
            vx, vy, vz = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1], points[b, 2] - points[o, 2]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            dot[k] = ux * vx + uy * vy + uz * vz
            area[k] = math.sqrt(nx * nx + ny * ny + nz * nz)
            sides[k, 0] = math.sqrt(ux * ux + uy * uy + uz * uz)
            sides[k, 1] = math.sqrt(vx * vx + vy * vy + vz * vz)
            for p in (a, b, o):
                largest = max(largest, abs(points[p, 0]), abs(points[p, 1]), abs(points[p, 2]))
        sine = dot[0] * area[1] + dot[1] * area[0]  # of alpha + beta, times the four sides
        move = 2.0 * math.sqrt(3.0) * ROUNDINGS * _U * largest
        limit = (sides[0, 0] + sides[0, 1]) * sides[1, 0] * sides[1, 1]
        limit = 2.0 * move * (limit + (sides[1, 0] + sides[1, 1]) * sides[0, 0] * sides[0, 1])
        if sine < -limit:
            state[f] = VIOLATES
        elif sine <= limit:
            state[f] = COCIRCULAR


@kernel
def deepest(points: Floats, offsets: Ints, nodes: Ints, rows: Ints, apexes: Ints) -> float:
    """Largest depth of a neighbour's far corner in the sphere of the owner of a face, over the radius."""
    most = 0.0
    for k in range(rows.size):
        i = offsets[rows[k]]
        o, p, q = nodes[i], nodes[i + 1], nodes[i + 2]
        r, e = apexes[k, 0], apexes[k, 1]
        bx, by, bz = points[p, 0] - points[o, 0], points[p, 1] - points[o, 1], points[p, 2] - points[o, 2]
        cx, cy, cz = points[q, 0] - points[o, 0], points[q, 1] - points[o, 1], points[q, 2] - points[o, 2]
        dx, dy, dz = points[r, 0] - points[o, 0], points[r, 1] - points[o, 1], points[r, 2] - points[o, 2]
        bb, cc, dd = bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz, dx * dx + dy * dy + dz * dz
        ux, uy, uz = cy * dz - cz * dy, cz * dx - cx * dz, cx * dy - cy * dx
        vx, vy, vz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
        wx, wy, wz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        twice = 2.0 * (bx * ux + by * uy + bz * uz)
        x = (bb * ux + cc * vx + dd * wx) / twice
        y = (bb * uy + cc * vy + dd * wy) / twice
        z = (bb * uz + cc * vz + dd * wz) / twice
        ex, ey, ez = points[e, 0] - points[o, 0] - x, points[e, 1] - points[o, 1] - y, points[e, 2] - points[o, 2] - z
        radius = math.sqrt(x * x + y * y + z * z)
        depth = 1.0 - math.sqrt(ex * ex + ey * ey + ez * ez) / radius
        most = depth if depth > most else most
    return most
