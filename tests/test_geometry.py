"""Areas, volumes and centres against closed forms, the reference values, VTK and each other."""

import json
import math
import runpy
from itertools import permutations, product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, faces_of_cells
from meshwright.audit.geometry import bounds, cell_geometry, face_geometry, total_volume
from meshwright.audit.mesh import CellBlock, Faces, Mesh

hybrid_mesh = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))["hybrid_mesh"]

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)


def solid(name, points):
    return Mesh(np.array(points, float), (CellBlock(name, [0], [np.arange(CELL_TYPES[name].n_nodes)]),))


def flat(name, points, dimension=2):
    points = np.array(points, float)
    points = np.column_stack([points, np.zeros(len(points))]) if points.shape[1] == 2 else points
    n = len(points)
    polygon = dict(offsets=[0, n], items=np.arange(n))
    block = CellBlock(name, [0], **(polygon if name == "polygon" else {"nodes": [np.arange(n)]}))
    return Mesh(points, (block,), dimension=dimension)


def polyhedral(mesh):
    """The same mesh told by faces alone, every cell a polyhedron."""
    offsets, items = faces_of_cells(mesh)
    block = CellBlock("polyhedron", np.arange(mesh.n_cells), offsets=offsets, items=items)
    return Mesh(mesh.points, (block,), faces=faces(mesh))


def convex(vertices, normals):
    """The polyhedron with these vertices whose faces look along `normals`, as a mesh of one cell."""
    sides = []
    for normal in normals:
        height = vertices @ normal
        on = np.flatnonzero(height > height.max() - 1e-9)
        u = vertices[on[0]] - vertices[on].mean(axis=0)
        v = np.cross(normal, u)
        around = vertices[on] - vertices[on].mean(axis=0)
        sides.append(on[np.argsort(np.arctan2(around @ v * math.hypot(*u) / math.hypot(*v), around @ u))])
    n = len(sides)
    table = Faces(
        np.cumsum([0, *map(len, sides)]), np.concatenate(sides), np.zeros(n, np.int32), np.full(n, -1, np.int32)
    )
    return Mesh(vertices, (CellBlock("polyhedron", [0], offsets=[0, n], items=np.arange(n)),), faces=table)


def dodecahedron():
    """Edge 2/phi about the origin."""
    phi = (1 + 5**0.5) / 2
    turns = lambda a, b, c: [(a, b, c), (c, a, b), (b, c, a)]  # noqa: E731
    vertices = [*product((-1, 1), repeat=3)]
    vertices += [v for s, t in product((-1, 1), repeat=2) for v in turns(0, s / phi, t * phi)]
    normals = [v for s, t in product((-1, 1), repeat=2) for v in turns(0, s * phi, t)]
    return convex(np.array(vertices, float), np.array(normals) / math.hypot(phi, 1))


def truncated_octahedron():
    """Edge sqrt 2 about the origin."""
    vertices = {tuple(s * x for s, x in zip(signs, p, strict=True)) for p in permutations((0, 1, 2))
                for signs in product((-1, 1), repeat=3)}  # fmt: skip
    normals = [*np.eye(3), *-np.eye(3), *(np.array([*product((-1, 1), repeat=3)]) / 3**0.5)]
    return convex(np.array(sorted(vertices), float), np.array(normals))


@pytest.mark.parametrize(
    ("mesh", "n_faces", "volume", "area"),
    [
        (
            dodecahedron(),
            12,
            (15 + 7 * 5**0.5) / 4 * (5**0.5 - 1) ** 3,
            3 * math.sqrt(25 + 10 * 5**0.5) * (5**0.5 - 1) ** 2,
        ),
        (truncated_octahedron(), 14, 8 * 2**0.5 * 2**1.5, (6 + 12 * 3**0.5) * 2),
    ],
    ids=["dodecahedron", "truncated octahedron"],
)
@pytest.mark.parametrize("shift", [0.0, 1e4, 2.0**30])
def test_polyhedra_have_the_volume_area_and_centre_of_the_books(mesh, n_faces, volume, area, shift):
    moved = Mesh(mesh.points + shift, mesh.blocks, faces=mesh.faces)
    found = cell_geometry(moved)
    # a coordinate stored at an offset d is rounded by d * 2**-53, which moves the walls by as much
    slack = 1e-13 + 8 * shift * 2.0**-53
    assert len(faces(moved)) == n_faces
    assert found.volume[0] == pytest.approx(volume, rel=slack)
    assert found.centre[0] == pytest.approx([shift] * 3, abs=4 * slack + shift * 2.0**-52)
    assert np.linalg.norm(face_geometry(moved).area, axis=1).sum() == pytest.approx(area, rel=slack)


@pytest.mark.parametrize(
    ("name", "points", "volume", "centre"),
    [
        ("tet", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], 1 / 6, [1 / 4] * 3),
        ("pyramid", [*CUBE[:4], [0.5, 0.5, 3]], 1.0, [0.5, 0.5, 3 / 4]),
        ("wedge", [*CUBE[[0, 1, 3]], *CUBE[[4, 5, 7]]], 1 / 2, [1 / 3, 1 / 3, 1 / 2]),
        ("hex", CUBE * [2, 3, 4], 24.0, [1, 1.5, 2]),
        ("hex", [*(CUBE[:4] * 2 - [0.5, 0.5, 0]), *CUBE[4:]], 7 / 3, [0.5, 0.5, 11 / 28]),
    ],
    ids=["corner tet", "pyramid", "half cube", "cuboid", "frustum"],
)
def test_simple_solids_have_the_volume_and_centre_of_the_books(name, points, volume, centre):
    found = cell_geometry(solid(name, points))
    assert found.volume[0] == pytest.approx(volume, rel=1e-14)
    assert found.centre[0] == pytest.approx(centre, rel=1e-13)
    mirrored = cell_geometry(solid(name, np.array(points, float) * [1, 1, -1]))
    assert mirrored.volume[0] == pytest.approx(-volume, rel=1e-14)
    assert mirrored.centre[0] == pytest.approx(np.array(centre) * [1, 1, -1], rel=1e-13)


def test_a_cube_without_one_pyramid_keeps_five_sixths():
    # the side z = 1 goes down to the middle of the cube
    sides = [s for s in CELL_TYPES["hex"].faces if s != (4, 5, 6, 7)] + [(4, 5, 8), (5, 6, 8), (6, 7, 8), (7, 4, 8)]
    table = Faces(np.cumsum([0, *map(len, sides)]), np.concatenate(sides), [0] * 9, [-1] * 9)
    block = CellBlock("polyhedron", [0], offsets=[0, 9], items=np.arange(9))
    found = cell_geometry(Mesh(np.array([*CUBE, [0.5, 0.5, 0.5]]), (block,), faces=table))
    assert found.volume[0] == pytest.approx(5 / 6, rel=1e-14)
    assert found.centre[0] == pytest.approx([0.5, 0.5, (0.5 - 1 / 6 * 7 / 8) / (5 / 6)], rel=1e-13)


def test_every_reference_element_has_its_reference_size(shared):
    elements = json.loads((shared / "reference" / "golden.json").read_text())["elements"]
    compared = 0
    for element in elements:
        kind = CELL_TYPES[element["type"]]
        key = "area" if kind.dimension == 2 else "volume"
        found = cell_geometry(solid(element["type"], element["points"])).volume[0]
        scale = np.ptp(np.array(element["points"]), axis=0).max() ** kind.dimension
        assert found == pytest.approx(float(element["values"][key]), rel=1e-12, abs=1e-15 * scale), element["name"]
        compared += 1
    assert compared > 60


@given(seed=st.integers(0, 2**32 - 1), shift=st.sampled_from([0.0, 1e4, 1e6, 1e9]))
@settings(max_examples=30, deadline=None)
def test_both_routes_agree_and_fill_the_box(seed, shift):
    mesh = hybrid_mesh(seed, n=2)
    mesh = Mesh(mesh.points + shift, mesh.blocks)
    by_nodes, by_faces = cell_geometry(mesh), cell_geometry(polyhedral(mesh))
    # both start from the same stored points: the offset must not show
    assert by_nodes.volume == pytest.approx(by_faces.volume, rel=1e-11, abs=1e-14)
    assert by_nodes.centre == pytest.approx(by_faces.centre, abs=1e-12 + 4e-16 * shift)
    assert by_nodes.volume.min() > 0
    found, geometry = faces(mesh), face_geometry(mesh)
    skin = found.neighbour < 0
    local = geometry.centre[skin] - shift
    gauss = np.einsum("ij,ij->", local, geometry.area[skin]) / 3
    assert total_volume(mesh) == pytest.approx(gauss, rel=1e-12 + 1e-15 * shift)
    assert np.abs(geometry.area[skin].sum(axis=0)).max() < 1e-12
    across = by_nodes.centre[found.neighbour[~skin]] - by_nodes.centre[found.owner[~skin]]
    assert np.einsum("ij,ij->i", across, geometry.area[~skin]).min() > 0


def verdict_volumes(mesh):
    """(n_cells,) volume by VTK's Verdict, and the VTK number of each cell's type."""
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for p in mesh.points:
        points.InsertNextPoint(p)
    cells = {}
    for block in mesh.blocks:
        for row, nodes in zip(block.rows.tolist(), block.nodes.tolist(), strict=True):
            cells[row] = CELL_TYPES[block.type].vtk, nodes
    grid = vtk.vtkUnstructuredGrid()
    grid.SetPoints(points)
    for row in range(mesh.n_cells):
        number, nodes = cells[row]
        grid.InsertNextCell(number, len(nodes), nodes)
    quality = vtk.vtkMeshQuality()
    quality.SetInputData(grid)
    quality.SetTetQualityMeasureToVolume()
    quality.SetPyramidQualityMeasureToVolume()
    quality.SetWedgeQualityMeasureToVolume()
    quality.SetHexQualityMeasureToVolume()
    quality.Update()
    values = vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality")).copy()
    return values, np.array([cells[row][0] for row in range(mesh.n_cells)])


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_volumes_are_verdicts(seed):
    warped = hybrid_mesh(seed, n=2)
    wanted, kinds = verdict_volumes(warped)
    # Verdict cuts a warped side of a pyramid or wedge along one diagonal; tets and hexes leave no choice
    alike = np.isin(kinds, [CELL_TYPES["tet"].vtk, CELL_TYPES["hex"].vtk])
    assert cell_geometry(warped).volume[alike] == pytest.approx(wanted[alike], rel=1e-12)
    straight = hybrid_mesh(seed, n=2, jitter=0.0)
    assert total_volume(straight) == pytest.approx(8.0, rel=1e-14)
    affine = np.eye(3) + np.random.default_rng(seed).uniform(-0.25, 0.25, (3, 3))
    oblique = Mesh(straight.points @ affine.T, straight.blocks)
    assert cell_geometry(oblique).volume == pytest.approx(verdict_volumes(oblique)[0], rel=1e-12)
    assert total_volume(oblique) == pytest.approx(8 * np.linalg.det(affine), rel=1e-13)


def test_the_answer_has_the_same_bits_for_any_number_of_threads():
    n = 34
    line = np.arange(n + 1.0)
    rng = np.random.default_rng(0)
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    row = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    corner = lambda a, b, c: row[a : n + a, b : n + b, c : n + c].ravel()  # noqa: E731
    order = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.stack([corner(*v) for v in order], axis=1)
    mesh = Mesh(points + rng.uniform(-0.2, 0.2, points.shape), (CellBlock("hex", np.arange(n**3), cells),))
    for measure, names in ((cell_geometry, ("volume", "centre")), (face_geometry, ("area", "centre"))):
        one, two, five = (measure(mesh, threads) for threads in (1, 2, 5))
        for name in names:
            assert getattr(one, name).tobytes() == getattr(two, name).tobytes() == getattr(five, name).tobytes()
    assert cell_geometry(mesh) is cell_geometry(mesh)


def test_flat_cells_are_signed_and_shells_are_not():
    square = [[0, 0], [2, 0], [2, 1], [0, 1]]
    assert cell_geometry(flat("quad", square)).volume[0] == 2.0
    assert cell_geometry(flat("quad", square[::-1])).volume[0] == -2.0
    assert cell_geometry(flat("quad", square[::-1], dimension=3)).volume[0] == 2.0
    lifted = [[0, 0, 0], [3, 0, 4], [3, 2, 4], [0, 2, 0]]
    shell = cell_geometry(flat("quad", lifted, dimension=3))
    assert (shell.volume[0], shell.centre[0].tolist()) == (10.0, [1.5, 1.0, 2.0])


def test_a_regular_polygon_has_the_area_of_the_books():
    for n in (5, 7, 100):
        turn = 2 * np.pi * np.arange(n) / n
        found = cell_geometry(flat("polygon", np.column_stack([np.cos(turn), np.sin(turn)]) + 10.0))
        assert found.volume[0] == pytest.approx(n / 2 * math.sin(2 * math.pi / n), rel=1e-13)
        assert found.centre[0] == pytest.approx([10, 10, 0], abs=1e-13)


def test_edges_of_a_flat_mesh_point_away_from_their_owner_in_the_plane():
    mesh = flat("tri", [[0, 0], [4, 0], [0, 3]])
    found = face_geometry(mesh)
    assert found.area == pytest.approx(np.array([[0, -4, 0], [3, 4, 0], [-3, 0, 0]]))
    assert found.centre == pytest.approx(np.array([[2, 0, 0], [2, 1.5, 0], [0, 1.5, 0]]))


def test_edges_of_a_shell_point_away_from_their_owner_in_its_plane():
    mesh = flat("quad", [[0, 0, 0], [3, 0, 4], [3, 2, 4], [0, 2, 0]], dimension=3)
    found = face_geometry(mesh).area
    assert found == pytest.approx(np.array([[0, -5, 0], [1.2, 0, 1.6], [0, 5, 0], [-1.2, 0, -1.6]]))


def test_cells_without_size_have_volume_zero_and_a_finite_centre():
    found = cell_geometry(solid("hex", np.ones((8, 3))))
    assert (found.volume[0], found.centre[0].tolist()) == (0.0, [1.0, 1.0, 1.0])
    faces_found = face_geometry(solid("hex", np.ones((8, 3))))
    assert np.array_equal(faces_found.centre, np.ones((6, 3)))


def test_a_nan_stays_with_the_cells_that_use_it():
    points = np.array([*CUBE, *(CUBE + 5)])
    points[3] = np.nan
    mesh = Mesh(points, (CellBlock("hex", [0, 1], [np.arange(8), np.arange(8, 16)]),))
    volume = cell_geometry(mesh).volume
    assert np.isnan(volume[0])
    assert volume[1] == 1.0
    assert bounds(mesh).tolist() == [[0, 0, 0], [6, 6, 6]]


def test_second_order_cells_are_measured_by_their_corners():
    corners = solid("hex", CUBE * [1, 2, 3])
    middle = [np.mean(corners.points[list(edge)], axis=0) + 0.1 for edge in CELL_TYPES["hex"].edges]
    quadratic = solid("hex20", [*corners.points, *middle])
    assert cell_geometry(quadratic).volume[0] == cell_geometry(corners).volume[0]
