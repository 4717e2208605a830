"""Stages of Verdict's metrics: extremes over the corners of a quadrilateral, a wedge, a hex.

Every number is free of units before it is raised to a power, so that no product under- or overflows. Powers stay
integer: roots are taken of the extremes, once per cell.

Rows of `tile.corner`, J being the determinant of the edges that leave a corner (of a quadrilateral their cross product
along the mean normal), e the edges, F the Frobenius norm:

row  hex and wedge                          quadrilateral
0    min J / prod |e|                       min J / prod |e|
1    min J^2 / (sum e^2)^3, 0 for J <= 0    min J / (sum e^2), 0 for J <= 0
2    max F(A) F(A^-1), inf for J <= 0       max (sum e^2) / |e1 x e2|
3    sum F(A) F(A^-1)                       sum (sum e^2) / |e1 x e2|
4    max cube of Oddy's number, with the centre     max of Oddy's number
5    J / prod |e| of the axes at the centre min J
6                                           min |e1 x e2|

Rows 2 to 5 of a wedge are not used: Verdict has other rules there. A corner is flat, and J counts as 0, when J is
below `FLAT` times the cube (square) of the longest edge.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.stages import Lane
from meshwright.audit.metrics.tile import LANES, Tile, stage

__all__ = [
    "CENTRE",
    "CONDITION",
    "CROSS",
    "JACOBIAN",
    "ODDY",
    "SCALED",
    "SHAPE",
    "SUM",
    "hex_corners",
    "quad_corners",
    "wedge_corners",
]

SCALED, SHAPE, CONDITION, SUM, ODDY, CENTRE = 0, 1, 2, 3, 4, 5
JACOBIAN, CROSS = 5, 6


@inner
def _gram(ux, uy, uz, vx, vy, vz, wx, wy, wz):  # type: ignore[no-untyped-def]
    """Squared lengths, their sum's inverse (0 for 0), determinant, of three vectors; and the two squares of the above.

    Returns (uu, vv, ww, inverse, J, +-J^2 / sum^3, +-J^2 / (uu vv ww)).
    """
    uu, vv, ww = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    total = uu + vv + ww
    inverse = 1.0 / total if total > 0.0 else 0.0
    j = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
    part = j * inverse
    share = part * abs(part) * inverse
    product = (uu * inverse) * (vv * inverse) * (ww * inverse)
    scaled = share / product if product > 0.0 else 0.0
    return uu, vv, ww, inverse, j, share, scaled


@inner
def _oddy_cubed(ux, uy, uz, vx, vy, vz, wx, wy, wz, uu, vv, ww, inverse, over):  # type: ignore[no-untyped-def]
    """Cube of Oddy's number (|G|^2 - tr(G)^2 / 3) / J^(4/3), G the metric tensor; the numerator as a sum of squares."""
    uv, vw, wu = ux * vx + uy * vy + uz * vz, vx * wx + vy * wy + vz * wz, wx * ux + wy * uy + wz * uz
    a, b, c = (uu - vv) * inverse, (vv - ww) * inverse, (ww - uu) * inverse
    uv, vw, wu = uv * inverse, vw * inverse, wu * inverse
    n = (a * a + b * b + c * c) / 3.0 + 2.0 * (uv * uv + vw * vw + wu * wu)
    return n * n * n * over * over


@stage
def hex_corners(tile: Tile, out: Lane) -> None:
    """Rows 0 to 5; needs `edges` and `axes`."""
    triads, x, c, flat = tile.tables.triads, tile.x, tile.corner, tile.work[0]
    for i in range(LANES):
        c[SCALED, i], c[SHAPE, i], c[CONDITION, i], c[SUM, i], c[ODDY, i] = np.inf, np.inf, 0.0, 0.0, 0.0
        longest2 = tile.edge_range[1, i]
        flat[i] = FLAT * longest2 * math.sqrt(longest2)
    for r in range(len(triads)):
        o, a, b, d = triads[r, 0], triads[r, 1], triads[r, 2], triads[r, 3]
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[o, 0, i], x[a, 1, i] - x[o, 1, i], x[a, 2, i] - x[o, 2, i]
            vx, vy, vz = x[b, 0, i] - x[o, 0, i], x[b, 1, i] - x[o, 1, i], x[b, 2, i] - x[o, 2, i]
            wx, wy, wz = x[d, 0, i] - x[o, 0, i], x[d, 1, i] - x[o, 1, i], x[d, 2, i] - x[o, 2, i]
            uu, vv, ww, inverse, j, share, scaled = _gram(ux, uy, uz, vx, vy, vz, wx, wy, wz)
            sound, over = j > flat[i], 1.0 / share
            px, py, pz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            qx, qy, qz = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
            rx, ry, rz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
            areas = px * px + py * py + pz * pz + qx * qx + qy * qy + qz * qz + rx * rx + ry * ry + rz * rz
            condition = math.sqrt(areas * inverse * inverse * over) if sound else np.inf
            cubed = _oddy_cubed(ux, uy, uz, vx, vy, vz, wx, wy, wz, uu, vv, ww, inverse, over)
            cubed = cubed if sound else np.inf
            c[SCALED, i] = min(c[SCALED, i], scaled)
            c[SHAPE, i] = min(c[SHAPE, i], share if sound else 0.0)
            c[CONDITION, i] = max(c[CONDITION, i], condition)
            c[SUM, i] += condition
            c[ODDY, i] = max(c[ODDY, i], cubed)
    b1, b2, b3 = tile.axis[0], tile.axis[1], tile.axis[2]
    for i in range(LANES):
        ux, uy, uz, vx, vy, vz = b1[0, i], b1[1, i], b1[2, i], b2[0, i], b2[1, i], b2[2, i]
        wx, wy, wz = b3[0, i], b3[1, i], b3[2, i]
        uu, vv, ww, inverse, j, share, scaled = _gram(ux, uy, uz, vx, vy, vz, wx, wy, wz)
        cubed = _oddy_cubed(ux, uy, uz, vx, vy, vz, wx, wy, wz, uu, vv, ww, inverse, 1.0 / share)
        c[ODDY, i] = max(c[ODDY, i], cubed if j > flat[i] else np.inf)
        c[CENTRE, i] = math.copysign(math.sqrt(abs(scaled)), scaled)
    for i in range(LANES):
        c[SCALED, i] = math.copysign(math.sqrt(abs(c[SCALED, i])), c[SCALED, i])


@stage
def wedge_corners(tile: Tile, out: Lane) -> None:
    """Rows 0 and 1; needs `edges`."""
    triads, x, c, flat = tile.tables.triads, tile.x, tile.corner, tile.work[0]
    for i in range(LANES):
        c[SCALED, i], c[SHAPE, i] = np.inf, np.inf
        longest2 = tile.edge_range[1, i]
        flat[i] = FLAT * longest2 * math.sqrt(longest2)
    for r in range(len(triads)):
        o, a, b, d = triads[r, 0], triads[r, 1], triads[r, 2], triads[r, 3]
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[o, 0, i], x[a, 1, i] - x[o, 1, i], x[a, 2, i] - x[o, 2, i]
            vx, vy, vz = x[b, 0, i] - x[o, 0, i], x[b, 1, i] - x[o, 1, i], x[b, 2, i] - x[o, 2, i]
            wx, wy, wz = x[d, 0, i] - x[o, 0, i], x[d, 1, i] - x[o, 1, i], x[d, 2, i] - x[o, 2, i]
            _, _, _, _, j, share, scaled = _gram(ux, uy, uz, vx, vy, vz, wx, wy, wz)
            c[SCALED, i] = min(c[SCALED, i], scaled)
            c[SHAPE, i] = min(c[SHAPE, i], share if j > flat[i] else 0.0)
    for i in range(LANES):
        c[SCALED, i] = math.copysign(math.sqrt(abs(c[SCALED, i])), c[SCALED, i])


@stage
def quad_corners(tile: Tile, out: Lane) -> None:
    """Rows 0 to 6; needs `edges` and `faces`. The mean normal of a flat quadrilateral is taken as 0."""
    x, c, mean, flat = tile.x, tile.corner, tile.work[:3], tile.work[3]
    for i in range(LANES):
        c[SCALED, i], c[SHAPE, i], c[CONDITION, i], c[SUM, i], c[ODDY, i] = np.inf, np.inf, 0.0, 0.0, 0.0
        c[JACOBIAN, i], c[CROSS, i] = np.inf, np.inf
        nx, ny, nz = tile.face[0, 0, i], tile.face[0, 1, i], tile.face[0, 2, i]
        n = math.sqrt(nx * nx + ny * ny + nz * nz)
        flat[i] = FLAT * tile.edge_range[1, i]
        over = 1.0 / n if n > flat[i] else 0.0
        mean[0, i], mean[1, i], mean[2, i] = nx * over, ny * over, nz * over
    for k in range(4):
        o, a, b = k, (k + 1) % 4, (k + 3) % 4
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[o, 0, i], x[a, 1, i] - x[o, 1, i], x[a, 2, i] - x[o, 2, i]
            vx, vy, vz = x[b, 0, i] - x[o, 0, i], x[b, 1, i] - x[o, 1, i], x[b, 2, i] - x[o, 2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            j = nx * mean[0, i] + ny * mean[1, i] + nz * mean[2, i]
            uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
            n2 = nx * nx + ny * ny + nz * nz
            n = math.sqrt(n2)
            sound, total = n > flat[i], uu + vv
            frobenius = total / n if sound else np.inf
            oddy = ((uu - vv) * (uu - vv) + 4.0 * uv * uv) / (2.0 * n2) if sound else np.inf
            c[SCALED, i] = min(c[SCALED, i], j / math.sqrt(uu * vv) if uu * vv > 0.0 else 0.0)
            c[SHAPE, i] = min(c[SHAPE, i], j / total if j > flat[i] else 0.0)
            c[CONDITION, i] = max(c[CONDITION, i], frobenius)
            c[SUM, i] += frobenius
            c[ODDY, i] = max(c[ODDY, i], oddy)
            c[JACOBIAN, i] = min(c[JACOBIAN, i], j)
            c[CROSS, i] = min(c[CROSS, i], n)
