"""Cells cut into smaller or simpler ones: conforming, of the same volume, in the same zones."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from repair_meshes import (
    bounded,
    box,
    hybrid_layers,
    in_two_zones,
    random_tets,
    random_triangles,
    solid,
    sphere,
    square,
    volume6,
)

from meshwright.audit import measure
from meshwright.audit.connectivity import faces, overused_faces
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import NO_CELL, CellBlock, Mesh, Zone
from meshwright.repair import repair, write
from meshwright.repair.refine import _cut, _Edges
from meshwright.repair.sizes import signed_sizes
from meshwright.repair.templates import OCTAHEDRON, tet_children, tri_children, whole_children
from meshwright.reports.cli import cli


def outer_size(mesh):
    """Area of the boundary (length of it in the plane), as far as faces are triangles or flat quads."""
    found = faces(mesh)
    total = 0.0
    for row in np.flatnonzero(found.neighbour == NO_CELL):
        x = mesh.points[found.nodes[found.offsets[row] : found.offsets[row + 1]]]
        if len(x) == 2:
            total += np.linalg.norm(x[1] - x[0])
        else:
            total += 0.5 * np.linalg.norm(sum(np.cross(x[i] - x[0], x[i + 1] - x[0]) for i in range(1, len(x) - 1)))
    return total


def assert_cut(before, after, rtol=1e-12):
    """The same body, cut into positive cells that fit together, and no point without a cell."""
    assert not len(overused_faces(after))
    sizes = signed_sizes(after)
    assert (sizes > 0).all()
    assert np.isclose(sizes.sum(), signed_sizes(before).sum(), rtol=rtol)
    # a face that does not fit shows as boundary on both sides
    assert np.isclose(outer_size(after), outer_size(before), rtol=rtol)
    assert np.array_equal(
        np.unique(np.concatenate([b.nodes.ravel() for b in after.blocks])), np.arange(len(after.points))
    )


def pyramids():
    """A cube of six pyramids around its middle."""
    points, hexes = box(1)
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    nodes = hexes[0][np.array(quads)][:, ::-1]
    return solid(np.vstack([points, [[0.5, 0.5, 0.5]]]), pyramid=np.column_stack([nodes, np.full(6, 8)]))


MESHES = {
    "tets": random_tets,
    "hexes": lambda: solid(box(3)[0], hex=box(3)[1]),
    "layers": hybrid_layers,
    "pyramids": pyramids,
    "triangles": random_triangles,
    "quads": lambda: solid(square(4, 0.2)[0], quad=square(4)[1]),
}
EIGHT = {"tets": 8, "hexes": 8, "layers": 8, "triangles": 4, "quads": 4}


@pytest.mark.parametrize("mask", range(64))
def test_a_tet_can_be_cut_at_any_of_its_edges(mask):
    corners = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]], float)
    mids = [(corners[a] + corners[b]) / 2 for a, b in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))]
    points = np.vstack([corners, mids])
    for diagonal in range(3 if mask == 63 else 1):
        children = tet_children(mask, diagonal)
        sizes = volume6(points, children)
        assert (sizes > 0.5).all()
        assert sizes.sum() == 8.0
        used = np.unique(children)
        assert set(used[used >= 4] - 4) == {e for e in range(6) if mask >> e & 1}
    if mask == 63:
        pair = set(OCTAHEDRON[2])
        assert any(pair <= set(tet) for tet in tet_children(63, 2).tolist())


def test_a_triangle_cut_at_all_edges_has_four_children_of_its_own_shape():
    points = np.array([[0, 0, 0], [3, 0.2, 0], [0.7, 2, 0]], float)
    points = np.vstack([points, (points[0] + points[1]) / 2, (points[1] + points[2]) / 2, (points[2] + points[0]) / 2])
    parent = np.sort(np.linalg.norm(points[[1, 2, 0]] - points[[0, 1, 2]], axis=1))
    for child in tri_children(7):
        edges = np.sort(np.linalg.norm(points[np.roll(child, -1)] - points[child], axis=1))
        assert np.allclose(edges, parent / 2)
    assert [len(tri_children(mask)) for mask in range(8)] == [1, 2, 2, 3, 2, 3, 3, 4]


def test_children_of_whole_cells_have_as_many_nodes_as_their_kind():
    for name, count in {"quad": 4, "hex": 8, "wedge": 8, "pyramid": 10}.items():
        assert sum(map(len, whole_children(name).values())) == count


@pytest.mark.parametrize("kind", MESHES)
def test_refining_everything_cuts_each_cell_in_four_or_eight(kind):
    mesh = MESHES[kind]()
    done = repair(mesh, "refine")
    assert done.steps[0].state == "kept", done.steps[0].reason
    assert_cut(mesh, done.after)
    if kind in EIGHT:
        assert done.after.n_cells == EIGHT[kind] * mesh.n_cells
    assert np.array_equal(done.after.points[: len(mesh.points)], mesh.points)
    assert len([s for s in done.steps if s.state == "kept"]) == 1, "it runs once in a repair"


def test_refined_hexes_and_triangles_are_as_good_as_they_were():
    for kind in ("hexes", "triangles", "quads"):
        mesh = MESHES[kind]()
        before = measure(mesh, ["gambit.equiangle_skew"]).values["gambit.equiangle_skew"]
        after = measure(repair(mesh, "refine").after, ["gambit.equiangle_skew"]).values["gambit.equiangle_skew"]
        for name in before:
            assert after[name].max() <= before[name].max() + 1e-9


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 0.99))
def test_any_edges_of_tets_and_triangles_can_be_cut(seed, share):
    r = np.random.default_rng(seed)
    for mesh in (random_tets(60, 3), random_triangles(5)):
        edges = _Edges.of(mesh)
        marked = r.random(len(edges.keys)) < share
        fresh, points_from, cells_from = _cut(mesh, edges, marked)
        assert_cut(mesh, fresh)
        assert (points_from < 0).sum() == marked.sum()
        sizes = signed_sizes(fresh)
        assert np.allclose(np.bincount(cells_from, sizes), signed_sizes(mesh), rtol=1e-11)


def test_only_the_zone_is_refined_and_cells_around_are_cut_to_fit():
    mesh = in_two_zones(random_tets(200))
    done = repair(mesh, "refine", refine=("left",))
    assert_cut(mesh, done.after)
    left, right = done.after.zones
    assert len(left.members) == 8 * len(mesh.zones[0].members)
    assert len(mesh.zones[1].members) < len(right.members) < 2 * len(mesh.zones[1].members)
    sizes = signed_sizes(done.after)
    for old, new in zip(mesh.zones, done.after.zones, strict=True):
        assert np.isclose(sizes[new.members].sum(), signed_sizes(mesh)[old.members].sum(), rtol=1e-12)


@pytest.mark.parametrize("passes", ["refine", "bisect"])
@pytest.mark.parametrize("kind", ["tets", "triangles"])
def test_no_edge_is_longer_than_asked_for_and_a_second_run_has_nothing_to_do(kind, passes):
    mesh = MESHES[kind]()
    done = repair(mesh, passes, max_edge=0.12)
    assert_cut(mesh, done.after)
    for block in done.after.blocks:
        x = done.after.points[block.nodes]
        for k in range(x.shape[1]):
            for j in range(k):
                assert (np.linalg.norm(x[:, k] - x[:, j], axis=1) <= 0.12).all()
    assert not repair(done.after, passes, max_edge=0.12).changed


def test_bisection_of_triangles_never_makes_the_smallest_angle_less_than_half():
    """Rosenberg and Stenger, 1975."""
    mesh = random_triangles()
    before = measure(mesh, ["angle.min"]).values["angle.min"]["tri"].min()
    done = repair(mesh, "bisect", max_edge=0.02)
    assert measure(done.after, ["angle.min"]).values["angle.min"]["tri"].min() >= 0.5 * before - 1e-9


def test_bisecting_a_zone_may_cut_beside_it_and_nowhere_else():
    mesh = in_two_zones(random_tets(300))
    done = repair(mesh, "bisect", refine=("left",), max_edge=0.08)
    assert_cut(mesh, done.after)
    grown = [len(new.members) / len(old.members) for old, new in zip(mesh.zones, done.after.zones, strict=True)]
    assert grown[0] > 4 * grown[1]


@pytest.mark.parametrize(("kind", "count"), [("tets", 4), ("triangles", 3)])
def test_points_in_the_middle_cut_cells_in_three_or_four(kind, count):
    mesh = MESHES[kind]()
    done = repair(mesh, "insert-centroids")
    assert_cut(mesh, done.after)
    assert done.after.n_cells == count * mesh.n_cells


@pytest.mark.parametrize("kind", ["hexes", "layers", "pyramids", "quads"])
def test_everything_can_be_cut_to_tets_or_triangles(kind):
    mesh = MESHES[kind]()
    done = repair(mesh, "split-to-tets")
    assert done.steps[0].state == "kept", done.steps[0].reason
    assert_cut(mesh, done.after)
    assert set(done.after.counts) == {"tri" if kind == "quads" else "tet"}
    each = {"hexes": 6, "pyramids": 2, "quads": 2}
    if kind in each:
        assert done.after.n_cells == each[kind] * mesh.n_cells
    assert not repair(done.after, "split-to-tets").changed


def test_numbers_of_points_do_not_decide_whether_tets_fit():
    points, hexes = box(3)
    order = np.random.default_rng(8).permutation(len(points))
    mesh = solid(points[order], hex=np.argsort(order)[hexes])
    assert_cut(mesh, repair(mesh, "split-to-tets").after)


def test_hexes_can_be_cut_in_five():
    mesh = bounded(MESHES["hexes"]())
    done = repair(mesh, "split-in-five")
    assert done.after.n_cells == 5 * mesh.n_cells
    assert_cut(mesh, done.after)
    outside = faces(done.after)
    listed = {tuple(sorted(t)) for t in done.after.boundary[0].nodes.tolist()}
    rows = np.flatnonzero(outside.neighbour == NO_CELL)
    assert listed == {tuple(sorted(outside.nodes[3 * r : 3 * r + 3].tolist())) for r in rows}, "walls are cut alike"


def test_hexes_around_an_odd_ring_cannot_be_cut_in_five():
    angle = 2 * np.pi * np.arange(3) / 3
    ring = np.c_[np.cos(angle), np.sin(angle)]
    flat = np.vstack([ring, 2 * ring])
    points = np.vstack([np.c_[flat, np.zeros(6)], np.c_[flat, np.ones(6)]])
    hexes = np.array([[i, 3 + i, 3 + (i + 1) % 3, (i + 1) % 3] for i in range(3)])
    mesh = solid(points, hex=np.hstack([hexes, hexes + 6]))
    done = repair(mesh, "split-in-five")
    assert not done.changed
    assert "cannot be coloured" in done.refused[0]
    assert repair(mesh, "split-to-tets").after.n_cells == 18


@pytest.mark.parametrize("passes", ["refine", "split-to-tets"])
@pytest.mark.parametrize("kind", ["tets", "hexes", "quads"])
def test_boundary_elements_are_cut_with_the_faces_they_lie_on(kind, passes):
    mesh = bounded(MESHES[kind]())
    done = repair(mesh, passes)
    found = faces(done.after)
    width = np.diff(found.offsets)
    sides = {tuple(sorted(found.nodes[o : o + w].tolist())) for o, w, n in
             zip(found.offsets[:-1], width, found.neighbour, strict=True) if n == NO_CELL}  # fmt: skip
    listed = {tuple(sorted(e)) for block in done.after.boundary for e in block.nodes.tolist()}
    assert listed == sides
    assert [z.name for z in done.after.zones] == ["inlet", "wall"]
    assert sum(len(z.members) for z in done.after.zones) == done.after.n_boundary


def test_a_part_of_hexes_cannot_be_refined_and_the_message_says_what_to_do():
    mesh = in_two_zones(MESHES["hexes"]())
    done = repair(mesh, "refine", refine=("left",))
    assert not done.changed
    assert "cut it to tets first" in done.refused[0]
    with pytest.raises(UsageError, match="no zone of cells matches"):
        repair(mesh, "refine", refine=("nowhere",))
    with pytest.raises(UsageError, match="max-edge"):
        repair(random_tets(20), "bisect")


def test_second_order_cells_become_linear_and_lose_their_mid_side_nodes():
    points, tris = sphere(1)
    pairs = np.sort(np.concatenate([tris[:, [0, 1]], tris[:, [1, 2]], tris[:, [2, 0]]]), axis=1)
    ends, which = np.unique(pairs, axis=0, return_inverse=True)
    middle = points[ends].mean(axis=1)
    curved = middle / np.linalg.norm(middle, axis=1)[:, None]
    nodes = np.hstack([tris, len(points) + which.reshape(3, -1).T])
    mesh = Mesh(np.vstack([points, curved]), (CellBlock("tri6", np.arange(len(tris)), nodes),),
                zones=(Zone("all", "", "", "cell", np.arange(len(tris))),))  # fmt: skip
    done = repair(mesh, "linearise")
    assert done.after.counts == {"tri": len(tris)}
    assert np.array_equal(done.after.points, points)
    gap = np.linalg.norm(curved - middle, axis=1).max()
    assert f"{gap:.3g} off" in done.steps[0].note
    assert not repair(done.after, "linearise").changed
    refused = repair(mesh, "refine")
    assert "linearise" in refused.refused[0]


def test_warped_hexes_are_cut_and_the_volume_changes_by_no_more_than_their_warp():
    points, hexes = box(3, 0.3)
    points[:, 2] += 0.05 * np.sin(7 * points[:, 0] + 5 * points[:, 1])
    mesh = solid(points, hex=hexes)
    for passes in ("refine", "split-to-tets"):
        done = repair(mesh, passes)
        assert done.changed, done.refused
        assert not len(overused_faces(done.after))


def test_refining_then_improving_is_one_command(tmp_path):
    source, out = tmp_path / "a.vtu", tmp_path / "b.vtu"
    write(random_tets(60), source)
    words = ["repair", str(source), "-o", str(out), "--passes", "refine,improve", "--quiet", "--format", "json"]
    run = CliRunner().invoke(cli, words)
    assert run.exit_code == 0, run.output
    steps = [s["pass"] for s in json.loads(run.stdout)["steps"] if s["state"] == "kept"]
    assert steps[0] == "refine"
    assert "improve" in steps[1:]
