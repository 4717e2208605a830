"""Metrics of faces: size, squish, non-orthogonality."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.metrics.facets import FaceTile, face_kernel
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, degrees_from_cotangent
from meshwright.audit.metrics.tile import LANES

__all__ = ["ROWS"]

_EVERY, _INSIDE = ("interior", "boundary"), ("interior",)


@face_kernel
def area(face: FaceTile, out: Lane) -> None:
    """|A|."""
    a = face.area
    for i in range(LANES):
        out[i] = math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2) * face.unit[i] ** 2


@face_kernel
def face_squish(face: FaceTile, out: Lane) -> None:
    """1 - A.d / |A||d|."""
    a, d = face.area, face.between
    for i in range(LANES):
        a2 = a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2
        d2 = d[0, i] ** 2 + d[1, i] ** 2 + d[2, i] ** 2
        dot = a[0, i] * d[0, i] + a[1, i] * d[1, i] + a[2, i] * d[2, i]
        out[i] = 1.0 - dot / math.sqrt(a2 * d2) if a2 * d2 > 0.0 else 1.0


@face_kernel
def non_orthogonality(face: FaceTile, out: Lane) -> None:
    """Angle between A and the line of the centres."""
    a, d = face.area, face.between
    for i in range(LANES):
        dot = a[0, i] * d[0, i] + a[1, i] * d[1, i] + a[2, i] * d[2, i]
        nx, ny, nz = (
            a[1, i] * d[2, i] - a[2, i] * d[1, i],
            a[2, i] * d[0, i] - a[0, i] * d[2, i],
            a[0, i] * d[1, i] - a[1, i] * d[0, i],
        )
        out[i] = (
            degrees_from_cotangent(dot / math.sqrt(nx * nx + ny * ny + nz * nz))
            if dot != 0.0
            else (90.0 if nx * nx + ny * ny + nz * nz > 0.0 else np.nan)
        )


ROWS = (
    Metric(
        id="face.area", title="Face area", entity="face", on=_EVERY, unit="L2", low=0.0, high=math.inf, best="none", ideal=None,
        degenerate=0.0, systems=("Fluent: Face Area", "OpenFOAM: face area magnitude"),
        formula="|A|, A the sum of the fan triangles' area vectors about the mean of the nodes; length of an edge in 2-D",
        source="OpenFOAM primitiveMesh face areas", kernel=area,
    ),
    Metric(
        id="fluent.face_squish", title="Face squish index", entity="face", on=_INSIDE, unit="1", low=0.0, high=2.0, best="low", ideal=0.0,
        degenerate=1.0, systems=("Fluent: Face Squish Index",), formula="1 - A.d / |A||d|, d from the centre of the owner to that of the neighbour",
        source="Fluent user's guide, mesh quality (words); CFDyna, Meshing for Numerical Simulations", kernel=face_squish,
    ),
    Metric(
        id="openfoam.non_orthogonality_deg", title="Non-orthogonality", entity="face", on=_INSIDE, unit="deg", low=0.0, high=180.0, best="low",
        ideal=0.0, degenerate=math.nan, systems=("OpenFOAM: non-orthogonality",), formula="angle between A and d, d from the centre of the owner to that of the neighbour",
        source="OpenFOAM polyMeshCheck",
        caveat="The average that checkMesh prints is the angle of the mean cosine, not the mean angle.", kernel=non_orthogonality,
    ),
)  # fmt: skip
