"""The boundary of real meshes is the surface that VTK finds."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import boundary_faces, cell_components, faces
from meshwright.audit.mesh import CellBlock, Mesh


def boundary_nodes(mesh):
    found = faces(mesh)
    return [found.nodes[found.offsets[f] : found.offsets[f + 1]].tolist() for f in boundary_faces(mesh)]


_SOLID = {10: "tet", 12: "hex", 13: "wedge", 14: "pyramid"}


def vtk_solids(path):
    """(VTK grid, Mesh) with the solid cells of a VTK file, read by VTK."""
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkXMLUnstructuredGridReader() if path.suffix == ".vtu" else vtk.vtkUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    kinds = [grid.GetCellType(c) for c in range(grid.GetNumberOfCells())]
    solid = vtk.vtkExtractCells()
    solid.SetInputData(grid)
    keep = vtk.vtkIdList()
    for c in np.flatnonzero(np.isin(kinds, list(_SOLID))):
        keep.InsertNextId(int(c))
    solid.SetCellList(keep)
    solid.Update()
    grid = solid.GetOutput()
    kinds = np.array([grid.GetCellType(c) for c in range(grid.GetNumberOfCells())])
    offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    blocks = []
    for number, name in _SOLID.items():
        rows = np.flatnonzero(kinds == number)
        if len(rows):
            width = CELL_TYPES[name].n_nodes
            blocks.append(CellBlock(name, rows, nodes[offsets[rows][:, None] + np.arange(width)]))
    return grid, Mesh(vtk_to_numpy(grid.GetPoints().GetData()).astype(float), tuple(blocks))


@pytest.mark.parametrize(
    "name",
    ["can.vtu", "grid_in_vtk_3d_04.vtk", "mesh_vtk51.vtk", "sfepy_cylinder.vtk", "sfepy_wheelset.vtk", "tetraMesh.vtk"],
)
def test_the_boundary_of_real_meshes_is_vtks_surface(shared, name):
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    grid, mesh = vtk_solids(shared / "meshes" / "vtk" / name)
    surface = vtk.vtkDataSetSurfaceFilter()
    surface.SetInputData(grid)
    surface.PassThroughPointIdsOn()
    surface.Update()
    skin = surface.GetOutput()
    original = vtk_to_numpy(skin.GetPointData().GetArray("vtkOriginalPointIds"))
    polys = skin.GetPolys()
    offsets = vtk_to_numpy(polys.GetOffsetsArray())
    nodes = original[vtk_to_numpy(polys.GetConnectivityArray())]
    wanted = Counter(frozenset(nodes[a:b].tolist()) for a, b in pairwise(offsets))
    found = Counter(frozenset(nodes) for nodes in boundary_nodes(mesh))
    assert found == wanted
    assert len(boundary_faces(mesh)) == skin.GetNumberOfCells()
    parts = vtk.vtkConnectivityFilter()
    parts.SetInputData(grid)
    parts.SetExtractionModeToAllRegions()
    parts.Update()
    # VTK joins cells at a shared point, we at a shared face: never fewer parts here
    assert cell_components(mesh).max() + 1 >= parts.GetNumberOfExtractedRegions()
