"""Shapes of faces as FEA systems look at them: mid-lines, opposite edges, medians. Shared by several families."""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.metrics.stages import Lane
from meshwright.audit.metrics.tile import LANES, Tile, stage

__all__ = [
    "ASPECT",
    "BROKEN",
    "COLLAPSED",
    "PARALLEL",
    "SKEW",
    "SKEWLESS",
    "face_shapes",
    "flattened",
    "opposite",
    "triangle_aspect2",
]

ASPECT, SKEW, PARALLEL, COLLAPSED, BROKEN, SKEWLESS = 0, 1, 2, 3, 4, 5
"""Rows of `Tile.face_shape`.

ASPECT: square of MAPDL's aspect ratio, the worst face.  SKEW: square of the tangent of the skew angle, the worst face.
PARALLEL: signed square of the cotangent between opposite edges, the smallest.  COLLAPSED: quadrilaterals with two
opposite edges of no length, which are lines.  BROKEN: quadrilaterals where one edge of a pair has no length, and points.
SKEWLESS: faces without a skew angle.
"""

_PARALLEL_SINE2 = 1e-28
"""Two edges span no triangle when the square of the sine between them is below this: the flat test of areas, squared."""


@inner
def triangle_aspect2(p, q, r, area2):  # type: ignore[no-untyped-def]
    """Square of MAPDL's aspect ratio of a triangle, by its squared edges and its squared area; inf when it is flat.

    Of the rectangles on a median m and the line s between the other two middles (|m x s| is the area A) the longest is
    m^2 / A on the longest median, since m^2 s^2 >= A^2 and the longest median is not shorter than any s.
    """
    median2 = 0.25 * (2.0 * (p + q + r) - 3.0 * min(p, q, r))
    return median2 * median2 / (3.0 * area2) if area2 > 0.0 else np.inf


@kernel(no_cpython_wrapper=True, forceinline=True)
def opposite(ux, uy, uz, vx, vy, vz):  # type: ignore[no-untyped-def]
    """Signed square of the cotangent between two edges; nan where either has no length."""
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    dot = ux * vx + uy * vy + uz * vz
    return dot * abs(dot) / (nx * nx + ny * ny + nz * nz)


@stage
def face_shapes(tile: Tile, out: Lane) -> None:
    """Extremes over the faces, in the rows named above.

    A quadrilateral collapsed to a line has no shape and is left out of the first three rows. Of the four rectangles on
    the mid-lines X1, X2 of a quadrilateral (|X1 x X2| is the area A) the longest is max(X1^2, X2^2) / A.
    """
    tris, quads, x, shape = tile.tables.tris, tile.tables.quads, tile.x, tile.face_shape
    for i in range(LANES):
        shape[ASPECT, i], shape[SKEW, i], shape[PARALLEL, i] = 0.0, 0.0, np.inf
        shape[COLLAPSED, i], shape[BROKEN, i], shape[SKEWLESS, i] = 0.0, 0.0, 0.0
    for f in range(len(tris)):
        a, b, c = tris[f, 0], tris[f, 1], tris[f, 2]
        for i in range(LANES):
            ux, uy, uz = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
            vx, vy, vz = x[c, 0, i] - x[b, 0, i], x[c, 1, i] - x[b, 1, i], x[c, 2, i] - x[b, 2, i]
            wx, wy, wz = x[a, 0, i] - x[c, 0, i], x[a, 1, i] - x[c, 1, i], x[a, 2, i] - x[c, 2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            p, q, r = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
            area2 = 0.25 * (nx * nx + ny * ny + nz * nz)
            low, high = min(p, q, r), max(p, q, r)
            # a median and the line between the other two middles: dot product (q - p) / 4, cross product A
            skew = 0.0625 * (high - low) * (high - low) / area2
            aspect = triangle_aspect2(p, q, r, area2)
            skew = skew if low > 0.0 else 0.0
            shape[ASPECT, i] = aspect if aspect > shape[ASPECT, i] else shape[ASPECT, i]
            shape[SKEW, i] = skew if skew > shape[SKEW, i] else shape[SKEW, i]
            shape[SKEWLESS, i] += 0.0 if low > 0.0 else 1.0
    for f in range(len(quads)):
        a, b, c, d = quads[f, 0], quads[f, 1], quads[f, 2], quads[f, 3]
        for i in range(LANES):
            # u, v and p, q are the pairs of opposite edges, their sums twice the mid-lines, X x Y four times the area
            ux, uy, uz = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
            vx, vy, vz = x[c, 0, i] - x[d, 0, i], x[c, 1, i] - x[d, 1, i], x[c, 2, i] - x[d, 2, i]
            px, py, pz = x[d, 0, i] - x[a, 0, i], x[d, 1, i] - x[a, 1, i], x[d, 2, i] - x[a, 2, i]
            qx, qy, qz = x[c, 0, i] - x[b, 0, i], x[c, 1, i] - x[b, 1, i], x[c, 2, i] - x[b, 2, i]
            ax, ay, az, bx, by, bz = ux + vx, uy + vy, uz + vz, px + qx, py + qy, pz + qz
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            a2, b2, n2 = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, nx * nx + ny * ny + nz * nz
            dot = ax * bx + ay * by + az * bz
            first, second = opposite(ux, uy, uz, vx, vy, vz), opposite(px, py, pz, qx, qy, qz)
            # neither edge of a pair has a length: no direction that could differ
            no_first = abs(ux) + abs(uy) + abs(uz) + abs(vx) + abs(vy) + abs(vz) == 0.0
            no_second = abs(px) + abs(py) + abs(pz) + abs(qx) + abs(qy) + abs(qz) == 0.0
            line = no_first or no_second
            high = max(a2, b2)
            aspect = high * high / n2 if n2 > 0.0 else np.inf
            aspect = 0.0 if line else aspect
            skew = dot * dot / n2
            sound = skew == skew
            skew = skew if sound else 0.0
            shape[ASPECT, i] = aspect if aspect > shape[ASPECT, i] else shape[ASPECT, i]
            shape[SKEW, i] = skew if skew > shape[SKEW, i] else shape[SKEW, i]
            least = shape[PARALLEL, i]
            least = first if first < least else least
            shape[PARALLEL, i] = second if second < least else least
            shape[COLLAPSED, i] += 1.0 if line else 0.0
            broken = (first != first) != no_first or (second != second) != no_second or (no_first and no_second)
            shape[BROKEN, i] += 1.0 if broken else 0.0
            shape[SKEWLESS, i] += 0.0 if sound else 1.0


@inner
def flattened(tile, i):  # type: ignore[no-untyped-def]
    """Whether the quadrilaterals around one direction of a hex are lines but not all of its faces: no direction there."""
    lines = tile.face_shape[COLLAPSED, i]
    return 4.0 <= lines < 6.0
