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

# The modes that mix each axis with the other two, in order: X_01, X_02, X_12.
_MIXED = np.array([[0, 1], [0, 2], [1, 2]])

# Factors of the two cross products in each derivative of the volume; see `hex_dimension`.
_CROSSED = np.array([[1, 2, 0, 1], [2, 0, 2, 0], [0, 1, 1, 2], [1, 0, 1, 2], [2, 2, 0, 0], [0, 1, 2, 1]])


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
    """Largest mixed mode over the shorter of its two axes, 0 where it vanishes; inf where all three axes do."""
    for i in range(LANES):
        longest2 = max(_square(tile.axis[0], i), _square(tile.axis[1], i), _square(tile.axis[2], i))
        out[i] = 0.0 if longest2 > 0.0 else np.inf
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

    The derivative along a direction is the axis plus the mixed modes times the other two coordinates, +-1/sqrt(3): 3 x 4
    vectors serve 8 points.
    """
    slope = np.empty((3, 2, 2, 3, LANES))  # direction, sign of the first and of the second other coordinate, xyz
    x, g = tile.x, 1.0 / math.sqrt(3.0)
    for d in range(3):
        twist = tile.work[0]
        for i in range(LANES):
            bottom = (x[1, d, i] - x[0, d, i]) - (x[2, d, i] - x[3, d, i])
            twist[i] = (0.25 / 3.0) * (bottom - ((x[5, d, i] - x[4, d, i]) - (x[6, d, i] - x[7, d, i])))
        for k in range(3):
            axis, first, second = tile.axis[k, d], tile.mode[_MIXED[k, 0], d], tile.mode[_MIXED[k, 1], d]
            a, b, c, e = slope[k, 0, 0, d], slope[k, 0, 1, d], slope[k, 1, 0, d], slope[k, 1, 1, d]
            for i in range(LANES):
                low, high = axis[i] - g * first[i], axis[i] + g * first[i]
                fall, rise = g * second[i] - twist[i], g * second[i] + twist[i]
                a[i], b[i], c[i], e[i] = low - fall, low + fall, high - rise, high + rise
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

    With the axes B and the mixed modes X of the trilinear map, V = [B1 B2 B3] + ([B1 X12 X13] + [X12 B2 X23] +
    [X13 X23 B3]) / 3. The signs that make modes of corners are orthogonal, so that the gradient by the modes has, but for
    a factor, the same norm.
    """
    b, m = tile.axis, tile.mode
    for i in range(LANES):
        out[i] = 0.0
    for r in range(6):
        # derivative by an axis: the other two, and a third of two modes; by a mode: a third of two mixed products
        share = 1.0 if r < 3 else 1.0 / 3.0
        p, q, s, t = _CROSSED[r, 0], _CROSSED[r, 1], _CROSSED[r, 2], _CROSSED[r, 3]
        u, v = (b[p], b[q]) if r < 3 else (m[p], b[q])
        w, z = (m[s], m[t]) if r < 3 else (b[s], m[t])
        for i in range(LANES):
            gx = share * (u[1, i] * v[2, i] - u[2, i] * v[1, i]) + (w[1, i] * z[2, i] - w[2, i] * z[1, i]) / 3.0
            gy = share * (u[2, i] * v[0, i] - u[0, i] * v[2, i]) + (w[2, i] * z[0, i] - w[0, i] * z[2, i]) / 3.0
            gz = share * (u[0, i] * v[1, i] - u[1, i] * v[0, i]) + (w[0, i] * z[1, i] - w[1, i] * z[0, i]) / 3.0
            out[i] += gx * gx + gy * gy + gz * gz
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        size = abs(tile.volume[i])
        sound = size > FLAT * longest2 * math.sqrt(longest2)
        out[i] = size / math.sqrt(out[i]) * tile.unit[i] if sound else 0.0
