"""Equi-angle skew by VTK, the independent second opinion on meshes that have no closed form."""

from __future__ import annotations

import numpy as np
import vtk
from generate.grid import FACES, Floats, Grid, Ints
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

__all__ = ["equiangle_skew"]

_VTK_CELL = {"tri": vtk.VTK_TRIANGLE, "quad": vtk.VTK_QUAD, "hex": vtk.VTK_HEXAHEDRON,
             "wedge": vtk.VTK_WEDGE, "pyramid": vtk.VTK_PYRAMID}  # fmt: skip
_SETTER = {"tri": "SetTriangleQualityMeasureToEquiangleSkew", "quad": "SetQuadQualityMeasureToEquiangleSkew",
           "hex": "SetHexQualityMeasureToEquiangleSkew", "wedge": "SetWedgeQualityMeasureToEquiangleSkew",
           "pyramid": "SetPyramidQualityMeasureToEquiangleSkew"}  # fmt: skip


def equiangle_skew(grid: Grid) -> dict[str, Floats]:
    """Type -> equi-angle skew of its cells in order of the file.

    VTK's own measure of a tetrahedron also looks at dihedral angles, so each is handed over as its four triangles.
    """
    found: dict[str, list[Floats]] = {}
    for part in grid.cells:
        if part.type == "tet":
            triangles = np.concatenate([part.nodes[:, face] for face in FACES["tet"]])
            values = _measured(grid.points, "tri", triangles).reshape(4, -1).max(axis=0)
        else:
            values = _measured(grid.points, part.type, part.nodes)
        found.setdefault(part.type, []).append(values)
    return {kind: np.concatenate(values) for kind, values in found.items()}


def _measured(points: Floats, kind: str, nodes: Ints) -> Floats:
    mesh = vtk.vtkUnstructuredGrid()
    where = vtk.vtkPoints()
    where.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    mesh.SetPoints(where)
    cells = vtk.vtkCellArray()
    offsets = np.arange(0, nodes.size + 1, nodes.shape[1], dtype=np.int64)
    flat = np.ascontiguousarray(nodes, dtype=np.int64).ravel()
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(flat, deep=True))
    mesh.SetCells(_VTK_CELL[kind], cells)
    quality = vtk.vtkMeshQuality()
    quality.SetInputData(mesh)
    getattr(quality, _SETTER[kind])()
    quality.Update()
    return np.array(vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality")))
