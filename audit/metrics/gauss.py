"""Jacobian determinants of a hex at its 2x2x2 Gauss points: HyperMesh's Jacobian and a second way to the volume."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, axes, edges, quad_axes
from meshwright.audit.metrics.tile import LANES, Tile, stage, tile_kernel

__all__ = ["ROWS", "gauss"]

_G = 1.0 / math.sqrt(3.0)
"""Local coordinate of the two Gauss points of a line."""

# Of each direction, the two modes that mix it with the next ones and their other directions, in ascending order.
_MIXED = np.array([[0, 1], [0, 2], [1, 2]])


@stage
def gauss(tile: Tile, out: Lane) -> None:
    """Extremes and mean of the determinants; needs `axes`.

    The derivative along a direction does not depend on that direction's own coordinate, so 3 x 4 vectors serve all points.
    """
    x, axis, mode = tile.x, tile.axis, tile.mode
    slope = np.empty((3, 4, 3, LANES))  # direction, signs of the other two coordinates, xyz
    for d in range(3):
        hour_glass = mode[3, d]
        for i in range(LANES):
            front, back = x[1, d, i] - x[0, d, i], x[2, d, i] - x[3, d, i]
            front_up, back_up = x[5, d, i] - x[4, d, i], x[6, d, i] - x[7, d, i]
            hour_glass[i] = 0.25 * ((front - back) - (front_up - back_up))
        for k in range(3):
            a, first, second = axis[k, d], mode[_MIXED[k, 0], d], mode[_MIXED[k, 1], d]
            for i in range(LANES):
                both = hour_glass[i] * (_G * _G)
                low, high = a[i] - first[i] * _G, a[i] + first[i] * _G
                low_shift, high_shift = second[i] * _G - both, second[i] * _G + both
                slope[k, 0, d, i] = low - low_shift
                slope[k, 1, d, i] = low + low_shift
                slope[k, 2, d, i] = high - high_shift
                slope[k, 3, d, i] = high + high_shift
    least, most, mean = tile.gauss[0], tile.gauss[1], tile.gauss[2]
    for i in range(LANES):
        least[i], most[i], mean[i] = np.inf, 0.0, 0.0
    for point in range(8):
        r, s, t = point // 4, point // 2 % 2, point % 2
        u, v, w = slope[0, 2 * s + t], slope[1, 2 * r + t], slope[2, 2 * r + s]
        for i in range(LANES):
            j = (
                u[0, i] * (v[1, i] * w[2, i] - v[2, i] * w[1, i])
                + u[1, i] * (v[2, i] * w[0, i] - v[0, i] * w[2, i])
                + u[2, i] * (v[0, i] * w[1, i] - v[1, i] * w[0, i])
            )
            least[i] = min(least[i], j)
            most[i] = max(most[i], abs(j))
            mean[i] += 0.125 * j


@tile_kernel
def hex_jacobian(tile: Tile, out: Lane) -> None:
    """min J / max |J| at the Gauss points, 0 for a flat hex."""
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        flat = tile.gauss[1, i] <= FLAT * longest2 * math.sqrt(longest2)
        out[i] = tile.gauss[0, i] / tile.gauss[1, i] if not flat else 0.0


@tile_kernel
def quad_jacobian(tile: Tile, out: Lane) -> None:
    """min J / max |J| at the 2x2 Gauss points of a quadrilateral, J along its own normal.

    J = n . (X1 x X2) / 4 + r n . (X1 x T) / 2 + s n . (T x X2) / 2 with the bisectors X1, X2 and the hour-glass vector T.
    """
    a, t = tile.axis, tile.mode[3]
    for i in range(LANES):
        nx, ny, nz = (
            a[0, 1, i] * a[1, 2, i] - a[0, 2, i] * a[1, 1, i],
            a[0, 2, i] * a[1, 0, i] - a[0, 0, i] * a[1, 2, i],
            a[0, 0, i] * a[1, 1, i] - a[0, 1, i] * a[1, 0, i],
        )
        along_r = (
            nx * (a[0, 1, i] * t[2, i] - a[0, 2, i] * t[1, i])
            + ny * (a[0, 2, i] * t[0, i] - a[0, 0, i] * t[2, i])
            + nz * (a[0, 0, i] * t[1, i] - a[0, 1, i] * t[0, i])
        )
        along_s = (
            nx * (t[1, i] * a[1, 2, i] - t[2, i] * a[1, 1, i])
            + ny * (t[2, i] * a[1, 0, i] - t[0, i] * a[1, 2, i])
            + nz * (t[0, i] * a[1, 1, i] - t[1, i] * a[1, 0, i])
        )
        centre = nx * nx + ny * ny + nz * nz
        longest2 = tile.edge_range[1, i]
        swing = 2.0 * _G * (abs(along_r) + abs(along_s))
        flat = centre <= (FLAT * longest2) ** 2
        out[i] = (centre - swing) / (centre + swing) if not flat else 0.0


@tile_kernel
def gauss_volume(tile: Tile, out: Lane) -> None:
    """Mean determinant, which is the volume."""
    for i in range(LANES):
        out[i] = tile.gauss[2, i] * tile.unit[i] * tile.unit[i] * tile.unit[i]


ROWS = (
    Metric(
        id="hm.jacobian_gauss", title="Jacobian at Gauss points (HyperMesh)", on=("quad", "hex"), unit="1", low=-1.0, high=1.0,
        best="high", ideal=1.0, degenerate=0.0, systems=("HyperMesh: Jacobian (integration points)",),
        formula="min J / max |J| at the 2x2 (quad) or 2x2x2 (hex) Gauss points; of a quad J along its own normal",
        source="Altair HyperMesh help, element quality calculations; Jmin/max|J| so that a mirrored hex is -1",
        caveat="Kinder than the value at the corners: a hex folded at one corner can still be positive here. HyperMesh calls 0.7 acceptable.",
        kernel={"quad": quad_jacobian, "hex": hex_jacobian}, stages={"quad": (edges, quad_axes), "hex": (edges, axes, gauss)},
    ),
    Metric(
        id="volume_gauss2", title="Volume by Gauss integration", on=("hex",), unit="L3", low=-math.inf, high=math.inf,
        best="none", ideal=None, degenerate=0.0, systems=(),
        formula="sum of the Jacobian determinants at the 2x2x2 Gauss points",
        source="Gauss-Legendre quadrature, exact for trilinear hexes",
        caveat="A check of `volume`, found by another way: the two agree to rounding.",
        stages=(axes, gauss), kernel=gauss_volume,
    ),
)  # fmt: skip
"""Rows of this file."""
