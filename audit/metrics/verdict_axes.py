"""Verdict's metrics of quadrilaterals and hexes that follow from edges, faces and principal axes."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.stages import Lane
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel
from meshwright.audit.metrics.verdict_corners import CROSS

__all__ = [
    "hex_dimension",
    "hex_distortion",
    "hex_max_edge_ratio",
    "hex_taper",
    "quad_aspect_ratio",
    "quad_max_edge_ratio",
    "quad_radius_ratio",
    "quad_taper",
    "quad_warpage",
]

# Pairs of axes, and the mode that mixes them.
_PAIRS = np.array([[0, 1, 0], [0, 2, 1], [1, 2, 2]])

# The four edges of a hex along each local direction, as (from, to), ordered by the other two directions.
_PARALLEL = np.array(
    [
        [[0, 1], [3, 2], [4, 5], [7, 6]],
        [[0, 3], [1, 2], [4, 7], [5, 6]],
        [[0, 4], [1, 5], [3, 7], [2, 6]],
    ]
)
_NEAR = 0.5 - 0.5 / math.sqrt(3.0)
"""Place of the nearer of the two Gauss points on an edge of length 1."""


@inner
def _square(row, i):  # type: ignore[no-untyped-def]
    """Squared length of the vectors (3, L) at lane i."""
    return row[0, i] ** 2 + row[1, i] ** 2 + row[2, i] ** 2


@tile_kernel
def quad_taper(tile: Tile, out: Lane) -> None:
    """Hour-glass vector over half the shorter bisector."""
    for i in range(LANES):
        low2 = min(_square(tile.axis[0], i), _square(tile.axis[1], i))
        out[i] = 2.0 * math.sqrt(_square(tile.mode[3], i) / low2) if low2 > 0.0 else np.inf


@tile_kernel
def hex_taper(tile: Tile, out: Lane) -> None:
    """Largest mixed mode over the shorter of its two axes; 0 where both vanish."""
    for i in range(LANES):
        out[i] = 0.0
    for r in range(3):
        p, q, mode = tile.axis[_PAIRS[r, 0]], tile.axis[_PAIRS[r, 1]], tile.mode[_PAIRS[r, 2]]
        for i in range(LANES):
            mixed2 = _square(mode, i)
            share2 = mixed2 / min(_square(p, i), _square(q, i)) if mixed2 > 0.0 else 0.0
            out[i] = max(out[i], share2)
    for i in range(LANES):
        out[i] = math.sqrt(out[i])


@tile_kernel
def quad_max_edge_ratio(tile: Tile, out: Lane) -> None:
    """Longer over shorter bisector."""
    for i in range(LANES):
        p, q = _square(tile.axis[0], i), _square(tile.axis[1], i)
        out[i] = math.sqrt(max(p, q) / min(p, q)) if min(p, q) > 0.0 else np.inf


@tile_kernel
def hex_max_edge_ratio(tile: Tile, out: Lane) -> None:
    """Longest over shortest axis."""
    for i in range(LANES):
        p, q, r = _square(tile.axis[0], i), _square(tile.axis[1], i), _square(tile.axis[2], i)
        low = min(p, q, r)
        out[i] = math.sqrt(max(p, q, r) / low) if low > 0.0 else np.inf


@inner
def _normal(tile, k, i):  # type: ignore[no-untyped-def]
    """Cross product of the two edges at corner k of a quadrilateral."""
    x, a, b = tile.x, (k + 1) % 4, (k + 3) % 4
    ux, uy, uz = x[a, 0, i] - x[k, 0, i], x[a, 1, i] - x[k, 1, i], x[a, 2, i] - x[k, 2, i]
    vx, vy, vz = x[b, 0, i] - x[k, 0, i], x[b, 1, i] - x[k, 1, i], x[b, 2, i] - x[k, 2, i]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@tile_kernel
def quad_warpage(tile: Tile, out: Lane) -> None:
    """Cube of the smaller cosine between the normals of opposite corners; nan where one is undefined."""
    for i in range(LANES):
        out[i] = np.inf
    for k in range(2):
        for i in range(LANES):
            ax, ay, az = _normal(tile, k, i)
            bx, by, bz = _normal(tile, k + 2, i)
            a2, b2 = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
            flat = FLAT * tile.edge_range[1, i]
            cosine = (ax * bx + ay * by + az * bz) / (math.sqrt(a2) * math.sqrt(b2))
            cosine = cosine if min(a2, b2) > flat * flat else np.nan
            out[i] = cosine if cosine < out[i] or cosine != cosine else out[i]
    for i in range(LANES):
        out[i] = out[i] * out[i] * out[i]


@tile_kernel
def quad_aspect_ratio(tile: Tile, out: Lane) -> None:
    """Longest edge times perimeter over four times the area."""
    e = tile.edge2
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        around = math.sqrt(e[0, i]) + math.sqrt(e[1, i]) + math.sqrt(e[2, i]) + math.sqrt(e[3, i])
        area = math.sqrt(_square(tile.face[0], i))
        out[i] = math.sqrt(longest2) * around / (4.0 * area) if area > FLAT * longest2 else np.inf


@tile_kernel
def quad_radius_ratio(tile: Tile, out: Lane) -> None:
    """Root of the summed squared edges times the longest edge or diagonal, over sqrt(8) the smallest corner parallelogram."""
    e = tile.edge2
    for i in range(LANES):
        longest2 = max(tile.edge_range[1, i], tile.diagonal_range[1, i])
        around = math.sqrt(e[0, i] + e[1, i] + e[2, i] + e[3, i])
        least = tile.corner[CROSS, i]
        sound = least > FLAT * tile.edge_range[1, i]
        out[i] = around * math.sqrt(longest2) / (math.sqrt(8.0) * least) if sound else np.inf


@tile_kernel
def hex_distortion(tile: Tile, out: Lane) -> None:
    """Smallest J, of the map from the unit cube, at the corners and the 2x2x2 Gauss points, over the volume; 0 when flat.

    The derivative along a direction does not depend on that direction's own coordinate: 3 x 4 vectors serve 8 points.
    """
    slope = np.empty((3, 2, 2, 3, LANES))  # direction, first and second other coordinate, xyz
    x, near, far = tile.x, 1.0 - _NEAR, _NEAR
    for k in range(3):
        for d in range(3):
            p, q = x[_PARALLEL[k, 0, 0], d], x[_PARALLEL[k, 0, 1], d]
            r, s = x[_PARALLEL[k, 1, 0], d], x[_PARALLEL[k, 1, 1], d]
            t, u = x[_PARALLEL[k, 2, 0], d], x[_PARALLEL[k, 2, 1], d]
            v, w = x[_PARALLEL[k, 3, 0], d], x[_PARALLEL[k, 3, 1], d]
            a, b, c, e = slope[k, 0, 0, d], slope[k, 1, 0, d], slope[k, 0, 1, d], slope[k, 1, 1, d]
            for i in range(LANES):
                first, second, third, fourth = q[i] - p[i], s[i] - r[i], u[i] - t[i], w[i] - v[i]
                low0, low1 = near * first + far * second, far * first + near * second
                high0, high1 = near * third + far * fourth, far * third + near * fourth
                a[i], b[i] = near * low0 + far * high0, near * low1 + far * high1
                c[i], e[i] = far * low0 + near * high0, far * low1 + near * high1
    for i in range(LANES):
        out[i] = tile.jacobian_range[0, i]
    for point in range(8):
        r, s, t = point // 4, point // 2 % 2, point % 2
        u, v, w = slope[0, s, t], slope[1, r, t], slope[2, r, s]
        for i in range(LANES):
            j = (
                u[0, i] * (v[1, i] * w[2, i] - v[2, i] * w[1, i])
                + u[1, i] * (v[2, i] * w[0, i] - v[0, i] * w[2, i])
                + u[2, i] * (v[0, i] * w[1, i] - v[1, i] * w[0, i])
            )
            out[i] = min(out[i], j)
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        size = abs(tile.volume[i])
        out[i] = out[i] / size if size > FLAT * longest2 * math.sqrt(longest2) else 0.0


@tile_kernel
def hex_dimension(tile: Tile, out: Lane) -> None:
    """V over sqrt(2) times the norm of its gradient by the coordinates of the corners; 0 when flat.

    The gradient at a corner is the area vector of its share of the faces. On a bilinear face with corners a, b, c, d the
    share of a is (2 ab + dc) x (2 ad + bc) / 36: the integral of the shape function of a times the normal.
    """
    quads, x = tile.tables.quads, tile.x
    gradient = np.zeros((8, 3, LANES))
    for r in range(6):
        for k in range(4):
            a, b, c, d = quads[r, k], quads[r, (k + 1) % 4], quads[r, (k + 2) % 4], quads[r, (k + 3) % 4]
            g = gradient[a]
            for i in range(LANES):
                ux = 2.0 * (x[b, 0, i] - x[a, 0, i]) + (x[c, 0, i] - x[d, 0, i])
                uy = 2.0 * (x[b, 1, i] - x[a, 1, i]) + (x[c, 1, i] - x[d, 1, i])
                uz = 2.0 * (x[b, 2, i] - x[a, 2, i]) + (x[c, 2, i] - x[d, 2, i])
                vx = 2.0 * (x[d, 0, i] - x[a, 0, i]) + (x[c, 0, i] - x[b, 0, i])
                vy = 2.0 * (x[d, 1, i] - x[a, 1, i]) + (x[c, 1, i] - x[b, 1, i])
                vz = 2.0 * (x[d, 2, i] - x[a, 2, i]) + (x[c, 2, i] - x[b, 2, i])
                g[0, i] += uy * vz - uz * vy
                g[1, i] += uz * vx - ux * vz
                g[2, i] += ux * vy - uy * vx
    for i in range(LANES):
        out[i] = 0.0
    for r in range(8):
        for i in range(LANES):
            out[i] += _square(gradient[r], i)
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        size = abs(tile.volume[i])
        sound = size > FLAT * longest2 * math.sqrt(longest2)
        out[i] = 36.0 * size / math.sqrt(2.0 * out[i]) * tile.unit[i] if sound else 0.0
