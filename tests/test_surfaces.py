"""Open edges, joints and watertightness of surface meshes, in closed form, and against trimesh on real ones."""

import dataclasses
import math

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.findings import Options, run_checks
from meshwright.audit.findings.hulls.shells import mesh_shells
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.readers import read

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
QUADS = np.array(CELL_TYPES["hex"].faces)


def surface(points, **cells):
    """A surface mesh in space; cells by type."""
    blocks, row = [], 0
    for name, nodes in cells.items():
        blocks.append(CellBlock(name, np.arange(row, row + len(nodes)), np.array(nodes)))
        row += len(nodes)
    return Mesh(np.array(points, float), tuple(blocks))


def triangles(quads):
    return np.array([t for a, b, c, d in np.asarray(quads).tolist() for t in ((a, b, c), (a, c, d))])


def sheet(nx, ny, lengths=(1.0, 1.0)):
    """(points, quads) of a flat sheet in the plane z = 0 of space."""
    x, y = np.meshgrid(np.linspace(0, lengths[0], nx + 1), np.linspace(0, lengths[1], ny + 1))
    at = np.arange(x.size).reshape(ny + 1, nx + 1)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), quads


def sphere(n, radius=1.0):
    """(points, triangles) of a cube of n x n quads a side blown up to a sphere, normals outward."""
    points, cells = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            flat, quads = sheet(n, n, (2.0, 2.0))
            u, v = flat[:, 0] - 1, flat[:, 1] - 1
            place = np.empty_like(flat)
            place[:, axis], place[:, (axis + 1) % 3], place[:, (axis + 2) % 3] = side, u, v
            cells.append((quads if side > 0 else quads[:, ::-1]) + sum(map(len, points)))
            points.append(place)
    every, at = np.unique(np.round(np.concatenate(points), 12), axis=0, return_inverse=True)
    every *= radius / np.linalg.norm(every, axis=1)[:, None]
    return every, triangles(at.ravel()[np.concatenate(cells)])


OURS = {"open-edges", "not-watertight", "inside-out-shell", "near-points", "unmerged-interface", "branch-cut"}


def found(mesh, options=None):
    """What is said of the surface as such, and all warnings and errors; not what only describes its shape."""
    findings = run_checks(mesh, options=options)
    return {finding.code: finding for finding in findings if finding.code in OURS or finding.severity != "info"}


def shells(finding):
    return {row["shell"]: row for row in finding.detail["table"]}


def test_a_box_without_its_lid_has_one_loop_of_four_edges_around_the_hole():
    mesh = surface(CUBE, quad=np.delete(QUADS, 1, axis=0))  # face 1 is the roof, z = 1
    finding = found(mesh)["open-edges"]
    assert (finding.severity, finding.entity, finding.count) == ("info", "edge", 4)
    (loop,) = finding.detail["chains"]
    assert (loop["edges"], loop["closed"], loop["length"]) == (4, True, 4.0)
    assert (loop["centre"], loop["low"], loop["high"]) == ([0.5, 0.5, 1.0], [0, 0, 1], [1, 1, 1])
    assert sorted(loop["points"]) == [4, 5, 6, 7]
    steps = np.diff(np.array([*loop["coordinates"], loop["coordinates"][0]]), axis=0)
    assert np.abs(steps).sum(axis=1).tolist() == [1.0] * 4  # in order around the hole


def test_a_closed_cube_of_either_kind_of_cell_gives_no_finding_about_its_surface():
    for mesh in (surface(CUBE, quad=QUADS), surface(CUBE, tri=triangles(QUADS))):
        assert found(mesh) == {}


def test_the_verdict_on_a_closed_cube_tells_its_area_and_volume():
    for mesh in (surface(CUBE, quad=QUADS), surface(CUBE, tri=triangles(QUADS))):
        finding = next(f for f in run_checks(mesh) if f.code == "watertight-shells")
        assert (finding.severity, finding.count) == ("info", mesh.n_cells)
        assert finding.message == "1 of 1 shell watertight, of area 6, enclosing 1"
    lidless = surface(CUBE, quad=QUADS[:-1])
    assert "watertight-shells" not in {f.code for f in run_checks(lidless)}


def test_holes_are_separate_loops_listed_with_the_longest_first():
    points, quads = sheet(10, 10)
    keep = np.ones(100, dtype=bool)
    keep[[22, 66, 67]] = False  # a hole of one cell and one of two
    finding = found(surface(points, quad=quads[keep]))["open-edges"]
    assert [(c["edges"], c["closed"]) for c in finding.detail["chains"]] == [(40, True), (6, True), (4, True)]
    assert [c["length"] for c in finding.detail["chains"]] == pytest.approx([4.0, 0.6, 0.4])
    assert finding.count == 50


def test_two_holes_that_meet_in_a_corner_are_two_loops():
    points, quads = sheet(6, 6)
    keep = np.ones(36, dtype=bool)
    keep[[14, 21]] = False  # diagonal neighbours
    finding = found(surface(points, quad=quads[keep]))["open-edges"]
    assert [(c["edges"], c["closed"]) for c in finding.detail["chains"]] == [(24, True), (4, True), (4, True)]


def test_plates_that_meet_in_a_tee_have_one_chain_of_edges_with_three_cells():
    points, quads = sheet(4, 2)  # the web stands on the line y = 0.5, points 5 to 9
    top = points[5:10] + [0, 0, 0.5]
    web = [[5 + i, 6 + i, 16 + i, 15 + i] for i in range(4)]
    mesh = surface(np.concatenate([points, top]), quad=np.concatenate([quads, web]))
    joint = found(mesh)["nonmanifold-edges"]
    assert joint.count == 4
    (chain,) = joint.detail["chains"]
    assert (chain["edges"], chain["closed"], chain["length"]) == (4, False, 1.0)
    assert chain["low"] == [0, 0.5, 0]
    assert chain["high"] == [1, 0.5, 0]
    assert joint.detail["cells_at_edge"] == {"3": 4}
    verdict = found(mesh)["not-watertight"]
    (row,) = verdict.detail["table"]  # one shell: the plates hang together at the joint
    assert (row["cells"], row["nonmanifold_edges"], row["open_edges"]) == (12, 4, 12 + 6)
    crossed = np.concatenate([points, top, top - [0, 0, 1.0]])
    below = [[6 + i, 5 + i, 20 + i, 21 + i] for i in range(4)]
    cross = surface(crossed, quad=np.concatenate([quads, web, below]))
    assert found(cross)["nonmanifold-edges"].detail["cells_at_edge"] == {"4": 4}


def test_a_flipped_triangle_fails_orientation_only_and_the_verdict_says_so():
    cells = triangles(QUADS)
    cells[5] = cells[5][::-1]
    findings = found(surface(CUBE, tri=cells))
    assert list(findings) == ["inconsistent-orientation"]
    (row,) = findings["inconsistent-orientation"].detail["table"]
    assert (row["watertight"], row["closed"], row["manifold"], row["oriented"]) == (True, True, True, False)
    assert row["inconsistent_edges"] == 3
    assert row["volume"] is None


def test_a_closed_shell_whose_normals_look_inward_is_inside_out():
    mesh = surface(CUBE, tri=triangles(QUADS)[:, ::-1])
    finding = found(mesh)["inside-out-shell"]
    assert (finding.severity, finding.entity, finding.count) == ("warning", "cell", 12)
    (row,) = finding.detail["table"]
    assert row["volume"] == pytest.approx(-1.0, rel=1e-15)
    assert row["area"] == pytest.approx(6.0, rel=1e-15)


def test_a_cavity_is_turned_inward_and_sound_and_nesting_is_told_level_by_level():
    # a ball in the cavity of a ball in a box; the cavity's wall looks inward, as it must
    box = (CUBE - 0.5) * 10.0
    points, cells, row = [box], [triangles(QUADS)], 8
    for radius, turned in ((3.0, False), (2.0, True), (1.0, False)):
        where, ball = sphere(4, radius)
        cells.append((ball[:, ::-1] if turned else ball) + row)
        points.append(where + [0.01, 0.02, 0.03])
        row += len(where)
    sound = surface(np.concatenate(points), tri=np.concatenate(cells))
    assert found(sound) == {}
    cells[0] = cells[0][:, ::-1]
    finding = found(surface(np.concatenate(points), tri=np.concatenate(cells)))["inside-out-shell"]
    table = shells(finding)
    assert [(table[k]["depth"], table[k]["inside"]) for k in range(4)] == [(0, None), (1, 0), (2, 1), (3, 2)]
    assert table[0]["volume"] == pytest.approx(-1000.0)
    assert table[2]["volume"] < 0.0
    assert finding.rows.tolist() == list(range(12))  # the box alone


def test_a_body_beside_another_one_is_not_inside_it_although_its_bounds_are():
    # an L of three cubes, and a small cube in the notch: inside the bounds of the L and outside of it
    plan = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    low, high = [(x, y, 0) for x, y in plan], [(x, y, 2) for x, y in plan]
    walls = [[i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i] for i in range(6)]
    caps = [[0, 3, 2, 1], [0, 5, 4, 3], [6, 7, 8, 9], [6, 9, 10, 11]]
    small = CUBE * 0.5 + [1.3, 1.3, 0.7]
    flipped = QUADS[:, ::-1] + 12
    mesh = surface([*low, *high, *small], quad=[*walls, *caps, *flipped])
    finding = found(mesh)["inside-out-shell"]
    table = shells(finding)
    assert table[0]["volume"] == pytest.approx(6.0)
    assert (table[1]["depth"], table[1]["inside"]) == (0, None)
    assert table[1]["volume"] == pytest.approx(-0.125)
    assert finding.count == 6
    small += [-1.0, -1.0, 0.0]  # now in the body of the L
    inner = surface([*low, *high, *small], quad=[*walls, *caps, *flipped])
    assert "inside-out-shell" not in found(inner)


@pytest.mark.parametrize("shift", [0.0, 0.25])
def test_nesting_is_right_where_the_ray_meets_corners_and_edges_of_the_shells_it_crosses(shift):
    # concentric cubes cut alike: a ray up from a corner of the inner one runs along edges of the outer one's roof
    points, cells = [], []
    for n, size in ((4, 4.0), (2, 2.0)):
        line = np.linspace(-size / 2, size / 2, n + 1)
        for axis in range(3):
            for side in (-1, 1):
                flat, quads = sheet(n, n)
                place = np.empty_like(flat)
                place[:, axis] = side * size / 2
                place[:, (axis + 1) % 3], place[:, (axis + 2) % 3] = (
                    line[0] + flat[:, 0] * size,
                    line[0] + flat[:, 1] * size,
                )
                cells.append((quads if side > 0 else quads[:, ::-1]) + sum(map(len, points)))
                points.append(place + (shift if size == 2.0 else 0.0))
    every, at = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    mesh = surface(every, quad=at.ravel()[np.concatenate(cells)][:, ::-1])
    table = shells(found(mesh)["inside-out-shell"])
    outer = max(table.values(), key=lambda row: row["area"])
    inner = min(table.values(), key=lambda row: row["area"])
    assert (outer["depth"], outer["inside"]) == (0, None)
    assert (inner["depth"], inner["inside"]) == (1, outer["shell"])


def test_a_small_hole_in_a_closed_shell_is_a_warning_and_the_rim_of_a_sheet_is_not():
    points, cells = sphere(40)
    torn = found(surface(points, tri=cells[1:]))["not-watertight"]
    assert (torn.severity, torn.count) == ("warning", 3)
    assert "1 of 1 shell" in torn.message
    points, quads = sheet(3, 3)
    plate = found(surface(points, quad=quads))["not-watertight"]
    assert (plate.severity, plate.count) == ("info", 12)
    flow = found(surface(points, quad=quads), Options(discipline="cfd"))["not-watertight"]
    assert flow.severity == "warning"


def test_each_shell_gets_its_own_verdict():
    lidless = np.delete(QUADS, 1, axis=0) + 8
    mesh = surface(np.concatenate([CUBE, CUBE + 3.0]), quad=np.concatenate([QUADS, lidless]))
    finding = found(mesh)["not-watertight"]
    assert (finding.detail["shells"], finding.detail["watertight"]) == (2, 1)
    table = shells(finding)
    assert (table[0]["watertight"], table[0]["volume"]) == (True, 1.0)
    assert (table[1]["watertight"], table[1]["open_edges"], table[1]["volume"]) == (False, 4, None)


def test_cubes_that_share_an_edge_are_one_shell_and_not_manifold_whatever_cell_comes_first():
    far = CUBE + [
        1,
        1,
        0,
    ]  # touches in the edge from (1, 1, 0) to (1, 1, 1): points 2 and 6 of one, 0 and 4 of the other
    points = np.concatenate([CUBE, far])
    second = QUADS + 8
    second[second == 8], second[second == 12] = 2, 6
    quads = np.concatenate([QUADS, second])
    for order in (np.arange(12), np.random.default_rng(5).permutation(12)):
        finding = found(surface(points, quad=quads[order]))["not-watertight"]
        (row,) = finding.detail["table"]
        assert (row["closed"], row["manifold"], row["nonmanifold_edges"]) == (True, False, 1)


def test_polygons_take_part_like_triangles():
    offsets = np.arange(0, 25, 4)
    block = CellBlock("polygon", np.arange(6), offsets=offsets, items=QUADS.ravel())
    assert found(Mesh(CUBE, (block,))) == {}
    block = CellBlock("polygon", np.arange(5), offsets=offsets[:6], items=QUADS[:5].ravel())
    assert found(Mesh(CUBE, (block,)))["open-edges"].count == 4


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 1.0, 1e30, 1e150])
def test_verdicts_do_not_depend_on_the_unit(scale):
    lidless = np.delete(QUADS, 1, axis=0)
    findings = found(surface(CUBE * scale, quad=lidless))
    assert findings["open-edges"].detail["chains"][0]["edges"] == 4
    inward = found(surface(CUBE * scale, tri=triangles(QUADS)[:, ::-1]))
    assert list(inward) == ["inside-out-shell"]


def test_points_without_a_place_stop_nothing():
    for rows in ([6], [0, 1, 2], range(8)):
        points = CUBE.copy()
        points[list(rows)] = np.nan
        for quads in (QUADS, QUADS[:5], QUADS[:1]):
            codes = list(found(surface(points, quad=quads)))
            assert "nonfinite-points" in codes
            assert ("open-edges" in codes) == (len(quads) < 6)


def test_of_many_chains_all_are_counted_and_only_the_longest_described():
    one = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], float)
    points = (one[None] * np.linspace(1, 2, 300)[:, None, None] + np.arange(300)[:, None, None] * 10.0).reshape(-1, 3)
    finding = found(surface(points, tri=np.arange(900).reshape(-1, 3)))["open-edges"]
    assert finding.detail["closed_chains"] == 300
    lengths = [chain["length"] for chain in finding.detail["chains"]]
    assert len(lengths) == 50
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[0] == pytest.approx(2 * (2 + math.sqrt(2)))


def test_renumbering_and_turning_a_surface_change_no_verdict():
    points, quads = sheet(10, 10)
    points[:, 2] = 0.2 * np.sin(5 * points[:, 0])
    keep = np.ones(100, dtype=bool)
    keep[[22, 66, 67]] = False
    before = found(surface(points, quad=quads[keep]))
    rng = np.random.default_rng(3)
    order, at = rng.permutation(97), rng.permutation(len(points))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    after = found(surface((points @ turn)[at], quad=np.argsort(at)[quads[keep]][order]))
    assert {code: f.count for code, f in after.items()} == {code: f.count for code, f in before.items()}
    for a, b in zip(after["open-edges"].detail["chains"], before["open-edges"].detail["chains"], strict=True):
        assert (a["edges"], a["closed"]) == (b["edges"], b["closed"])
        assert a["length"] == pytest.approx(b["length"], rel=1e-12)


SECOND_OPINIONS = (
    *("42400-IDGH.stl", "Vase.stl", "footbones.ply", "gebco7510_55cl.stl", "stratocaster.ply", "trimesh_ballA.off"),
    *("trimesh_busted.STL", "trimesh_featuretype.STL", "trimesh_multibody.stl", "trimesh_octagonal_pocket.ply"),
    *("InterpolatingOnSTL_final.stl", "trimesh_not_convex.obj"),
)


def poly_data(mesh):
    vtk = pytest.importorskip("vtk")
    support = pytest.importorskip("vtk.util.numpy_support")
    data, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetData(support.numpy_to_vtk(mesh.points, deep=True))
    nodes = mesh.block("tri").nodes
    rows = np.column_stack([np.full(len(nodes), 3), nodes]).astype(np.int64)
    cells.ImportLegacyFormat(support.numpy_to_vtkIdTypeArray(rows.ravel(), deep=True))
    data.SetPoints(points)
    data.SetPolys(cells)
    return vtk, data


@pytest.mark.parametrize("name", SECOND_OPINIONS)
def test_vtk_agrees_about_open_edges_joints_area_and_volume(shared, name):
    mesh = read(shared / "meshes" / "surface" / name)
    vtk, data = poly_data(mesh)
    ours = mesh_shells(mesh)
    for kind, count in (("Boundary", ours.free.sum()), ("NonManifold", ours.crowded.sum())):
        edges = vtk.vtkFeatureEdges()
        edges.SetInputData(data)
        for word in ("Boundary", "NonManifold", "Feature", "Manifold"):
            getattr(edges, f"Set{word}Edges")(word == kind)
        edges.Update()
        assert (kind, edges.GetOutput().GetNumberOfLines()) == (kind, count)
    mass = vtk.vtkMassProperties()
    mass.SetInputData(data)
    assert ours.area.sum() == pytest.approx(mass.GetSurfaceArea(), rel=1e-9)
    parts = vtk.vtkPolyDataConnectivityFilter()
    parts.SetInputData(data)
    parts.SetExtractionModeToAllRegions()
    parts.Update()
    assert parts.GetNumberOfExtractedRegions() <= len(ours.cells)  # VTK joins what touches in a point
    if ours.watertight.all() and not ours.turned.any():
        # VTK's volume loses digits far from the origin, and has no sign
        assert abs(ours.volume.sum()) == pytest.approx(mass.GetVolume(), rel=1e-4)


def test_points_and_cells_are_named_by_the_numbers_of_the_file():
    mesh = dataclasses.replace(
        surface(CUBE, quad=np.delete(QUADS, 1, axis=0)), point_ids=np.arange(101, 109), cell_ids=np.arange(11, 16)
    )
    findings = found(mesh)
    assert sorted(findings["open-edges"].detail["chains"][0]["points"]) == [105, 106, 107, 108]
    assert findings["not-watertight"].detail["table"][0]["first_cell"] == 11
