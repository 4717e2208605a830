"""Corner angles of faces: extremes, equi-angle skew on both scales, deviation from the ideal angle."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.cells import LINEAR_TYPES, POLYTOPES
from meshwright.audit.jit import inner
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, angles
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS", "deviation_of_face", "skew_of_face"]

_ON = LINEAR_TYPES + POLYTOPES


@inner
def skew_of_face(low, high, ideal):  # type: ignore[no-untyped-def]
    """Equi-angle skew of a face by its extreme and its ideal angle; above 1 at a reflex corner."""
    return max((high - ideal) / (180.0 - ideal), (ideal - low) / ideal)


@inner
def deviation_of_face(low, high, ideal):  # type: ignore[no-untyped-def]
    """Largest deviation from the ideal angle of a face."""
    return max(high - ideal, ideal - low)


@tile_kernel
def smallest_angle(tile: Tile, out: Lane) -> None:
    """Smallest corner angle; undefined where an edge has no length."""
    for i in range(LANES):
        low, other = tile.angle[0, i], tile.angle[2, i]
        low = other if other < low or low != low else low
        out[i] = low if tile.shapeless[0, i] + tile.shapeless[1, i] == 0.0 else np.nan


@tile_kernel
def largest_angle(tile: Tile, out: Lane) -> None:
    """Largest corner angle; undefined where an edge has no length."""
    for i in range(LANES):
        high, other = tile.angle[1, i], tile.angle[3, i]
        high = other if other > high or high != high else high
        out[i] = high if tile.shapeless[0, i] + tile.shapeless[1, i] == 0.0 else np.nan


@tile_kernel
def equiangle_skew(tile: Tile, out: Lane) -> None:
    """Per face with that face's ideal angle, then the worst; 1 for reflex corners and edges without length."""
    for i in range(LANES):
        tri = skew_of_face(tile.angle[0, i], tile.angle[1, i], 60.0)
        quad = skew_of_face(tile.angle[2, i], tile.angle[3, i], 90.0)
        tri = tri if tri > 0.0 else 0.0
        skew = quad if quad > tri else tri
        skew = skew if skew < 1.0 else 1.0
        out[i] = skew if tile.shapeless[0, i] + tile.shapeless[1, i] == 0.0 else 1.0


@tile_kernel
def equiangle_skewness(tile: Tile, out: Lane) -> None:
    """ICEM CFD's end of the same scale."""
    equiangle_skew(tile, out)
    for i in range(LANES):
        out[i] = 1.0 - out[i]


@tile_kernel
def internal_angle_deviation(tile: Tile, out: Lane) -> None:
    """Largest deviation of a defined corner angle from 60 (triangles) or 90 degrees (quadrilaterals)."""
    for i in range(LANES):
        tri = deviation_of_face(tile.angle[0, i], tile.angle[1, i], 60.0)
        quad = deviation_of_face(tile.angle[2, i], tile.angle[3, i], 90.0)
        out[i] = quad if quad > tri or tri != tri else tri
    broken = False
    for i in range(LANES):
        broken |= tile.shapeless[0, i] + tile.shapeless[1, i] > 0.0
    for i in range(LANES if broken else 0):
        if tile.shapeless[0, i] + tile.shapeless[1, i] > 0.0:
            tri = deviation_of_face(tile.angle[0, i], tile.angle[1, i], 60.0)
            quad = deviation_of_face(tile.angle[2, i], tile.angle[3, i], 90.0)
            tri = tri if _has_a_sound_corner(tile, tile.tables.tris, i) else np.nan
            quad = quad if _has_a_sound_corner(tile, tile.tables.quads, i) else np.nan
            out[i] = quad if quad > tri or tri != tri else tri


@inner
def _has_a_sound_corner(tile, faces, i):  # type: ignore[no-untyped-def]
    """Whether some node of these faces has no edge of zero length on them; without one the cell has no shape."""
    n, size = faces.shape
    for node in range(len(tile.x)):
        uses, broken = 0, 0
        for r in range(n):
            for k in range(size):
                if faces[r, k] == node:
                    uses += 1
                    for other in (faces[r, (k + 1) % size], faces[r, (k + size - 1) % size]):
                        gap = (
                            abs(tile.x[node, 0, i] - tile.x[other, 0, i])
                            + abs(tile.x[node, 1, i] - tile.x[other, 1, i])
                            + abs(tile.x[node, 2, i] - tile.x[other, 2, i])
                        )
                        broken += gap == 0.0
        if uses > 0 and broken == 0:
            return True
    return False


ROWS = (
    Metric(
        id="angle.min", title="Smallest face angle", on=_ON, unit="deg", low=0.0, high=180.0, best="high",
        ideal=None, degenerate=math.nan, systems=("CFX: Minimum Face Angle", "HyperMesh: min angle", "Cubit: minimum angle"),
        formula="min over the corners of all faces of the angle between the two edges",
        source="CFX-Post mesh statistics; Altair HyperMesh help", caveat="Ideal 60 on triangles, 90 on quadrilaterals, 180 (n - 2)/n on faces of n corners: that is the most it can be.",
        stages=(angles,), kernel=smallest_angle, polytope="smallest_angle",
    ),
    Metric(
        id="angle.max", title="Largest face angle", on=_ON, unit="deg", low=60.0, high=360.0, best="low",
        ideal=None, degenerate=math.nan, systems=("CFX: Maximum Face Angle", "HyperMesh: max angle", "Cubit: maximum angle"),
        formula="max over the corners of all faces of the angle between the two edges; above 180 at a reflex corner",
        source="CFX-Post mesh statistics; Altair HyperMesh help", caveat="Ideal 60 on triangles, 90 on quadrilaterals, 180 (n - 2)/n on faces of n corners. A hanging node is a corner of 180.",
        stages=(angles,), kernel=largest_angle, polytope="largest_angle",
    ),
    Metric(
        id="gambit.equiangle_skew", title="Equi-angle skew", on=_ON, unit="1", low=0.0, high=1.0, best="low",
        ideal=0.0, degenerate=1.0,
        systems=("GAMBIT: EquiAngle Skew (its default)", "Fluent: Cell Equiangle Skew", "Pointwise: Equiangle Skewness"),
        formula="max[(Tmax - Te)/(180 - Te), (Te - Tmin)/Te], worst face; Te = 180 (n - 2)/n on faces of n corners: 60, 90, 108, ...",
        source="Ansys FAQ 'definition of mesh quality'; GAMBIT 2 User's Guide 3.4; Verdict for pyramids and wedges",
        caveat="Blind to slivers: a flat tet of four points in a square scores 0.5. Look at equi-size skew for tets. On polyhedra a "
        "face with a hanging node on a straight edge scores 1.",
        stages=(angles,), kernel=equiangle_skew, polytope="skew",
    ),
    Metric(
        id="icem.equiangle_skewness", title="Equi-angle skewness (ICEM)", on=_ON, unit="1", low=0.0, high=1.0,
        best="high", ideal=1.0, degenerate=0.0, systems=("ICEM CFD: Equiangle skewness",),
        formula="1 - equi-angle skew", source="ICEM CFD help 24.2; the same quantity on the opposite scale",
        caveat="Same number as gambit.equiangle_skew read from the other end: 1 is best here.",
        stages=(angles,), kernel=equiangle_skewness, polytope="skewness",
    ),
    Metric(
        id="seed.internal_angle_deviation", title="Internal angle deviation", on=_ON, unit="deg", low=0.0,
        high=270.0, best="low", ideal=0.0, degenerate=math.nan, systems=("FEMAP: Internal Angles", "ICEM CFD: Angle (as 90 - value)"),
        formula="max over faces of max(|Te - Tmin|, |Tmax - Te|), Te = 180 (n - 2)/n on faces of n corners: 60, 90, 108, ...",
        source="CFDyna, Meshing for Numerical Simulations, 'Internal Angle Deviation'",
        caveat="Undefined where no node of the faces is free of zero-length edges.",
        stages=(angles,), kernel=internal_angle_deviation, polytope="deviation",
    ),
)  # fmt: skip
