"""ICEM CFD's determinants: smallest over largest Jacobian at the corners, and at 27 points of a hex."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, faces, jacobians
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]


@tile_kernel
def corner_determinant(tile: Tile, out: Lane) -> None:
    """min J / max |J| over the corners."""
    _ratio(tile, tile.jacobian_range[0], tile.jacobian_range[1], out)


@tile_kernel
def _ratio(tile, low, high, out):  # type: ignore[no-untyped-def]
    """low / high; 0 for a flat cell."""
    extent = tile.work[2]
    for i in range(LANES):
        extent[i] = 0.0
    for j in range(1, len(tile.x)):
        for i in range(LANES):
            extent[i] = max(extent[i], tile.x[j, 0, i] ** 2 + tile.x[j, 1, i] ** 2 + tile.x[j, 2, i] ** 2)
    for i in range(LANES):
        flat = high[i] <= FLAT * extent[i] * math.sqrt(extent[i])
        out[i] = low[i] / high[i] if not flat else 0.0


@tile_kernel
def quad_determinant(tile: Tile, out: Lane) -> None:
    """min J / max |J| over the corners, J signed by the quadrilateral's own normal."""
    x, normal = tile.x, tile.face[0]
    low, high = tile.work[0], tile.work[1]
    for i in range(LANES):
        low[i], high[i] = np.inf, 0.0
    for k in range(4):
        o, a, b = k, (k + 1) % 4, (k + 3) % 4
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[o, 0, i], x[a, 1, i] - x[o, 1, i], x[a, 2, i] - x[o, 2, i]
            vx, vy, vz = x[b, 0, i] - x[o, 0, i], x[b, 1, i] - x[o, 1, i], x[b, 2, i] - x[o, 2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            j = nx * normal[0, i] + ny * normal[1, i] + nz * normal[2, i]
            low[i] = min(low[i], j)
            high[i] = max(high[i], abs(j))
    for i in range(LANES):
        out[i] = low[i] / high[i] if high[i] > 0.0 else 0.0


@tile_kernel
def _mean(a, b, out):  # type: ignore[no-untyped-def]
    """Half the sum of two (3, L) vectors."""
    for d in range(3):
        for i in range(LANES):
            out[d, i] = 0.5 * (a[d, i] + b[d, i])


@tile_kernel
def _difference(tile, a, b, out):  # type: ignore[no-untyped-def]
    """The edge from corner a to corner b."""
    for d in range(3):
        for i in range(LANES):
            out[d, i] = tile.x[b, d, i] - tile.x[a, d, i]


@tile_kernel
def determinant_27(tile: Tile, out: Lane) -> None:
    """min J / max |J| at the points r, s, t in {-1, 0, 1}; the eight corners are done already.

    The derivative along a direction does not depend on that direction's own coordinate: along r it takes 9 values,
    and for each r there are 3 along s and 3 along t, all means of the hex's edges.
    """
    along_r = np.empty((3, 3, 3, LANES))  # s, t, xyz
    along_s, along_t = np.empty((3, 3, LANES)), np.empty((3, 3, LANES))  # t (of s), xyz
    _difference(tile, 0, 1, along_r[0, 0])
    _difference(tile, 3, 2, along_r[2, 0])
    _difference(tile, 4, 5, along_r[0, 2])
    _difference(tile, 7, 6, along_r[2, 2])
    for t in range(0, 3, 2):
        _mean(along_r[0, t], along_r[2, t], along_r[1, t])
    for s in range(3):
        _mean(along_r[s, 0], along_r[s, 2], along_r[s, 1])
    low, high = tile.work[0], tile.work[1]
    for i in range(LANES):
        low[i], high[i] = tile.jacobian_range[0, i], tile.jacobian_range[1, i]
    for r in range(3):
        if r == 0:
            _difference(tile, 0, 3, along_s[0])
            _difference(tile, 4, 7, along_s[2])
            _difference(tile, 0, 4, along_t[0])
            _difference(tile, 3, 7, along_t[2])
        elif r == 2:
            _difference(tile, 1, 2, along_s[0])
            _difference(tile, 5, 6, along_s[2])
            _difference(tile, 1, 5, along_t[0])
            _difference(tile, 2, 6, along_t[2])
        else:
            for d in range(3):
                for i in range(LANES):
                    x = tile.x[:, d, i]
                    along_s[0, d, i] = 0.5 * ((x[3] - x[0]) + (x[2] - x[1]))
                    along_s[2, d, i] = 0.5 * ((x[7] - x[4]) + (x[6] - x[5]))
                    along_t[0, d, i] = 0.5 * ((x[4] - x[0]) + (x[5] - x[1]))
                    along_t[2, d, i] = 0.5 * ((x[7] - x[3]) + (x[6] - x[2]))
        _mean(along_s[0], along_s[2], along_s[1])
        _mean(along_t[0], along_t[2], along_t[1])
        for s in range(3):
            for t in range(3):
                if r != 1 and s != 1 and t != 1:
                    continue
                u, v, w = along_r[s, t], along_s[t], along_t[s]
                for i in range(LANES):
                    j = (
                        u[0, i] * (v[1, i] * w[2, i] - v[2, i] * w[1, i])
                        + u[1, i] * (v[2, i] * w[0, i] - v[0, i] * w[2, i])
                        + u[2, i] * (v[0, i] * w[1, i] - v[1, i] * w[0, i])
                    )
                    low[i] = min(low[i], j)
                    high[i] = max(high[i], abs(j))
    _ratio(tile, low, high, out)


ROWS = (
    Metric(
        id="icem.determinant", title="Determinant 2x2x2", on=("quad", "tet", "pyramid", "wedge", "hex"), unit="1", low=-1.0,
        high=1.0, best="high", ideal=1.0, degenerate=0.0,
        systems=("ICEM CFD: Determinant (2x2x2)", "ANSYS: Jacobian ratio, new style", "Verdict: nodal Jacobian ratio (hex)"),
        formula="min J / max |J| over the corners",
        source="Ansys ICEM CFD help 24.2; corners only for other types than the hex",
        caveat="Always 1 or -1 for a tet, whose Jacobian is constant. ICEM asks for more than 0.3.",
        kernel={t: (quad_determinant if t == "quad" else corner_determinant) for t in ("quad", "tet", "pyramid", "wedge", "hex")},
        stages={t: ((faces,) if t == "quad" else (jacobians,)) for t in ("quad", "tet", "pyramid", "wedge", "hex")},
    ),
    Metric(
        id="icem.determinant_3x3x3", title="Determinant 3x3x3", on=("hex",), unit="1", low=-1.0, high=1.0, best="high",
        ideal=1.0, degenerate=0.0, systems=("ICEM CFD: Determinant (3x3x3)",),
        formula="min J / max |J| at 27 points: corners, edge middles, face centres, body centre",
        source="Ansys ICEM CFD help 24.2; Jmin/max|J|, because the printed form gives +1 for a mirrored cell",
        caveat="A hex twisted by 90 degrees scores 1 at the corners and 0.5 here.",
        kernel=determinant_27, stages=(jacobians,),
    ),
)  # fmt: skip
