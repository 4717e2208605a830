"""Fluent's cell metrics: aspect ratio, squish and the orthogonality of a cell's own faces."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.dihedral import areas
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, centres, edges, faces, volume
from meshwright.audit.metrics.tile import LANES, Tile, stage, tile_kernel

__all__ = ["ABOUT_THE_CENTRE", "ROWS", "is_flat", "slants"]

_ON = ("tet", "pyramid", "wedge", "hex")


@inner
def is_flat(tile, i):  # type: ignore[no-untyped-def]
    """Whether the cell of this lane has no volume and therefore no centre."""
    longest2 = tile.edge_range[1, i]
    return not (abs(tile.volume[i]) >= FLAT * longest2 * math.sqrt(longest2) and longest2 > 0.0)


@stage
def slants(tile: Tile, out: Lane) -> None:
    """Smallest signed square of the cotangent between a face's normal and the line from centre to face centre.

    It falls monotonically with the angle, keeps its digits near 0 and 180 degrees, and three metrics come from it. Right
    angles (0) for a face without direction, and for a flat cell, whose centre is not defined. Needs `edges`, `faces`,
    `volume`, `centres` and `areas`.
    """
    slant, m = tile.slant, tile.centre
    for i in range(LANES):
        slant[i] = np.inf
    for f in range(tile.face.shape[0]):
        a, c, area2 = tile.face[f], tile.face_centre[f], tile.area2[f]
        for i in range(LANES):
            dx, dy, dz = c[0, i] - m[0, i], c[1, i] - m[1, i], c[2, i] - m[2, i]
            nx, ny, nz = a[1, i] * dz - a[2, i] * dy, a[2, i] * dx - a[0, i] * dz, a[0, i] * dy - a[1, i] * dx
            dot = a[0, i] * dx + a[1, i] * dy + a[2, i] * dz
            s = dot * abs(dot) / (nx * nx + ny * ny + nz * nz)
            s = s if area2[i] > 0.0 and s == s else 0.0
            slant[i] = s if s < slant[i] else slant[i]
    for i in range(LANES):
        slant[i] = 0.0 if is_flat(tile, i) else slant[i]


ABOUT_THE_CENTRE = (edges, faces, volume, centres, areas)
"""Stages that `slants` and everything else that looks from the cell's centre at its faces needs."""


@tile_kernel
def orthogonality(tile: Tile, out: Lane) -> None:
    """Cosine of the largest of those angles."""
    for i in range(LANES):
        s = tile.slant[i]
        cosine = 1.0 / math.sqrt(1.0 + 1.0 / abs(s))
        out[i] = cosine if s >= 0.0 else -cosine


@tile_kernel
def squish(tile: Tile, out: Lane) -> None:
    """1 minus that cosine, near 0 without cancellation."""
    for i in range(LANES):
        s = tile.slant[i]
        cosine = 1.0 / math.sqrt(1.0 + 1.0 / abs(s))
        sine2 = 1.0 / (1.0 + abs(s))
        out[i] = sine2 / (1.0 + cosine) if s >= 0.0 else 1.0 + cosine


@tile_kernel
def distance_ratio(tile: Tile, out: Lane) -> None:
    """Largest over smallest distance of the centre from the corners and from the planes of the faces."""
    x, m, low, high = tile.x, tile.centre, tile.work[0], tile.work[1]
    for i in range(LANES):
        low[i], high[i] = np.inf, 0.0
    for j in range(x.shape[0]):
        for i in range(LANES):
            d2 = (x[j, 0, i] - m[0, i]) ** 2 + (x[j, 1, i] - m[1, i]) ** 2 + (x[j, 2, i] - m[2, i]) ** 2
            low[i] = min(low[i], d2)
            high[i] = max(high[i], d2)
    for f in range(tile.face.shape[0]):
        a, c, area2 = tile.face[f], tile.face_centre[f], tile.area2[f]
        for i in range(LANES):
            dot = a[0, i] * (c[0, i] - m[0, i]) + a[1, i] * (c[1, i] - m[1, i]) + a[2, i] * (c[2, i] - m[2, i])
            d2 = dot * dot / area2[i] if area2[i] > 0.0 else 0.0
            low[i] = min(low[i], d2)
            high[i] = max(high[i], d2)
    for i in range(LANES):
        out[i] = math.sqrt(high[i] / low[i]) if low[i] > 1e-28 * high[i] and not is_flat(tile, i) else np.inf


ROWS = (
    Metric(
        id="fluent.aspect_ratio", title="Aspect ratio (Fluent)", on=(*_ON, "polyhedron"), unit="1", low=1.0, high=math.inf, best="low",
        ideal=None, degenerate=math.inf, systems=("Fluent: Cell Aspect Ratio",),
        formula="largest / smallest of the distances from the cell's centroid to its nodes and to the planes of its faces",
        source="Ansys Fluent User's Guide 24.2, mesh quality",
        caveat="Never 1: sqrt(3) = 1.73 for a cube, 2.65 for a regular wedge, 3 for a regular tet, 4.12 for an equilateral pyramid.",
        stages=ABOUT_THE_CENTRE, kernel=distance_ratio, polytope="reach",
    ),
    Metric(
        id="fluent.cell_squish", title="Cell squish index", on=(*_ON, "polyhedron"), unit="1", low=0.0, high=2.0, best="low", ideal=0.0,
        degenerate=1.0, systems=("Fluent: Cell Squish Index", "Verdict: squish index (tet)"),
        formula="1 - min over faces of A.f / |A||f|, A the area vector, f from the cell's centroid to the face's",
        source="Ansys Fluent User's Guide; Verdict (squish index of a tet)",
        caveat="An equilateral pyramid has 0.095. Above 1 where a face looks at the centroid from its back: 2 for a mirrored cell.",
        stages=(*ABOUT_THE_CENTRE, slants), kernel=squish, polytope="squish",
    ),
    Metric(
        id="fluent.ortho_cell_face", title="Orthogonality of the cell's faces", on=(*_ON, "polyhedron"), unit="1", low=-1.0, high=1.0, best="high",
        ideal=1.0, degenerate=0.0, systems=("Fluent: face part of Orthogonal Quality",),
        formula="min over faces of A.f / |A||f|, A the area vector, f from the cell's centroid to the face's",
        source="Ansys Fluent User's Guide 24.2, mesh quality",
        caveat="The part of orthogonal quality that needs no neighbours: 1 - cell squish. Negative for a mirrored cell.",
        stages=(*ABOUT_THE_CENTRE, slants), kernel=orthogonality, polytope="orthogonality",
    ),
)  # fmt: skip
