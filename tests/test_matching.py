"""Matching two meshes: numbers do not matter, places do."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from report_meshes import MESHES, block_of_hexes, plate

from meshwright.audit.matching import match_meshes
from meshwright.audit.mesh import CellBlock, Mesh

SHUFFLED = [name for name in MESHES if name not in ("not finite", "polyhedron")]


def shuffled(mesh, seed=0):
    """The same mesh with points and cells in another order."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(mesh.points))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    rows = rng.permutation(mesh.n_cells)
    blocks = []
    for block in mesh.blocks:
        turn = np.argsort(rows[block.rows])
        nodes = place[block.nodes][turn]
        nodes = np.roll(nodes, 0, axis=1)
        blocks.append(CellBlock(block.type, np.sort(rows[block.rows]), nodes))
    return Mesh(mesh.points[order], tuple(blocks), dimension=mesh.dimension), rows


@pytest.mark.parametrize("name", SHUFFLED)
def test_a_mesh_in_another_order_is_the_same_mesh(name):
    mesh = MESHES[name]()
    other, rows = shuffled(mesh)
    found = match_meshes(mesh, other)
    assert len(found.same) == mesh.n_cells
    assert len(found.moved) == len(found.removed) == len(found.added) == 0
    assert (rows[found.same[:, 0]] == found.same[:, 1]).all()
    assert (found.shift, found.scale) == ((0.0, 0.0, 0.0), 1.0)


def test_polyhedra_match_by_their_points():
    mesh = MESHES["polyhedron"]()
    assert match_meshes(mesh, mesh).same.tolist() == [[0, 0], [1, 1]]


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 26), st.floats(0.01, 0.3), st.integers(0, 5))
def test_a_point_that_moves_moves_the_cells_around_it(which, distance, seed):
    mesh = block_of_hexes(4, zones=False)
    inner = np.flatnonzero(((mesh.points > 0) & (mesh.points < 4)).all(axis=1))
    point = inner[which % len(inner)]
    points = mesh.points.copy()
    step = np.random.default_rng(seed).normal(size=3)
    points[point] += distance * step / np.linalg.norm(step)
    other, rows = shuffled(dataclasses.replace(mesh, points=points), seed)
    found = match_meshes(mesh, other)
    ring = np.flatnonzero((mesh.blocks[0].nodes == point).any(axis=1))
    assert set(found.moved[:, 0].tolist()) == set(ring.tolist())
    assert (rows[found.moved[:, 0]] == found.moved[:, 1]).all()
    assert np.allclose(found.distance, distance, rtol=1e-9)
    assert len(found.removed) == len(found.added) == 0


def test_all_points_moved_at_random_are_found_by_their_numbers():
    mesh = block_of_hexes(4)
    move = np.random.default_rng(1).uniform(-0.05, 0.05, mesh.points.shape)
    found = match_meshes(mesh, dataclasses.replace(mesh, points=mesh.points + move))
    assert len(found.moved) == mesh.n_cells
    assert found.distance.max() <= np.linalg.norm(move, axis=1).max() + 1e-12


def test_cells_that_come_and_go_are_added_and_removed():
    mesh = block_of_hexes(3, zones=False)
    fewer = dataclasses.replace(
        mesh, blocks=(CellBlock("hex", np.arange(24), mesh.blocks[0].nodes[:24]),), cell_ids=None
    )
    found = match_meshes(mesh, fewer)
    assert found.removed.tolist() == [24, 25, 26]
    assert len(found.same) == 24
    assert match_meshes(fewer, mesh).added.tolist() == [24, 25, 26]


def test_a_split_cell_is_removed_and_its_parts_are_added():
    mesh = plate()
    quads, tris = mesh.blocks
    split = (
        CellBlock("quad", [0], quads.nodes[:1]),
        CellBlock("tri", [1, 2, 3, 4], [[1, 2, 5], [1, 5, 4], *tris.nodes]),
    )
    found = match_meshes(mesh, Mesh(mesh.points, split, dimension=2))
    assert found.removed.tolist() == [1]
    assert found.added.tolist() == [1, 2]
    assert len(found.same) == 3


@pytest.mark.parametrize("shift", [(3.0, 0.0, 0.0), (1e6, -2.5, 0.125)])
def test_a_mesh_that_is_moved_as_a_whole_is_told_so(shift):
    mesh = block_of_hexes(4)
    found = match_meshes(mesh, dataclasses.replace(mesh, points=mesh.points + shift))
    assert len(found.same) == mesh.n_cells
    assert np.allclose(found.shift, shift)
    assert found.scale == 1.0


@pytest.mark.parametrize("scale", [1000.0, 0.001, 25.4])
def test_another_unit_of_length_is_told_as_such(scale):
    mesh = block_of_hexes(4)
    other, _ = shuffled(dataclasses.replace(mesh, points=mesh.points * scale))
    found = match_meshes(mesh, other)
    assert len(found.same) == mesh.n_cells
    assert found.scale == scale


def test_doubled_cells_are_matched_one_by_one():
    mesh = block_of_hexes(2, zones=False)
    nodes = mesh.blocks[0].nodes
    doubled = dataclasses.replace(
        mesh, blocks=(CellBlock("hex", np.arange(10), np.concatenate([nodes, nodes[:2]])),), cell_ids=None
    )
    found = match_meshes(mesh, doubled)
    assert len(found.same) == 8
    assert len(found.added) == 2
    assert len(match_meshes(doubled, doubled).same) == 10


def test_points_within_the_tolerance_are_one_place():
    mesh = block_of_hexes(3)
    noise = np.random.default_rng(2).uniform(-1, 1, mesh.points.shape) * 1e-10
    near = dataclasses.replace(mesh, points=mesh.points + noise)
    assert len(match_meshes(mesh, near).same) == mesh.n_cells
    assert len(match_meshes(mesh, near, 0.0).same) < mesh.n_cells


def test_a_point_that_is_no_place_does_not_stop_the_match():
    mesh = block_of_hexes(3)
    points = mesh.points.copy()
    points[20] = math.nan
    found = match_meshes(mesh, dataclasses.replace(mesh, points=points))
    around = np.flatnonzero((mesh.blocks[0].nodes == 20).any(axis=1))
    assert len(found.same) == mesh.n_cells - len(around)
