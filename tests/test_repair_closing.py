"""Surfaces closed, untied, stitched, and how far they end from what they were."""

import builtins
import json

import numpy as np
import pytest
from click.testing import CliRunner
from repair_meshes import bounded, box, random_tets, solid, soup, sphere, square

from meshwright.audit.connectivity import cell_components, faces
from meshwright.audit.mesh import NO_CELL, CellBlock, Mesh, Zone
from meshwright.repair import repair, write
from meshwright.repair.bvh import Tree
from meshwright.repair.hausdorff import surfaces_apart
from meshwright.repair.intersections import intersecting
from meshwright.repair.patch import best_patch
from meshwright.repair.surface import open_sides
from meshwright.reports.cli import cli


def shell(points, tris, zones=()):
    return Mesh(points, (CellBlock("tri", np.arange(len(tris)), np.asarray(tris)),), zones=zones)


def tris_of(mesh):
    return mesh.block("tri").nodes.astype(np.int64)


def cup(level=0.5):
    """The unit sphere without what lies above a height: one round hole of many edges."""
    points, tris = sphere(4)
    tris = tris[(points[tris][:, :, 2] <= level).all(axis=1)]
    keep, into = np.unique(tris, return_inverse=True)
    return points[keep], into.reshape(-1, 3)


def test_the_nearest_triangle_is_the_one_that_looking_at_all_of_them_finds():
    points, tris = sphere(3)
    where = np.random.default_rng(1).normal(size=(300, 3))
    away, which = Tree.of(points, tris).nearest(where)
    for p, d, t in zip(where, away, which, strict=True):
        every, _ = Tree.of(points, tris[t : t + 1]).nearest(p[None])
        assert every[0] == d
    one = np.min([Tree.of(points, tris[t : t + 1]).nearest(where)[0] for t in range(len(tris))], axis=0)
    assert np.array_equal(one, away)


def test_distances_to_a_triangle_are_those_of_geometry():
    tree = Tree.of(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    where = {(0.2, 0.2, 3.0): 3.0, (-1.0, -1.0, 0.0): 2**0.5, (0.5, -2.0, 0.0): 2.0, (2.0, 0.0, 0.0): 1.0,
             (1.0, 1.0, 0.0): 0.5**0.5, (-3.0, 0.5, 4.0): 5.0, (0.0, 3.0, 0.0): 2.0}  # fmt: skip
    found, _ = tree.nearest(np.array(list(where)))
    assert np.allclose(found, list(where.values()), rtol=1e-15)


def test_a_sphere_is_apart_from_a_larger_one_by_the_difference_and_the_sag():
    points, tris = sphere(4)
    apart = surfaces_apart((points, tris), (1.1 * points, tris))
    middle = np.linalg.norm(points[tris].mean(axis=1), axis=1).min()
    assert 0.1 < apart.there < 1.1 - middle
    assert apart.hausdorff >= 0.1
    assert surfaces_apart((points, tris), (points, tris)).hausdorff < 1e-15


def test_distances_agree_with_vtk(tmp_path):
    vtk = pytest.importorskip("vtk")
    points, tris = sphere(3)
    write(shell(points, tris), tmp_path / "s.vtk")
    reader = vtk.vtkUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "s.vtk"))
    reader.Update()
    locator = vtk.vtkCellLocator()
    locator.SetDataSet(reader.GetOutput())
    locator.BuildLocator()
    where = np.random.default_rng(2).normal(size=(200, 3))
    theirs = []
    for p in where:
        found, cell, sub, square_ = [0.0] * 3, vtk.reference(0), vtk.reference(0), vtk.reference(0.0)
        locator.FindClosestPoint(p, found, cell, sub, square_)
        theirs.append(float(square_) ** 0.5)
    assert np.allclose(Tree.of(points, tris).nearest(where)[0], theirs, rtol=1e-12)


def test_the_receipt_of_a_soup_tells_how_far_the_closed_surface_is_from_it(tmp_path):
    write(soup(), tmp_path / "soup.stl")
    words = ["repair", str(tmp_path / "soup.stl"), "--dry-run", "--passes", "surface", "--tolerance", "1e-5", "--quiet"]
    told = json.loads(CliRunner().invoke(cli, [*words, "--format", "json"]).stdout)["surface"]
    assert told["hausdorff"] == max(told["there"], told["back"])
    assert np.isclose(told["back_at"][0], 3.0, atol=0.05), "the speck is what is furthest from the result"
    assert 0.0 < told["there"] < 0.25, "the holes are closed where the sphere was"
    assert "Hausdorff" in CliRunner().invoke(cli, words).stdout


def test_crossing_triangles_are_found_and_touching_ones_are_not():
    flat = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    through = [[0.2, 0.2, -1], [0.2, 0.3, 1], [0.3, 0.2, 1]]
    above = [[0.2, 0.2, 0.1], [0.2, 0.3, 1], [0.3, 0.2, 1]]
    touching = [[0.2, 0.2, 0.0], [0.2, 0.3, 1], [0.3, 0.2, 1]]
    pair = np.array([[0, 1, 2], [3, 4, 5]])
    for other, crosses in ((through, True), (above, False), (touching, False)):
        for turn in (np.eye(3), np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]):
            points = np.array(flat + other, float) @ turn
            if crosses or other is not touching:
                assert len(intersecting(points, pair)) == crosses
    assert not len(intersecting(np.array(flat + touching, float), pair))


def test_two_spheres_cross_along_the_circle_in_which_they_meet_and_nowhere_else():
    one, tris = sphere(2)
    two = one + [0.6, 0.1, 0.2]
    points, every = np.vstack([one, two]), np.vstack([tris, tris + len(one)])
    pairs = intersecting(points, every)
    assert len(pairs) > 20
    assert ((pairs[:, 0] < len(tris)) & (pairs[:, 1] >= len(tris))).all()
    far = np.abs(np.linalg.norm(points[every[pairs[:, 0]]].mean(axis=1) - [0.6, 0.1, 0.2], axis=1) - 1.0)
    assert far.max() < 0.35


def test_a_fold_that_crosses_is_cut_out_and_closed():
    points, tris = sphere(3)
    at = int(np.argmax(points[:, 2]))
    points = points.copy()
    points[at] = [0.13, 0.07, -1.2]  # one point pushed out through the other side
    mesh = shell(points, tris)
    assert len(intersecting(points, tris))
    done = repair(mesh, "untie")
    assert done.changed
    after = tris_of(done.after)
    assert not len(intersecting(done.after.points, after))
    assert open_sides(after) == 0
    assert not repair(done.after, "untie").changed


def test_two_bodies_that_cross_are_left_as_they_are_and_told_of():
    one, tris = sphere(2)
    mesh = shell(np.vstack([one, one + [0.6, 0.1, 0.2]]), np.vstack([tris, tris + len(one)]))
    done = repair(mesh, "untie")
    assert "pairs of triangles cross, one at" in done.refused[0]
    assert open_sides(tris_of(done.after)) == 0


def test_a_large_hole_is_left_open_unless_it_is_asked_for():
    points, tris = cup()
    mesh = shell(points, tris)
    left = repair(mesh, "fill-holes")
    assert not left.changed
    assert "--max-hole" in left.refused[0]
    edges = open_sides(tris)
    done = repair(mesh, "fill-holes", max_hole=edges)
    after = tris_of(done.after)
    assert open_sides(after) == 0
    assert len(after) == len(tris) + edges - 2
    volume = np.einsum("ij,ij->i", *(done.after.points[after[:, k]] for k in (0,)), np.cross(
        done.after.points[after[:, 1]], done.after.points[after[:, 2]])).sum() / 6  # fmt: skip
    height = 0.5 - (0.5 - points[:, 2].max())
    cap = np.pi * (1 - height) ** 2 * (2 + height) / 3
    assert np.isclose(volume, 4 * np.pi / 3 - cap, rtol=0.05)


def test_the_patch_of_a_flat_rim_is_flat_and_of_its_area():
    angle = np.sort(np.random.default_rng(3).uniform(0, 2 * np.pi, 40))
    radius = np.where(np.arange(40) % 2, 1.0, 0.6)
    rim = np.c_[radius * np.cos(angle), radius * np.sin(angle), 0 * angle]
    beyond = 1.5 * 0.5 * (rim + np.roll(rim, -1, axis=0))
    patch = best_patch(rim, beyond)
    assert len(patch) == 38
    area = 0.5 * np.cross(rim[patch[:, 1]] - rim[patch[:, 0]], rim[patch[:, 2]] - rim[patch[:, 0]])[:, 2]
    shoelace = 0.5 * np.cross(rim, np.roll(rim, -1, axis=0))[:, 2].sum()
    assert np.isclose(np.abs(area).sum(), shoelace, rtol=1e-12), "a star is covered once"


def two_plates(gap, n=4):
    points, quads = square(n)
    tris = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    points[:, 2] = 0.1 * points[:, 0] ** 2
    other = points * [-1, 1, 1] - [gap, 0, 0]
    zones = tuple(Zone(name, "", "", "cell", np.arange(len(tris)) + k * len(tris)) for k, name in enumerate("ab"))
    return shell(np.vstack([points, other]), np.vstack([tris, tris[:, ::-1] + len(points)]), zones)


def test_two_plates_with_points_of_their_own_become_one():
    mesh = two_plates(1e-7)
    done = repair(mesh, "stitch", tolerance=1e-5)
    assert len(done.after.points) == len(mesh.points) - 5
    assert int(cell_components(done.after).max()) == 0
    assert [len(z.members) for z in done.after.zones] == [len(z.members) for z in mesh.zones]
    assert not repair(done.after, "stitch", tolerance=1e-5).changed
    assert not repair(two_plates(1e-3), "stitch", tolerance=1e-5).changed, "what is further apart stays apart"


def test_blocks_of_hexes_are_stitched_face_by_face():
    points, hexes = box(3)
    both = solid(np.vstack([points, points + [1.0, 0, 0]]), hex=np.vstack([hexes, hexes + len(points)]))
    done = repair(both, "stitch")
    assert len(done.after.points) == len(both.points) - 16
    assert np.count_nonzero(faces(done.after).neighbour == NO_CELL) == 2 * 54 - 18
    refused = repair(both, "stitch", tolerance=0.2)
    assert "too large" in refused.refused[0]


def test_many_small_parts_are_meant_and_a_few_specks_are_not():
    points, tris = sphere(3)
    small = [0.02 * points + [2 + k, 0, 0] for k in range(6)]
    many = shell(np.vstack([points, *small]), np.vstack([tris + k * len(points) for k in range(7)]))
    done = repair(many, "drop-specks")
    assert not done.changed
    assert "look meant" in done.refused[0]


def test_an_open_surface_says_how_open_it_is():
    points, tris = cup()
    done = repair(shell(points, tris), "orient")
    assert any(f"{open_sides(tris)} sides of triangles have no other triangle" in text for text in done.limits)


@pytest.mark.parametrize("name", ["trimesh", "pymeshlab"])
def test_another_programs_repair_is_one_transaction_with_zones_and_receipt(name):
    pytest.importorskip(name)
    points, tris = sphere(3)
    tris = np.array(tris)
    tris[::5] = tris[::5, ::-1]
    tris = np.delete(tris, [7], axis=0)
    left = points[tris].mean(axis=1)[:, 0] < 0
    zones = (Zone("left", "", "", "cell", np.flatnonzero(left)), Zone("right", "", "", "cell", np.flatnonzero(~left)))
    done = repair(shell(points, tris, zones), f"{name}-repair")
    assert done.changed, done.refused
    after = tris_of(done.after)
    assert open_sides(after) == 0
    assert len(after) == len(tris) + 1
    for zone, sign in zip(done.after.zones, (-1, 1), strict=True):
        middle = done.after.points[after[zone.members]].mean(axis=1)[:, 0]
        assert (sign * middle > -0.2).all()
    assert {z.name: len(z.members) for z in done.after.zones}["left"] in (left.sum(), left.sum() + 1)
    assert not repair(done.after, f"{name}-repair").changed


def test_what_is_not_installed_is_told_with_how_to_get_it(monkeypatch):
    real = builtins.__import__

    def without(name, *rest, **more):
        if name.startswith(("trimesh", "pymeshlab")):
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr("meshwright.repair.engines.import_module", without)
    points, tris = sphere(1)
    for name in ("trimesh", "pymeshlab"):
        done = repair(shell(points, tris[1:]), f"{name}-repair")
        assert "meshwright[surfaces]" in done.refused[0]


def test_solid_meshes_are_no_surfaces_for_these_passes():
    mesh = bounded(random_tets(40))
    for name in ("untie", "trimesh-repair", "pymeshlab-repair", "fill-holes"):
        assert not repair(mesh, name).changed
