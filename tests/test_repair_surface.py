"""A triangle soup becomes one closed surface, and the receipt counts each kind of fault."""

import numpy as np
import pytest
from repair_meshes import soup, sphere

from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.repair import repair


def uses_of_edges(tris):
    sides = np.sort(np.concatenate([tris[:, [0, 1]], tris[:, [1, 2]], tris[:, [2, 0]]]), axis=1)
    return np.unique(sides, axis=0, return_counts=True)[1]


def volume(mesh):
    x = mesh.points[mesh.block("tri").nodes]
    return float(np.einsum("ij,ij->i", x[:, 0], np.cross(x[:, 1], x[:, 2])).sum() / 6.0)


@pytest.fixture(scope="module")
def closed():
    return repair(soup(), "surface", tolerance=1e-6)


def test_every_edge_has_two_triangles_that_walk_it_in_opposite_directions(closed):
    tris = closed.after.block("tri").nodes
    assert set(uses_of_edges(tris)) == {2}
    walks = np.concatenate([tris[:, [0, 1]], tris[:, [1, 2]], tris[:, [2, 0]]])
    assert len(np.unique(walks, axis=0)) == len(walks)


def test_the_surface_is_the_one_it_was_made_from_with_its_holes_closed_along_its_curvature(closed):
    points, tris = sphere()
    whole = Mesh(points, (CellBlock("tri", np.arange(len(tris)), tris),))
    assert volume(closed.after) == pytest.approx(volume(whole), rel=2e-4)
    assert np.abs(np.linalg.norm(closed.after.points, axis=1) - 1.0).max() < 0.02
    assert closed.after.n_cells == len(tris) + 2, "two more: both sides of the T-junction are split"


def test_each_kind_of_fault_is_counted(closed):
    changed = {step.name: step.changed for step in closed.steps if step.state == "kept"}
    assert changed["drop-duplicates"] == 3
    assert changed["drop-flat"] == 1
    assert changed["split-junctions"] == 1
    assert changed["drop-fins"] == 2
    assert changed["drop-specks"] == 8
    assert changed["fill-holes"] == 3


def test_a_second_run_changes_nothing(closed):
    assert not repair(closed.after, "surface", tolerance=1e-6).changed


def test_a_large_hole_is_refused_with_its_place_and_left_open():
    points, tris = sphere()
    half = tris[points[tris].mean(axis=1)[:, 2] < 0.5]
    done = repair(Mesh(points, (CellBlock("tri", np.arange(len(half)), half),)), "fill-holes")
    assert not done.changed
    assert "is left open; --max-hole 40 closes it" in done.refused[0]


def test_where_a_cleaning_pass_is_refused_those_after_it_are_not_run():
    done = repair(soup(), "surface", tolerance=0.3)
    assert not done.changed
    assert "must stay under 0.1 of the shortest edge left" in done.refused[0]
    assert done.refused[1] == "the passes after weld were not run"


def test_solid_meshes_are_no_surfaces():
    tet = Mesh(np.vstack([np.zeros(3), np.eye(3)]), (CellBlock("tet", [0], [[0, 1, 2, 3]]),))
    done = repair(tet, "drop-flat,split-junctions,drop-fins,drop-specks,fill-holes")
    assert not done.changed
    assert done.steps == ()


def test_the_wall_of_a_void_stays_turned_inward():
    points, tris = sphere(2)
    both = np.vstack([tris, tris[:, ::-1] + len(points)])
    done = repair(Mesh(np.vstack([points, 0.5 * points]), (CellBlock("tri", np.arange(len(both)), both),)), "orient")
    assert not done.changed
