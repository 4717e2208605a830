"""Numbers of faces that only limits of OpenFOAM's meshQualityDict ask for, as its motion smoother computes them.

Sources: OpenFOAM polyMeshGeometry.C (face tets, face angles, triangle twist, cell determinant),
polyMeshTetDecomposition.C (base points) and tetrahedronI.H (tet quality).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.connectivity import faces
from meshwright.audit.geometry import face_geometry
from meshwright.audit.mesh import NO_CELL, Floats, Mesh
from meshwright.audit.profiles.face_shapes import CONCAVITY, TETS, TWIST, face_shapes

__all__ = ["QUANTITIES", "Quantity"]


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


def _column(column: int) -> Callable[[Mesh], Floats]:
    def of(mesh: Mesh) -> Floats:
        found: Floats = face_shapes(mesh)[:, column]
        return found

    return of


@once_per_mesh
def _determinants(mesh: Mesh) -> Floats:
    """The lower of both cells' 27 det(sum A A / |A| / sum |A|) over all faces of a cell; 1 for a cube."""
    table, area = faces(mesh), face_geometry(mesh).area
    size = np.sqrt(np.einsum("ij,ij->i", area, area))
    direction = area / np.where(size > 0, size, 1.0)[:, None]
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
            f"{_POLY}, checkFaceTets", _solid(_column(TETS)),
        ),
        Quantity(
            "openfoam.face_concavity_deg", "Face concavity", "low", "deg", 0.0, 90.0,
            "largest angle, folded to 90, between consecutive edges of a face that turn against its normal",
            f"{_POLY}, checkFaceAngles", _solid(_column(CONCAVITY)),
        ),
        Quantity(
            "openfoam.triangle_twist", "Triangle twist", "high", "1", -1.0, 1.0,
            "smallest cosine between the normals of consecutive triangles about the centre of a face",
            f"{_POLY}, checkTriangleTwist", _solid(_column(TWIST)),
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
