"""Faces, edges and parts of a mesh against brute force, Euler's formula."""

import gc
import runpy
import time
import weakref
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import (
    boundary_faces,
    cell_components,
    duplicate_cells,
    edges,
    faces,
    faces_of_cells,
    nodes_of_cells,
    overused_faces,
    points_to_cells,
    unused_points,
)
from meshwright.audit.mesh import CellBlock, Faces, Mesh

_HYBRID = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))
hybrid_mesh, sides_of_cells = _HYBRID["hybrid_mesh"], _HYBRID["sides_of_cells"]
faces_by_brute_force = _HYBRID["faces_by_brute_force"]


def one_block(name, cells, n_points=None, **others):
    cells = np.array(cells)
    points = np.zeros((int(cells.max()) + 1 if n_points is None else n_points, 3))
    return Mesh(points, (CellBlock(name, np.arange(len(cells)), cells),), **others)


def rows_of(table):
    offsets, items = table
    return [items[a:b].tolist() for a, b in pairwise(offsets)]


def listed(found):
    return list(
        zip(
            map(tuple, rows_of((found.offsets, found.nodes))),
            found.owner.tolist(),
            found.neighbour.tolist(),
            strict=True,
        )
    )


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_faces_of_hybrid_meshes_are_those_found_by_brute_force_in_the_same_order(seed):
    mesh = hybrid_mesh(seed)
    assert listed(faces(mesh)) == faces_by_brute_force(mesh)
    assert not len(overused_faces(mesh))


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_tables_of_hybrid_meshes_agree_with_brute_force(seed):
    mesh = hybrid_mesh(seed, n=2)
    sides = sides_of_cells(mesh)
    nodes = [sorted({n for side in cell for n in side}) for cell in sides]
    assert [sorted(row) for row in rows_of(nodes_of_cells(mesh))] == nodes
    assert rows_of(points_to_cells(mesh)) == [
        [row for row, cell in enumerate(nodes) if point in cell] for point in range(len(mesh.points))
    ]
    wanted = faces_by_brute_force(mesh)
    assert rows_of(faces_of_cells(mesh)) == [
        [f for f, face in enumerate(wanted) if row in face[1:]] for row in range(mesh.n_cells)
    ]
    around = {tuple(sorted(e)) for cell in sides for s in cell for e in zip(s, (*s[1:], s[0]), strict=True)}
    assert list(map(tuple, edges(mesh).tolist())) == sorted(around)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_eulers_formula_holds_for_a_ball_and_its_surface(seed):
    mesh = hybrid_mesh(seed, n=4)
    used = len(mesh.points) - len(unused_points(mesh))
    assert used - len(edges(mesh)) + len(faces(mesh)) - mesh.n_cells == 1
    found = faces(mesh)
    skin = [frozenset(nodes) for nodes, _, other in listed(found) if other < 0]
    rims = {
        frozenset(e)
        for nodes, _, other in listed(found)
        if other < 0
        for e in zip(nodes, (*nodes[1:], nodes[0]), strict=True)
    }
    assert len(boundary_faces(mesh)) == len(skin)
    assert len(set().union(*skin)) - len(rims) + len(skin) == 2


def test_eulers_formula_holds_for_a_ring_of_hexes():
    n = 7
    ring = [[4 * (i % n) + j for i in (c, c + 1) for j in range(4)] for c in range(n)]
    mesh = one_block("hex", ring)
    assert len(mesh.points) - len(edges(mesh)) + len(faces(mesh)) - mesh.n_cells == 0
    assert len(boundary_faces(mesh)) == 4 * n


@pytest.mark.parametrize("wanted", ["tri6", "quad8", "quad9", "tet10", "pyramid13", "wedge15", "hex20", "hex27"])
def test_second_order_cells_take_part_with_their_corners(wanted):
    kind = CELL_TYPES[wanted]
    cell = np.arange(kind.n_nodes)[None]
    found = faces(one_block(wanted, cell))
    sides = kind.edges if kind.dimension == 2 else kind.faces
    assert listed(found) == [(side, 0, -1) for side in sides]
    mesh = one_block(wanted, cell)
    assert list(map(tuple, edges(mesh).tolist())) == sorted(tuple(sorted(edge)) for edge in kind.edges)
    assert rows_of(nodes_of_cells(mesh)) == [list(range(kind.n_nodes))]
    assert not len(unused_points(mesh))


def test_a_node_in_hundreds_of_cells_pairs_as_well_as_any_other():
    n = 150
    ring = [[0, 1, 2 + c, 2 + (c + 1) % n] for c in np.random.default_rng(5).permutation(n)]
    mesh = one_block("tet", ring)
    assert listed(faces(mesh)) == faces_by_brute_force(mesh)
    assert len(boundary_faces(mesh)) == 2 * n


def test_flat_cells_of_all_kinds_meet_at_edges():
    mesh = Mesh(
        np.zeros((8, 3)),
        (
            CellBlock("tri", [1], [[1, 4, 2]]),
            CellBlock("quad", [0], [[0, 1, 2, 3]]),
            CellBlock("polygon", [2], offsets=[0, 5], items=[2, 4, 5, 6, 7]),
        ),
        dimension=2,
    )
    assert listed(faces(mesh)) == [
        ((0, 1), 0, -1),
        ((1, 2), 0, 1),
        ((2, 3), 0, -1),
        ((3, 0), 0, -1),
        ((1, 4), 1, -1),
        ((4, 2), 1, 2),
        ((4, 5), 2, -1),
        ((5, 6), 2, -1),
        ((6, 7), 2, -1),
        ((7, 2), 2, -1),
    ]
    assert len(edges(mesh)) == 10


@pytest.mark.parametrize("n", [3, 4, 100])
def test_a_face_of_many_cells_is_overused_and_loses_no_cell(n):
    mesh = one_block("tet", [[0, 1, 2, 3 + c] for c in range(n)])
    found = listed(faces(mesh))
    sides = Counter(row for _, owner, other in found for row in (owner, other) if row >= 0)
    assert sides == dict.fromkeys(range(n), 4)
    crowded = [f for f, (nodes, _, _) in enumerate(found) if set(nodes) == {0, 1, 2}]
    assert overused_faces(mesh).tolist() == crowded
    assert [found[f][1:] for f in crowded] == [(0, 1), *((c, -1) for c in range(2, n))]


def test_three_sheets_at_one_edge_are_overused_in_a_shell():
    mesh = one_block("tri", [[0, 1, 2], [0, 1, 3], [1, 0, 4]])
    assert [listed(faces(mesh))[f] for f in overused_faces(mesh)] == [((0, 1), 0, 1), ((1, 0), 2, -1)]


def test_a_collapsed_hex_meets_its_neighbours_with_the_triangles_it_has():
    # nodes 3 and 2, 7 and 6 fall together: a wedge written as a hex, with a tet on its triangle 4-5-6
    mesh = Mesh(
        np.zeros((7, 3)),
        (CellBlock("tet", [1], [[3, 4, 5, 6]]), CellBlock("hex", [0], [[0, 1, 2, 2, 3, 4, 5, 5]])),
    )
    found = listed(faces(mesh))
    assert Counter(len(nodes) for nodes, owner, _ in found if owner == 0) == {3: 2, 4: 3}
    assert [(set(nodes), owner, other) for nodes, owner, other in found if other >= 0] == [({3, 4, 5}, 0, 1)]


@pytest.mark.parametrize("turn", range(4))
def test_a_quad_side_with_two_equal_corners_is_a_triangle_wherever_they_stand(turn):
    base = np.roll([0, 1, 2, 2], turn)
    found = listed(faces(one_block("pyramid", [[*base, 3]])))
    assert sorted(len(nodes) for nodes, _, _ in found) == [3, 3, 3, 3]
    assert {frozenset(nodes) for nodes, _, _ in found} == {frozenset({0, 1, 2, 3} - {v}) for v in range(4)}


def test_a_cell_folded_onto_itself_is_never_its_own_neighbour():
    mesh = one_block("hex", [[0, 1, 2, 3, 0, 1, 2, 3]])
    assert [(set(nodes), owner, other) for nodes, owner, other in listed(faces(mesh))] == [({0, 1, 2, 3}, 0, -1)] * 2
    assert overused_faces(mesh).tolist() == [0, 1]


def polyhedral(mesh):
    """The same mesh told by faces alone, every cell a polyhedron."""
    offsets, items = faces_of_cells(mesh)
    block = CellBlock("polyhedron", np.arange(mesh.n_cells), offsets=offsets, items=items)
    return Mesh(mesh.points, (block,), faces=faces(mesh))


def test_polyhedra_have_the_edges_nodes_and_parts_of_the_cells_they_replace():
    mesh = hybrid_mesh(11)
    told = polyhedral(mesh)
    assert np.array_equal(edges(told), edges(mesh))
    assert rows_of(nodes_of_cells(told)) == [sorted(row) for row in rows_of(nodes_of_cells(mesh))]
    assert rows_of(points_to_cells(told)) == rows_of(points_to_cells(mesh))
    assert np.array_equal(cell_components(told), cell_components(mesh))


def test_a_face_based_mesh_keeps_its_own_faces():
    mesh = polyhedral(hybrid_mesh(3))
    assert faces(mesh) is mesh.faces
    assert not len(overused_faces(mesh))


def test_points_no_cell_uses_are_listed():
    assert unused_points(one_block("tet", [[0, 2, 4, 5]], n_points=8)).tolist() == [1, 3, 6, 7]


def test_parts_hang_together_by_faces_not_by_edges():
    # hexes in a row: 0 and 2 share a face, 1 touches 2 along an edge only, 3 is alone
    a = [0, 1, 2, 3, 4, 5, 6, 7]
    beside = [1, 8, 9, 2, 5, 10, 11, 6]
    along_an_edge = [9, 12, 13, 14, 11, 15, 16, 17]
    alone = list(range(18, 26))
    assert cell_components(one_block("hex", [a, along_an_edge, beside, alone])).tolist() == [0, 1, 0, 2]


@given(order=st.permutations(list(range(30))))
@settings(max_examples=20, deadline=None)
def test_a_chain_is_one_part_in_whatever_order_its_cells_come(order):
    mesh = one_block("quad", [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in order])
    assert cell_components(mesh).tolist() == [0] * 30


def test_duplicate_cells_are_found_across_types_and_node_orders():
    mesh = Mesh(
        np.zeros((9, 3)),
        (
            CellBlock("tet", [0, 2, 4, 5], [[0, 1, 2, 3], [4, 5, 6, 7], [3, 1, 0, 2], [1, 2, 3, 0]]),
            CellBlock("pyramid", [1, 3], [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0]]),
        ),
    )
    assert duplicate_cells(mesh).tolist() == [[3, 1], [4, 0], [5, 0]]
    assert duplicate_cells(hybrid_mesh(1)).shape == (0, 2)


def test_answers_are_kept_with_the_mesh_and_die_with_it():
    mesh = hybrid_mesh(2)
    first = faces(mesh)
    assert faces(mesh) is first
    assert not first.nodes.flags.writeable
    gone = weakref.ref(mesh)
    del mesh
    gc.collect()
    assert gone() is None


def test_faces_of_a_polyhedral_mesh_may_carry_the_numbers_of_the_file():
    mesh = polyhedral(hybrid_mesh(4))
    found = mesh.faces
    numbered = Faces(found.offsets, found.nodes, found.owner, found.neighbour, ids=np.arange(len(found)) + 100)
    again = Mesh(mesh.points, mesh.blocks, faces=numbered)
    assert rows_of(faces_of_cells(again)) == rows_of(faces_of_cells(mesh))


def test_threads_that_ask_for_the_same_of_a_mesh_share_one_answer():
    asked = []

    @once_per_mesh
    def slow(mesh):
        asked.append(mesh)
        time.sleep(0.05)
        return object()

    mesh, other = hybrid_mesh(0), hybrid_mesh(1)
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(slow, [mesh, other] * 8))
    assert len(asked) == len(set(map(id, answers))) == 2
    assert answers[0] is slow(mesh)
