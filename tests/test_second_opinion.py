"""VTK's Verdict filter on random cells, wherever its definition is the same as ours."""

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh

vtk = pytest.importorskip("vtk", reason="VTK is not installed: pip install 'meshwright[oracles]'")

SHAPES = {
    "tri": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0)],
    "quad": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    "tet": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0.5, 0.29, 0.82)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0.7)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0, 0, 1), (1, 0, 1), (0.5, 0.87, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}
VTK_NAMES = {"tri": "Triangle", "quad": "Quad", "tet": "Tet", "pyramid": "Pyramid", "wedge": "Wedge", "hex": "Hex"}

# (type, our metric, VTK's measure, VTK's value from ours)
SAME = [
    ("tri", "area", "Area", lambda v: v),
    ("tri", "gambit.aspect_ratio", "RadiusRatio", lambda v: v),
    ("tri", "gambit.edge_ratio", "EdgeRatio", lambda v: v),
    ("tri", "gambit.equiangle_skew", "EquiangleSkew", lambda v: v),
    ("tri", "angle.min", "MinAngle", lambda v: v),
    ("tri", "angle.max", "MaxAngle", lambda v: v),
    ("quad", "gambit.edge_ratio", "EdgeRatio", lambda v: v),
    ("quad", "gambit.midangle_skew", "Skew", lambda v: v),
    ("quad", "gambit.stretch", "Stretch", lambda v: 1 - v),
    ("quad", "gambit.equiangle_skew", "EquiangleSkew", lambda v: v),
    ("tet", "volume", "Volume", lambda v: v),
    ("tet", "gambit.aspect_ratio", "RadiusRatio", lambda v: v),
    ("tet", "gambit.edge_ratio", "EdgeRatio", lambda v: v),
    ("tet", "gambit.equisize_skew", "EquivolumeSkew", lambda v: v),
    ("tri", "icem.r_over_R_x2", "RadiusRatio", lambda v: 1 / v),
    ("tet", "icem.r_over_R_x3", "RadiusRatio", lambda v: 1 / v),
    ("tet", "fluent.cell_squish", "SquishIndex", lambda v: v),
    ("pyramid", "gambit.equiangle_skew", "EquiangleSkew", lambda v: v),
    ("wedge", "gambit.edge_ratio", "EdgeRatio", lambda v: v),
    ("wedge", "gambit.equiangle_skew", "EquiangleSkew", lambda v: v),
    ("hex", "volume", "Volume", lambda v: v),
    ("hex", "gambit.diagonal_ratio", "Diagonal", lambda v: 1 / v),
    ("hex", "gambit.equiangle_skew", "EquiangleSkew", lambda v: v),
    ("hex", "gambit.midangle_skew", "Skew", lambda v: v),
    ("hex", "gambit.stretch", "Stretch", lambda v: 1 - v),
    ("hex", "icem.determinant", "NodalJacobianRatio", lambda v: v),
]

# Where Verdict's number of the same name is another one: why it is not compared. Each was checked on cells like these.
DIFFERENT = {
    ("hex", "EdgeRatio"): "its maximum is taken over edges 0 to 5 only: a 1 x 1 x 5 box gets 1",
    ("tet", "MinAngle"): "mixes dihedral angles and their supplements",
    ("tet", "EquiangleSkew"): "dihedral angles count too; GAMBIT takes face angles only",
    ("quad", "AspectRatio"): "Lmax P / 4A; GAMBIT takes mean length over mean width",
    ("quad", "Taper"): "divides by the shorter bisector and counts the out-of-plane part",
    ("quad", "Warpage"): "a cosine, 1 best",
    ("hex", "Taper"): "largest cross derivative over the shortest axis",
}


def random_cells(type_name, n=400):
    shape = np.array(SHAPES[type_name])
    flat = type_name in ("tri", "quad")
    noise = np.random.default_rng(5).uniform(-0.12, 0.12, (n, *shape.shape)) * (1, 1, 0 if flat else 1)
    return (shape + noise).reshape(-1, 3)


def verdict(type_name, points, measure_name):
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    n = len(SHAPES[type_name])
    grid = vtk.vtkUnstructuredGrid()
    vtk_points = vtk.vtkPoints()
    vtk_points.SetData(numpy_to_vtk(points, deep=True))
    grid.SetPoints(vtk_points)
    for first in range(0, len(points), n):
        grid.InsertNextCell(CELL_TYPES[type_name].vtk, n, list(range(first, first + n)))
    quality = vtk.vtkMeshQuality()
    quality.SetInputData(grid)
    getattr(quality, f"Set{VTK_NAMES[type_name]}QualityMeasureTo{measure_name}")()
    quality.Update()
    return vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality"))


def ours(type_name, points, metric):
    nodes = np.arange(len(points)).reshape(-1, len(SHAPES[type_name]))
    mesh = Mesh(points, (CellBlock(type_name, np.arange(len(nodes)), nodes),))
    return measure(mesh, [metric], threads=1).values[metric][type_name]


@pytest.mark.parametrize(
    ("type_name", "metric", "name", "convert"), SAME, ids=lambda v: v if isinstance(v, str) else ""
)
def test_verdict_gives_the_same_number(type_name, metric, name, convert):
    points = random_cells(type_name)
    np.testing.assert_allclose(
        verdict(type_name, points, name), convert(ours(type_name, points, metric)), rtol=1e-9, atol=1e-12
    )


def test_the_known_differences_are_still_there():
    """When a release of VTK mends one of these, it can move to the list of equals."""
    box = np.array([(x, y, z) for z in (0, 5) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    assert verdict("hex", box, "EdgeRatio")[0] == pytest.approx(1.0)
    assert ours("hex", box, "gambit.edge_ratio")[0] == pytest.approx(5.0)
    rectangle = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], dtype=float)
    assert verdict("quad", rectangle, "AspectRatio")[0] == pytest.approx(1.5)
    assert ours("quad", rectangle, "gambit.aspect_ratio")[0] == pytest.approx(2.0)
    assert ("hex", "EdgeRatio") in DIFFERENT
    assert ("quad", "AspectRatio") in DIFFERENT
