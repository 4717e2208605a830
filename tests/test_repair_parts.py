"""A mesh that is swept in parts on several threads, and what its tables are made of."""

from collections import defaultdict

import numba
import numpy as np
import pytest
from repair_meshes import random_tets, random_triangles, volume6

from meshwright.audit.connectivity import faces
from meshwright.audit.parallel import limited_to
from meshwright.repair import repair, tet_tables
from meshwright.repair.curve import along_curve
from meshwright.repair.pairing import WALL, pair_sides
from meshwright.repair.tet_shape import both, cost_of, quality_floor, quality_of
from meshwright.repair.tet_tables import TetTables

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
NOTHING = np.empty((0, 3), int)


def by_search(cells, corners, walls):
    """`pair_sides` by a dictionary."""
    closed = {tuple(sorted(wall)) for wall in walls.tolist()}
    at = defaultdict(list)
    for cell, nodes in enumerate(cells.tolist()):
        for side, which in enumerate(corners.tolist()):
            at[tuple(sorted(nodes[k] for k in which))].append(len(corners) * cell + side)
    out = np.full(len(cells) * len(corners), WALL)
    for nodes, sides in at.items():
        if len(sides) == 2 and nodes not in closed:
            out[sides] = sides[::-1]
    return out.reshape(len(cells), len(corners))


@pytest.mark.parametrize("seed", range(5))
def test_sides_are_paired_as_a_search_pairs_them(seed):
    r = np.random.default_rng(seed)
    tets = np.array([r.permutation(12)[:4] for _ in range(60)], dtype=np.int32)
    walls = tets[:5, FACES[0]]
    assert np.array_equal(pair_sides(tets, FACES, walls), by_search(tets, FACES, walls))
    edges = np.array([[0, 1], [1, 2], [2, 0]])
    tris = random_triangles(6).block("tri").nodes
    assert np.array_equal(pair_sides(tris, edges, tris[:3, :2]), by_search(tris, edges, tris[:3, :2]))


def test_sides_without_a_partner_and_around_one_edge_are_paired_too():
    """All sides different is the most that the table has to hold; a fan has half of its sides at one edge."""
    loose = np.arange(4000).reshape(-1, 4)
    assert (pair_sides(loose, FACES, NOTHING) == WALL).all()
    n = 5000
    ring = 2 + np.arange(n)
    fan = np.stack([np.zeros(n, int), np.ones(n, int), ring, np.roll(ring, -1)], axis=1)
    found = pair_sides(fan, FACES, NOTHING)
    assert (found[:, :2] == WALL).all()
    assert np.array_equal(found[:, 2] // 4, np.roll(np.arange(n), -1))


def test_no_tets_have_no_partners():
    assert pair_sides(np.empty((0, 4), np.int32), FACES, NOTHING).shape == (0, 4)


def test_what_is_near_in_space_is_near_along_the_curve():
    grid = np.stack(np.meshgrid(*[np.arange(16.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    order = along_curve(np.random.default_rng(0).permutation(grid))
    assert np.array_equal(np.sort(order), np.arange(len(grid)))
    walk = np.random.default_rng(0).permutation(grid)[order]
    steps = np.linalg.norm(np.diff(walk, axis=0), axis=1)
    assert np.median(steps) == 1.0
    assert along_curve(np.empty((0, 3))).shape == (0,)
    assert np.array_equal(along_curve(np.ones((3, 3))), [0, 1, 2])


@pytest.fixture
def thin_parts(monkeypatch):
    """So thin that a mesh of a few thousand tets has several, and swaps reach over their borders all the time."""
    monkeypatch.setattr(tet_tables, "_LAYERS", 3)


def swept(mesh, threads):
    tables = TetTables.of(mesh.points, mesh.block("tet").nodes, NOTHING, np.zeros(len(mesh.points), bool))
    with limited_to(threads):
        made = [tables.swap(np.inf, by_fitness=False, give=give) for give in (0.3, 0.3, -1e-6)]
        made += [tables.move(1), tables.swap(0.2, by_fitness=True), tables.move(1, below=0.2)]
    return tables, made


def test_parts_give_the_same_mesh_on_any_number_of_threads(thin_parts):
    mesh = random_tets(1200)
    first, made = swept(mesh, 1)
    assert min(made) > 0
    for threads in (2, 3, 7):
        again, now = swept(mesh, threads)
        assert now == made
        for one, two in zip(first.result(), again.result(), strict=True):
            assert np.array_equal(one, two)


def test_parts_leave_a_whole_mesh(thin_parts):
    mesh = random_tets(1200)
    tables, _ = swept(mesh, 2)
    rows = np.flatnonzero(tables.tets[:, 0] >= 0)
    for f in range(4):
        beyond = tables.across[rows, f]
        inner = beyond >= 0
        assert np.array_equal(tables.across[beyond[inner] // 4, beyond[inner] % 4], 4 * rows[inner] + f)
        mine = np.sort(tables.tets[rows[inner]][:, FACES[f]], axis=1)
        theirs = np.take_along_axis(tables.tets[beyond[inner] // 4], FACES[beyond[inner] % 4], axis=1)
        assert np.array_equal(mine, np.sort(theirs, axis=1))
    assert np.array_equal(tables.free[1 : tables.free[0] + 1], np.flatnonzero(tables.tets[:, 0] < 0)[::-1])
    assert (tables.fit[tables.tets[:, 0] < 0] == np.inf).all()
    points, tets, origin = tables.result()
    assert (volume6(points, tets) > 0).all()
    assert np.isclose(volume6(points, tets).sum(), volume6(mesh.points, mesh.block("tet").nodes).sum(), rtol=1e-13)
    assert (np.diff(origin) >= 0).all()


def test_few_swaps_are_missed_for_the_borders_of_parts(monkeypatch):
    """What leaves a part is tried again with the parts moved by half: a sweep in parts does what a whole one does."""
    mesh = random_tets(1200)
    one = TetTables.of(mesh.points, mesh.block("tet").nodes, NOTHING, np.zeros(len(mesh.points), bool))
    whole = one.swap(np.inf, by_fitness=False)
    monkeypatch.setattr(tet_tables, "_LAYERS", 8)
    two = TetTables.of(mesh.points, mesh.block("tet").nodes, NOTHING, np.zeros(len(mesh.points), bool))
    assert two.swap(np.inf, by_fitness=False) > 0.95 * whole
    assert abs(two.total / one.total - 1.0) < 0.01


def test_the_result_does_not_depend_on_how_points_are_numbered():
    """Up to the numbers: tables stand along a curve through space. The order of the tets may decide between equals."""
    mesh = random_tets(400)
    order = np.random.default_rng(0).permutation(len(mesh.points))
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    shuffled = type(mesh)(
        mesh.points[order], (type(mesh.blocks[0])("tet", mesh.blocks[0].rows, place[mesh.block("tet").nodes]),)
    )
    one, two = repair(mesh).after, repair(shuffled).after
    assert np.array_equal(two.points[place], one.points)
    assert np.array_equal(np.sort(two.block("tet").nodes, axis=None), np.sort(place[one.block("tet").nodes], axis=None))


@numba.njit(error_model="numpy")
def rated(points, tets):
    """(fitness, quality, what the fitness promises of it, cost, cost alone) of each tet."""
    out = np.empty((len(tets), 5))
    for t in range(len(tets)):
        a, b, c, d = tets[t]
        out[t, 0], out[t, 3] = both(points, a, b, c, d)
        out[t, 1] = quality_of(points, a, b, c, d)
        out[t, 2] = quality_floor(out[t, 0])
        out[t, 4] = cost_of(points, a, b, c, d)
    return out


def test_a_tet_is_never_worse_than_its_fitness_promises():
    """The cheap bound behind which the dear quality is not computed."""
    r = np.random.default_rng(1)
    points = r.normal(size=(80_000, 3)) * r.uniform(0.05, 1.0, (80_000, 1))
    fit, good, promised, cost, alone = rated(points, np.arange(len(points)).reshape(-1, 4)).T
    sound = fit > 0.0
    assert sound.sum() > 5000
    assert (good[sound] >= promised[sound] * (1.0 - 1e-12)).all()
    assert np.allclose(cost[sound], alone[sound], rtol=1e-9)
    assert (alone >= 1.0 - 1e-12).all()


def test_surfaces_of_parts_have_the_faces_of_the_mesh_before(thin_parts):
    mesh = random_tets(1200)
    done = repair(mesh)
    outer = [np.sort(faces(m).nodes.reshape(-1, 3)[faces(m).neighbour < 0], axis=1) for m in (mesh, done.after)]
    assert np.array_equal(np.unique(outer[0], axis=0), np.unique(outer[1], axis=0))
    assert not repair(done.after).changed
