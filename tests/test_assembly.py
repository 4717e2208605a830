"""Cells assembled from faces are the cells the faces were taken from, whatever the order of the file."""

import pickle
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.assembly import AssemblyError, blocks_from_faces
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import MeshError
from meshwright.audit.mesh import Faces, Mesh

_HYBRID = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))
hybrid_mesh, sides_of_cells, turned = _HYBRID["hybrid_mesh"], _HYBRID["sides_of_cells"], _HYBRID["turned"]
faces_by_brute_force = _HYBRID["faces_by_brute_force"]


def arrays(faces):
    """[(nodes, owner, neighbour)] as the arguments of blocks_from_faces."""
    offsets = np.cumsum([0, *(len(nodes) for nodes, _, _ in faces)])
    nodes = np.array([n for nodes, _, _ in faces for n in nodes], dtype=np.int64)
    return offsets, nodes, np.array([f[1] for f in faces]), np.array([f[2] for f in faces])


def cell_of(sides):
    """One cell's own faces, all outward."""
    return [(tuple(side), 0, -1) for side in sides]


def reference(name):
    return cell_of(CELL_TYPES[name].faces)


def shuffled(faces, rng):
    """The same mesh as another file would write it: faces in any order, started anywhere, sides swapped."""
    out = []
    for index in rng.permutation(len(faces)):
        nodes, owner, neighbour = faces[index]
        start = rng.integers(len(nodes))
        nodes = (*nodes[start:], *nodes[:start])
        if neighbour >= 0 and rng.random() < 0.5:
            nodes, owner, neighbour = nodes[::-1], neighbour, owner
        out.append((nodes, owner, neighbour))
    return out


def assert_same_cells(mesh, blocks):
    """Same type and same outward faces, cell by cell: that is the same cell up to an admissible renumbering."""
    again = Mesh(mesh.points, blocks)
    assert {b.type: b.rows.tolist() for b in again.blocks} == {b.type: b.rows.tolist() for b in mesh.blocks}
    for old, new in zip(sides_of_cells(mesh), sides_of_cells(again), strict=True):
        assert {turned(side) for side in old} == {turned(side) for side in new}


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_hybrid_cells_survive_any_order_start_and_side_of_their_faces(seed):
    mesh = hybrid_mesh(seed)
    faces = shuffled(faces_by_brute_force(mesh), np.random.default_rng(seed))
    blocks = blocks_from_faces(*arrays(faces), mesh.n_cells, 3)
    assert [b.type for b in blocks] == [t for t in CELL_TYPES if t in mesh.counts]
    assert_same_cells(mesh, blocks)


@pytest.mark.parametrize("name", ["tet", "pyramid", "wedge", "hex"])
def test_one_face_turned_the_wrong_way_is_outvoted(name):
    for wrong in range(len(reference(name))):
        faces = reference(name)
        faces[wrong] = (faces[wrong][0][::-1], 0, -1)
        (block,) = blocks_from_faces(*arrays(faces), 1, 3)
        found = {turned(tuple(int(block.nodes[0, v]) for v in side)) for side in CELL_TYPES[name].faces}
        assert block.type == name
        assert found == {turned(side) for side in CELL_TYPES[name].faces}


@pytest.mark.parametrize("name", ["tet", "pyramid", "wedge", "hex"])
def test_a_left_handed_file_gives_the_mirrored_cell(name):
    faces = [(nodes[::-1], 0, -1) for nodes, _, _ in reference(name)]
    (block,) = blocks_from_faces(*arrays(faces), 1, 3)
    found = {turned(tuple(int(block.nodes[0, v]) for v in side)) for side in CELL_TYPES[name].faces}
    assert found == {turned(side[::-1]) for side in CELL_TYPES[name].faces}


def test_six_quads_that_are_no_cube_stay_a_polyhedron():
    # a pillow of two quads, split four times along a new path between opposite corners: 8 nodes, 6 quads
    faces = [(0, 1, 2, 3), (3, 2, 1, 0)]
    for new in range(4, 8):
        a, b, c, d = faces.pop(0)
        faces += [(a, b, c, new), (a, new, c, d)]
    (block,) = blocks_from_faces(*arrays(cell_of(faces)), 1, 3)
    assert len({n for f in faces for n in f}) == 8
    assert (block.type, block.items.tolist()) == ("polyhedron", [0, 1, 2, 3, 4, 5])


def test_four_triangles_that_are_two_flat_pockets_are_not_called_a_tet():
    (block,) = blocks_from_faces(*arrays(cell_of([(0, 1, 2), (2, 1, 0), (3, 4, 5), (5, 4, 3)])), 1, 3)
    assert block.type == "polyhedron"


def test_a_cube_pinched_so_that_opposite_corners_are_one_point_is_not_called_a_hex():
    sides = [tuple(0 if node == 6 else node for node in side) for side in CELL_TYPES["hex"].faces]
    (block,) = blocks_from_faces(*arrays(cell_of(sides)), 1, 3)
    assert block.type == "polyhedron"


def test_a_cube_with_one_side_in_four_and_its_hanging_nodes_listed_is_a_polyhedron():
    edges = {(4, 5): 8, (5, 6): 9, (6, 7): 10, (4, 7): 11}
    sides = []
    for side in CELL_TYPES["hex"].faces:
        if side == (4, 5, 6, 7):
            sides += [(4, 8, 12, 11), (8, 5, 9, 12), (12, 9, 6, 10), (11, 12, 10, 7)]
            continue
        around = []
        for a, b in zip(side, (*side[1:], side[0]), strict=True):
            around += [a, edges[min(a, b), max(a, b)]] if (min(a, b), max(a, b)) in edges else [a]
        sides.append(tuple(around))
    (block,) = blocks_from_faces(*arrays(cell_of(sides)), 1, 3)
    assert (block.type, len(block.items)) == ("polyhedron", 9)
    Mesh(np.zeros((13, 3)), (block,), faces=Faces(*arrays(cell_of(sides))))


def test_polyhedra_among_recognised_cells_keep_their_rows_and_faces():
    faces = [(nodes, row, -1) for row in (0, 2) for nodes in CELL_TYPES["tet"].faces]
    prism = [(0, 4, 3, 2, 1), (5, 6, 7, 8, 9), *((i, (i + 1) % 5, 5 + (i + 1) % 5, 5 + i) for i in range(5))]
    faces[2:2] = [(nodes, 1, -1) for nodes in prism]
    tets, poly = blocks_from_faces(*arrays(faces), 3, 3)
    assert (tets.type, tets.rows.tolist(), poly.type, poly.rows.tolist()) == ("tet", [0, 2], "polyhedron", [1])
    assert poly.items.tolist() == list(range(2, 9))


def broken(name, change):
    faces = reference(name)
    change(faces)
    with pytest.raises(AssemblyError) as caught:
        blocks_from_faces(*arrays(faces), 1, 3)
    return caught.value


def test_a_missing_face_is_reported_with_the_edge_it_leaves_open():
    error = broken("hex", lambda faces: faces.pop())
    assert error.cell == 0
    assert error.expected == "every edge in exactly 2 of its faces"
    assert error.found in {f"edge {a}-{b} in 1" for a, b in ((0, 3), (3, 7), (4, 7), (0, 4))}


@pytest.mark.parametrize("name", ["tet", "pyramid", "wedge", "hex"])
def test_one_wrong_node_in_one_face_is_never_overlooked(name):
    for wrong, (nodes, _, _) in enumerate(reference(name)):
        for at in range(len(nodes)):
            faces = reference(name)
            faces[wrong] = ((*nodes[:at], 99, *nodes[at + 1 :]), 0, -1)
            with pytest.raises(AssemblyError, match=r"every edge in exactly 2 of its faces, found edge .* in 1"):
                blocks_from_faces(*arrays(faces), 1, 3)


def test_an_edge_in_four_faces_of_a_cell_is_refused():
    fin = [(0, 1, 9), (9, 1, 0)]
    assert "edge 0-1 in 4" in str(broken("tet", lambda faces: faces.extend((f, 0, -1) for f in fin)))


def test_a_face_that_names_a_node_twice_is_refused_however_long_it_is():
    def repeat(faces, size):
        faces[0] = ((*range(size), 0), 0, -1)

    assert broken("hex", lambda faces: repeat(faces, 3)).found == "face 0 with node 0 twice"
    assert broken("hex", lambda faces: repeat(faces, 5)).found == "face 0 with node 0 twice"
    assert broken("hex", lambda faces: repeat(faces, 100)).found == "face 0 with node 0 twice"


def test_a_face_of_two_nodes_is_refused():
    assert broken("tet", lambda faces: faces.append(((0, 1), 0, -1))).found == "face 4 of 2"


def test_a_cell_that_is_its_own_neighbour_is_refused():
    assert "both sides" in broken("tet", lambda faces: faces.append(((0, 1, 2), 0, 0))).found


def test_a_cell_without_faces_is_named():
    with pytest.raises(AssemblyError, match="cell row 1: expected at least 4 faces, found none"):
        blocks_from_faces(*arrays([(nodes, row, -1) for row in (0, 2) for nodes in CELL_TYPES["tet"].faces]), 3, 3)


def test_an_absurd_number_of_cells_is_refused_before_memory_is_taken():
    with pytest.raises(AssemblyError, match="cell row 1: expected at least one face, found none"):
        blocks_from_faces(*arrays(reference("tet")), 2**40, 3)


@pytest.mark.parametrize(
    ("place", "value"), [("owner", 1), ("owner", -1), ("neighbour", 1), ("neighbour", -2), ("nodes", -1)]
)
def test_numbers_out_of_range_never_reach_a_kernel(place, value):
    offsets, nodes, owner, neighbour = arrays(reference("tet"))
    {"owner": owner, "neighbour": neighbour, "nodes": nodes}[place][2] = value
    with pytest.raises(MeshError):
        blocks_from_faces(offsets, nodes, owner, neighbour, 1, 3)


@pytest.mark.parametrize("offsets", [[0, 3, 6, 9, 13], [0, 3, 9, 6, 12], [1, 3, 6, 9, 12], [0, 3, 6, 12]])
def test_offsets_that_do_not_fit_are_refused(offsets):
    _, nodes, owner, neighbour = arrays(reference("tet"))
    with pytest.raises(MeshError):
        blocks_from_faces(np.array(offsets), nodes, owner, neighbour, 1, 3)


def test_the_error_survives_pickling_between_processes():
    error = pickle.loads(pickle.dumps(AssemblyError(7, "this", "that")))  # noqa: S301
    assert (error.cell, error.expected, error.found, str(error)) == (
        7,
        "this",
        "that",
        "cell row 7: expected this, found that",
    )


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_flat_cells_come_back_counter_clockwise_from_edges_in_any_order(seed):
    # a fan of polygons about node 0, neighbours sharing a spoke: sizes 3 to 9, counter-clockwise
    rng = np.random.default_rng(seed)
    n_cells = int(rng.integers(3, 8))
    spokes = list(range(1, n_cells + 1))
    cells, node = [], n_cells + 1
    for c in range(n_cells):
        extra = int(rng.integers(0, 7))
        cells.append((0, spokes[c], *range(node, node + extra), spokes[(c + 1) % n_cells]))
        node += extra
    edges = {}
    for row, cell in enumerate(cells):
        for a, b in zip(cell, (*cell[1:], cell[0]), strict=True):
            if (b, a) in edges:
                edges[b, a] = (edges[b, a][0], row)
            else:
                edges[a, b] = (row, -1)
    faces = [((a, b), owner, other) for (a, b), (owner, other) in edges.items()]
    faces = [f if f[2] < 0 or rng.random() < 0.5 else (f[0][::-1], f[2], f[1]) for f in faces]
    faces = [faces[i] for i in rng.permutation(len(faces))]
    blocks = blocks_from_faces(*arrays(faces), n_cells, 2)
    found = {}
    for block in blocks:
        starts = np.arange(len(block) + 1) * block.nodes.shape[1] if block.items is None else block.offsets
        items = block.nodes.ravel() if block.items is None else block.items
        for i, r in enumerate(block.rows.tolist()):
            found[r] = (block.type, turned(tuple(items[starts[i] : starts[i + 1]].tolist())))
    name = {3: "tri", 4: "quad"}
    assert found == {row: (name.get(len(cell), "polygon"), turned(cell)) for row, cell in enumerate(cells)}


def flat(edges):
    with pytest.raises(AssemblyError) as caught:
        blocks_from_faces(*arrays([(edge, 0, -1) for edge in edges]), 1, 2)
    return caught.value.found


def test_edges_that_form_no_single_loop_are_refused():
    assert flat([(0, 1), (1, 2), (2, 3)]) in ("node 0 in 1", "node 3 in 1")
    assert flat([(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3)]) == "a loop of 3 of its 6 edges"
    assert flat([(0, 1), (1, 2), (2, 0), (0, 3), (3, 4), (4, 0)]) == "node 0 in 4"
    assert flat([(0, 1), (1, 0)]) == "2"
    assert flat([(0, 1), (1, 2), (2, 2)]) == "face 2 with node 2 twice"
    assert flat([(0, 1), (1, 2), (2, 0), (0, 1, 2)]) == "face 3 of 3"


def test_one_edge_turned_the_wrong_way_is_outvoted_in_the_plane():
    edges = [((1, 0), 0, -1), ((1, 2), 0, -1), ((2, 3), 0, -1), ((3, 0), 0, -1)]
    (block,) = blocks_from_faces(*arrays(edges), 1, 2)
    assert (block.type, turned(tuple(block.nodes[0].tolist()))) == ("quad", (0, 1, 2, 3))
