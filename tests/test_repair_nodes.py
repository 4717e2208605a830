"""Points of tets that are put in and taken away."""

import numpy as np
import pytest
from repair_meshes import in_two_zones, random_tets, random_triangles, solid, volume6
from scipy.spatial import Delaunay

from meshwright.audit.connectivity import faces
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import Mesh
from meshwright.repair import repair
from meshwright.repair.held import held_points
from meshwright.repair.journal import changes
from meshwright.repair.outcome import FREE, Options
from meshwright.repair.tet_tables import TetTables


def delaunay(points):
    tets = Delaunay(points).simplices
    size = volume6(points, tets)
    tets[size < 0] = tets[size < 0][:, [0, 2, 1, 3]]
    return solid(points, tet=tets[np.abs(size) > 1e-12])


def cube(inside):
    """The unit cube with points on its sides, in a grid that is shaken within them, and these inside."""
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 5)] * 3, indexing="ij"), -1).reshape(-1, 3)
    outside = grid[((grid == 0) | (grid == 1)).any(axis=1)]
    on = (outside == 0) | (outside == 1)
    outside = np.where(on, outside, outside + np.random.default_rng(2).uniform(-0.06, 0.06, outside.shape))
    return delaunay(np.vstack([outside, inside]))


def is_conforming(mesh):
    """Whether the boundary faces are those of the cube and nothing else is open."""
    sides = faces(mesh)
    outer = sides.nodes.reshape(-1, 3)[sides.neighbour < 0]
    at = mesh.points[outer]
    return (((at == 0).all(axis=1)) | ((at == 1).all(axis=1))).any(axis=1).all()


@pytest.fixture(scope="module")
def both():
    mesh = random_tets(400)
    return mesh, repair(mesh), repair(mesh, nodes=FREE)


def test_free_points_reach_a_better_worst_tet_than_kept_ones(both):
    mesh, kept, free = both
    assert len(kept.after.points) == len(mesh.points)
    assert free.last.worst > kept.last.worst
    assert free.last.quality.mean() > kept.last.quality.mean() - 0.01
    assert not repair(free.after, nodes=FREE).changed


def test_volume_boundary_and_conformity_are_kept(both):
    mesh, _, free = both
    done = free.after
    assert is_conforming(done)
    assert np.isclose(volume6(done.points, done.block("tet").nodes).sum(), 6.0, rtol=1e-12)
    assert (volume6(done.points, done.block("tet").nodes) > 0).all()
    used = np.unique(done.block("tet").nodes)
    assert np.array_equal(used, np.arange(len(done.points))), "no point is left without a cell"
    outside = mesh.points[((mesh.points == 0) | (mesh.points == 1)).any(axis=1)]
    there = {tuple(p) for p in done.points.tolist()}
    assert all(tuple(p) in there for p in outside.tolist())


def test_every_point_put_in_or_taken_away_is_in_the_journal(both):
    mesh, _, free = both
    added = removed = 0
    for step in free.steps:
        if step.state == "kept":
            told = changes(step)
            added += len(told["added_points"])
            removed += len(told["removed_points"])
            assert np.array_equal(step.after.points[told["added_points"]], told["added_at"])
    assert added > 0
    assert len(free.after.points) == len(mesh.points) + added - removed


def test_one_of_two_points_that_nearly_coincide_is_taken_away():
    middle = np.array([[0.52, 0.47, 0.55], [0.5201, 0.4702, 0.5499]])
    mesh = cube(np.vstack([middle, [[0.25, 0.25, 0.25], [0.75, 0.3, 0.6], [0.3, 0.7, 0.7], [0.7, 0.75, 0.3]]]))
    tables = TetTables.of(mesh.points, mesh.block("tet").nodes, np.empty((0, 3)), held_points(mesh, Options()))
    before = tables.floor
    assert tables.contract(below=0.02) >= 1
    assert tables.floor > before
    points, tets, _ = tables.result()
    assert len(np.intersect1d(tets, [len(points) - 6, len(points) - 5])) <= 1
    assert np.isclose(volume6(points, tets).sum(), 6.0, rtol=1e-12)


def test_a_cube_without_inner_points_gets_some():
    mesh = cube(np.empty((0, 3)))
    assert is_conforming(mesh)
    done = repair(mesh, nodes=FREE)
    assert len(done.after.points) > len(mesh.points)
    assert done.last.worst > done.first.worst
    assert done.last.quality.mean() > repair(mesh).last.quality.mean() + 0.02
    assert is_conforming(done.after)


def test_new_cells_are_in_the_zone_they_stand_in_and_its_border_stays():
    mesh = in_two_zones(random_tets(300))
    done = repair(mesh, nodes=FREE)

    def volumes(m):
        size = volume6(m.points, m.block("tet").nodes)
        return [size[zone.members].sum() for zone in m.zones]

    assert np.allclose(volumes(mesh), volumes(done.after), rtol=1e-12)


def test_numbers_of_new_points_are_new():
    mesh = random_tets(300)
    ids = np.arange(len(mesh.points))[::-1] * 3 + 7
    done = repair(Mesh(mesh.points, mesh.blocks, point_ids=ids), nodes=FREE)
    found = done.after.point_ids
    assert len(np.unique(found)) == len(found)
    where = {int(i): tuple(p) for i, p in zip(ids, mesh.points, strict=True)}
    outside = ((mesh.points == 0) | (mesh.points == 1)).any(axis=1)
    for i in ids[outside].tolist():
        assert tuple(done.after.points[np.flatnonzero(found == i)[0]]) == where[i]


def test_the_result_is_the_same_on_one_thread_and_two():
    mesh = random_tets(300)
    one, two = repair(mesh, nodes=FREE, threads=1), repair(mesh, nodes=FREE, threads=2)
    assert np.array_equal(one.after.points, two.after.points)
    assert np.array_equal(one.after.block("tet").nodes, two.after.block("tet").nodes)


@pytest.mark.parametrize("corners", [3, 4, 5, 6, 7])
def test_the_faces_between_two_points_give_way_to_the_edge_between_them(corners):
    """A flat double pyramid is cut by its polygon; the best it can be is cut around its axis."""
    angle = 2 * np.pi * np.arange(corners) / corners
    ring = np.c_[np.cos(angle), np.sin(angle), 0 * angle]
    points = np.vstack([ring, [[0, 0, 0.4]], [[0, 0, -0.4]]])
    top, bottom = corners, corners + 1
    fan = [(0, i, i + 1) for i in range(1, corners - 1)]
    tets = np.array([(a, b, c, top) for a, b, c in fan] + [(a, c, b, bottom) for a, b, c in fan])
    assert (volume6(points, tets) > 0).all()
    tables = TetTables.of(points, tets, np.empty((0, 3)), np.ones(len(points), bool))
    before = tables.floor
    while tables.swap(np.inf, by_fitness=True):
        pass
    assert tables.floor > before
    _, found, _ = tables.result()
    assert len(found) == corners, "all of them stand around the axis"
    assert ((found == top).any(axis=1) & (found == bottom).any(axis=1)).all()
    assert np.isclose(volume6(points, found).sum(), volume6(points, tets).sum(), rtol=1e-14)


def test_triangles_with_free_points_get_better_and_stay_the_same_sheet():
    mesh = random_triangles(16)
    kept, free = repair(mesh), repair(mesh, nodes=FREE)
    assert free.last.worst >= kept.last.worst
    assert free.last.quality.mean() > kept.last.quality.mean()
    assert len(free.after.points) != len(mesh.points)
    tris, x = free.after.block("tri").nodes, free.after.points
    area = 0.5 * np.cross(x[tris[:, 1]] - x[tris[:, 0]], x[tris[:, 2]] - x[tris[:, 0]])[:, 2]
    assert (area > 0).all()
    assert np.isclose(area.sum(), 1.0, rtol=1e-12)
    assert np.array_equal(np.unique(tris), np.arange(len(x))), "no point is left without a triangle"
    sides = faces(free.after)
    rim = sides.nodes.reshape(-1, 2)[sides.neighbour < 0]
    assert (((x[rim] == 0) | (x[rim] == 1)).any(axis=2)).all(), "nothing is torn inside"
    outside = mesh.points[((mesh.points[:, :2] == 0) | (mesh.points[:, :2] == 1)).any(axis=1)]
    assert {tuple(p) for p in outside.tolist()} <= {tuple(p) for p in x.tolist()}
    assert not repair(free.after, nodes=FREE).changed


def test_a_needle_of_triangles_is_contracted():
    mesh = random_triangles(8)
    points, tris = np.array(mesh.points), mesh.block("tri").nodes.astype(np.int64)
    inside = ((points[tris][:, :, :2] > 0.2) & (points[tris][:, :, :2] < 0.8)).all(axis=(1, 2))
    t = int(np.flatnonzero(inside)[0])
    a, b, c = tris[t]
    near, twin = points[a] + 1e-3 * (points[tris[t]].mean(axis=0) - points[a]), len(points)
    tris[t] = [a, b, twin]
    bad = solid(np.vstack([points, [near]]), tri=np.vstack([tris, [[twin, b, c], [a, twin, c]]]))
    assert repair(bad, "orient").first.worst < 0.02
    done = repair(bad, nodes=FREE)
    assert done.last.worst > 0.3
    assert not repair(done.after, nodes=FREE).changed


def test_zones_of_triangles_keep_their_areas_when_points_are_free():
    mesh = in_two_zones(random_triangles(14))
    done = repair(mesh, nodes=FREE)

    def areas(m):
        tris, x = m.block("tri").nodes, m.points
        area = 0.5 * np.cross(x[tris[:, 1]] - x[tris[:, 0]], x[tris[:, 2]] - x[tris[:, 0]])[:, 2]
        return [np.abs(area[zone.members]).sum() for zone in m.zones]

    assert np.allclose(areas(mesh), areas(done.after), rtol=1e-12)


def test_an_unknown_choice_is_refused():
    with pytest.raises(UsageError, match="unknown choice of nodes"):
        repair(random_tets(20), nodes="many")
