"""Numbers built on a cell's principal axes: mid-angle skew, taper, warpage."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, axes, quad_axes
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]

_ON = ("quad", "hex")
# Pairs of axes, and of a mode with an axis: mode 0 mixes axes 0 and 1, mode 1 axes 0 and 2, mode 2 axes 1 and 2; mode 3 is
# the hour-glass vector of a quadrilateral.
_QUAD_AXES, _HEX_AXES = np.array([[0, 1]]), np.array([[0, 1], [0, 2], [1, 2]])
_QUAD_SHARES, _HEX_SHARES = np.array([[3, 0], [3, 1]]), np.array([[0, 0], [0, 1], [1, 0], [1, 2], [2, 1], [2, 2]])


@inner
def _largest_cosine(tile, pairs, out):  # type: ignore[no-untyped-def]
    """Largest |cos| of the angles between these pairs of axes, 1 when an axis vanishes."""
    a = tile.axis
    for i in range(LANES):
        out[i] = 0.0
    for r in range(len(pairs)):
        k, m = pairs[r, 0], pairs[r, 1]
        for i in range(LANES):
            dot = a[k, 0, i] * a[m, 0, i] + a[k, 1, i] * a[m, 1, i] + a[k, 2, i] * a[m, 2, i]
            k2 = a[k, 0, i] ** 2 + a[k, 1, i] ** 2 + a[k, 2, i] ** 2
            m2 = a[m, 0, i] ** 2 + a[m, 1, i] ** 2 + a[m, 2, i] ** 2
            cosine = abs(dot) / math.sqrt(k2 * m2) if k2 * m2 > 0.0 else 1.0
            out[i] = max(out[i], cosine)


@tile_kernel
def quad_midangle(tile: Tile, out: Lane) -> None:
    """|cos| of the angle between the bisectors."""
    _largest_cosine(tile, _QUAD_AXES, out)


@tile_kernel
def hex_midangle(tile: Tile, out: Lane) -> None:
    """Largest |cos| of the angles between the three axes."""
    _largest_cosine(tile, _HEX_AXES, out)


@inner
def _largest_share(tile, pairs, out):  # type: ignore[no-untyped-def]
    """Largest |mode . axis| / axis^2 over these pairs, 0 along an axis that vanishes."""
    t, a = tile.mode, tile.axis
    for i in range(LANES):
        out[i] = 0.0
    for r in range(len(pairs)):
        m, k = pairs[r, 0], pairs[r, 1]
        for i in range(LANES):
            dot = abs(t[m, 0, i] * a[k, 0, i] + t[m, 1, i] * a[k, 1, i] + t[m, 2, i] * a[k, 2, i])
            a2 = a[k, 0, i] ** 2 + a[k, 1, i] ** 2 + a[k, 2, i] ** 2
            share = dot / a2 if a2 > 0.0 else 0.0
            out[i] = max(out[i], share)


@tile_kernel
def quad_taper(tile: Tile, out: Lane) -> None:
    """Hour-glass vector along a bisector, over half that bisector."""
    _largest_share(tile, _QUAD_SHARES, out)
    for i in range(LANES):
        out[i] *= 2.0


@tile_kernel
def hex_taper(tile: Tile, out: Lane) -> None:
    """Largest mixed mode X_kl along one of its own two axes."""
    _largest_share(tile, _HEX_SHARES, out)


@tile_kernel
def warpage(tile: Tile, out: Lane) -> None:
    """Distance of the corners from the mean plane over the shorter bisector; worst face of a hex."""
    quads, x = tile.tables.quads, tile.x
    for i in range(LANES):
        out[i] = 0.0
    for r in range(len(quads)):
        p, q, s, t = quads[r, 0], quads[r, 1], quads[r, 2], quads[r, 3]
        for i in range(LANES):
            # twice the bisectors and four times the hour-glass vector: the factors cancel to 1/2 below
            ax = (x[q, 0, i] - x[p, 0, i]) + (x[s, 0, i] - x[t, 0, i])
            ay = (x[q, 1, i] - x[p, 1, i]) + (x[s, 1, i] - x[t, 1, i])
            az = (x[q, 2, i] - x[p, 2, i]) + (x[s, 2, i] - x[t, 2, i])
            bx = (x[s, 0, i] - x[q, 0, i]) + (x[t, 0, i] - x[p, 0, i])
            by = (x[s, 1, i] - x[q, 1, i]) + (x[t, 1, i] - x[p, 1, i])
            bz = (x[s, 2, i] - x[q, 2, i]) + (x[t, 2, i] - x[p, 2, i])
            hx = (x[p, 0, i] - x[q, 0, i]) + (x[s, 0, i] - x[t, 0, i])
            hy = (x[p, 1, i] - x[q, 1, i]) + (x[s, 1, i] - x[t, 1, i])
            hz = (x[p, 2, i] - x[q, 2, i]) + (x[s, 2, i] - x[t, 2, i])
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            a2, b2, n2 = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, nx * nx + ny * ny + nz * nz
            value = 0.5 * abs(hx * nx + hy * ny + hz * nz) / math.sqrt(n2 * min(a2, b2))
            value = value if n2 > (FLAT * max(a2, b2)) ** 2 else np.nan
            out[i] = value if value > out[i] or value != value else out[i]


ROWS = (
    Metric(
        id="gambit.midangle_skew", title="Mid-angle skew", on=_ON, unit="1", low=0.0, high=1.0, best="low", ideal=0.0,
        degenerate=1.0, systems=("GAMBIT: MidAngle Skew", "Verdict: skew"),
        formula="quad |cos(X1, X2)| of the bisectors; hex: largest |cos| between the lines through opposite face centres",
        source="GAMBIT 2 User's Guide 3.4; Verdict manual (skew)",
        kernel={"quad": quad_midangle, "hex": hex_midangle}, stages={"quad": (quad_axes,), "hex": (axes,)},
    ),
    Metric(
        id="gambit.taper", title="Taper", on=_ON, unit="1", low=0.0, high=1.0, best="low", ideal=0.0, degenerate=1.0,
        systems=("GAMBIT: Taper",),
        formula="quad: max_k 2|T.Xk|/Xk^2, T the hour-glass vector; hex: max |X_kl.B_m|/B_m^2, m in {k, l}",
        source="GAMBIT 2 User's Guide 3.4 (words); normalised by half the bisector so that a quad collapsed to a triangle is 1",
        kernel={"quad": quad_taper, "hex": hex_taper}, stages={"quad": (quad_axes,), "hex": (axes,)},
    ),
    Metric(
        id="gambit.warpage", title="Warpage", on=_ON, unit="1", low=0.0, high=1.0, best="low", ideal=0.0,
        degenerate=math.nan, systems=("GAMBIT: Warpage",),
        formula="Z / min(|X1|, |X2|), Z the distance of the corners from the mean plane; hex: worst face",
        source="GAMBIT 2 User's Guide 3.4 (quads); the hex rule is ours",
        caveat="Not Verdict's or ICEM CFD's warpage: those are a cosine (1 best) and an angle in degrees.",
        kernel=warpage,
    ),
)  # fmt: skip
