"""ICEM CFD's determinants: smallest over largest Jacobian at the corners, and at 27 points of a hex."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, edges, faces, jacobians
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]


@tile_kernel
def corner_determinant(tile: Tile, out: Lane) -> None:
    """min J / max |J| over the corners."""
    _ratio(tile, tile.jacobian_range[0], tile.jacobian_range[1], out)


@inner
def _ratio(tile, low, high, out):  # type: ignore[no-untyped-def]
    """low / high; 0 for a flat cell."""
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        flat = high[i] <= FLAT * longest2 * math.sqrt(longest2)
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


# The four edges of a hex along each local direction, as (from, to), ordered by the other two directions.
_PARALLEL = np.array(
    [
        [[0, 1], [3, 2], [4, 5], [7, 6]],
        [[0, 3], [1, 2], [4, 7], [5, 6]],
        [[0, 4], [1, 5], [3, 7], [2, 6]],
    ]
)


@tile_kernel
def determinant_27(tile: Tile, out: Lane) -> None:
    """min J / max |J| at the points r, s, t in {-1, 0, 1}; the eight corners are done already.

    The derivative along a direction does not depend on that direction's own coordinate, so 3 x 9 vectors serve all
    points: the edges, their means over a face, and the mean of all four.
    """
    slope = np.empty((3, 3, 3, 3, LANES))  # direction, first and second other coordinate, xyz
    x, low, high = tile.x, tile.work[0], tile.work[1]
    for k in range(3):
        for d in range(3):
            for e in range(4):
                a, b, edge = x[_PARALLEL[k, e, 0], d], x[_PARALLEL[k, e, 1], d], slope[k, 2 * (e % 2), 2 * (e // 2), d]
                for i in range(LANES):
                    edge[i] = b[i] - a[i]
            for m in range(5):  # two means along the first other coordinate, then three along the second
                if m < 2:
                    a, b, mean = slope[k, 0, 2 * m, d], slope[k, 2, 2 * m, d], slope[k, 1, 2 * m, d]
                else:
                    a, b, mean = slope[k, m - 2, 0, d], slope[k, m - 2, 2, d], slope[k, m - 2, 1, d]
                for i in range(LANES):
                    mean[i] = 0.5 * (a[i] + b[i])
    for i in range(LANES):
        low[i], high[i] = tile.jacobian_range[0, i], tile.jacobian_range[1, i]
    for point in range(27):
        r, s, t = point // 9, point // 3 % 3, point % 3
        if r != 1 and s != 1 and t != 1:
            continue
        u, v, w = slope[0, s, t], slope[1, r, t], slope[2, r, s]
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
        systems=("ICEM CFD: Determinant (2x2x2)", "ANSYS: Jacobian ratio, new style", "HyperMesh: Jacobian (corners)",
                 "Verdict: nodal Jacobian ratio (hex)"),
        formula="min J / max |J| over the corners",
        source="Ansys ICEM CFD help 24.2; corners only for other types than the hex",
        caveat="Always 1 or -1 for a tet, whose Jacobian is constant. ICEM asks for more than 0.3.",
        kernel={t: (quad_determinant if t == "quad" else corner_determinant) for t in ("quad", "tet", "pyramid", "wedge", "hex")},
        stages={t: ((faces,) if t == "quad" else (edges, jacobians)) for t in ("quad", "tet", "pyramid", "wedge", "hex")},
    ),
    Metric(
        id="icem.determinant_3x3x3", title="Determinant 3x3x3", on=("hex",), unit="1", low=-1.0, high=1.0, best="high",
        ideal=1.0, degenerate=0.0, systems=("ICEM CFD: Determinant (3x3x3)",),
        formula="min J / max |J| at 27 points: corners, edge middles, face centres, body centre",
        source="Ansys ICEM CFD help 24.2; Jmin/max|J|, because the printed form gives +1 for a mirrored cell",
        caveat="A hex twisted by 90 degrees scores 1 at the corners and 0.5 here.",
        kernel=determinant_27, stages=(edges, jacobians),
    ),
)  # fmt: skip
