"""Points below the axis of rotation, and how upright cells stand on walls."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.connectivity import faces
from meshwright.audit.findings import Options, run_checks
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.readers import read

SAMPLES = Path(__file__).parent.parent / "samples"
hybrid_mesh = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))["hybrid_mesh"]


def found(mesh, code, **options):
    here = [f for f in run_checks(mesh, options=Options(**options)) if f.code == code]
    return here[0] if here else None


def grid(nx, ny, shear=0.0, **more):
    """Unit squares, x fastest, sheared in x; elements 0 to nx - 1 are the lower side."""
    x, y = np.meshgrid(np.arange(nx + 1.0), np.arange(ny + 1.0))
    row = np.arange(x.size).reshape(x.shape)
    nodes = np.stack([row[:-1, :-1], row[:-1, 1:], row[1:, 1:], row[1:, :-1]], axis=-1).reshape(-1, 4)
    points = np.stack([(x + shear * y).ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    lines = CellBlock("line", range(nx), [[i, i + 1] for i in range(nx)])
    return Mesh(points, (CellBlock("quad", range(len(nodes)), nodes),), boundary=(lines,), dimension=2, **more)


def moved(mesh, row, by):
    points = mesh.points.copy()
    points[row] += by
    return Mesh(points, mesh.blocks, mesh.boundary, zones=mesh.zones, dimension=mesh.dimension)


def test_one_point_a_thousandth_below_the_axis_is_named_when_the_mesh_is_axisymmetric():
    mesh = read(SAMPLES / "defects" / "below-axis.fluent.msh")
    finding = found(mesh, "points-below-axis", axis="x")
    assert (finding.severity, finding.entity, finding.count) == ("error", "point", 1)
    assert mesh.points[finding.rows[0], 1] == pytest.approx(-1e-3)
    assert finding.detail["lowest"] == pytest.approx(-1e-3)
    assert found(mesh, "points-below-axis") is None


def test_the_file_may_say_which_side_is_the_axis():
    zone = Zone("centre", "zone", "axis", "face", range(4))
    sound = grid(4, 2, zones=(zone,))
    assert found(sound, "points-below-axis") is None
    assert found(moved(sound, 2, (0, -1e-3, 0)), "points-below-axis").rows.tolist() == [2]
    # the same mesh standing upright, its axis along y
    for mesh, rows in ((sound, None), (moved(sound, 3, (0, -1e-3, 0)), [3])):
        nodes = mesh.blocks[0].nodes[:, ::-1]
        upright = Mesh(
            mesh.points[:, [1, 0, 2]], (CellBlock("quad", range(8), nodes),), mesh.boundary, zones=(zone,), dimension=2
        )
        finding = found(upright, "points-below-axis")
        assert (None if finding is None else finding.rows.tolist()) == rows
        assert finding is None or finding.detail["axis"] == "y"


@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
def test_rounding_on_the_axis_is_forgiven_in_proportion_to_the_mesh(scale):
    diagonal = math.hypot(4, 2)
    for below, there in ((0.5e-10, False), (2e-10, True)):
        mesh = moved(grid(4, 2), 1, (0, -below * diagonal, 0))
        mesh = Mesh(mesh.points * scale, mesh.blocks, dimension=2)
        assert (found(mesh, "points-below-axis", axis="x") is not None) == there


def test_points_that_no_cell_uses_and_meshes_in_space_have_no_axis():
    mesh = grid(4, 2)
    points = np.vstack([mesh.points, [(0, -5, 0)]])
    assert found(Mesh(points, mesh.blocks, dimension=2), "points-below-axis", axis="x") is None
    assert found(hybrid_mesh(0), "points-below-axis", axis="x") is None


@pytest.mark.parametrize("angle", [90.0, 60.0, 30.0, 12.0])
def test_a_sheared_cell_stands_on_its_wall_at_the_angle_of_the_shear(angle):
    # the centre of a parallelogram lies half its height along the slanted side above the middle of its base
    zone = Zone("plate", "physical group", "wall", "face", range(3))
    mesh = grid(3, 2, shear=1 / math.tan(math.radians(angle)), zones=(zone,))
    finding = found(mesh, "wall-orthogonality")
    (row,) = finding.detail["zones"]
    assert (row["zone"], row["faces"], row["below"], finding.severity) == ("plate", 3, 0, "info")
    assert row["min"] == pytest.approx(angle, rel=1e-9)
    assert row["mean"] == pytest.approx(angle, rel=1e-9)
    assert finding.rows.tolist() == [0, 1, 2]


def test_cells_that_lie_along_the_wall_are_a_warning():
    zone = Zone("plate", "physical group", "wall", "face", range(3))
    finding = found(grid(3, 2, shear=1 / math.tan(math.radians(8)), zones=(zone,)), "wall-orthogonality")
    assert (finding.severity, finding.rows.tolist()) == ("warning", [0, 1, 2])
    assert "8 degrees" in finding.message


def test_walls_are_known_by_role_or_by_the_word_in_their_name_where_there_are_no_roles():
    for name, role, there in (
        ("lower wall", "", True),
        ("Wall_1", "", True),
        ("wallpaper", "", False),
        ("wall", "inlet", False),
        ("rim", "wall", True),
        ("rim", "", False),
    ):
        mesh = grid(3, 2, zones=(Zone(name, "group", role, "face", range(3)),))
        assert (found(mesh, "wall-orthogonality") is not None) == there, name


def test_walls_inside_count_on_both_sides_but_not_in_a_solid_and_faces_of_the_file_are_used():
    mesh = grid(2, 2)
    own = faces(mesh)
    inner = np.flatnonzero((own.neighbour >= 0) & (np.ptp(mesh.points[own.nodes.reshape(-1, 2), 1], axis=1) == 0))
    table = Faces(own.offsets, own.nodes, own.owner, own.neighbour)
    wall = Zone("wall", "zone", "wall", "face", inner)
    fluid, solid = Zone("air", "zone", "fluid", "cell", [0, 1]), Zone("steel", "zone", "solid", "cell", [2, 3])
    for zones, rows in (((wall,), [0, 1, 2, 3]), ((wall, fluid, solid), [0, 1])):
        finding = found(Mesh(mesh.points, mesh.blocks, faces=table, zones=zones, dimension=2), "wall-orthogonality")
        assert finding.rows.tolist() == rows
        assert finding.detail["zones"][0]["min"] == pytest.approx(90.0)


@pytest.mark.parametrize("scale", [1e-250, 1e-60, 1e70, 1e250])
def test_the_angle_at_a_wall_does_not_depend_on_the_unit(scale):
    mesh = read(SAMPLES / "hybrid" / "hybrid-openfoam")
    big = Mesh(mesh.points * scale, mesh.blocks, faces=mesh.faces, zones=mesh.zones)
    first, second = (found(m, "wall-orthogonality").detail["zones"] for m in (mesh, big))
    assert [row["min"] for row in second] == pytest.approx([row["min"] for row in first], rel=1e-6)
    # the apexes of the tetrahedra and pyramids at the sides are known: atan 2 = 63.4 degrees
    assert min(row["min"] for row in first) == pytest.approx(math.degrees(math.atan(2)), rel=1e-9)
