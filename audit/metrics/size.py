"""Plain sizes: area, volume, edge lengths, Jacobian at the corners."""

from __future__ import annotations

import math

from meshwright.audit.cells import LINEAR_TYPES, POLYTOPES
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, edges, faces, jacobians, volume
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]

_SOLIDS = ("tet", "pyramid", "wedge", "hex")


@tile_kernel
def area(tile: Tile, out: Lane) -> None:
    """|A| of the cell's only face."""
    a = tile.face[0]
    for i in range(LANES):
        out[i] = math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2) * tile.unit[i] ** 2


@tile_kernel
def signed_volume(tile: Tile, out: Lane) -> None:
    """V, negative for a cell whose nodes run the wrong way round."""
    for i in range(LANES):
        out[i] = tile.volume[i] * tile.unit[i] * tile.unit[i] * tile.unit[i]


@tile_kernel
def shortest_edge(tile: Tile, out: Lane) -> None:
    """Length of the shortest edge."""
    for i in range(LANES):
        out[i] = math.sqrt(tile.edge_range[0, i]) * tile.unit[i]


@tile_kernel
def longest_edge(tile: Tile, out: Lane) -> None:
    """Length of the longest edge."""
    for i in range(LANES):
        out[i] = math.sqrt(tile.edge_range[1, i]) * tile.unit[i]


@tile_kernel
def smallest_jacobian(tile: Tile, out: Lane) -> None:
    """Smallest corner determinant."""
    for i in range(LANES):
        out[i] = tile.jacobian_range[0, i] * tile.unit[i] * tile.unit[i] * tile.unit[i]


ROWS = (
    Metric(
        id="area", title="Area", on=("tri", "quad", "polygon"), unit="L2", low=0.0, high=math.inf, best="none", ideal=None,
        degenerate=0.0, systems=("GAMBIT: Area", "ICEM CFD: Surface area", "Verdict: area"),
        formula="|A|; of a quadrilateral half the length of the cross product of its diagonals",
        source="GAMBIT 2 User's Guide 3.4 (table of parameters and types)",
        caveat="Of a warped quadrilateral or polygon the area of its shadow on the mean plane.",
        stages=(faces,), kernel=area, polytope="size",
    ),
    Metric(
        id="volume", title="Volume", on=(*_SOLIDS, "polyhedron"), unit="L3", low=-math.inf, high=math.inf, best="none", ideal=None,
        degenerate=0.0, systems=("GAMBIT: Volume", "Fluent: Cell Volume", "ICEM CFD: Volume", "Verdict: volume"),
        formula="sum of the signed tetrahedra between the faces, fanned about their vertex mean, and one corner",
        source="OpenFOAM primitiveMesh cell volume; equals 2x2x2 Gauss integration for a hex with bilinear faces",
        caveat="Negative when the nodes run the wrong way round. Look at the sign before any other number.",
        stages=(volume,), kernel=signed_volume, polytope="size",
    ),
    Metric(
        id="edge.min", title="Shortest edge", on=LINEAR_TYPES + POLYTOPES, unit="L", low=0.0, high=math.inf, best="none", ideal=None,
        degenerate=0.0, systems=("HyperMesh: min size", "ICEM CFD: Min length"), formula="min |e|",
        source="Altair HyperMesh help, element size checks", stages=(edges,), kernel=shortest_edge, polytope="shortest",
    ),
    Metric(
        id="edge.max", title="Longest edge", on=LINEAR_TYPES + POLYTOPES, unit="L", low=0.0, high=math.inf, best="none", ideal=None,
        degenerate=0.0, systems=("HyperMesh: max size", "ICEM CFD: Max length"), formula="max |e|",
        source="Altair HyperMesh help, element size checks", stages=(edges,), kernel=longest_edge, polytope="longest",
    ),
    Metric(
        id="jacobian.min_corner", title="Smallest corner Jacobian", on=_SOLIDS, unit="L3", low=-math.inf, high=math.inf,
        best="none", ideal=None, degenerate=0.0, systems=("Verdict: jacobian",),
        formula="min over corners of det[e1, e2, e3], e the edges leaving the corner; a tet has one value, 6 V",
        source="Sandia Verdict manual (2007), Jacobian; the four base corners of a pyramid",
        caveat="Zero or negative: the cell is folded at that corner even where its volume is positive.",
        stages=(jacobians,), kernel=smallest_jacobian,
    ),
)  # fmt: skip
