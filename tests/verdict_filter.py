"""Cells by the hundred and VTK's numbers for them; the tests of second opinions load this file."""

from functools import cache

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh

ROOT3 = 3**0.5
IDEAL = {
    "tri": [(0, 0, 0), (1, 0, 0), (0.5, ROOT3 / 2, 0)],
    "quad": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    "tet": [(0, 0, 0), (1, 0, 0), (0.5, ROOT3 / 2, 0), (0.5, ROOT3 / 6, (2 / 3) ** 0.5)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0.5**0.5)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0.5, ROOT3 / 2, 0), (0, 0, 1), (1, 0, 1), (0.5, ROOT3 / 2, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}
NAMES = {"tri": "Triangle", "quad": "Quad", "tet": "Tet", "pyramid": "Pyramid", "wedge": "Wedge", "hex": "Hex"}
FLAT_TYPES = ("tri", "quad")


def turned(cells, rng):
    """Each cell in an orientation of its own."""
    turns = np.linalg.qr(rng.normal(size=(len(cells), 3, 3)))[0]
    turns[np.linalg.det(turns) < 0, 0] *= -1
    return cells @ turns


def shaken(type_name, n, rng, most, plane):
    """The ideal cell with each corner moved by up to `most`; quads stay plane where asked."""
    shape = np.array(IDEAL[type_name])
    return shape + rng.uniform(-most, most, (n, *shape.shape)) * (1, 1, 0 if plane else 1)


def corner_jacobians(type_name, cells):
    """(n, corners) determinants of the edges at each corner; of plane cells in the x-y plane the cross product."""
    if type_name in FLAT_TYPES:
        a, b = np.roll(cells, -1, axis=1) - cells, np.roll(cells, 1, axis=1) - cells
        return np.cross(a, b)[..., 2]
    triads = CELL_TYPES[type_name].triad_table
    edges = cells[:, triads[:, 1:]] - cells[:, triads[:, :1]]
    return np.linalg.det(edges)


def least_corner(type_name, cells):
    """(n,) smallest over largest corner determinant, of the cell and of each of its quadrilaterals."""
    jacobians = corner_jacobians(type_name, cells)
    least = jacobians.min(axis=1) / np.abs(jacobians).max(axis=1)
    for face in CELL_TYPES[type_name].quad_faces:
        corners = cells[:, face]
        a, b = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
        normals = np.cross(a, b)
        mean = normals.sum(axis=1, keepdims=True)
        shares = (normals * mean).sum(axis=2) / (mean**2).sum(axis=2)
        least = np.minimum(least, shares.min(axis=1))
    return least


@cache
def families(type_name, n=400, seed=5):
    """{name: (n, corners, 3)} valid cells in any orientation: no corner of the cell or of a face is folded."""
    rng = np.random.default_rng(seed)
    plane = type_name in FLAT_TYPES
    made = {
        "random": shaken(type_name, 4 * n, rng, 0.15, plane),
        "sheared": shaken(type_name, 4 * n, rng, 0.05, plane),
        "stretched": shaken(type_name, 4 * n, rng, 0.1, plane),
        "warped": shaken(type_name, 4 * n, rng, 0.25, False),
    }
    made["sheared"][..., 0] += rng.uniform(-1.5, 1.5, (4 * n, 1)) * made["sheared"][..., 1]
    if not plane:
        made["sheared"][..., 1] += rng.uniform(-1.5, 1.5, (4 * n, 1)) * made["sheared"][..., 2]
    made["stretched"] *= 10 ** rng.uniform(-1, 1, (4 * n, 1, 3))
    for name, cells in made.items():
        valid = cells[least_corner(type_name, cells) > 0.02][:n]
        assert len(valid) == n, (type_name, name, len(valid))
        made[name] = turned(valid, rng)
    return made


def verdict(type_name, cells, measure_name):
    """(n,) of vtkMeshQuality."""
    import vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    cells = np.asarray(cells, dtype=float).reshape(-1, len(IDEAL[type_name]), 3)
    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    points.SetData(numpy_to_vtk(cells.reshape(-1, 3), deep=True))
    grid.SetPoints(points)
    k = cells.shape[1]
    for first in range(0, len(cells) * k, k):
        grid.InsertNextCell(CELL_TYPES[type_name].vtk, k, list(range(first, first + k)))
    quality = vtk.vtkMeshQuality()
    quality.SetInputData(grid)
    getattr(quality, f"Set{NAMES[type_name]}QualityMeasureTo{measure_name}")()
    quality.Update()
    return vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality"))


def ours(type_name, cells, metric):
    """(n,) of this program."""
    points = np.asarray(cells, dtype=float).reshape(-1, 3)
    nodes = np.arange(len(points)).reshape(-1, len(IDEAL[type_name]))
    mesh = Mesh(points, (CellBlock(type_name, np.arange(len(nodes)), nodes),))
    return measure(mesh, [metric], threads=1).values[metric][type_name]
