"""Metrics of faces: what lies on both sides of them, and how flat and convex they are."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.facets import FaceTile, face_kernel
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, corner, degrees, degrees_from_cotangent
from meshwright.audit.metrics.tile import LANES

__all__ = ["ROWS"]

_EVERY, _INSIDE, _OUTSIDE = ("interior", "boundary"), ("interior",), ("boundary",)


@inner
def _dot(a, b, i):  # type: ignore[no-untyped-def]
    """a.b in lane i."""
    return a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i]


@inner
def _length(a, i):  # type: ignore[no-untyped-def]
    """|a| in lane i."""
    return math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)


@inner
def _angle(a, b, i):  # type: ignore[no-untyped-def]
    """Angle between a and b in degrees, nan where one of them has no length."""
    nx, ny, nz = (
        a[1, i] * b[2, i] - a[2, i] * b[1, i],
        a[2, i] * b[0, i] - a[0, i] * b[2, i],
        a[0, i] * b[1, i] - a[1, i] * b[0, i],
    )
    return degrees_from_cotangent(_dot(a, b, i) / math.sqrt(nx * nx + ny * ny + nz * nz))


@face_kernel
def area(face: FaceTile, out: Lane) -> None:
    """|A|, or the length of an edge."""
    edges = face.count[0] == 2
    for i in range(LANES):
        out[i] = face.fan[i] * face.unit[i] if edges else _length(face.area, i) * face.unit[i] * face.unit[i]


@face_kernel
def face_squish(face: FaceTile, out: Lane) -> None:
    """1 - A.d / |A||d|."""
    a, d = face.area, face.between
    for i in range(LANES):
        size = _length(a, i) * _length(d, i)
        out[i] = 1.0 - _dot(a, d, i) / size if size > 0.0 else 1.0


@face_kernel
def growth_ratio(face: FaceTile, out: Lane) -> None:
    """Larger over smaller volume."""
    for i in range(LANES):
        a, b = abs(face.volume[0, i]), abs(face.volume[1, i])
        out[i] = max(a, b) / min(a, b) if min(a, b) > 0.0 else np.inf


@face_kernel
def non_orthogonality(face: FaceTile, out: Lane) -> None:
    """Angle between A and the line of the centres."""
    for i in range(LANES):
        out[i] = _angle(face.area, face.between, i)


@face_kernel
def skewness(face: FaceTile, out: Lane) -> None:
    """Distance from the centre of the face to where the line of the centres meets it, over its extent that way.

    On the boundary that line leaves the centre of the cell at a right angle to the face.
    """
    x, centre, work = face.x, face.centre, face.work  # rows of scratch: 0 to 2 the distance s, 3 the extent, s.(x - c)
    for i in range(LANES):
        inside = face.boundary[i] == 0.0
        ax, ay, az = face.area[0, i], face.area[1, i], face.area[2, i]
        dx, dy, dz = (face.between[0, i], face.between[1, i], face.between[2, i]) if inside else (ax, ay, az)
        along = _dot(face.area, face.own, i) / (ax * dx + ay * dy + az * dz)
        work[0, i] = face.own[0, i] - along * dx
        work[1, i] = face.own[1, i] - along * dy
        work[2, i] = face.own[2, i] - along * dz
        # the least extent is a fifth of the distance of the centres; beyond the boundary a cell is thought mirrored
        line = math.sqrt(dx * dx + dy * dy + dz * dz)
        work[3, i] = (0.2 * line if inside else 0.4 * abs(along) * line) * _length(work, i)
    for k in range(face.count[0]):
        for i in range(LANES):
            reach = abs(
                work[0, i] * (x[k, 0, i] - centre[0, i])
                + work[1, i] * (x[k, 1, i] - centre[1, i])
                + work[2, i] * (x[k, 2, i] - centre[2, i])
            )
            work[3, i] = reach if reach > work[3, i] else work[3, i]
    for i in range(LANES):
        square = _dot(work, work, i)
        ratio = square / work[3, i] if square > 0.0 else square
        out[i] = ratio if ratio == ratio else np.inf  # the line never meets the face, or there is no face


@face_kernel
def face_weight(face: FaceTile, out: Lane) -> None:
    """Share of the nearer centre in the distance of both from the face."""
    for i in range(LANES):
        a, b = abs(_dot(face.area, face.own, i)), abs(_dot(face.area, face.other, i))
        out[i] = min(a, b) / (a + b) if a + b > 0.0 else 0.0


@face_kernel
def volume_ratio(face: FaceTile, out: Lane) -> None:
    """Smaller over larger volume; below 0 where one is negative. Two negative ones count as two positive ones."""
    for i in range(LANES):
        a, b = face.volume[0, i], face.volume[1, i]
        low, high = (min(a, b), max(a, b)) if a > 0.0 or b > 0.0 else (min(-a, -b), max(-a, -b))
        out[i] = low / high if high > 0.0 else 0.0


@face_kernel
def flatness(face: FaceTile, out: Lane) -> None:
    """|A| over the sum of the areas of the fan about the centre; 1 for edges and for a face without area."""
    x, centre, total = face.x, face.centre, face.work[0]
    n = face.count[0]
    for i in range(LANES):
        total[i] = 0.0
    for k in range(n if n > 3 else 0):
        p, q = x[k], x[k + 1 if k + 1 < n else 0]
        for i in range(LANES):
            ux, uy, uz = p[0, i] - centre[0, i], p[1, i] - centre[1, i], p[2, i] - centre[2, i]
            vx, vy, vz = q[0, i] - centre[0, i], q[1, i] - centre[1, i], q[2, i] - centre[2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            total[i] += 0.5 * math.sqrt(nx * nx + ny * ny + nz * nz)
    for i in range(LANES):
        out[i] = _length(face.area, i) / total[i] if total[i] > 0.0 else 1.0


@face_kernel
def face_twist(face: FaceTile, out: Lane) -> None:
    """Smallest cosine between d and a triangle of the fan, reduced as signed square of n.d / |n|."""
    x, centre, low = face.x, face.centre, face.work[0]
    n = face.count[0]
    for i in range(LANES):
        low[i] = np.inf
    for k in range(n):
        p, q = x[k], x[k + 1 if k + 1 < n else 0]
        for i in range(LANES):
            if n > 2:
                ux, uy, uz = p[0, i] - centre[0, i], p[1, i] - centre[1, i], p[2, i] - centre[2, i]
                vx, vy, vz = q[0, i] - centre[0, i], q[1, i] - centre[1, i], q[2, i] - centre[2, i]
                nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            else:
                nx, ny, nz = face.area[0, i], face.area[1, i], face.area[2, i]
            inside = face.boundary[i] == 0.0
            dx = face.between[0, i] if inside else face.own[0, i]
            dy = face.between[1, i] if inside else face.own[1, i]
            dz = face.between[2, i] if inside else face.own[2, i]
            dot = nx * dx + ny * dy + nz * dz
            square = dot * abs(dot) / (nx * nx + ny * ny + nz * nz)
            low[i] = square if square < low[i] else low[i]
    for i in range(LANES):
        size = _length(face.between if face.boundary[i] == 0.0 else face.own, i)
        cosine = math.copysign(math.sqrt(abs(low[i])), low[i]) / size
        out[i] = cosine if abs(cosine) < np.inf else 0.0


@face_kernel
def face_pyramid(face: FaceTile, out: Lane) -> None:
    """Volume of the smaller of the pyramids from the centres of the cells onto the face; of an edge, area of a triangle."""
    edges = face.count[0] == 2
    for i in range(LANES):
        low = _dot(face.area, face.own, i)
        other = -_dot(face.area, face.other, i)
        low = other if other < low and face.boundary[i] == 0.0 else low
        square = face.unit[i] * face.unit[i]
        out[i] = low / 2.0 * square if edges else low / 3.0 * square * face.unit[i]


@face_kernel
def concave_angle(face: FaceTile, out: Lane) -> None:
    """Largest turn of the rim against the sense of the face, as smallest signed square of its cotangent.

    Edges without length are left out, those of the nodes that shorter faces repeat among them.
    """
    x, a, work = face.x, face.area, face.work  # rows of scratch: 0 to 2 the edge before, 3 the reduction
    n = face.count[0]
    for i in range(LANES):
        work[3, i] = np.inf
        for d in range(3):
            work[d, i] = x[0, d, i] - x[n - 1, d, i]
    for k in range(n if n > 3 else 0):
        p, q = x[k], x[k + 1 if k + 1 < n else 0]
        for i in range(LANES):
            ex, ey, ez = q[0, i] - p[0, i], q[1, i] - p[1, i], q[2, i] - p[2, i]
            square, nx, ny, nz = corner(work[0, i], work[1, i], work[2, i], ex, ey, ez)
            turned = nx * a[0, i] + ny * a[1, i] + nz * a[2, i] < 0.0
            work[3, i] = square if turned and square < work[3, i] else work[3, i]
            moved = ex != 0.0 or ey != 0.0 or ez != 0.0
            work[0, i] = ex if moved else work[0, i]
            work[1, i] = ey if moved else work[1, i]
            work[2, i] = ez if moved else work[2, i]
    for i in range(LANES):
        turn = degrees(work[3, i]) if work[3, i] < np.inf else 0.0
        out[i] = turn if face.fan[i] > 0.0 and _length(a, i) > 0.0 else np.nan


@face_kernel
def wall_orthogonality(face: FaceTile, out: Lane) -> None:
    """90 degrees less the angle between A and the way from the centre of the cell to that of the face."""
    for i in range(LANES):
        out[i] = 90.0 - _angle(face.area, face.own, i)


ROWS = (
    Metric(
        id="face.area", title="Face area", entity="face", on=_EVERY, unit="L2", low=0.0, high=math.inf, best="none", ideal=None,
        degenerate=0.0, systems=("Fluent: Face Area", "OpenFOAM: face area magnitude"),
        formula="|A|, A the sum of the fan triangles' area vectors about the mean of the nodes; length of an edge in 2-D",
        source="OpenFOAM primitiveMeshFaceCentresAndAreas.C", kernel=area,
    ),
    Metric(
        id="fluent.face_squish", title="Face squish index", entity="face", on=_INSIDE, unit="1", low=0.0, high=2.0, best="low", ideal=0.0,
        degenerate=1.0, systems=("Fluent: Face Squish Index",), formula="1 - A.d / |A||d|, d from the centre of the owner to that of the neighbour",
        source="Fluent user's guide, mesh quality (words); CFDyna, Meshing for Numerical Simulations", kernel=face_squish,
        caveat="In a shell the neighbour is unfolded into the plane of the owner first, for this and all other face metrics.",
    ),
    Metric(
        id="growth_ratio", title="Growth ratio", entity="face", on=_INSIDE, unit="1", low=1.0, high=math.inf, best="low", ideal=1.0,
        degenerate=math.inf, systems=("Pointwise: Volume Ratio", "1 / OpenFOAM's face volume ratio"),
        formula="larger over smaller of the volumes (areas in 2-D) of the two cells, magnitudes", source="Pointwise, Examine: Volume Ratio",
        caveat="Of volumes: layers that grow by 1.2 in one direction show 1.2. Look at inverted cells first, it does not.", kernel=growth_ratio,
    ),
    Metric(
        id="openfoam.non_orthogonality_deg", title="Non-orthogonality", entity="face", on=_INSIDE, unit="deg", low=0.0, high=180.0, best="low",
        ideal=0.0, degenerate=math.nan, systems=("OpenFOAM: non-orthogonality",), formula="angle between A and d, d from the centre of the owner to that of the neighbour",
        source="OpenFOAM primitiveMeshTools::faceOrthogonality",
        caveat="The average that checkMesh prints is the angle of the mean cosine, not the mean angle.", kernel=non_orthogonality,
    ),
    Metric(
        id="openfoam.skewness", title="Face skewness (OpenFOAM)", entity="face", on=_EVERY, unit="1", low=0.0, high=math.inf, best="low", ideal=0.0,
        degenerate=math.inf, systems=("OpenFOAM: skewness",),
        formula="|s|/max(0.2 |d|, max_k |s.(x_k - c)|/|s|), s = f - (A.f/A.d) d, f = c - C_owner, x_k the nodes of the face, c its centre; "
        "on the boundary d = n (n.f) and 0.4 |d|",
        source="OpenFOAM primitiveMeshTools::faceSkewness, boundaryFaceSkewness",
        caveat="Not the skewness of any other program: no upper end, 4 is OpenFOAM's limit. inf where d lies in the face.", kernel=skewness,
    ),
    Metric(
        id="openfoam.face_weight", title="Face interpolation weight", entity="face", on=_INSIDE, unit="1", low=0.0, high=0.5, best="high", ideal=0.5,
        degenerate=0.0, systems=("OpenFOAM: face interpolation weight",),
        formula="min(a, b)/(a + b), a and b the distances |A.(c - C)| of the two cell centres from the face", source="OpenFOAM polyMeshTools::faceWeights",
        kernel=face_weight,
    ),
    Metric(
        id="openfoam.volume_ratio", title="Face volume ratio", entity="face", on=_INSIDE, unit="1", low=0.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0, systems=("OpenFOAM: face volume ratio",), formula="smaller over larger of the signed volumes of the two cells",
        source="OpenFOAM polyMeshTools::volRatio",
        caveat="Below 0 where one of the cells is inverted. Between two inverted cells OpenFOAM prints the larger over the smaller.", kernel=volume_ratio,
    ),
    Metric(
        id="openfoam.flatness", title="Face flatness", entity="face", on=_EVERY, unit="1", low=0.0, high=1.0, best="high", ideal=1.0,
        degenerate=1.0, systems=("OpenFOAM: face flatness",), formula="|A| over the sum of the areas of the triangles about the centre of the face",
        source="OpenFOAM primitiveMeshTools::faceFlatness",
        caveat="The average that checkMesh prints leaves out triangles. It takes a face that crosses itself to no area for flat; here that is 0.",
        kernel=flatness,
    ),
    Metric(
        id="openfoam.face_twist", title="Face twist", entity="face", on=_EVERY, unit="1", low=-1.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0, systems=("OpenFOAM: meshQualityDict minTwist",),
        formula="min over the triangles about the centre of the face of n.d/|d|, n the triangle's normal; on the boundary d runs from the centre of the cell to that of the face",
        source="OpenFOAM polyMeshGeometry::checkFaceTwist", caveat="OpenFOAM looks at faces of four and more nodes only.", kernel=face_twist,
    ),
    Metric(
        id="openfoam.face_pyramid", title="Smallest face pyramid", entity="face", on=_EVERY, unit="L3", low=-math.inf, high=math.inf, best="high",
        ideal=None, degenerate=0.0, systems=("OpenFOAM: face pyramids, meshQualityDict minVol",),
        formula="A.(c - C)/3, the smaller of the two sides, positive outward of the owner and inward of the neighbour; A.(c - C)/2 in 2-D",
        source="OpenFOAM primitiveMeshTools::facePyramidVolume", caveat="In 2-D an area: unit L2.", kernel=face_pyramid,
    ),
    Metric(
        id="openfoam.concave_angle", title="Concave face angle", entity="face", on=_EVERY, unit="deg", low=0.0, high=180.0, best="low",
        ideal=0.0, degenerate=math.nan, systems=("OpenFOAM: concave angles in faces, meshQualityDict maxConcave",),
        formula="largest angle between consecutive edges of the face where it turns against its normal; 0 for a convex face",
        source="OpenFOAM primitiveMeshTools::faceConcavity",
        caveat="OpenFOAM takes an arc sine and prints 180 minus the angle beyond 90; it ignores turns of less than 10.", kernel=concave_angle,
    ),
    Metric(
        id="wall.orthogonality_deg", title="Wall orthogonality", entity="face", on=_OUTSIDE, unit="deg", low=-90.0, high=90.0, best="high",
        ideal=90.0, degenerate=math.nan, systems=("CFDyna: theta at a wall",),
        formula="90 - angle between A and c - C, from the centre of the cell to that of the face", source="CFDyna, Meshing for Numerical Simulations",
        caveat="Of all boundary faces: group by zone to see the walls alone.", kernel=wall_orthogonality,
    ),
)  # fmt: skip
