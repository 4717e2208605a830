"""Boundary points that slide: along flat parts, along smooth surfaces, and never over an edge of the geometry."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from repair_meshes import random_tets, solid, sphere, volume6
from scipy.spatial import Delaunay

from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.repair import repair, write
from meshwright.repair.sliding import PROJECT, SLIDE, Sheet, sliding_points
from meshwright.repair.tet_tables import TetTables
from meshwright.reports.cli import cli


def ball(levels=4, inside=1500, seed=3):
    """A ball in tets: its surface an octahedron cut and blown up, random points inside; not good at all."""
    shell, _ = sphere(levels)
    r = np.random.default_rng(seed)
    inner = r.normal(size=(inside, 3))
    inner *= (0.75 * r.random(inside) ** (1 / 3) / np.linalg.norm(inner, axis=1))[:, None]
    turn = np.linalg.qr(r.normal(size=(3, 3)))[0]
    shell = shell + 0.35 / 2**levels * r.uniform(-1, 1, shell.shape)
    points = np.vstack([shell / np.linalg.norm(shell, axis=1)[:, None], inner]) @ turn.T
    tets = Delaunay(points).simplices
    size = volume6(points, tets)
    tets[size < 0] = tets[size < 0][:, [0, 2, 1, 3]]
    return solid(points, tet=tets[np.abs(size) > 1e-9])


def distance_to_cube(points):
    """Of points on the surface of the unit cube, 0 for those exactly on it."""
    return np.minimum(np.abs(points), np.abs(points - 1.0)).min(axis=1)


def test_points_inside_flat_sides_may_slide_and_edges_and_corners_may_not():
    mesh = random_tets()
    slides = sliding_points(mesh, SLIDE)
    on = ((mesh.points == 0.0) | (mesh.points == 1.0)).sum(axis=1)
    assert np.array_equal(slides, on == 1)


def test_a_smooth_surface_has_no_flat_point_but_all_of_them_may_be_projected():
    mesh = ball()
    assert not sliding_points(mesh, SLIDE).any()
    slides = sliding_points(mesh, PROJECT)
    on = np.abs(np.linalg.norm(mesh.points, axis=1) - 1.0) < 1e-9
    assert not slides[~on].any()
    assert slides[on].mean() > 0.5, "where the faces turn by less than 30 degrees"


def test_sliding_keeps_the_cube_to_the_bit_and_betters_what_a_fixed_boundary_cannot():
    mesh = random_tets()
    fixed, slid = repair(mesh), repair(mesh, boundary=SLIDE)
    moved = (slid.after.points != mesh.points).any(axis=1)
    on = ((mesh.points == 0.0) | (mesh.points == 1.0)).sum(axis=1)
    assert moved[on == 1].any()
    assert not moved[on > 1].any(), "edges and corners of the cube stay"
    assert (distance_to_cube(slid.after.points[on == 1]) == 0.0).all()
    assert np.isclose(volume6(slid.after.points, slid.after.block("tet").nodes).sum(), 6.0, rtol=1e-12)
    assert slid.last.worst > 0.8 * fixed.last.worst, "the worst tet is not where the boundary was in the way"
    assert slid.last.quality.mean() > fixed.last.quality.mean()
    assert slid.along.moved == moved[on == 1].sum()
    assert slid.apart.hausdorff < 1e-12
    assert fixed.along is None


def test_a_turned_cube_slides_in_planes_that_no_axis_is_in():
    mesh = random_tets()
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    done = repair(Mesh(mesh.points @ turn.T, mesh.blocks), boundary=SLIDE)
    back = done.after.points @ turn
    on = ((mesh.points == 0.0) | (mesh.points == 1.0)).sum(axis=1)
    assert done.along.moved > 0
    assert distance_to_cube(back[on == 1]).max() < 1e-13
    assert abs(done.along.volume) < 1e-12


def test_projected_points_stay_on_the_surface_as_it_was_given():
    mesh = ball()
    done = repair(mesh, boundary=PROJECT)
    assert done.along.moved > 0
    before = Sheet.of(mesh, PROJECT)
    slides = sliding_points(mesh, PROJECT)
    _, off = before.seats(done.after.points[slides])
    assert off.max() < 1e-12
    assert done.last.worst > repair(mesh).last.worst
    assert abs(done.along.volume) < 0.01
    assert not repair(done.after, boundary=PROJECT).changed


def test_the_nearest_point_of_a_sheet_is_the_nearest_of_all_its_triangles():
    shell = ball()
    sheet = Sheet.of(shell, PROJECT)
    r = np.random.default_rng(4)
    direction = r.normal(size=(200, 3))
    where = 1.02 * direction / np.linalg.norm(direction, axis=1)[:, None]
    _, found = sheet.seats(where)
    dense = r.dirichlet((1, 1, 1), size=400)
    corners = sheet.corners.reshape(-1, 3, 3)
    nearest = np.array([np.linalg.norm(np.einsum("ki,tij->tkj", dense, corners) - p, axis=2).min() for p in where[:40]])
    assert (found[:40] <= nearest + 1e-12).all()
    assert (found[:40] > nearest - 0.05).all()


def test_points_on_a_border_of_boundary_zones_stay():
    mesh = random_tets()
    bottom = mesh.block("tet").nodes[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    bottom = bottom[(mesh.points[bottom][:, :, 2] == 0.0).all(axis=1)]
    left = np.flatnonzero(mesh.points[bottom][:, :, 0].mean(axis=1) < 0.5)
    right = np.setdiff1d(np.arange(len(bottom)), left)
    zones = (Zone("left", "w", "wall", "face", left), Zone("right", "w", "wall", "face", right))
    mesh = Mesh(mesh.points, mesh.blocks, boundary=(CellBlock("tri", np.arange(len(bottom)), bottom),), zones=zones)
    border = np.intersect1d(bottom[left], bottom[right])
    done = repair(mesh, boundary=SLIDE)
    assert len(border) > 4
    assert np.array_equal(done.after.points[border], mesh.points[border])
    assert done.along.moved > 0


@pytest.mark.parametrize("height", [0.6, 1.5])
def test_two_tets_with_a_flat_quadrilateral_are_halved_the_other_way_where_that_is_better(height):
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, height)], float)
    points[1], points[3] = (0.62, 0.38, 0), (0.38, 0.62, 0)  # a kite: its long diagonal is the worse one
    tets = np.array([(0, 1, 2, 4), (0, 2, 3, 4)])
    assert (volume6(points, tets) > 0).all()
    held = np.ones(5, bool)
    for slides, turned in ((np.zeros(5, bool), 0), (np.arange(5) == 0, 1)):
        tables = TetTables.of(points, tets, np.empty((0, 3)), held, slides, Sheet.of(solid(points, tet=tets), SLIDE))
        before = tables.floor
        tables.swap(np.inf, by_fitness=True)
        assert tables.flips == turned
        assert (tables.floor > before) == bool(turned)
        _, found, _ = tables.result()
        assert np.isclose(volume6(points, found).sum(), volume6(points, tets).sum(), rtol=1e-14)
        assert (volume6(points, found) > 0).all()
        assert (found == 1).any(axis=1).all() == bool(turned), "the short diagonal is in both tets now"


def sides_of_cube(mesh):
    """(k, 3) boundary faces of a mesh of the unit cube, outward, and the side of the cube (0 to 5) that each is in."""
    every = mesh.block("tet").nodes[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    x = mesh.points[every]
    flat = np.stack([(x[..., a] == v).all(axis=1) for v in (0.0, 1.0) for a in range(3)], axis=1)
    return every[flat.any(axis=1)], flat[flat.any(axis=1)].argmax(axis=1)


def area_of(points, tris):
    x = points[tris]
    return 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum()


def test_listed_triangles_and_their_zones_follow_the_edges_that_are_turned():
    mesh = random_tets()
    faces, side = sides_of_cube(mesh)
    left = (side == 2) & (mesh.points[faces][:, :, 0].mean(axis=1) < 0.5)
    zones = [Zone(f"side {k}", "w", "wall", "face", np.flatnonzero((side == k) & ~left)) for k in range(6)]
    zones += [Zone("left", "w", "wall", "face", np.flatnonzero(left))]
    ids = 100 + np.arange(len(faces))
    block = CellBlock("tri", np.arange(len(faces)), faces)
    mesh = Mesh(mesh.points, mesh.blocks, boundary=(block,), zones=tuple(zones), boundary_ids=ids)
    done = repair(mesh, boundary=SLIDE)
    assert "boundary edges turned" in done.steps[0].note
    now = done.after.boundary[0].nodes
    there, _ = sides_of_cube(done.after)
    assert {tuple(sorted(f)) for f in now.tolist()} == {tuple(sorted(f)) for f in there.tolist()}
    assert len(now) == len(faces)
    assert {frozenset(f) for f in now.tolist()} != {frozenset(f) for f in faces.tolist()}
    assert np.array_equal(done.after.boundary_ids, ids)
    for old, new in zip(mesh.zones, done.after.zones, strict=True):
        assert np.array_equal(old.members, new.members)
        assert np.isclose(area_of(done.after.points, now[new.members]), area_of(mesh.points, faces[old.members]))
    x = done.after.points[now]
    outward = np.einsum("ij,ij->i", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), x.mean(axis=1) - 0.5)
    assert (outward > 0).all(), "they look the way they did"
    assert not repair(done.after, boundary=SLIDE).changed


def test_an_unknown_boundary_is_refused_and_the_receipt_tells_of_a_known_one(tmp_path):
    with pytest.raises(UsageError, match="unknown boundary"):
        repair(random_tets(20), boundary="loose")
    write(random_tets(), tmp_path / "a.vtu")
    words = ["repair", str(tmp_path / "a.vtu"), "--dry-run", "--boundary", "slide", "--quiet"]
    told = json.loads(CliRunner().invoke(cli, [*words, "--format", "json"]).stdout)["boundary"]
    assert told["mode"] == "slide"
    assert told["moved"] > 0
    assert f"{told['moved']} of them on the boundary" in CliRunner().invoke(cli, words).stdout
