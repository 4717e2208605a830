"""Angles between faces, and the squared face areas that say which faces have a direction."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES, LINEAR_TYPES
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, degrees, edges, faces
from meshwright.audit.metrics.tile import LANES, Tile, stage, tile_kernel

__all__ = ["ROWS", "SIDES", "areas", "dihedrals"]

_ON = ("tet", "pyramid", "wedge", "hex")


def _edges_of_faces() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """`SIDES` and the faces beside each edge: a kernel knows its type by the number of edges, which no two types share."""
    sides, beside = np.zeros((13, 6, 4), np.int64), np.zeros((13, 12, 2), np.int64)
    for cell in (CELL_TYPES[name] for name in LINEAR_TYPES):
        row = {frozenset(edge): r for r, edge in enumerate(cell.edges)}
        seen = [0] * len(row)
        for f, face in enumerate([*cell.tri_faces.tolist(), *cell.quad_faces.tolist()]):
            around = [row[frozenset(pair)] for pair in zip(face, [*face[1:], face[0]], strict=True)]
            sides[len(row), f] = (*around, around[-1])[:4]
            for r in around:
                beside[len(row), r, seen[r]] = f
                seen[r] += 1
    return sides, beside


SIDES, _BESIDE = _edges_of_faces()
"""SIDES[edges of the cell, face]: rows of the edge table around a face, the last one twice for a triangle."""


@stage
def areas(tile: Tile, out: Lane) -> None:
    """Squared areas of the faces, 0 for a flat one by the measure of its own longest edge; needs `edges` and `faces`."""
    sides, e = SIDES[len(tile.tables.edges)], tile.edge2
    for f in range(tile.face.shape[0]):
        a, b, c, d = sides[f, 0], sides[f, 1], sides[f, 2], sides[f, 3]
        area = tile.face[f]
        for i in range(LANES):
            longest2 = max(e[a, i], e[b, i], e[c, i], e[d, i])
            area2 = area[0, i] ** 2 + area[1, i] ** 2 + area[2, i] ** 2
            tile.area2[f, i] = area2 if area2 > (FLAT * longest2) ** 2 else 0.0


@stage
def dihedrals(tile: Tile, out: Lane) -> None:
    """Extreme angles between the faces along each edge; needs `edges`, `faces` and `areas`.

    180 degrees minus the angle between the area vectors, reduced as signed squares of the cotangent, which fall
    monotonically with the angle. Undefined where an edge has no length or a face no area.
    """
    n = len(tile.tables.edges)
    beside, area, work = _BESIDE[n], tile.face, tile.work
    small, large, least = work[0], work[1], work[2]
    for i in range(LANES):
        small[i], large[i], least[i] = -np.inf, np.inf, tile.edge_range[0, i]
    for f in range(area.shape[0]):
        for i in range(LANES):
            least[i] = min(least[i], tile.area2[f, i])
    for r in range(n):
        a, b = area[beside[r, 0]], area[beside[r, 1]]
        for i in range(LANES):
            nx = a[1, i] * b[2, i] - a[2, i] * b[1, i]
            ny = a[2, i] * b[0, i] - a[0, i] * b[2, i]
            nz = a[0, i] * b[1, i] - a[1, i] * b[0, i]
            dot = a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i]
            s = -dot * abs(dot) / (nx * nx + ny * ny + nz * nz)
            small[i] = s if s > small[i] else small[i]
            large[i] = s if s < large[i] else large[i]
    for i in range(LANES):
        low, high = degrees(small[i]), degrees(large[i])
        tile.dihedral[0, i] = low if least[i] > 0.0 else np.nan
        tile.dihedral[1, i] = high if least[i] > 0.0 else np.nan


@tile_kernel
def smallest_dihedral(tile: Tile, out: Lane) -> None:
    """Smallest angle between two faces."""
    for i in range(LANES):
        out[i] = tile.dihedral[0, i]


@tile_kernel
def largest_dihedral(tile: Tile, out: Lane) -> None:
    """Largest angle between two faces."""
    for i in range(LANES):
        out[i] = tile.dihedral[1, i]


_CAVEAT = (
    "Ideal: 70.53 in a regular tet, 54.74 and 109.47 in an equilateral pyramid, 60 and 90 in a wedge, 90 in a cube. A warped "
    "face counts with its mean normal. A reflex edge is not told from its mirror image: 360 minus the angle counts, so "
    "inversion shows in the volume and the Jacobians."
)

ROWS = (
    Metric(
        id="dihedral.min", title="Smallest dihedral angle", on=_ON, unit="deg", low=0.0, high=180.0, best="high", ideal=None,
        degenerate=math.nan, systems=("Verdict: Min Dihedral Angle (tet)",),
        formula="min over the edges of 180 degrees - angle between the outward normals of the two faces",
        source="Verdict manual (tetrahedra); for other cells the same on the area vectors of the faces", caveat=_CAVEAT,
        stages=(edges, faces, areas, dihedrals), kernel=smallest_dihedral,
    ),
    Metric(
        id="dihedral.max", title="Largest dihedral angle", on=_ON, unit="deg", low=0.0, high=180.0, best="low", ideal=None,
        degenerate=math.nan, systems=(),
        formula="max over the edges of 180 degrees - angle between the outward normals of the two faces",
        source="Verdict manual (tetrahedra); for other cells the same on the area vectors of the faces", caveat=_CAVEAT,
        stages=(edges, faces, areas, dihedrals), kernel=largest_dihedral,
    ),
)  # fmt: skip
