"""Warp: the angle between the two triangles of a quadrilateral face."""

from __future__ import annotations

import numpy as np

from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.dihedral import SIDES
from meshwright.audit.metrics.stages import Lane, degrees
from meshwright.audit.metrics.tile import LANES, Tile, stage

__all__ = ["warps"]


@stage
def warps(tile: Tile, out: Lane) -> None:
    """Largest angle between the two triangles of a quadrilateral face, over both diagonals and all faces; needs `edges`.

    The product of the two normals points along the diagonal and has the length of the diagonal times the determinant of
    the face's three edges at a corner. Undefined where one of the triangles is flat.
    """
    quads, x, sides = tile.tables.quads, tile.x, SIDES[len(tile.tables.edges)]
    worst, margin = tile.work[0], tile.work[1]
    for i in range(LANES):
        worst[i], margin[i] = np.inf, np.inf
    for r in range(len(quads)):
        a, b, c, d = quads[r, 0], quads[r, 1], quads[r, 2], quads[r, 3]
        f = len(tile.tables.tris) + r
        ab, bc = tile.edge2[sides[f, 0]], tile.edge2[sides[f, 1]]
        cd, da = tile.edge2[sides[f, 2]], tile.edge2[sides[f, 3]]
        for i in range(LANES):
            ex, ey, ez = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
            fx, fy, fz = x[c, 0, i] - x[b, 0, i], x[c, 1, i] - x[b, 1, i], x[c, 2, i] - x[b, 2, i]
            gx, gy, gz = x[d, 0, i] - x[c, 0, i], x[d, 1, i] - x[c, 1, i], x[d, 2, i] - x[c, 2, i]
            hx, hy, hz = x[a, 0, i] - x[d, 0, i], x[a, 1, i] - x[d, 1, i], x[a, 2, i] - x[d, 2, i]
            # twice the area vectors of the triangles at the corners a, b, c and d
            ax, ay, az = hy * ez - hz * ey, hz * ex - hx * ez, hx * ey - hy * ex
            bx, by, bz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
            cx, cy, cz = fy * gz - fz * gy, fz * gx - fx * gz, fx * gy - fy * gx
            dx, dy, dz = gy * hz - gz * hy, gz * hx - gx * hz, gx * hy - gy * hx
            det = gx * bx + gy * by + gz * bz
            ac, bd = ax * cx + ay * cy + az * cz, bx * dx + by * dy + bz * dz
            px, py, pz = x[c, 0, i] - x[a, 0, i], x[c, 1, i] - x[a, 1, i], x[c, 2, i] - x[a, 2, i]
            qx, qy, qz = x[d, 0, i] - x[b, 0, i], x[d, 1, i] - x[b, 1, i], x[d, 2, i] - x[b, 2, i]
            p2, q2 = px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz
            across_p = bd * abs(bd) / (det * det * p2)
            across_q = ac * abs(ac) / (det * det * q2)
            worst[i] = min(worst[i], across_p, across_q)
            least = min(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz)
            least = min(least, cx * cx + cy * cy + cz * cz, dx * dx + dy * dy + dz * dz)
            longest2 = max(ab[i], bc[i], cd[i], da[i])
            margin[i] = min(margin[i], least - (2.0 * FLAT * longest2) ** 2)
    for i in range(LANES):
        tile.warp[i] = degrees(worst[i]) if margin[i] > 0.0 else np.nan
