"""What a repair promises: nothing gets worse, what is held stays, a second run changes nothing."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from repair_meshes import (
    box,
    hybrid_layers,
    in_two_zones,
    random_tets,
    random_triangles,
    solid,
    square,
    volume6,
    with_reversed,
)

from meshwright.audit import measure
from meshwright.audit.connectivity import faces
from meshwright.audit.errors import MeshError, UsageError
from meshwright.audit.geometry import total_volume
from meshwright.audit.mesh import NO_CELL, CellBlock, Mesh, Zone
from meshwright.repair import PASSES, repair
from meshwright.repair.guards import broken
from meshwright.repair.held import border_faces
from meshwright.repair.outcome import Options, Outcome, Pass
from meshwright.repair.quality import standing, worst_first


def boundary_of(mesh):
    """Faces of the outside as sets of coordinates, to the last bit."""
    found = faces(mesh)
    out = set()
    for f in np.flatnonzero(found.neighbour == NO_CELL):
        nodes = found.nodes[found.offsets[f] : found.offsets[f + 1]]
        out.add(frozenset(tuple(p) for p in mesh.points[nodes].tolist()))
    return out


def worst_of(mesh, metric):
    values = measure(mesh, [metric]).values[metric]
    return {kind: (float(v.min()), float(v.max()), float(v.mean())) for kind, v in values.items()}


MESHES = {
    "tets": random_tets,
    "tets in two zones": lambda: in_two_zones(random_tets()),
    "tangled hexes": lambda: solid(box(6, 0.75)[0], hex=box(6)[1]),
    "hexes of which five are inside out": lambda: solid(
        box(6, 0.3)[0], hex=with_reversed(box(6)[1], "hex", [3, 50, 77, 120, 200])
    ),
    "tangled quads": lambda: solid(square(10, 0.6)[0], quad=with_reversed(square(10)[1], "quad", [1, 33, 60])),
}


@pytest.fixture(scope="module", params=MESHES)
def done(request):
    return repair(MESHES[request.param]())


def test_no_cell_is_left_inverted_and_the_worst_one_is_better(done):
    assert done.last.bad == 0
    assert done.changed
    assert worst_first(done.first, done.last)


def test_the_boundary_stays_to_the_last_bit(done):
    assert boundary_of(done.after) == boundary_of(done.before)


def test_the_volume_is_kept(done):
    right = total_volume(done.after)
    oriented = next((s.after for s in reversed(done.steps) if s.name == "orient" and s.state == "kept"), done.before)
    assert right == pytest.approx(total_volume(oriented), rel=1e-12)
    assert right == pytest.approx(1.0, rel=1e-12)


def test_a_second_run_changes_nothing(done):
    again = repair(done.after)
    assert not again.changed
    assert again.after is done.after


def test_the_result_is_the_same_on_any_number_of_threads(done):
    one, many = repair(done.before, threads=1), repair(done.before, threads=3)
    for other in (one, many):
        assert np.array_equal(other.after.points, done.after.points)
        for a, b in zip(other.after.blocks, done.after.blocks, strict=True):
            assert np.array_equal(a.nodes, b.nodes)


def test_the_steps_lead_from_the_mesh_before_to_the_mesh_after(done):
    kept = [step for step in done.steps if step.state == "kept"]
    assert kept[0].before is done.before
    assert kept[-1].after is done.after
    assert all(a.after is b.before for a, b in pairwise(kept))


def test_zones_keep_their_names_their_volume_and_the_wall_between_them():
    done = repair(MESHES["tets in two zones"]())
    assert [z.name for z in done.after.zones] == ["left", "right"]
    for old, new in zip(done.before.zones, done.after.zones, strict=True):
        sizes = [
            volume6(m.points, m.block("tet").nodes)[z.members].sum() for m, z in ((done.before, old), (done.after, new))
        ]
        assert sizes[1] == pytest.approx(sizes[0], rel=1e-12)

    def wall(mesh):
        found = faces(mesh)
        rows = np.flatnonzero(border_faces(mesh) & (found.neighbour != NO_CELL))
        return {frozenset(map(tuple, mesh.points[found.nodes[3 * f : 3 * f + 3]].tolist())) for f in rows}

    assert wall(done.after) == wall(done.before)
    assert wall(done.after)


LOCAL = {
    "tets": random_tets,
    "tets in two zones": lambda: in_two_zones(random_tets()),
    "triangles": lambda: random_triangles(14),
    "tets and wedges": hybrid_layers,
}


@pytest.mark.parametrize("name", LOCAL)
def test_no_cell_is_worse_than_the_worst_one_was_around_its_points(name):
    mesh = LOCAL[name]()
    done = repair(mesh)
    assert done.changed
    table = [[tuple(cell) for cell in block.nodes.tolist()] for block in mesh.blocks]
    rows = [row for block in mesh.blocks for row in block.rows.tolist()]
    cells = dict(zip(rows, [cell for block in table for cell in block], strict=True))
    at = {}
    for row, cell in cells.items():
        for p in cell:
            at.setdefault(p, set()).add(row)
    around = {p: set().union(*(at[q] for row in mine for q in cells[row])) for p, mine in at.items()}
    quality = standing(done.before).quality
    low = {p: min(quality[list(near)]) for p, near in around.items()}
    for block in done.after.blocks:
        for row, cell in zip(block.rows.tolist(), block.nodes.tolist(), strict=True):
            assert done.last.quality[row] >= max(low[p] for p in cell) - 1e-9


def test_tets_end_well_above_where_slivers_begin():
    done = repair(random_tets())
    before, after = (worst_of(m, "dihedral.min")["tet"][0] for m in (done.before, done.after))
    assert before < 1.0
    assert after > 15.0
    for metric, sign in (("verdict.scaled_jacobian", 1), ("gambit.equiangle_skew", -1), ("dihedral.max", -1)):
        old, new = worst_of(done.before, metric)["tet"], worst_of(done.after, metric)["tet"]
        end = 0 if sign > 0 else 1
        assert sign * new[end] >= sign * old[end]
        assert sign * new[2] > sign * old[2], f"the mean of {metric} fell"


@pytest.mark.parametrize("jitter", [0.3, 0.75, 1.5])
def test_a_tangled_box_becomes_the_grid_it_was(jitter):
    points, hexes = box(6, jitter)
    done = repair(solid(points, hex=hexes), "orient,untangle,relax")
    assert np.allclose(done.after.points, box(6)[0], atol=1e-4)


def test_a_graded_layer_keeps_its_spacing_where_cells_far_from_it_are_untangled():
    points, hexes = box(16)
    points = np.array(points)
    points[:, 0] = points[:, 0] ** 3
    wrong = int(np.flatnonzero(np.isclose(points, [0.875**3, 0.5, 0.5]).all(axis=1))[0])
    points[wrong, 1] += 0.2
    mesh = solid(points, hex=hexes)
    done = repair(mesh)
    assert done.first.bad > 0
    assert done.last.bad == 0
    layer = points[:, 0] < 0.2
    assert np.array_equal(done.after.points[layer], points[layer])


def test_exactly_the_cells_that_are_inside_out_are_reversed_however_tangled_the_others_are():
    points, hexes = box(8, 0.75, seed=5)
    wrong = np.random.default_rng(3).choice(len(hexes), 40, replace=False)
    done = repair(solid(points, hex=with_reversed(hexes, "hex", wrong)), "orient")
    assert done.steps[0].changed == 40
    assert np.array_equal(done.after.block("hex").nodes, hexes)


def test_points_of_held_zones_do_not_move():
    mesh = in_two_zones(random_tets())
    done = repair(mesh, hold=("left",))
    rows = np.unique(mesh.block("tet").nodes[mesh.zones[0].members])
    assert done.changed
    assert np.array_equal(done.after.points[rows], mesh.points[rows])


def test_holding_a_zone_that_is_not_there_names_those_that_are():
    with pytest.raises(UsageError, match="no zone matches 'rigth'; the mesh has: left, right"):
        repair(in_two_zones(random_tets()), hold=("rigth",))


def test_an_unknown_pass_names_the_known_ones():
    with pytest.raises(UsageError, match="unknown pass 'smoth'; known are clean, surface, weld, "):
        repair(random_tets(), "smoth")


def test_points_without_coordinates_are_refused():
    points, hexes = box(2)
    points[5, 1] = np.nan
    with pytest.raises(MeshError, match="1 points have coordinates that are nan or infinite"):
        repair(solid(points, hex=hexes))


def test_welding_joins_what_lies_together_and_dropping_removes_what_is_left():
    points, hexes = box(3)
    own = points[hexes].reshape(-1, 3) + np.random.default_rng(1).uniform(-1e-9, 1e-9, (8 * len(hexes), 3))
    torn = solid(np.vstack([own, [[9.0, 9.0, 9.0]]]), hex=np.arange(8 * len(hexes)).reshape(-1, 8))
    done = repair(torn, "weld,drop-unused", tolerance=1e-7)
    assert len(done.after.points) == 64
    assert int((faces(done.after).neighbour == NO_CELL).sum()) == 54
    assert [step.changed for step in done.steps if step.state == "kept"] == [216 - 64, 1]


def test_welding_across_cells_is_refused_with_the_length_that_would_do():
    points, hexes = box(3)
    done = repair(solid(points, hex=hexes), "weld", tolerance=0.2)
    assert not done.changed
    assert "must stay under 0.1 of the shortest edge left, 0.333" in done.refused[0]


def test_second_copies_of_cells_and_cells_without_an_inside_are_dropped():
    points, hexes = box(3)
    flat = hexes[4].copy()
    flat[4:] = flat[:4]
    wedge = hexes[9].copy()
    wedge[[2, 6]] = wedge[[3, 7]]
    done = repair(
        solid(points, hex=np.vstack([hexes, hexes[[2]], flat[None], wedge[None]])), "drop-degenerate,drop-duplicates"
    )
    assert np.array_equal(done.after.block("hex").nodes, np.vstack([hexes, wedge[None]])), "a hex that is a wedge stays"


def test_a_moebius_band_is_refused_and_left_alone():
    n = 12
    top = [[np.cos(t), np.sin(t), 0.0] for t in np.linspace(0, 2 * np.pi, n, endpoint=False)]
    a = np.array(top) * (1 + 0.3 * np.cos(np.linspace(0, np.pi, n, endpoint=False)))[:, None]
    b = np.array(top) * (1 - 0.3 * np.cos(np.linspace(0, np.pi, n, endpoint=False)))[:, None]
    lift = 0.3 * np.sin(np.linspace(0, np.pi, n, endpoint=False))
    a[:, 2], b[:, 2] = lift, -lift
    quads = [[i, (i + 1), n + i + 1, n + i] for i in range(n - 1)] + [[n - 1, n, 0, 2 * n - 1]]
    mesh = Mesh(np.vstack([a, b]), solid(np.vstack([a, b]), quad=quads).blocks)
    done = repair(mesh, "orient")
    assert not done.changed
    assert "cannot be oriented" in done.refused[0]


def test_a_closed_surface_is_turned_outward():
    points, hexes = box(1)
    sides = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    shell = hexes[0][sides]
    done = repair(Mesh(points, solid(points, quad=with_reversed(shell, "quad", [0, 1, 2, 4])).blocks), "orient")
    assert np.array_equal(done.after.block("quad").nodes[:, 0], shell[:, 0])
    assert done.steps[0].changed == 4


BREAKS = {
    "a held point moves": (
        lambda m: replace(m, points=np.vstack([m.points[:1] + 1e-16, m.points[1:]])), "a point that is held would move"
    ),
    "a cell turns over": (
        lambda m: replace(m, points=np.where(np.arange(len(m.points))[:, None] == 62, 5.0, m.points)),
        "more cells would be inverted or degenerate",
    ),
    "a zone goes": (lambda m: replace(m, zones=m.zones[:1]), "zones would be lost"),
    "a coordinate is lost": (
        lambda m: replace(m, points=np.where(np.arange(len(m.points))[:, None] == 62, np.nan, m.points)),
        "no finite coordinates",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BREAKS)
def test_a_pass_that_breaks_an_invariant_is_caught(name):
    spoil, words = BREAKS[name]
    mesh = in_two_zones(solid(box(4, 0.1)[0], hex=box(4)[1]))
    spoilt = spoil(mesh)
    row = Pass("bad", "", lambda mesh, options: Outcome(spoilt, 1))
    after = standing(spoilt) if not spoilt.n_nonfinite else standing(mesh)
    assert words in broken(row, mesh, Outcome(spoilt, 1), standing(mesh), after, Options())


def test_a_pass_that_worsens_one_corner_of_the_mesh_is_caught_though_the_mesh_is_better_on_the_whole():
    grid, hexes = box(8)
    near, far = (int(np.flatnonzero((grid == at).all(axis=1))[0]) for at in (0.125, 0.875))

    def with_offsets(a, b):
        points = np.array(grid)
        points[near] += a
        points[far] += b
        return solid(points, hex=hexes)

    mesh = with_offsets(0.04, 0.005)
    better, mixed = (Outcome(replace(mesh, points=with_offsets(0.0, b).points), 1) for b in (0.005, 0.02))
    row, before = PASSES["improve"], standing(mesh)
    assert broken(row, mesh, better, before, standing(better.mesh), Options()) == ""
    after = standing(mixed.mesh)
    assert after.worst > before.worst
    assert "neighbourhood" in broken(row, mesh, mixed, before, after, Options())


def test_triangles_end_near_the_best_there_is_with_their_boundary_and_number_kept():
    mesh = random_triangles()
    done = repair(mesh)
    assert worst_of(done.after, "angle.min")["tri"][0] > 35.0
    assert worst_of(done.after, "angle.max")["tri"][1] < 110.0
    assert boundary_of(done.after) == boundary_of(mesh)
    assert done.after.counts == mesh.counts
    assert total_volume(done.after) == pytest.approx(1.0, rel=1e-12)
    assert not repair(done.after).changed


def test_triangles_of_a_folded_sheet_keep_the_fold():
    flat = random_triangles(8)
    points = np.array(flat.points)
    points[square(8)[0][:, 0] == 0.5, 0] = 0.5
    points[:, 2] = np.abs(points[:, 0] - 0.5)
    mesh = Mesh(points, flat.blocks)
    done = repair(mesh)
    assert done.changed
    assert np.allclose(done.after.points[:, 2], np.abs(done.after.points[:, 0] - 0.5), atol=1e-12)
    assert total_volume(done.after) == pytest.approx(total_volume(mesh), rel=1e-12)


def test_edges_between_zones_stay():
    mesh = in_two_zones(random_triangles())
    done = repair(mesh)

    def areas(m):
        corners = [m.points[m.block("tri").nodes[zone.members]] for zone in m.zones]
        return [float(np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum()) for x in corners]

    assert done.changed
    assert areas(done.after) == pytest.approx(areas(mesh), rel=1e-12)


def test_a_mesh_given_by_its_faces_keeps_its_walls_and_leaves_out_its_inner_zones():
    cells = in_two_zones(random_tets(60))
    found = faces(cells)
    outer = np.flatnonzero(found.neighbour == NO_CELL)
    zones = (
        *cells.zones,
        Zone("wall", "patch", "wall", "face", outer[::2]),
        Zone("inner", "interior", "interior", "face", np.flatnonzero(found.neighbour != NO_CELL)),
        Zone("inlet", "patch", "inlet", "face", outer[1::2]),
    )
    mesh = Mesh(cells.points, cells.blocks, faces=found, zones=zones)
    done = repair(mesh)
    assert done.changed
    assert [(z.name, len(z.members)) for z in done.after.zones if z.entity == "face"] == [
        ("wall", len(outer[::2])), ("inlet", len(outer[1::2])),
    ]  # fmt: skip
    assert "'inner' is left out" in done.notes[0]
    for zone, rows in zip(done.after.zones[2:], (outer[::2], outer[1::2]), strict=True):
        nodes = done.after.boundary[0].nodes[zone.members]
        assert np.array_equal(nodes, found.nodes.reshape(-1, 3)[rows])


def test_polyhedra_are_left_alone_and_said_to_be():
    points, hexes = box(2)
    one = solid(points, hex=hexes)
    found = faces(one)
    offsets = np.arange(0, 6 * len(hexes) + 1, 6)
    items = np.concatenate([np.flatnonzero((found.owner == c) | (found.neighbour == c)) for c in range(len(hexes))])
    block = CellBlock("polyhedron", np.arange(len(hexes)), offsets=offsets, items=items)
    done = repair(Mesh(points, (block,), faces=found))
    assert not done.changed
    assert any(f"{len(hexes)} polyhedra" in text for text in done.refused)


def test_a_boundary_face_that_decides_the_worst_skew_is_named_with_its_place():
    points = np.array([[0.0, 0, 0], [3, 0, 0], [1.5, 0.3, 0], [1.5, 0.1, 2]])
    done = repair(solid(points, tet=[[0, 1, 2, 3]]))
    worst = worst_of(done.after, "gambit.equiangle_skew")["tet"][1]
    assert worst > 0.8
    assert f"cannot fall under {worst:.3g} while the boundary stays" in done.limits[0]
    assert done.limits[0].endswith("boundary face at (1.5, 0.1, 0)")


@pytest.mark.parametrize("mesh", [random_tets(), solid(box(3, 0.2)[0], hex=box(3)[1])])
def test_no_limit_is_told_where_inner_cells_decide_or_all_is_well(mesh):
    assert repair(mesh).limits == ()


def test_points_that_a_zone_or_a_boundary_element_names_are_not_unused():
    points, hexes = box(2)
    lone = np.vstack([points, [[5.0, 0, 0], [6.0, 0, 0], [7.0, 0, 0], [8.0, 0, 0]]])
    line = CellBlock("line", [0], [[27, 28]])
    mesh = Mesh(lone, solid(lone, hex=hexes).blocks, boundary=(line,), zones=(Zone("probe", "set", "", "point", [29]),))
    done = repair(mesh, "drop-unused")
    assert len(done.after.points) == 30
    assert done.after.points[done.after.zones[0].members].tolist() == [[7.0, 0.0, 0.0]]
    assert done.after.points[done.after.boundary[0].nodes[0]].tolist() == [[5.0, 0.0, 0.0], [6.0, 0.0, 0.0]]
