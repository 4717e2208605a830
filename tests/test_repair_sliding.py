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


def test_an_unknown_boundary_is_refused_and_the_receipt_tells_of_a_known_one(tmp_path):
    with pytest.raises(UsageError, match="unknown boundary"):
        repair(random_tets(20), boundary="loose")
    write(random_tets(), tmp_path / "a.vtu")
    words = ["repair", str(tmp_path / "a.vtu"), "--dry-run", "--boundary", "slide", "--quiet"]
    told = json.loads(CliRunner().invoke(cli, [*words, "--format", "json"]).stdout)["boundary"]
    assert told["mode"] == "slide"
    assert told["moved"] > 0
    assert f"{told['moved']} of them on the boundary" in CliRunner().invoke(cli, words).stdout
