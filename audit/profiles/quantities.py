"""Numbers of faces that only limits of OpenFOAM's meshQualityDict ask for, as its motion smoother computes them.

Sources: OpenFOAM polyMeshGeometry.C (face tets, face angles, triangle twist, cell determinant),
polyMeshTetDecomposition.C (base points) and tetrahedronI.H (tet quality).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces
from meshwright.audit.geometry import cell_geometry, face_geometry, in_safe_units
from meshwright.audit.mesh import NO_CELL, Floats, Mesh

__all__ = ["QUANTITIES", "Quantity"]

_VSMALL = 1e-300
_SMALL = 1e-15
_EQUILATERAL = 8.0 / (9.0 * math.sqrt(3.0))
"""Volume of a regular tetrahedron over the cube of its circumradius."""


@dataclass(frozen=True, eq=False)
class Quantity:
    """A number of faces that is no metric of the registry.

    values: (mesh) -> a value per face of `connectivity.faces`, nan where there is none.  The other fields: as those of
    `Metric`.
    """

    id: str
    title: str
    best: str
    unit: str
    low: float
    high: float
    formula: str
    source: str
    values: Callable[[Mesh], Floats]
    entity: str = "face"
    on: tuple[str, ...] = ("interior", "boundary")


def _by_size(mesh: Mesh, least: int = 3) -> Iterator[tuple[NDArray[np.intp], Floats]]:
    """Faces of one number of nodes at a time: their rows and corners (m, n, 3)."""
    table = faces(mesh)
    sizes = np.diff(table.offsets)
    for n in np.unique(sizes):
        if n >= least:
            rows = np.flatnonzero(sizes == n)
            nodes = table.nodes[table.offsets[rows][:, None] + np.arange(n)]
            yield rows, mesh.points[nodes]


def _dot(a: Floats, b: Floats) -> Floats:
    found: Floats = np.einsum("...i,...i->...", a, b)
    return found


def _unit(a: Floats) -> tuple[Floats, Floats]:
    """Directions, 0 where there is none, and lengths."""
    size = np.sqrt(_dot(a, a))
    return a / np.where(size > 0, size, 1.0)[..., None], size


def _tet_quality(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Signed volume over that of the regular tetrahedron with the same circumsphere."""
    u, v, w = b - a, c - a, d - a
    normal = np.cross(v, u)
    denominator = _dot(w, normal)
    top = (_dot(w, w) - _dot(u, w))[..., None] * normal - (_dot(v, v) - _dot(u, v))[..., None] * np.cross(w, u)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        centre = 0.5 * (u + top / denominator[..., None])
        radius = np.sqrt(_dot(centre, centre))
        quality = -denominator / 6.0 / (_EQUILATERAL * radius**3)
    return np.where(np.abs(denominator) > _VSMALL, quality, 0.0)


def _tets(mesh: Mesh) -> Floats:
    """Worst tet of the cuts of a face about its centre, and of the best of its cuts from one of its nodes."""
    scaled, _ = in_safe_units(mesh)
    table = faces(scaled)
    out = np.full(len(table), math.nan)
    centre, cell = face_geometry(scaled).centre, cell_geometry(scaled).centre
    for rows, x in _by_size(scaled):
        n = x.shape[1]
        apexes = [(cell[table.owner[rows]], False, np.ones(len(rows), bool))]
        inside = table.neighbour[rows] != NO_CELL
        apexes.append((cell[np.where(inside, table.neighbour[rows], 0)], True, inside))
        worst = np.full(len(rows), math.inf)
        based = np.full((n, len(rows)), math.inf)
        for apex, turned, there in apexes:
            for i in range(n):
                p, q = x[:, i], x[:, (i + 1) % n]
                fan = _tet_quality(p, q, centre[rows], apex) if turned else _tet_quality(p, q, apex, centre[rows])
                worst = np.where(there, np.minimum(worst, fan), worst)
                for k in range(1, n - 1):
                    a, b = x[:, (i + k) % n], x[:, (i + k + 1) % n]
                    a, b = (b, a) if turned else (a, b)
                    cut = _tet_quality(apex, x[:, i], a, b)
                    based[i] = np.where(there, np.minimum(based[i], cut), based[i])
        out[rows] = np.minimum(worst, based.max(axis=0))
    return out


def _concavity(mesh: Mesh) -> Floats:
    """Largest turn against the normal of a face, its sine taken for the angle."""
    normal = _unit(face_geometry(mesh).area)[0]
    out = np.full(len(faces(mesh)), math.nan)
    for rows, x in _by_size(mesh):
        edge, length = _unit(np.roll(x, -1, axis=1) - x)
        turn = np.cross(np.roll(edge, 1, axis=1), edge)
        direction, sine = _unit(turn)
        seen = (length > 0) & (np.roll(length, 1, axis=1) > 0) & (sine > 0)
        reflex = seen & (_dot(direction, normal[rows][:, None]) < _SMALL)
        out[rows] = np.degrees(np.arcsin(np.minimum(np.where(reflex, sine, 0.0).max(axis=1), 1.0)))
    return out


def _triangle_twist(mesh: Mesh) -> Floats:
    """Smallest cosine between the normals of consecutive triangles about the centre of a face of four nodes or more."""
    centre = face_geometry(mesh).centre
    out = np.full(len(faces(mesh)), math.nan)
    for rows, x in _by_size(mesh, least=4):
        c = centre[rows][:, None]
        normal, area = _unit(np.cross(x - c, np.roll(x, -1, axis=1) - c))
        there = area > 0
        value = np.where(there.all(axis=1), math.inf, 0.0)  # a triangle without area fails any limit above 0
        previous = np.zeros((len(rows), 3))
        known = np.zeros(len(rows), bool)
        for i in [*range(x.shape[1]), *range(x.shape[1])]:  # the second round meets the first triangle again
            here = there[:, i]
            value = np.where(known & here, np.minimum(value, _dot(previous, normal[:, i])), value)
            previous = np.where(here[:, None], normal[:, i], previous)
            known |= here
        out[rows] = np.where(known, value, math.nan)
    return out


def _determinants(mesh: Mesh) -> Floats:
    """The lower of both cells' 27 det(sum A A / |A| / sum |A|) over all faces of a cell; 1 for a cube."""
    table, area = faces(mesh), face_geometry(mesh).area
    direction, size = _unit(area)
    n = mesh.n_cells
    inside = table.neighbour != NO_CELL
    sides = np.concatenate([np.arange(len(table)), np.flatnonzero(inside)])
    cells = np.concatenate([table.owner, table.neighbour[inside]])
    total = np.bincount(cells, size[sides], n)
    tensor = np.empty((n, 3, 3))
    for i in range(3):
        for j in range(i, 3):
            part = np.bincount(cells, (size * direction[:, i] * direction[:, j])[sides], n)
            tensor[:, i, j] = tensor[:, j, i] = part / np.where(total > 0, total, 1.0)
    determinant = 27.0 * np.linalg.det(tensor)
    of_owner = determinant[table.owner]
    return np.where(inside, np.minimum(of_owner, determinant[np.where(inside, table.neighbour, 0)]), of_owner)


def _solid(values: Callable[[Mesh], Floats]) -> Callable[[Mesh], Floats]:
    """nan for the edges of 2-D cells, and where coordinates are not finite."""

    def of(mesh: Mesh) -> Floats:
        if mesh.cell_dimension < 3:
            return np.full(len(faces(mesh)), math.nan)
        with np.errstate(invalid="ignore"):
            return values(mesh)

    return of


_POLY = "OpenFOAM polyMeshGeometry.C"

QUANTITIES: dict[str, Quantity] = {
    row.id: row
    for row in (
        Quantity(
            "openfoam.tet_quality", "Face tet quality", "high", "1", -math.inf, 1.0,
            "V over that of the regular tet with the same circumsphere; the worst tet over the face triangles about "
            "the face centre and over those about the best base node, with the centres of both cells",
            f"{_POLY}, checkFaceTets", _solid(_tets),
        ),
        Quantity(
            "openfoam.face_concavity_deg", "Face concavity", "low", "deg", 0.0, 90.0,
            "asin of the largest sine between consecutive edges of a face that turn against its normal",
            f"{_POLY}, checkFaceAngles", _solid(_concavity),
        ),
        Quantity(
            "openfoam.triangle_twist", "Triangle twist", "high", "1", -1.0, 1.0,
            "smallest cosine between the normals of consecutive triangles about the centre of a face",
            f"{_POLY}, checkTriangleTwist", _solid(_triangle_twist), on=("interior", "boundary"),
        ),
        Quantity(
            "openfoam.smoother_determinant", "Cell determinant of the motion smoother", "high", "1", 0.0, 1.0,
            "27 det(sum(A A/|A|) / sum |A|) over all faces of a cell; of a face the lower of its cells'. checkMesh's "
            "own determinant takes the interior faces alone",
            f"{_POLY}, checkCellDeterminant", _solid(_determinants),
        ),
    )
}  # fmt: skip
"""By id. A face of a 2-D mesh has none of them, and a triangle no triangle twist."""
