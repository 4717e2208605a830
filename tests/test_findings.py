"""What each check says: a mesh that triggers it, and the sound mesh beside it that does not."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.findings import CHECKS, census, face_handedness, run_checks
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone

hybrid_mesh = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))["hybrid_mesh"]

UNIT = {
    "tet": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    "tri": [(0, 0, 0), (1, 0, 0), (0, 1, 0)],
    "quad": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
}
MIRROR = {
    "tet": [0, 2, 1, 3],
    "pyramid": [0, 3, 2, 1, 4],
    "wedge": [3, 4, 5, 0, 1, 2],
    "hex": [4, 5, 6, 7, 0, 1, 2, 3],
    "tri": [0, 2, 1],
    "quad": [0, 3, 2, 1],
}
SOLIDS = ("tet", "pyramid", "wedge", "hex")
SHEET = ["open-edges", "not-watertight"]
"""What is told of any surface with a rim."""


def mesh_of(points, cells, **more):
    """cells: type -> list of node lists; rows run through the types in order."""
    blocks, row = [], 0
    for name, nodes in cells.items():
        blocks.append(CellBlock(name, np.arange(row, row + len(nodes)), np.array(nodes)))
        row += len(nodes)
    return Mesh(np.array(points, float), tuple(blocks), **more)


def bricks(n=2):
    """(points, nodes) of n x n x n unit hexes."""
    line = np.arange(n + 1.0)
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)[:, ::-1]
    row = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    low, high = slice(None, -1), slice(1, None)
    corners = [(low, low, low), (low, low, high), (low, high, high), (low, high, low)]
    corners += [(high, *c[1:]) for c in corners]
    return points, np.stack([row[c].ravel() for c in corners], axis=1)


def separate(name, count):
    """`count` cells of one type, apart from each other."""
    cell = np.array(UNIT[name], float)
    points = np.concatenate([cell + [3.0 * i, 0, 0] for i in range(count)])
    return points, np.arange(len(points)).reshape(count, -1)


def with_faces(mesh, turned=(), **more):
    """The same mesh with faces of its own, some of them turned round."""
    f = faces(mesh)
    nodes = f.nodes.copy()
    for row in turned:
        nodes[f.offsets[row] : f.offsets[row + 1]] = nodes[f.offsets[row] : f.offsets[row + 1]][::-1]
    own = Faces(f.offsets, nodes, f.owner, f.neighbour)
    return Mesh(mesh.points, mesh.blocks, faces=own, dimension=mesh.dimension, **more)


def as_polyhedra(mesh, turned=()):
    """The same mesh without any cell types."""
    own = with_faces(mesh, turned).faces
    items = [np.flatnonzero((own.owner == c) | (own.neighbour == c)) for c in range(mesh.n_cells)]
    offsets = np.cumsum([0, *map(len, items)])
    block = CellBlock("polyhedron", np.arange(mesh.n_cells), offsets=offsets, items=np.concatenate(items))
    return Mesh(mesh.points, (block,), faces=own)


FIGURES = {
    *("features", "blocks", "size-jump", "chordal-deviation", "delaunay-violations", "misplaced-pyramids"),
    *("boundary-layers", "wall-orthogonality"),
}
"""Findings that describe a mesh and name no fault; tests of their own look at them."""


def codes(mesh):
    return [f.code for f in run_checks(mesh) if f.severity != "info" or f.code not in FIGURES]


def the(mesh, code):
    found = [finding for finding in run_checks(mesh) if finding.code == code]
    assert len(found) == 1, codes(mesh)
    return found[0]


@pytest.mark.parametrize(
    ("name", "dimension"), [*((name, 3) for name in SOLIDS), ("tri", 2), ("quad", 2), ("tri", 3), ("quad", 3)]
)
def test_sound_cells_of_every_type_give_no_finding(name, dimension):
    points, nodes = separate(name, 3)
    sheet = dimension == 3 and name in ("tri", "quad")
    assert codes(mesh_of(points, {name: nodes}, dimension=dimension)) == (SHEET if sheet else [])


@pytest.mark.parametrize("seed", range(3))
def test_a_sound_hybrid_mesh_gives_no_error_and_no_warning_however_it_is_stored(seed):
    mesh = hybrid_mesh(seed)
    for version in (mesh, with_faces(mesh), as_polyhedra(mesh)):
        assert [f.code for f in run_checks(version) if f.severity != "info"] == []


@pytest.mark.parametrize("name", SOLIDS)
def test_one_reversed_cell_among_sound_ones_is_inverted_and_flagged_and_its_neighbours_are_not(name):
    points, nodes = separate(name, 4)
    nodes[2] = nodes[2][MIRROR[name]]
    mesh = mesh_of(points, {name: nodes})
    assert codes(mesh) == ["inverted-cells", "left-handed-faces"]
    assert the(mesh, "inverted-cells").rows.tolist() == [2]
    assert face_handedness(mesh)[1].tolist() == [0, 0, 1, 0]


@pytest.mark.parametrize("row", range(27))
def test_a_reversed_cell_is_flagged_alone_wherever_it_stands_in_the_file(row):
    points, nodes = bricks(3)
    nodes[row] = nodes[row][MIRROR["hex"]]
    mesh = mesh_of(points, {"hex": nodes}, cell_ids=np.arange(27) + 101)
    assert np.flatnonzero(face_handedness(mesh)[1]).tolist() == [row]
    assert the(mesh, "inverted-cells").ids(mesh).tolist() == [row + 101]
    assert the(mesh, "left-handed-faces").ids(mesh).tolist() == [row + 101]


def test_the_two_quads_of_the_article_pass_and_a_reversed_one_has_face_handedness_1():
    # nodes 1 to 6 around a 2 x 1 rectangle; elements 1 2 5 6 and 2 3 4 5
    points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (0, 1, 0)]
    sound = mesh_of(points, {"quad": [[0, 1, 4, 5], [1, 2, 3, 4]]}, dimension=2)
    assert codes(sound) == []
    assert face_handedness(sound)[1].tolist() == [0, 0]
    turned = mesh_of(points, {"quad": [[0, 1, 4, 5], [1, 4, 3, 2]]}, dimension=2)
    assert codes(turned) == ["inverted-cells", "left-handed-faces"]
    assert face_handedness(turned)[1].tolist() == [0, 1]
    assert np.flatnonzero(face_handedness(turned)[1] > 0.5).tolist() == [1]
    assert codes(with_faces(sound)) == []
    reversed_edge = with_faces(sound, turned=[1])
    assert codes(reversed_edge) == ["left-handed-faces"]
    assert face_handedness(reversed_edge)[1].tolist() == [1, 1]


@pytest.mark.parametrize("shape", [with_faces, as_polyhedra])
def test_one_reversed_face_is_left_handed_and_marks_the_cells_on_both_sides(shape):
    points, nodes = bricks(2)
    sound = mesh_of(points, {"hex": nodes})
    f = faces(sound)
    inner, outer = np.flatnonzero(f.neighbour >= 0)[3], np.flatnonzero(f.neighbour < 0)[5]
    mesh = shape(sound, turned=[inner, outer])
    finding = the(mesh, "left-handed-faces")
    assert [c for c in codes(mesh) if c != "mixed-element-types"] == ["left-handed-faces"]
    assert finding.rows.tolist() == sorted([inner, outer])
    assert finding.entity == "face"
    per_face, per_cell = face_handedness(mesh)
    assert np.flatnonzero(per_face).tolist() == sorted([inner, outer])
    assert set(np.flatnonzero(per_cell)) == {f.owner[inner], f.neighbour[inner], f.owner[outer]}


def test_a_cell_turned_inside_out_by_one_node_is_inverted_and_not_a_convention():
    # two tets on the triangle 0 1 2; the apex of the second is pushed through it to the other side
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.2, 0.2, 1), (0.2, 0.2, 0.5)]
    mesh = mesh_of(points, {"tet": [[0, 1, 2, 3], [0, 2, 1, 4]]})
    assert the(mesh, "inverted-cells").rows.tolist() == [1]
    points[4] = (0.2, 0.2, -0.5)
    assert codes(mesh_of(points, {"tet": [[0, 1, 2, 3], [0, 2, 1, 4]]})) == []


@pytest.mark.parametrize("name", SOLIDS)
def test_a_whole_mesh_of_mirrored_cells_is_a_convention_from_five_cells_on(name):
    for count, code in ((4, "inverted-cells"), (5, "node-order-convention")):
        points, nodes = separate(name, count)
        found = codes(mesh_of(points, {name: nodes[:, MIRROR[name]]}))
        assert found[0] == code
        assert ("left-handed-faces" in found) == (code == "inverted-cells")


def test_wedges_in_the_old_order_beside_sound_hexes_are_a_convention_with_their_count():
    mesh = hybrid_mesh(1)
    blocks = [
        CellBlock(b.type, b.rows, b.nodes[:, MIRROR["wedge"]] if b.type == "wedge" else b.nodes) for b in mesh.blocks
    ]
    swapped = Mesh(mesh.points, tuple(blocks))
    finding = the(swapped, "node-order-convention")
    wedges = mesh.block("wedge")
    assert finding.severity == "warning"
    assert finding.rows.tolist() == wedges.rows.tolist()
    assert f"{len(wedges)} wedge" in finding.message
    assert [f.code for f in run_checks(swapped) if f.severity == "error"] == []


def test_a_single_wedge_in_the_old_order_beside_a_hex_is_a_convention_but_a_folded_one_is_not():
    points = [*UNIT["hex"], (2, 0, 0), (2, 0, 1)]
    sound = [1, 8, 2, 5, 9, 6]
    assert codes(mesh_of(points, {"hex": [range(8)], "wedge": [sound]})) == ["mixed-element-types"]
    swapped = mesh_of(points, {"hex": [range(8)], "wedge": [[sound[i] for i in MIRROR["wedge"]]]})
    assert codes(swapped) == ["node-order-convention", "mixed-element-types"]
    points[8:] = [(0.5, 0.4, 0), (0.5, 0.4, 1)]  # the ridge pushed into the hex
    folded = mesh_of(points, {"hex": [range(8)], "wedge": [sound]})
    assert codes(folded) == ["inverted-cells", "left-handed-faces", "mixed-element-types"]


def test_a_flat_mesh_drawn_clockwise_is_a_convention_and_a_single_clockwise_cell_is_inverted():
    points, nodes = separate("tri", 9)
    assert codes(mesh_of(points, {"tri": nodes[:, ::-1]}, dimension=2)) == ["node-order-convention"]
    nodes[4] = nodes[4][::-1]
    assert the(mesh_of(points, {"tri": nodes}, dimension=2), "inverted-cells").rows.tolist() == [4]
    assert codes(mesh_of(points, {"tri": nodes}, dimension=3)) == SHEET  # a surface has no up


def test_a_concave_corner_is_reported_though_the_volume_is_positive():
    points = np.array(UNIT["hex"], float)
    points[6] = (0.3, 0.3, 0.3)  # past the plane through 2, 5 and 7, x + y + z = 2, and more: corner Jacobian < 0
    mesh = mesh_of(points, {"hex": [range(8)]})
    assert the(mesh, "negative-jacobian-cells").rows.tolist() == [0]
    assert "inverted-cells" not in codes(mesh)
    arrow = [(0, 0, 0), (1, 0, 0), (0.2, 0.2, 0), (0, 1, 0)]
    for dimension in (2, 3):
        assert "negative-jacobian-cells" in codes(mesh_of(arrow, {"quad": [range(4)]}, dimension=dimension))
        assert "inverted-cells" not in codes(mesh_of(arrow, {"quad": [range(4)]}, dimension=dimension))


@pytest.mark.parametrize("name", SOLIDS)
def test_a_cell_squashed_into_a_plane_is_degenerate_and_not_inverted(name):
    points, nodes = separate(name, 6)
    slanted = points[nodes[3]]
    slanted[:, 2] = 0.3 * slanted[:, 0] + 0.7 * slanted[:, 1]
    points[nodes[3]] = slanted
    mesh = mesh_of(points, {name: nodes})
    assert the(mesh, "degenerate-cells").rows.tolist() == [3]
    assert {"inverted-cells", "left-handed-faces", "negative-jacobian-cells"}.isdisjoint(codes(mesh))


def test_a_hex_folded_into_a_wedge_is_collapsed_and_nothing_worse():
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
    mesh = mesh_of(points, {"hex": [[0, 1, 2, 2, 3, 4, 5, 5]]})
    assert codes(mesh) == ["collapsed-cells"]
    assert codes(mesh_of(points, {"wedge": [range(6)]})) == []


def test_points_that_are_no_place_are_reported_and_their_cells_left_alone():
    points, nodes = bricks(2)
    points = points.copy()
    points[3, 1], points[20, 0] = np.nan, np.inf
    mesh = mesh_of(points, {"hex": nodes}, point_ids=np.arange(27) + 1)
    finding = the(mesh, "nonfinite-points")
    assert finding.ids(mesh).tolist() == [4, 21]
    assert codes(mesh) == ["nonfinite-points"]
    assert codes(with_faces(mesh))[0] == "nonfinite-points"


def test_coincident_points_are_counted_once_each_and_minus_zero_is_zero():
    points, nodes = separate("hex", 3)
    points[8:] -= [[2.0, 0, 0]]  # the second and third hex now touch the one before: x = 1 and x = 4 - 2 = 2 + ...
    points[16:] -= [[2.0, 0, 0]]
    points[points == 0.0] = -0.0
    points[:4] = np.abs(points[:4])
    mesh = mesh_of(points, {"hex": nodes})
    finding = the(mesh, "duplicate-points")
    assert finding.count == len(points) - len(np.unique(points + 0.0, axis=0)) == 8
    assert codes(mesh) == ["duplicate-points", "unmerged-interface"]


def test_points_that_only_swap_coordinates_are_not_duplicates():
    points = [(1, 2, 3), (2, 1, 3), (3, 2, 1), (1, 3, 2)]
    assert "duplicate-points" not in codes(mesh_of(points, {"tet": [range(4)]}))


def test_unused_points_are_those_of_no_cell_and_no_boundary_element():
    points = [*UNIT["tet"], (5, 5, 5), (6, 6, 6)]
    mesh = mesh_of(points, {"tet": [range(4)]}, boundary=(CellBlock("vertex", [0], [[5]]),))
    assert the(mesh, "unused-points").rows.tolist() == [4]
    twin = mesh_of([*points[:4], points[0]], {"tet": [range(4)]})
    assert codes(twin) == ["unused-points"]  # coincident, but no cell uses it


@pytest.mark.parametrize("name", SOLIDS)
def test_a_cell_listed_twice_is_a_duplicate_and_its_faces_are_not_reported_again(name):
    points, nodes = separate(name, 3)
    mesh = mesh_of(points, {name: [*nodes, nodes[1][MIRROR[name]][MIRROR[name]]]})
    assert codes(mesh) == ["duplicate-cells"]
    assert the(mesh, "duplicate-cells").rows.tolist() == [3]


def test_duplicate_faces_are_reported_and_baffles_are_not():
    points, nodes = bricks(2)
    mesh = with_faces(mesh_of(points, {"hex": nodes}))
    own = mesh.faces
    inner = int(np.flatnonzero(own.neighbour >= 0)[0])
    face = own.nodes[own.offsets[inner] : own.offsets[inner + 1]]

    def again(*, owner, neighbour, nodes, first_neighbour):
        neighbours = own.neighbour.copy()
        neighbours[inner] = first_neighbour
        offsets = np.append(own.offsets, own.offsets[-1] + 4)
        more = Faces(
            offsets, np.append(own.nodes, nodes), np.append(own.owner, owner), np.append(neighbours, neighbour)
        )
        return Mesh(mesh.points, mesh.blocks, faces=more)

    twice = again(
        owner=own.owner[inner], neighbour=own.neighbour[inner], nodes=face, first_neighbour=own.neighbour[inner]
    )
    assert the(twice, "duplicate-faces").rows.tolist() == [len(own)]
    baffle = again(owner=own.neighbour[inner], neighbour=-1, nodes=face[::-1], first_neighbour=-1)
    assert codes(baffle) == []


def test_a_face_of_three_cells_is_overused_and_of_three_plates_nonmanifold():
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.2, 0.2, 1), (0.2, 0.2, -1), (0.4, 0.4, -1.5)]
    pair = {"tet": [[0, 1, 2, 3], [0, 2, 1, 4]]}
    assert "overused-faces" not in codes(mesh_of(points, pair))
    mesh = mesh_of(points, {"tet": [*pair["tet"], [0, 2, 1, 5]]})
    assert the(mesh, "overused-faces").count == 1
    plates = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)]
    joint = mesh_of(plates, {"tri": [[0, 1, 2], [1, 0, 3], [1, 0, 4]]})
    assert the(joint, "nonmanifold-edges").count == 1
    assert codes(mesh_of(plates[:4], {"tri": [[0, 1, 2], [1, 0, 3]]})) == SHEET


def test_a_cube_surface_passes_and_with_one_triangle_flipped_fails_orientation_only():
    quads = CELL_TYPES["hex"].faces
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    assert codes(mesh_of(UNIT["hex"], {"tri": triangles})) == ["watertight-shells"]
    triangles[5] = triangles[5][::-1]
    flipped = mesh_of(UNIT["hex"], {"tri": triangles})
    assert codes(flipped) == ["inconsistent-orientation", "watertight-shells"]
    assert the(flipped, "inconsistent-orientation").count == 3  # its three edges


def test_a_polyhedron_that_lacks_a_face_is_open():
    points, nodes = bricks(2)
    mesh = as_polyhedra(mesh_of(points, {"hex": nodes}))
    assert codes(mesh) == []
    own, block = mesh.faces, mesh.blocks[0]
    gone = int(np.flatnonzero(own.neighbour < 0)[0])
    keep = np.arange(len(own)) != gone
    sizes = np.diff(own.offsets)[keep]
    less = Faces(
        np.append(0, np.cumsum(sizes)),
        own.nodes[np.repeat(keep, np.diff(own.offsets))],
        own.owner[keep],
        own.neighbour[keep],
    )
    items = [block.items[a:b] for a, b in zip(block.offsets[:-1], block.offsets[1:], strict=True)]
    items = [i[i != gone] - (i[i != gone] > gone) for i in items]
    lists = CellBlock("polyhedron", block.rows, offsets=np.cumsum([0, *map(len, items)]), items=np.concatenate(items))
    finding = the(Mesh(mesh.points, (lists,), faces=less), "open-cells")
    assert finding.rows.tolist() == [own.owner[gone]]


def test_mixed_types_are_listed_by_zone_and_a_pure_zone_is_called_pure():
    points, nodes = separate("hex", 2)
    more, tets = separate("tet", 1)
    zones = (Zone("water", "zone", "fluid", "cell", [0, 2]), Zone("steel", "zone", "solid", "cell", [1]))
    mesh = mesh_of(np.concatenate([points, more + 9.0]), {"hex": nodes, "tet": tets + len(points)}, zones=zones)
    finding = the(mesh, "mixed-element-types")
    assert finding.severity == "info"
    assert finding.rows.tolist() == [2]
    assert "steel: pure hex" in finding.message
    assert "water: 1 hex + 1 tet" in finding.message
    assert census(mesh) == {"water": {"hex": 1, "tet": 1}, "steel": {"hex": 1}}
    assert codes(mesh_of(points, {"hex": nodes})) == []


def test_zones_are_checked_for_emptiness_gaps_and_overlap():
    points, nodes = bricks(2)
    mesh = mesh_of(points, {"hex": nodes})

    def zoned(*zones):
        return with_faces(mesh, zones=zones)

    body = Zone("body", "zone", "fluid", "cell", np.arange(8))
    wall, inlet = (Zone(n, "patch", n, "face", m, i) for n, m, i in (("wall", [0, 1, 2], 7), ("inlet", [3, 4], 8)))
    assert codes(zoned(body, wall, inlet)) == []
    nothing = Zone("left over", "zone", "", "face", [], 9)
    empty = the(zoned(body, wall, nothing), "empty-zones")
    assert (empty.severity, empty.rows.tolist()) == ("info", [2])
    assert empty.ids(zoned(body, wall, nothing)).tolist() == [9]
    part = Zone("part", "zone", "fluid", "cell", [0, 1, 2, 3, 4, 5, 7])
    assert the(zoned(part), "unzoned-cells").rows.tolist() == [6]
    overlapping = Zone("inlet", "patch", "inlet", "face", [2, 3])
    double = the(zoned(body, wall, overlapping), "faces-in-two-zones")
    assert (double.severity, double.rows.tolist()) == ("warning", [2])
    assert codes(zoned(body, wall, Zone("selection", "faceZone", "", "face", [2, 3]))) == []


def test_overlapping_boundary_zones_of_a_cell_based_mesh_give_the_numbers_of_its_elements():
    zones = (Zone("a", "physical group", "", "face", [0, 1]), Zone("b", "physical group", "", "face", [1]))
    boundary = (CellBlock("tri", [0, 1], [[0, 1, 2], [0, 1, 3]]),)
    mesh = mesh_of(UNIT["tet"], {"tet": [range(4)]}, boundary=boundary, boundary_ids=[50, 60], zones=zones)
    assert the(mesh, "faces-in-two-zones").ids(mesh).tolist() == [60]


def test_every_finding_has_a_stable_code_of_words_and_a_row_that_explains_its_severity():
    for code, check in CHECKS.items():
        assert code == check.code == "-".join(code.split("-")).lower()
        assert check.severity in ("error", "warning", "info")
        assert len(check.reason) > 20
        assert check.title
