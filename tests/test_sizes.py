"""Sizes: jumps between neighbours, requests, divisions of curves, chords of curved boundaries."""

import math

import numpy as np
import pytest

from meshwright.audit.connectivity import faces
from meshwright.audit.findings import Options, run_checks
from meshwright.audit.findings.divisions import curve_counts
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.options import SizeRegion
from meshwright.audit.findings.requests import inside
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def cubes(*boxes):
    """A mesh of cubes, each (x, y, z, side); corners in one place are one point."""
    points, nodes = {}, []
    for *low, side in boxes:
        nodes.append([points.setdefault(tuple(np.add(low, side * np.array(c))), len(points)) for c in CORNERS])
    return Mesh(np.array(list(points), float), (CellBlock("hex", np.arange(len(nodes)), np.array(nodes)),))


def grid(xs, ys, **more):
    """A 2-D mesh of quadrilaterals between these lines, x fastest."""
    x, y = np.meshgrid(xs, ys)
    row = np.arange(x.size).reshape(x.shape)
    nodes = np.stack([row[:-1, :-1], row[:-1, 1:], row[1:, 1:], row[1:, :-1]], axis=-1).reshape(-1, 4)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return Mesh(points, (CellBlock("quad", np.arange(len(nodes)), nodes),), dimension=2, **more)


def found(mesh, code, **options):
    here = [f for f in run_checks(mesh, options=Options(**options)) if f.code == code]
    return here[0] if here else None


def test_a_neighbour_of_a_quarter_of_the_size_is_found_through_an_edge_alone():
    # the big cube and the small one share a part of the edge x = 4, y = 4 and no face
    mesh = cubes((0, 0, 0, 4), (4, 4, 0, 1))
    finding = found(mesh, "size-jump")
    assert (finding.severity, finding.entity, finding.rows.tolist()) == ("info", "cell", [0, 1])
    assert finding.detail["worst"] == [{"cell": 0, "neighbour": 1, "sizes": [4.0, 1.0], "ratio": 4.0}]
    assert finding.detail["ratio_counts"][:3] == [0, 0, 2]
    assert found(mesh, "size-jump", growth=4.0) is None


def test_a_factor_of_two_is_allowed_up_to_rounding_and_a_point_in_common_is_no_neighbourhood():
    assert found(cubes((0, 0, 0, 2), (2, 2, 0, 1)), "size-jump") is None
    assert found(cubes((0, 0, 0, 4), (4, 4, 4, 1)), "size-jump") is None
    assert found(cubes((0, 0, 0, 4), (4, 4, 1, 1)), "size-jump") is None  # apart: no end in common
    for excess, there in ((1e-7, False), (1e-5, True)):
        mesh = grid([0, 1, 3 + 2 * excess], [0, 1])
        assert (found(mesh, "size-jump") is not None) == there


def test_a_face_between_cells_of_any_kind_counts_and_the_numbers_are_those_of_the_file():
    xs = [0, 1, 2, 5, 8]
    mesh = grid(xs, [0, 1], cell_ids=[11, 12, 13, 14])
    finding = found(mesh, "size-jump")
    assert finding.ids(mesh).tolist() == [12, 13]
    assert finding.detail["worst"][0] == {"cell": 12, "neighbour": 13, "sizes": [1.0, 3.0], "ratio": 3.0}
    quads = mesh.blocks[0].nodes
    loops = CellBlock("polygon", range(4), offsets=range(0, 17, 4), items=quads.ravel())
    assert found(Mesh(mesh.points, (loops,), dimension=2), "size-jump").rows.tolist() == [1, 2]
    bricks = cubes((0, 0, 0, 1), (1, 0, 0, 1))
    stretched = Mesh(bricks.points * [[1, 1, 1]] + (bricks.points[:, :1] > 1.5) * [[2, 0, 0]], bricks.blocks)
    own = faces(stretched)
    items = [np.flatnonzero((own.owner == c) | (own.neighbour == c)) for c in range(2)]
    poly = CellBlock("polyhedron", [0, 1], offsets=[0, 6, 12], items=np.concatenate(items))
    table = Faces(own.offsets, own.nodes, own.owner, own.neighbour)
    for either in (stretched, Mesh(stretched.points, (poly,), faces=table)):
        assert found(either, "size-jump").detail["max_ratio"] == 3.0


def test_each_cell_is_compared_with_the_smallest_and_the_largest_around_an_edge():
    # four boxes around one edge: 1, 1, 1 and 3 high
    mesh = cubes((0, 0, 0, 1), (1, 0, 0, 1), (0, 1, 0, 1))
    points = np.vstack([mesh.points, [(4, 1, 0), (4, 4, 0), (1, 4, 0), (4, 1, 1), (4, 4, 1), (1, 4, 1)]])
    at = {tuple(p): i for i, p in enumerate(points.tolist())}
    last = [at[p] for p in ((1, 1, 0), (4, 1, 0), (4, 4, 0), (1, 4, 0), (1, 1, 1), (4, 1, 1), (4, 4, 1), (1, 4, 1))]
    nodes = np.vstack([mesh.blocks[0].nodes, last])
    finding = found(Mesh(points, (CellBlock("hex", range(4), nodes),)), "size-jump")
    assert finding.rows.tolist() == [0, 1, 2, 3]
    assert finding.detail["max_ratio"] == 3.0


def box_with_zones(n=10):
    """A square of side 10 with its lower side as a zone, as a cell-based file lists it."""
    mesh = grid(np.linspace(0, 10, n + 1), np.linspace(0, 10, n + 1))
    lines = CellBlock("line", range(n), [[i, i + 1] for i in range(n)])
    zones = (Zone("floor", "physical group", "", "face", range(n)),)
    return Mesh(mesh.points, mesh.blocks, boundary=(lines,), zones=zones, dimension=2)


def test_a_surface_size_overrules_the_global_one_wherever_it_stands_in_the_list():
    mesh = box_with_zones(2)  # edges of length 5
    everywhere = SizeRegion("everywhere", 5.0)
    floor = SizeRegion("floor", 1.0, "zone", "floor")
    assert found(mesh, "size-request-missed", sizes=(everywhere,)) is None
    for sizes in ((everywhere, floor), (floor, everywhere)):
        finding = found(mesh, "size-request-missed", sizes=sizes)
        assert (finding.severity, finding.rows.tolist()) == ("warning", [0, 1])
        table = {row["name"]: row for row in finding.detail["regions"]}
        assert (table["floor"]["edges"], table["floor"]["too_long"], table["floor"]["mean"]) == (2, 2, 5.0)
        assert (table["everywhere"]["edges"], table["everywhere"]["too_long"]) == (10, 0)


def test_points_lines_and_surfaces_overrule_each_other_in_this_order():
    cube = cubes((0, 0, 0, 1))
    # elements: the floor, one of its edges, one end of that edge
    boundary = (CellBlock("quad", [0], [[0, 3, 2, 1]]), CellBlock("line", [1], [[0, 4]]))
    zones = (
        Zone("floor", "group", "", "face", [0]),
        Zone("post", "group", "", "face", [1]),
        Zone("foot", "group", "", "point", [0]),
    )
    mesh = Mesh(cube.points, cube.blocks, boundary=boundary, zones=zones)
    sizes = [SizeRegion(name, size, "zone", name) for name, size in (("floor", 4.0), ("post", 3.0), ("foot", 2.0))]
    table = found(mesh, "size-requests", sizes=(*sizes, SizeRegion("all", 5.0))).detail["regions"]
    # three edges meet at the foot: two belong to the floor, the third to the post
    assert {row["name"]: row["edges"] for row in table} == {"floor": 4, "post": 1, "foot": 0, "all": 7}


def test_boxes_cylinders_and_spheres_count_the_cells_inside_and_give_their_mean_size():
    mesh = grid(np.linspace(0, 10, 11), np.linspace(0, 4, 9))
    wake = SizeRegion("wake", 0.5, "box", place=(4.9, 0.9, -1, 8.1, 3.1, 1))
    ball = SizeRegion("ball", 1.0, "sphere", place=(1, 1, 0, 0.8))
    pipe = SizeRegion("pipe", 1.0, "cylinder", place=(9, 0, 0, 9, 4, 0, 0.6))
    table = found(mesh, "size-requests", sizes=(SizeRegion("all", 1.0), wake, ball, pipe)).detail["regions"]
    by_name = {row["name"]: row for row in table}
    assert by_name["wake"]["cells"] == 3 * 4  # 3 columns of centres between 4.9 and 8.1, 4 rows between 0.9 and 3.1
    # 4 x 4 upright edges of 0.5 and 5 x 3 level ones of 1.0 have their middle inside
    assert (by_name["wake"]["edges"], by_name["wake"]["too_long"]) == (31, 15)
    assert by_name["wake"]["mean"] == pytest.approx((16 * 0.5 + 15 * 1.0) / 31)
    assert by_name["ball"]["cells"] == 4
    assert by_name["pipe"]["cells"] == 2 * 8
    places = np.array([(0, 0, 0), (0, 0, 2.0), (0, 1.0, 1.0), (0, 1.1, 1.0), (np.nan, 0, 0)])
    assert inside(SizeRegion("", 1, "cylinder", place=(0, 0, 0, 0, 0, 2, 1)), places).tolist() == [
        True, True, True, False, False,
    ]  # fmt: skip


def test_a_later_region_overrules_an_earlier_one():
    mesh = grid(np.linspace(0, 10, 11), [0, 1])
    whole = SizeRegion("a", 1.0, "box", place=(-1, -1, -1, 11, 2, 1))
    half = SizeRegion("b", 1.0, "box", place=(-1, -1, -1, 5.2, 2, 1))
    for sizes, wanted in (((whole, half), {"a": 15, "b": 16}), ((half, whole), {"a": 31, "b": 0})):
        table = found(mesh, "size-requests", sizes=sizes).detail["regions"]
        assert {row["name"]: row["edges"] for row in table} == wanted


def test_a_curve_of_length_ten_at_size_three_is_expected_to_have_three_edges():
    # a quarter ring whose inner arc is 10 long
    radius = 10 / (math.pi / 2)
    for n in (3, 40):
        mesh = grid(np.linspace(0, math.pi / 2, n + 1), [0.0, 1.0])
        t, r = mesh.points[:, 0], radius + mesh.points[:, 1]
        ring = Mesh(np.stack([r * np.sin(t), r * np.cos(t), 0 * t], axis=1), mesh.blocks, dimension=2)
        rows = curve_counts(Facts(ring, options=Options(feature_angle=40.0, sizes=(SizeRegion("all", 3.0),))))
        chords = sorted((row["length"], row["edges"], row["expected"]) for row in rows)
        # straight ends of length 1, the inner arc, the outer one of 10 + pi / 2; chords are shorter than arcs
        assert [edges for _, edges, _ in chords] == [1, 1, n, n]
        assert chords[2][0] == pytest.approx(2 * n * radius * math.sin(math.pi / 4 / n))
        assert [wanted for *_, wanted in chords] == [1, 1, 3, 3]
        finding = found(ring, "curve-count", feature_angle=40.0, sizes=(SizeRegion("all", 3.0),))
        assert (finding is None) == (n == 3)


def disc(n, twist=0.0):
    """A fan of n triangles."""
    t = twist + 2 * math.pi * np.arange(n) / n
    points = np.vstack([np.stack([2 * np.cos(t), 2 * np.sin(t), 0 * t], axis=1), [(0, 0, 0)]])
    nodes = [(i, (i + 1) % n, n) for i in range(n)]
    return Mesh(points, (CellBlock("tri", range(n), nodes),), dimension=2)


@pytest.mark.parametrize("n", [12, 25, 48, 1000])
def test_n_equal_segments_of_a_circle_lie_r_times_1_minus_cos_pi_over_n_inside_it(n):
    finding = found(disc(n, 0.3), "chordal-deviation")
    assert finding.severity == "info"
    assert finding.detail["edges"] == n
    assert finding.detail["max_deviation"] == pytest.approx(2 * (1 - math.cos(math.pi / n)), rel=1e-9)
    assert finding.detail["mean_deviation"] == pytest.approx(2 * (1 - math.cos(math.pi / n)), rel=1e-9)
    assert finding.detail["max_angle"] == pytest.approx(360 / n, rel=1e-9)


def test_straight_boundaries_and_sharp_corners_have_no_chords():
    assert found(grid([0, 1, 3, 4], [0, 1, 2]), "chordal-deviation") is None
    assert found(disc(6), "chordal-deviation") is None  # a hexagon with corners of 60 degrees
    assert found(disc(6), "chordal-deviation", feature_angle=70.0).detail["max_angle"] == pytest.approx(60.0)
    assert found(cubes((0, 0, 0, 1), (1, 0, 0, 1)), "chordal-deviation") is None


def cylinder(n, layers=3):
    """A shell around the z axis."""
    t, z = np.meshgrid(2 * math.pi * np.arange(n) / n, np.arange(layers + 1.0))
    points = np.stack([3 * np.cos(t), 3 * np.sin(t), z], axis=-1).reshape(-1, 3)
    row = np.arange(len(points)).reshape(z.shape)
    after = np.roll(row, -1, axis=1)
    nodes = np.stack([row[:-1], after[:-1], after[1:], row[1:]], axis=-1).reshape(-1, 4)
    return Mesh(points, (CellBlock("quad", np.arange(len(nodes)), nodes),))


@pytest.mark.parametrize("scale", [1e-200, 1e-90, 1e90, 1e200])
def test_chords_scale_with_the_mesh(scale):
    for mesh in (disc(48), cylinder(40)):
        first, second = (
            found(Mesh(mesh.points * s, mesh.blocks, dimension=mesh.dimension), "chordal-deviation").detail
            for s in (1.0, scale)
        )
        assert second["max_deviation"] == pytest.approx(first["max_deviation"] * scale, rel=1e-9)
        assert (second["edges"], second["angle_counts"]) == (first["edges"], first["angle_counts"])


@pytest.mark.parametrize("n", [12, 36, 90])
def test_the_chords_of_a_cylinder_are_those_of_its_circle_and_its_generators_are_straight(n):
    detail = found(cylinder(n), "chordal-deviation").detail
    assert detail["edges"] == 4 * n  # two rims and two circles between them
    assert detail["max_deviation"] == pytest.approx(3 * (1 - math.cos(math.pi / n)), rel=1e-9)
    assert detail["max_angle"] == pytest.approx(360 / n, rel=1e-9)
    assert sum(detail["angle_counts"]) == 4 * n


def test_no_size_is_asked_for_unless_the_user_does():
    for code in ("size-requests", "size-request-missed", "curve-count"):
        assert found(box_with_zones(), code) is None
