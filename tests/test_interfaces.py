"""Interfaces, parts not merged, branch cuts, hanging nodes: closed forms, and the sound meshes beside them."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.connectivity import faces
from meshwright.audit.findings import run_checks
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.parallel import limited_to
from meshwright.audit.readers import read

CODES = {"nonconformal-interface", "unmerged-interface", "branch-cut", "hanging-nodes"}


def bricks(n, low, high):
    """(points, hexes) of a block."""
    axes = [np.linspace(a, b, k + 1) for a, b, k in zip(low, high, n, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    row = np.arange(len(points)).reshape(np.array(n) + 1)
    p, q = slice(None, -1), slice(1, None)
    order = [(p, p, p), (q, p, p), (q, q, p), (p, q, p), (p, p, q), (q, p, q), (q, q, q), (p, q, q)]
    return points, np.stack([row[c].ravel() for c in order], axis=1)


def quads(n, low, high):
    """(points, quads) of a rectangle in the plane."""
    x, y = np.meshgrid(*[np.linspace(a, b, k + 1) for a, b, k in zip(low, high, n, strict=True)])
    at = np.arange(x.size).reshape(n[1] + 1, n[0] + 1)
    nodes = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), nodes


def joined(*blocks, merge=False, dimension=None, **more):
    """One mesh of several blocks; merge: points in one place become one."""
    points = np.concatenate([p for p, _ in blocks])
    start = np.cumsum([0, *(len(p) for p, _ in blocks)])
    nodes = np.concatenate([c + s for (_, c), s in zip(blocks, start, strict=False)])
    if merge:
        points, at = np.unique(np.round(points, 9), axis=0, return_inverse=True)
        nodes = at.ravel()[nodes]
    name = {4: "quad", 8: "hex"}[nodes.shape[1]]
    dimension = dimension or {4: 2, 8: 3}[nodes.shape[1]]
    return Mesh(points, (CellBlock(name, np.arange(len(nodes)), nodes),), dimension=dimension, **more)


def with_zones(mesh, **zones):
    """The mesh as a face-based one with zones of those of its boundary faces that a function of their centres picks."""
    f = faces(mesh)
    own = Faces(f.offsets, f.nodes, f.owner, f.neighbour)
    centre = np.stack(
        [mesh.points[f.nodes[a:b]].mean(axis=0) for a, b in zip(f.offsets[:-1], f.offsets[1:], strict=True)]
    )
    outside = f.neighbour < 0
    made = tuple(
        Zone(name.replace("_", "-"), "zone", role, "face", np.flatnonzero(outside & pick(centre, f.owner)))
        for name, (role, pick) in zones.items()
    )
    return dataclasses.replace(mesh, faces=own, zones=made)


def found(mesh):
    return {f.code: f for f in run_checks(mesh) if f.code in CODES}


def told(mesh):
    """Codes of these checks, and of all warnings and errors."""
    return {f.code for f in run_checks(mesh) if f.code in CODES | {"near-points"} or f.severity != "info"}


def only(mesh, code):
    findings = found(mesh)
    assert list(findings) == [code]
    return findings[code]


FOUR = bricks((2, 4, 4), (0, 0, 0), (1, 1, 1))
SIX = bricks((3, 6, 6), (1, 0, 0), (2, 1, 1))


def test_a_block_of_4_by_4_against_one_of_6_by_6_is_one_interface_that_covers_all_and_matches_nothing():
    finding = only(joined(FOUR, SIX), "nonconformal-interface")
    assert (finding.severity, finding.entity, finding.count) == ("warning", "face", 16 + 36)
    (place,) = finding.detail["interfaces"]
    assert (place["facets"], place["matched_facets"], place["matched_ratio"]) == (52, 0, 0.0)
    assert place["overlap"] == pytest.approx(1.0, rel=1e-12)
    assert place["overlap_area"] == pytest.approx(1.0, rel=1e-12)
    assert [side["facets"] for side in place["sides"]] == [16, 36]
    assert [side["overlap"] for side in place["sides"]] == pytest.approx([1.0, 1.0], rel=1e-12)
    assert place["gap_max"] == 0.0


def test_an_interface_in_the_plane_has_edges_for_faces():
    finding = only(joined(quads((2, 4), (0, 0), (1, 1)), quads((3, 6), (1, 0), (2, 1))), "nonconformal-interface")
    assert (finding.entity, finding.count) == ("edge", 10)
    assert finding.detail["interfaces"][0]["overlap_area"] == pytest.approx(1.0, rel=1e-12)


def test_blocks_that_overlap_in_part_say_how_much_of_each_side_is_covered():
    shifted = bricks((3, 6, 6), (1, 0.5, 0), (2, 1.5, 1))
    (place,) = only(joined(FOUR, shifted), "nonconformal-interface").detail["interfaces"]
    assert place["overlap_area"] == pytest.approx(0.5, rel=1e-12)
    # half of each side; of the facets that take part, those of 1/4 end at the overlap, and so do those of 1/6
    assert [side["area"] for side in place["sides"]] == pytest.approx([0.5, 0.5])


def test_tets_against_hexes_are_an_interface_whatever_the_shape_of_their_faces():
    points, nodes = bricks((2, 2, 2), (1, 0, 0), (2, 1, 1))
    split = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
    tets = np.concatenate([nodes[:, t] for t in split]) + len(FOUR[0])
    blocks = (CellBlock("hex", np.arange(32), FOUR[1]), CellBlock("tet", np.arange(32, 32 + len(tets)), tets))
    (place,) = only(Mesh(np.concatenate([FOUR[0], points]), blocks), "nonconformal-interface").detail["interfaces"]
    assert [side["facets"] for side in place["sides"]] == [16, 8]
    assert place["overlap_area"] == pytest.approx(1.0, rel=1e-12)


def test_blocks_that_match_and_are_not_merged_are_said_apart():
    again = bricks((2, 4, 4), (1, 0, 0), (2, 1, 1))
    finding = only(joined(FOUR, again), "unmerged-interface")
    assert (finding.severity, finding.count) == ("info", 32)
    (place,) = finding.detail["interfaces"]
    assert (place["matched_ratio"], place["overlap"], place["coincident"]) == (1.0, pytest.approx(1.0), True)
    assert found(joined(FOUR, again, merge=True)) == {}


def test_a_gap_between_bodies_is_measured_and_no_more_than_told():
    apart = SIX[0] + [0.01, 0, 0], SIX[1]  # 6 % of the edges of 1/6
    finding = only(joined(FOUR, apart), "nonconformal-interface")
    assert finding.severity == "info"
    (place,) = finding.detail["interfaces"]
    assert place["gap_max"] == pytest.approx(0.01)
    assert not place["coincident"]
    assert found(joined(FOUR, (SIX[0] + [0.05, 0, 0], SIX[1]))) == {}


def test_zones_that_say_interface_make_it_one_that_is_meant():
    mesh = joined(FOUR, SIX)
    touching = {
        side: (lambda c, o, k=k: (np.abs(c[:, 0] - 1) < 1e-9) & ((o < 32) == k))
        for side, k in (("a", True), ("b", False))
    }
    for role in ("interface", "cyclicAMI"):
        meant = only(
            with_zones(mesh, left_side=(role, touching["a"]), right=(role, touching["b"])), "nonconformal-interface"
        )
        assert meant.severity == "info"
        (place,) = meant.detail["interfaces"]
        assert place["declared"]
        assert [side["face_zones"] for side in place["sides"]] == [["left-side"], ["right"]]
    walls = with_zones(mesh, left=("wall", touching["a"]), right=("interface", touching["b"]))
    assert found(walls)["nonconformal-interface"].severity == "warning"


def test_an_interface_zone_with_nothing_against_it_is_told():
    mesh = joined(FOUR)
    alone = with_zones(mesh, side=("interface", lambda c, _: c[:, 0] > 1 - 1e-9))
    finding = only(alone, "nonconformal-interface")
    assert (finding.severity, finding.entity, finding.detail["zones_without_partner"]) == ("info", "zone", ["side"])


def test_a_rotor_in_a_stator_meets_it_on_a_cylinder_that_neither_follows(shared):
    finding = only(read(shared / "meshes" / "fluent_legacy" / "axial_comp.msh"), "nonconformal-interface")
    (place,) = finding.detail["interfaces"]
    assert (place["declared"], finding.severity) == (True, "info")
    assert [side["face_zones"][0] for side in place["sides"]] == ["rotor-interface", "stator-interface"]
    assert [side["cell_zones"] for side in place["sides"]] == [["fluid-rotor"], ["fluid-stator"]]
    assert place["overlap"] > 0.95


def rings(n_around, radii):
    """(points, quads) of a ring, open where it starts: the first and last rays lie on each other."""
    angle = np.linspace(0, 2 * math.pi, n_around + 1)
    angle[-1] = 0.0
    points = np.array([(r * math.cos(a), r * math.sin(a), 0.0) for a in angle for r in radii])
    m = len(radii)
    at = np.arange(len(points)).reshape(-1, m)
    nodes = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    return points, nodes


def test_the_cut_of_an_o_grid_is_told_with_the_number_of_cells_around():
    finding = only(joined(rings(24, [1.0, 2.0, 3.0, 4.0])), "branch-cut")
    assert (finding.severity, finding.entity, finding.count) == ("info", "edge", 6)
    (cut,) = finding.detail["cuts"]
    assert (cut["cells_around"], cut["lines"], cut["closed_lines"]) == (24, 3, 3)
    assert "closes after 24 cells" in finding.message
    assert told(joined(rings(24, [1.0, 2.0, 3.0, 4.0]))) == {"branch-cut", "duplicate-points"}
    assert found(joined(rings(24, [1.0, 2.0, 3.0, 4.0]), merge=True)) == {}


def test_the_cut_of_an_o_grid_in_space_is_no_free_edge_of_a_surface_and_no_interface_of_a_solid():
    sheet = joined(rings(16, [1.0, 2.0, 3.0]), dimension=3)
    findings = {f.code: f for f in run_checks(sheet)}
    assert findings["branch-cut"].count == 4
    assert findings["open-edges"].count == 32  # the two rims, 16 edges each
    assert [c["closed"] for c in findings["open-edges"].detail["chains"]] == [False, False]
    flat, nodes = rings(16, [1.0, 2.0, 3.0])
    points = np.concatenate([flat, flat + [0, 0, 1.0]])
    solid = Mesh(points, (CellBlock("hex", np.arange(32), np.concatenate([nodes, nodes + len(flat)], axis=1)),))
    finding = only(solid, "branch-cut")
    assert (finding.entity, finding.count, finding.detail["cuts"][0]["cells_around"]) == ("face", 4, 16)


def test_a_slit_is_a_cut_that_nothing_closes_and_says_which_points_its_ends_share():
    points, nodes = quads((6, 6), (0, 0), (6, 6))
    row = {tuple(p): i for i, p in enumerate(points[:, :2].tolist())}
    inner = [row[(x, 3.0)] for x in (2.0, 3.0, 4.0)]
    double = {p: len(points) + i for i, p in enumerate(inner)}
    above = points[nodes].mean(axis=1)[:, 1] > 3
    nodes = np.where(above[:, None] & np.isin(nodes, inner), np.vectorize(lambda p: double.get(p, p))(nodes), nodes)
    finding = only(joined((np.concatenate([points, points[inner]]), nodes)), "branch-cut")
    assert finding.count == 8  # four edges from (1, 3) to (5, 3), both sides
    (cut,) = finding.detail["cuts"]
    assert (cut["points_in_common"], cut["cells_around"]) == (2, None)


def test_the_wake_cut_of_a_c_grid_is_a_branch_cut_and_nothing_else():
    mesh = read(Path(__file__).parent.parent / "samples" / "aerofoil" / "naca0012-c-cut.msh.gz")
    finding = only(mesh, "branch-cut")
    assert finding.count == 56
    assert "C-grid" in finding.message
    assert told(mesh) == {"branch-cut", "duplicate-points"}


def test_one_square_beside_four_of_half_its_size_has_one_hanging_node():
    coarse, fine = quads((1, 1), (0, 0), (2, 2)), quads((2, 2), (2, 0), (4, 2))
    mesh = joined(coarse, fine, merge=True)
    finding = only(mesh, "hanging-nodes")
    assert (finding.severity, finding.entity, finding.count) == ("warning", "point", 1)
    assert mesh.points[finding.rows].tolist() == [[2, 1, 0]]
    assert finding.detail["level_difference"] == {"1": 2}
    (family,) = finding.detail["families"]
    assert (family["parent"], family["level_difference"]) == (0, 1)
    assert family["children"] == [1, 3]


@pytest.mark.parametrize(("ratio", "level"), [(2, 1), (4, 2), (8, 3)])
def test_the_level_difference_counts_halvings(ratio, level):
    mesh = joined(quads((1, 1), (0, 0), (8, 8)), quads((ratio, ratio), (8, 0), (16, 8)), merge=True)
    finding = only(mesh, "hanging-nodes")
    assert finding.count == ratio - 1
    assert finding.detail["level_difference"] == {str(level): ratio}


def test_a_hex_beside_eight_of_half_its_size_has_five_hanging_nodes():
    mesh = joined(bricks((1, 1, 1), (0, 0, 0), (2, 2, 2)), bricks((2, 2, 2), (2, 0, 0), (4, 2, 2)), merge=True)
    finding = only(mesh, "hanging-nodes")
    assert finding.count == 5  # the middles of the four edges, and of the face
    assert finding.detail["families"] == [{"parent": 0, "children": [1, 2, 3, 4], "level_difference": 1}]


def refined_box():
    """4 x 4 x 4 units of hexes; those with x > 2 and y > 2 halved: (mesh, points that hang)."""
    points, nodes = bricks((4, 4, 4), (0, 0, 0), (4, 4, 4))
    middle = points[nodes].mean(axis=1)
    fine = (middle[:, 0] > 2) & (middle[:, 1] > 2)
    mesh = joined((points, nodes[~fine]), bricks((4, 4, 8), (2, 2, 0), (4, 4, 4)), merge=True)
    # on the planes x = 2 and y = 2 of the refined part: all its points that are not on the coarse lattice
    x, y, _ = mesh.points.T
    on = ((x == 2) & (y >= 2)) | ((y == 2) & (x >= 2))
    return mesh, np.flatnonzero(on & ((mesh.points % 1.0) != 0).any(axis=1))


def test_a_refined_corner_of_a_box_hangs_with_all_that_is_not_on_the_coarse_lattice():
    mesh, hanging = refined_box()
    finding = only(mesh, "hanging-nodes")
    assert finding.rows.tolist() == hanging.tolist()
    assert finding.detail["level_difference"] == {"1": 2 * 2 * 4 * 4}  # two planes of 2 x 4 faces, four children each


def as_polyhedra(mesh):
    """The refined mesh as polyhedra with the small faces on both sides: what adaptive solvers write."""
    f = faces(mesh)
    corners = [f.nodes[a:b] for a, b in zip(f.offsets[:-1], f.offsets[1:], strict=True)]
    centre = np.array([mesh.points[c].mean(axis=0) for c in corners])
    size = np.array([np.ptp(mesh.points[c], axis=0).max() for c in corners])
    outside = f.neighbour < 0
    owner, neighbour, gone = f.owner.copy(), f.neighbour.copy(), np.zeros(len(f), dtype=bool)
    inner = ((centre[:, 0] == 2) & (centre[:, 1] > 2)) | ((centre[:, 1] == 2) & (centre[:, 0] > 2))
    large = np.flatnonzero(outside & inner & (size == 1.0))
    for small in np.flatnonzero(outside & inner & (size == 0.5)):
        parent = large[np.argmin(np.abs(centre[large] - centre[small]).max(axis=1))]
        neighbour[small] = f.owner[parent]
        gone[parent] = True
    keep = np.flatnonzero(~gone)
    lists = [corners[k].tolist() for k in keep]
    place = {tuple(p): i for i, p in enumerate(mesh.points.tolist())}
    for face in lists:  # edges of large faces run through the points that hang on them
        for i in range(len(face) - 1, -1, -1):
            a, b = face[i], face[(i + 1) % len(face)]
            middle = place.get(tuple(0.5 * (mesh.points[a] + mesh.points[b])))
            if middle is not None:
                face.insert(i + 1, middle)
    owner, neighbour = owner[keep], neighbour[keep]
    own = Faces(np.cumsum([0, *map(len, lists)]), np.concatenate(lists), owner, neighbour)
    items = [np.flatnonzero((owner == c) | (neighbour == c)) for c in range(mesh.n_cells)]
    block = CellBlock(
        "polyhedron", np.arange(mesh.n_cells), offsets=np.cumsum([0, *map(len, items)]), items=np.concatenate(items)
    )
    return Mesh(mesh.points, (block,), faces=own)


def test_the_same_refinement_in_polyhedra_hangs_in_the_same_points_and_is_no_more_than_told():
    mesh, hanging = refined_box()
    poly = as_polyhedra(mesh)
    finding = only(poly, "hanging-nodes")
    assert finding.severity == "info"
    assert finding.rows.tolist() == hanging.tolist()
    assert [f.code for f in run_checks(poly) if f.severity != "info"] == []


def test_polygons_that_go_straight_on_at_a_corner_of_others_have_a_hanging_node_there():
    points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (3, 0, 0), (3, 1, 0), (2, 1, 0), (3, 2, 0)]
    items = [0, 1, 6, 2, 3, 1, 4, 5, 6, 6, 5, 7, 2]
    mesh = Mesh(
        np.array(points, float), (CellBlock("polygon", [0, 1, 2], offsets=[0, 5, 9, 13], items=items),), dimension=2
    )
    finding = only(mesh, "hanging-nodes")
    assert (finding.severity, finding.rows.tolist()) == ("info", [6])
    assert finding.detail["cells_with_straight_corners"] == [{"cell": 0, "nodes": 1}]


def test_a_corner_that_bends_no_cell_around_it_is_not_a_hanging_node():
    points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (2, -2, 0), (0, -2, 0)]
    items = [0, 1, 2, 3, 4, 0, 6, 5, 2, 1]
    mesh = Mesh(np.array(points, float), (CellBlock("polygon", [0, 1], offsets=[0, 5, 10], items=items),), dimension=2)
    assert found(mesh) == {}


def test_parts_merged_where_they_match_and_hanging_elsewhere_are_one_place_of_hanging_nodes():
    mesh = joined(FOUR, SIX, merge=True)
    finding = only(mesh, "hanging-nodes")
    # 25 and 49 points on the two sides, 9 of them in common: 16 + 40 hang
    assert finding.count == (25 - 9) + (49 - 9)


def test_a_quadrilateral_against_two_triangles_is_nonconformal_though_all_its_corners_are_shared():
    points = [*bricks((1, 1, 1), (0, 0, 0), (1, 1, 1))[0], (2, 0.5, 0.5)]  # 4 to 7 are the corners at x = 1
    hexes = bricks((1, 1, 1), (0, 0, 0), (1, 1, 1))[1]
    tets = [[4, 6, 7, 8], [4, 7, 5, 8]]  # the square cut along 4-7
    mesh = Mesh(np.array(points, float), (CellBlock("hex", [0], hexes), CellBlock("tet", [1, 2], tets)))
    finding = found(mesh)["nonconformal-interface"]
    assert "hanging-nodes" not in found(mesh)
    assert finding.count == 3
    assert finding.detail["interfaces"][0]["overlap_area"] == pytest.approx(1.0)


def test_doubled_cells_and_parts_that_run_through_each_other_are_no_interface():
    points, nodes = FOUR
    twice = Mesh(points, (CellBlock("hex", np.arange(64), np.concatenate([nodes, nodes])),))
    assert found(twice) == {}
    assert found(joined(FOUR, FOUR)) == {}
    assert found(joined(FOUR, (FOUR[0] + [0.55, 0.05, 0.05], FOUR[1]))) == {}


def test_a_sharp_edge_and_a_thin_wall_are_no_contact():
    for degrees in (5.0, 1.0, 0.05):
        points, nodes = quads((8, 1), (1, -1), (9, 1))
        points[:, 1] *= points[:, 0] * math.tan(math.radians(degrees / 2))
        tip = len(points)
        mesh = Mesh(
            np.concatenate([points, [[0, 0, 0]]]),
            (CellBlock("quad", np.arange(8), nodes), CellBlock("tri", [8], [[tip, 0, 9]])),
            dimension=2,
        )
        assert found(mesh) == {}
        hole = Mesh(mesh.points * [1, 1, 1], mesh.blocks, dimension=3)  # the same as a sheet in space
        assert found(hole) == {}


SAFE = CODES | {
    *("nonfinite-points", "inverted-cells", "degenerate-cells", "left-handed-faces", "negative-jacobian-cells"),
    *("node-order-convention", "duplicate-points", "collapsed-cells", "mixed-element-types", "near-points"),
}


@pytest.mark.parametrize("seed", range(6))
def test_broken_coordinates_and_folded_cells_stop_nothing(seed):
    rng = np.random.default_rng(seed)
    mesh = joined(FOUR, SIX)
    points = mesh.points.copy()
    points[rng.choice(len(points), 12, replace=False)] = rng.choice([np.nan, np.inf, -np.inf], (12, 1))
    points[rng.choice(len(points), 12, replace=False)] = points[rng.choice(len(points), 12)]
    points[rng.choice(len(points), 4, replace=False)] *= 1e250
    assert told(dataclasses.replace(mesh, points=points)) <= SAFE
    nowhere = dataclasses.replace(mesh, points=np.full_like(points, np.nan))
    assert told(nowhere) == {"nonfinite-points"}
    heap = dataclasses.replace(mesh, points=np.zeros_like(points))
    assert told(heap) <= SAFE


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 1e30, 1e200])
def test_contacts_do_not_depend_on_the_unit(scale):
    mesh = joined(FOUR, SIX)
    finding = found(dataclasses.replace(mesh, points=mesh.points * scale))["nonconformal-interface"]
    assert finding.count == 52
    assert finding.detail["interfaces"][0]["overlap"] == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_turning_moving_and_renumbering_change_no_contact(seed):
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    for mesh in (joined(FOUR, SIX), refined_box()[0], joined(FOUR, SIX, merge=True)):
        at, order = rng.permutation(len(mesh.points)), rng.permutation(mesh.n_cells)
        nodes = np.argsort(at)[mesh.block("hex").nodes][order]
        points = (mesh.points @ turn + rng.uniform(-100, 100, 3))[at]
        moved = Mesh(points, (CellBlock("hex", np.arange(len(nodes)), nodes),))
        assert {c: f.count for c, f in found(moved).items()} == {c: f.count for c, f in found(mesh).items()}


def test_findings_are_the_same_on_one_thread_and_on_many():
    for mesh in (joined(FOUR, SIX), refined_box()[0]):
        seen = []
        for threads in (1, 2, 8):
            with limited_to(threads):
                again = dataclasses.replace(mesh)
                seen.append([(f.code, f.rows.tolist(), f.detail) for f in run_checks(again)])
        assert seen[0] == seen[1] == seen[2]


def test_figures_are_what_json_holds():
    for mesh in (joined(FOUR, SIX), refined_box()[0], as_polyhedra(refined_box()[0]), joined(rings(24, [1.0, 2.0]))):
        for finding in run_checks(mesh):
            json.dumps(finding.detail, allow_nan=False)


def test_many_small_parts_are_many_interfaces_of_which_the_largest_are_described():
    line = [bricks((1, 2, 2), (k, 0, 0), (k + 1, 1, 1)) for k in range(80)]
    finding = only(joined(*line), "unmerged-interface")
    assert finding.detail["count"] == 79
    assert len(finding.detail["interfaces"]) == 50
    assert finding.count == 79 * 8
