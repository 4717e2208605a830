"""Points inserted by Delaunay cavities, and the signs that decide them."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit
from repair_meshes import box, in_two_zones, random_tets, solid, volume6
from scipy.spatial import Delaunay
from test_repair_refine import assert_cut

from meshwright.audit import measure
from meshwright.audit.findings import run_checks
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.predicates import in_circle as exact_circle
from meshwright.audit.predicates import in_sphere as exact
from meshwright.repair import repair
from meshwright.repair.delaunay import in_sphere
from meshwright.repair.tri_delaunay import in_circle


@njit(error_model="numpy")
def sign(points, x, y, z):
    return in_sphere(points, 0, 1, 2, 3, x, y, z)


def positive(points):
    return points if volume6(points, np.array([[0, 1, 2, 3]]))[0] > 0 else points[[0, 2, 1, 3]]


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0, 1e-16, 1e-15, 1e-12, 1e-3, 1.0]))
def test_in_sphere_agrees_with_exact_rationals_up_to_what_106_bits_leave_open(seed, off):
    r = np.random.default_rng(seed)
    shift = r.choice([0.0, 1.0, 1e3])
    directions = r.normal(size=(5, 3))
    five = shift + directions / np.linalg.norm(directions, axis=1)[:, None]
    five[4] += off * r.normal(size=3)
    four = positive(five[:4])
    told = sign(four, *five[4])
    truth = exact(*four, five[4])
    assert told == (truth > 0) - (truth < 0)


def test_corners_of_a_cube_lie_on_one_sphere():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    four = positive(corners[[0, 1, 2, 4]])
    for p in corners[[3, 5, 6, 7]]:
        assert sign(four, *p) == 0
    assert sign(four, 0.5, 0.5, 0.5) == 1
    assert sign(four, 2.0, 0.5, 0.5) == -1


@njit(error_model="numpy")
def sign_of_circle(points, x, y):
    return in_circle(points, 0, 1, 2, x, y)


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0, 1e-16, 1e-15, 1e-12, 1e-3, 1.0]))
def test_in_circle_agrees_with_exact_rationals_up_to_what_106_bits_leave_open(seed, off):
    r = np.random.default_rng(seed)
    angles = np.r_[np.sort(r.uniform(0, 2 * np.pi, 3)), r.uniform(0, 2 * np.pi)]
    four = r.choice([0.0, 1.0, 1e3]) + np.stack([np.cos(angles), np.sin(angles), np.zeros(4)], axis=1)
    four[3, :2] += off * r.normal(size=2)
    u, v = four[1, :2] - four[0, :2], four[2, :2] - four[0, :2]
    assume(u[0] * v[1] - u[1] * v[0] > 1e-9)
    truth = exact_circle(*four)
    assert sign_of_circle(four, *four[3, :2]) == (truth > 0) - (truth < 0)


def violations(mesh):
    return sum(f.count for f in run_checks(mesh) if f.code == "delaunay-violations")


def delaunay_of(seed=3, n=250):
    """A Delaunay mesh whose points are not on a lattice, so that no five lie on a sphere."""
    r = np.random.default_rng(seed)
    inside = r.random((n, 3)) ** 2
    points = np.vstack([np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float), inside])
    tets = Delaunay(points).simplices
    size = volume6(points, tets)
    tets[size < 0] = tets[size < 0][:, [0, 2, 1, 3]]
    return solid(points, tet=tets[np.abs(size) > 1e-12])


def test_what_is_delaunay_stays_delaunay():
    mesh = delaunay_of()
    before = violations(mesh)
    done = repair(mesh, "insert-delaunay")
    assert done.steps[0].state == "kept", done.refused
    assert len(done.after.points) > 1.2 * len(mesh.points)
    assert_cut(mesh, done.after)
    assert before == 0
    assert violations(done.after) == 0


def test_tets_that_are_left_are_no_longer_than_twice_their_shortest_edge_allows_or_stand_at_a_wall():
    mesh = random_tets(300)
    done = repair(mesh, "insert-delaunay")
    tets, x = done.after.block("tet").nodes, done.after.points
    skew = [measure(m, ["gambit.equisize_skew"]).values["gambit.equisize_skew"]["tet"] for m in (mesh, done.after)]
    assert np.mean(skew[1]) < np.mean(skew[0])
    assert (volume6(x, tets) > 0).all()
    assert np.array_equal(x[: len(mesh.points)], mesh.points), "points that are there stay"


def plate(seed=3, n=200, hand=1):
    """A Delaunay mesh of a square of random points, close together at one corner; hand -1: turned over."""
    r = np.random.default_rng(seed)
    side = np.linspace(0.0, 1.0, 13)[:-1]
    rim = np.concatenate([np.c_[side, 0 * side], np.c_[1 + 0 * side, side], np.c_[1 - side, 1 + 0 * side],
                          np.c_[0 * side, 1 - side]])  # fmt: skip
    points = np.vstack([rim, 0.03 + 0.94 * r.random((n, 2)) ** 1.5])
    tris = Delaunay(points).simplices
    a, b, c = points[tris].transpose(1, 0, 2)
    size = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    wrong = size * hand < 0
    tris[wrong] = tris[wrong][:, [0, 2, 1]]
    return solid(np.c_[points, 0 * points[:, 0]], tri=tris[np.abs(size) > 1e-12])


def circumcentre(a, b, c):
    return a + np.linalg.solve(2.0 * np.array([b - a, c - a]), [(b - a) @ (b - a), (c - a) @ (c - a)])


def areas(mesh, rows=slice(None)):
    x = mesh.points[mesh.block("tri").nodes[rows]]
    return 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])[:, 2]


def angles(mesh):
    return measure(mesh, ["angle.min"]).values["angle.min"]["tri"]


@pytest.mark.parametrize("hand", [1, -1])
def test_flat_triangles_stay_delaunay_and_lose_their_small_angles(hand):
    mesh = plate(hand=hand)
    done = repair(mesh, "insert-delaunay")
    assert done.steps[0].state == "kept", done.refused
    assert violations(mesh) == violations(done.after) == 0
    assert (hand * areas(done.after) > 0).all()
    assert np.isclose(areas(done.after).sum(), hand, rtol=1e-12)
    assert np.array_equal(done.after.points[: len(mesh.points)], mesh.points)
    rim = done.after.points[np.c_[np.arange(48), (np.arange(48) + 1) % 48], :2]
    for t in np.flatnonzero(angles(done.after) < 20.7):
        c = circumcentre(*done.after.points[done.after.block("tri").nodes[t], :2])
        to = rim - c
        over = (to[:, 0] * to[:, 1]).sum(axis=1) < 0.0
        assert over.any() or (c < 0.0).any() or (c > 1.0).any(), "the boundary is in its way"
    assert (angles(mesh) < 20.7).mean() > 0.15
    assert (angles(done.after) < 20.7).mean() < 0.05
    assert not repair(done.after, "insert-delaunay").changed


def test_no_circle_reaches_over_a_border_between_zones_of_triangles():
    mesh = plate()
    middle = mesh.points[mesh.block("tri").nodes].mean(axis=1)[:, 0] < 0.5
    zones = tuple(
        Zone(n, "part", "solid", "cell", np.flatnonzero(m)) for n, m in (("left", middle), ("right", ~middle))
    )
    mesh = Mesh(mesh.points, (CellBlock("tri", np.arange(mesh.n_cells), mesh.block("tri").nodes),), zones=zones,
                dimension=2)  # fmt: skip
    done = repair(mesh, "insert-delaunay", refine=("left",))
    assert len(done.after.zones[0].members) > 1.1 * len(zones[0].members)
    assert len(done.after.zones[1].members) == len(zones[1].members)
    for old, new in zip(mesh.zones, done.after.zones, strict=True):
        assert np.isclose(areas(mesh, old.members).sum(), areas(done.after, new.members).sum(), rtol=1e-12)


def test_triangles_are_cut_down_to_max_edge_and_those_of_surfaces_are_refused():
    mesh = plate(n=40)
    done = repair(mesh, "insert-delaunay", max_edge=0.1)
    lengths = [np.linalg.norm(m.points[m.block("tri").nodes] - m.points[m.block("tri").nodes[:, [1, 2, 0]]], axis=2)
               for m in (mesh, done.after)]  # fmt: skip
    assert np.mean(lengths[1] > 0.1) < 0.3 * np.mean(lengths[0] > 0.1)
    dome = Mesh(mesh.points + np.sin(3 * mesh.points[:, :1]) * [0, 0, 1], mesh.blocks, dimension=3)
    assert "surface in space" in repair(dome, "insert-delaunay").refused[0]


def test_max_edge_is_a_size():
    mesh = random_tets(100)
    done = repair(mesh, "insert-delaunay", max_edge=0.25)
    assert_cut(mesh, done.after)
    edges = [np.linalg.norm(m.points[m.block("tet").nodes[:, [0, 1, 2]]] - m.points[m.block("tet").nodes[:, [1, 2, 3]]],
                            axis=2) for m in (mesh, done.after)]  # fmt: skip
    assert np.mean(edges[1] > 0.25) < 0.3 * np.mean(edges[0] > 0.25)


def test_zones_keep_their_bodies_and_only_the_chosen_one_is_cut():
    mesh = in_two_zones(random_tets(300))
    done = repair(mesh, "insert-delaunay", refine=("left",))
    grown = [len(b.members) / len(a.members) for a, b in zip(mesh.zones, done.after.zones, strict=True)]
    assert grown[0] > 1.1
    assert grown[1] == 1.0, "cavities do not cross the border"
    for old, new in zip(mesh.zones, done.after.zones, strict=True):
        sizes = [volume6(m.points, m.block("tet").nodes[z.members]).sum() for m, z in ((mesh, old), (done.after, new))]
        assert np.isclose(*sizes, rtol=1e-12)


@pytest.mark.parametrize("threads", [1, 2])
def test_the_result_is_the_same_on_any_number_of_threads(threads):
    mesh = random_tets(200)
    one, other = repair(mesh, "insert-delaunay"), repair(mesh, "insert-delaunay", threads=threads)
    assert np.array_equal(one.after.block("tet").nodes, other.after.block("tet").nodes)


def test_other_cells_are_refused_with_what_to_do():
    done = repair(solid(box(2)[0], hex=box(2)[1]), "insert-delaunay")
    assert "split-to-tets" in done.refused[0]
