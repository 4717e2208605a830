"""Face metrics: the definitions face by face, reference values, closed forms, folded shells, laws."""

import json
import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from meshwright.audit.connectivity import faces
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Faces, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.readers import read

HERE = Path(__file__).parent
_HYBRID = runpy.run_path(str(HERE / "hybrid.py"))
hybrid_mesh, with_shuffled_faces = _HYBRID["hybrid_mesh"], _HYBRID["with_shuffled_faces"]

IDS = tuple(id_ for id_, row in METRICS.items() if row.entity == "face")
POWER = {"L": 1, "L2": 2, "L3": 3}
CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def values(mesh, threads=1):
    return {id_: by["face"] for id_, by in measure(mesh, IDS, threads=threads).values.items()}


def angle(a, b):
    return math.degrees(math.atan2(np.linalg.norm(np.cross(a, b)), a @ b))


def face_of(p):
    """Area vector and centre of corners p (n, 3)."""
    q, mean = np.roll(p, -1, axis=0), p.mean(axis=0)
    fan = np.cross(p - mean, q - mean) / 2
    weight = np.linalg.norm(fan, axis=1)
    return fan.sum(axis=0), (weight[:, None] * (p + q + mean) / 3).sum(axis=0) / weight.sum()


def cells_of(mesh):
    """Volumes and centres of the cells of a 3-D mesh, by pyramids on its faces."""
    table = faces(mesh)
    loops = [mesh.points[table.nodes[a:b]] for a, b in zip(table.offsets[:-1], table.offsets[1:], strict=True)]
    area, centre = map(np.array, zip(*map(face_of, loops), strict=True))
    inner = np.flatnonzero(table.neighbour >= 0)
    cell = np.concatenate([table.owner, table.neighbour[inner]])
    out = np.concatenate([area, -area[inner]])
    at = np.concatenate([centre, centre[inner]])
    add = lambda what: np.stack([np.bincount(cell, column, mesh.n_cells) for column in what.T], axis=1)  # noqa: E731
    guess = add(at) / np.bincount(cell)[:, None]
    piece = ((at - guess[cell]) * out).sum(axis=1)
    total = np.bincount(cell, piece)
    return total / 3, guess + 0.75 * add(piece[:, None] * (at - guess[cell])) / total[:, None]


def by_the_book(p, own, other, volumes):
    """The metrics of one face of a solid mesh: corners p (n, 3), centres of the cells or None, their volumes."""
    area, c = face_of(p)
    f, n = c - own, area / np.linalg.norm(area)
    d = n * (n @ f) if other is None else other - own
    s = f - (area @ f) / (area @ d) * d
    size = np.linalg.norm(s)
    reach = max(abs((p - c) @ (s / size))) if size > 0 else 1.0
    fan = np.cross(p - c, np.roll(p, -1, axis=0) - c) / 2
    line = f if other is None else d
    edges = p - np.roll(p, 1, axis=0)
    turns = [
        angle(e, g) if np.cross(e, g) @ area < 0 else 0.0
        for e, g in zip(edges, np.roll(edges, -1, axis=0), strict=True)
    ]
    found = {
        "face.area": np.linalg.norm(area),
        "openfoam.skewness": size / max((0.4 if other is None else 0.2) * np.linalg.norm(d), reach),
        "openfoam.flatness": np.linalg.norm(area) / np.linalg.norm(fan, axis=1).sum(),
        "openfoam.face_twist": min(fan @ line / np.linalg.norm(fan, axis=1) / np.linalg.norm(line)),
        "openfoam.face_pyramid": area @ f / 3,
        "openfoam.concave_angle": max(turns),
    }
    if other is None:
        return {**found, "wall.orthogonality_deg": 90 - angle(area, f)}
    a, b = abs(area @ f), abs(area @ (other - c))
    return {
        **found,
        "openfoam.face_pyramid": min(area @ f, area @ (other - c)) / 3,
        "fluent.face_squish": 1 - area @ d / np.linalg.norm(area) / np.linalg.norm(d),
        "growth_ratio": max(np.abs(volumes)) / min(np.abs(volumes)),
        "openfoam.non_orthogonality_deg": angle(area, d),
        "openfoam.face_weight": min(a, b) / (a + b),
        "openfoam.volume_ratio": min(volumes) / max(volumes),
    }


def mixed(seed):
    """Hexes, wedges, pyramids and tets with jittered points."""
    return hybrid_mesh(seed, n=4, jitter=0.2)


@pytest.mark.parametrize("seed", range(3))
def test_every_face_of_a_mixed_mesh_has_the_figures_of_the_definitions(seed):
    mesh = mixed(seed)
    found, table = values(mesh), faces(mesh)
    volume, centre = cells_of(mesh)
    assert (table.neighbour >= 0).sum() > 100
    for f in range(len(table)):
        a, b = int(table.owner[f]), int(table.neighbour[f])
        p = mesh.points[table.nodes[table.offsets[f] : table.offsets[f + 1]]]
        wanted = by_the_book(p, centre[a], centre[b] if b >= 0 else None, volume[[a, b]])
        for id_ in IDS:
            if id_ in wanted:
                assert found[id_][f] == pytest.approx(wanted[id_], rel=1e-9, abs=1e-9), (f, id_)
            else:
                assert math.isnan(found[id_][f]), (f, id_)


@pytest.mark.parametrize("number", range(4))
def test_the_faces_of_small_meshes_have_the_reference_values(shared, number):
    golden = json.loads((shared / "reference/golden.json").read_text())["meshes"][number]
    types = dict.fromkeys(name for name, _ in golden["cells"])
    rows = {name: [i for i, (other, _) in enumerate(golden["cells"]) if other == name] for name in types}
    blocks = tuple(CellBlock(name, at, [golden["cells"][i][1] for i in at]) for name, at in rows.items())
    mesh = Mesh(np.array(golden["points"]), blocks)
    table, found = faces(mesh), values(mesh)
    row = {tuple(sorted(table.nodes[table.offsets[f] : table.offsets[f + 1]].tolist())): f for f in range(len(table))}
    names = {"area": "face.area", "openfoam.vol_ratio": "openfoam.volume_ratio"}
    seen = set()
    for face in golden["faces"]:
        f = row[tuple(sorted(face.pop("nodes")))]
        assert (table.owner[f], table.neighbour[f]) == (face.pop("owner"), face.pop("neighbour"))
        for key, value in face.items():
            id_ = names.get(key, key)
            assert found[id_][f] == pytest.approx(value, rel=1e-9, abs=1e-12), (face, id_)
            seen.add(id_)
    assert len(seen) == 8


def hexes(*cells):
    """A mesh of hexes given by their corners; equal corners are one point."""
    points, nodes = np.unique(np.array(cells, float).reshape(-1, 3), axis=0, return_inverse=True)
    return Mesh(points, (CellBlock("hex", np.arange(len(cells)), nodes.reshape(-1, 8)),))


def between(mesh):
    """The metrics of the one inner face."""
    (f,) = np.flatnonzero(faces(mesh).neighbour >= 0)
    return {id_: column[f] for id_, column in values(mesh).items() if not math.isnan(column[f])}


def test_two_cubes_are_perfect_neighbours():
    found = between(hexes(CUBE, np.add(CUBE, (1, 0, 0))))
    assert found == pytest.approx(
        {"face.area": 1, "fluent.face_squish": 0, "growth_ratio": 1, "openfoam.non_orthogonality_deg": 0,
         "openfoam.skewness": 0, "openfoam.face_weight": 0.5, "openfoam.volume_ratio": 1, "openfoam.flatness": 1,
         "openfoam.face_twist": 1, "openfoam.face_pyramid": 1 / 6, "openfoam.concave_angle": 0}, abs=1e-15,
    )  # fmt: skip


def test_a_cube_beside_a_brick_three_long_has_a_quarter_of_the_way():
    found = between(hexes(CUBE, np.add(np.multiply(CUBE, (3, 1, 1)), (1, 0, 0))))
    assert (found["growth_ratio"], found["openfoam.volume_ratio"]) == (pytest.approx(3), pytest.approx(1 / 3))
    assert found["openfoam.face_weight"] == pytest.approx(0.5 / 2)


def test_a_cube_beside_a_leaning_one_is_off_by_half_a_face():
    # Centres (0.5, 0.5) and (1.5, 1): the way is (1, 1/2), it meets the face at 3/4 where the centre lies at 1/2.
    lean = [(x + 1, y + x, z) for x, y, z in CUBE]
    found = between(hexes(CUBE, lean))
    assert found["openfoam.non_orthogonality_deg"] == pytest.approx(math.degrees(math.atan(1 / 2)), rel=1e-14)
    assert found["fluent.face_squish"] == pytest.approx(1 - 2 / 5**0.5, rel=1e-14)
    assert found["openfoam.face_twist"] == pytest.approx(2 / 5**0.5, rel=1e-14)
    # |s| = 1/4, the face reaches 1/2 that way, and 0.2 |d| = 0.22 is less.
    assert found["openfoam.skewness"] == pytest.approx(0.25 / 0.5, rel=1e-14)


def test_a_leaning_wall_is_seen_at_an_angle():
    # Roof and floor shifted by one: from the centre the roof lies at (1/2, 1/2), 45 degrees off its normal.
    mesh = hexes([(x + z, y, z) for x, y, z in CUBE])
    found, centre = values(mesh), {}
    for f in range(6):
        centre[tuple(mesh.points[faces(mesh).nodes[4 * f : 4 * f + 4]].mean(axis=0).tolist())] = f
    roof, front = centre[1.5, 0.5, 1.0], centre[1.0, 0.0, 0.5]
    assert found["wall.orthogonality_deg"][roof] == pytest.approx(45, rel=1e-14)
    assert found["wall.orthogonality_deg"][front] == pytest.approx(90, rel=1e-14)
    # s = (1/2, 0, 0) over the reach of the roof, 1/2; the normal distance is 1/2, of which 0.4 is less.
    assert found["openfoam.skewness"][roof] == pytest.approx(1.0, rel=1e-14)
    assert found["openfoam.skewness"][front] == pytest.approx(0.0, abs=1e-15)


def test_a_needle_of_a_wall_face_is_measured_by_the_height_of_its_cell():
    # The roof is one thousandth wide, so 0.4 of the height of 1/2 counts: 0.5 / 0.2.
    mesh = hexes([(0.001 * x + z, y, z) for x, y, z in CUBE])
    assert max(values(mesh)["openfoam.skewness"]) == pytest.approx(0.5 / 0.2, rel=1e-12)


def polyhedron(points, sides):
    table = Faces(np.cumsum([0, *map(len, sides)]), np.concatenate(sides), [0] * len(sides), [-1] * len(sides))
    block = CellBlock("polyhedron", [0], offsets=[0, len(sides)], items=np.arange(len(sides)))
    return Mesh(np.array(points, float), (block,), faces=table)


def prism(ring):
    n = len(ring)
    points = [(x, y, z) for z in (0, 1) for x, y in ring]
    walls = [(i, (i + 1) % n, (i + 1) % n + n, i + n) for i in range(n)]
    return polyhedron(points, [tuple(range(n))[::-1], tuple(range(n, 2 * n)), *walls])


CONCAVE = [
    ("an L", [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 90.0),
    ("a notch of 45 degrees each way", [(0, 0), (2, 0), (2, 2), (1, 1), (0, 2)], 90.0),
    ("a sharp notch", [(0, 0), (2, 0), (2, 2), (1, 2 - 3**0.5), (0, 2)], 120.0),
    ("a dent of 1 in 10", [(0, 0), (2, 0), (2, 2), (1, 1.9), (0, 2)], 2 * math.degrees(math.atan(0.1))),
    ("a regular hexagon", [(math.cos(k * math.pi / 3), math.sin(k * math.pi / 3)) for k in range(6)], 0.0),
    ("a square with a node on its side", [(0, 0), (1, 0), (2, 0), (2, 2), (0, 2)], 0.0),
    ("an L with a corner named twice", [(0, 0), (2, 0), (2, 1), (1, 1), (1, 1), (1, 2), (0, 2)], 90.0),
]


@pytest.mark.parametrize(("what", "ring", "turn"), CONCAVE)
def test_concave_angles_are_the_turns_against_the_sense_of_the_face(what, ring, turn):
    # The walls are quadrilaterals, so the rings share a tile with faces of fewer nodes.
    found = values(prism(ring))["openfoam.concave_angle"]
    assert found[:2] == pytest.approx([turn, turn], rel=1e-12, abs=1e-12), what
    assert max(np.nan_to_num(found[2:])) == 0.0


def test_a_saddle_is_as_flat_and_as_twisted_as_its_triangles():
    # Corners up and down by 1/4: triangles of sqrt(1/16 + h^2/4), their normals off by the cosine 1/4 over that.
    h = 0.25
    raised = [(x, y, z + (h if z and x == y else -h if z else 0)) for x, y, z in CUBE]
    found = values(polyhedron(raised, SIDES))
    triangle = math.sqrt(1 / 16 + h * h / 4)
    assert found["openfoam.flatness"][1] == pytest.approx(1 / (4 * triangle), rel=1e-14)
    assert found["openfoam.face_twist"][1] == pytest.approx(0.25 / triangle, rel=1e-14)
    assert found["openfoam.flatness"][0] == 1.0


def test_a_face_that_crosses_itself_has_no_area_and_is_not_flat():
    crossed = np.array(CUBE, float)
    crossed[[6, 7]] = crossed[[7, 6]]
    found = values(polyhedron(crossed, [SIDES[0], SIDES[1]] + [SIDES[2]] * 2))
    assert found["face.area"][1] == found["openfoam.flatness"][1] == 0.0
    assert math.isnan(found["openfoam.concave_angle"][1])


def test_an_inverted_cell_shows_in_pyramids_and_volume_ratio_and_two_are_as_one_mirror_image():
    wide = np.add(CUBE, (1, 0, 0))
    inverted = hexes([(1 - x, y, z) for x, y, z in CUBE], wide)
    found = between(inverted)
    assert found["openfoam.volume_ratio"] == pytest.approx(-1.0)
    assert found["openfoam.face_pyramid"] == pytest.approx(-1 / 6)
    assert found["growth_ratio"] == pytest.approx(1.0)
    mesh = mixed(1)
    mirrored = Mesh(mesh.points * [-1, 1, 1], mesh.blocks)
    np.testing.assert_array_equal(values(mirrored)["openfoam.volume_ratio"], values(mesh)["openfoam.volume_ratio"])


def test_cells_without_extent_have_the_degenerate_values_of_the_registry():
    found = values(hexes(CUBE, np.add(CUBE, (1, 0, 0))))
    mesh = hexes(CUBE, np.add(CUBE, (1, 0, 0)))
    point = values(Mesh(np.full_like(mesh.points, 7.0), mesh.blocks))
    for id_, column in point.items():
        defined = ~np.isnan(found[id_])
        np.testing.assert_array_equal(column[defined], METRICS[id_].degenerate, err_msg=id_)
        assert np.isnan(column[~defined]).all()


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_point_that_is_not_finite_spoils_the_faces_around_it_and_of_the_cells_at_it_alone(bad):
    mesh = mixed(2)
    points, table = mesh.points.copy(), faces(mesh)
    points[10, 1] = bad
    broken = np.zeros(mesh.n_cells, bool)
    for block in mesh.blocks:
        broken[block.rows] = (block.nodes == 10).any(axis=1)
    spoilt = broken[table.owner] | ((table.neighbour >= 0) & broken[table.neighbour])
    assert 0 < spoilt.sum() < len(table)
    good = values(mesh)
    for id_, column in values(Mesh(points, mesh.blocks)).items():
        np.testing.assert_array_equal(column, np.where(spoilt, np.nan, good[id_]), err_msg=id_)


# --- meshes of 2-D cells


def grid(n=6, jitter=0.2, seed=1):
    """Jittered quads, a third of them cut into triangles, counter-clockwise in the x-y plane."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    points[:, :2] += rng.uniform(-jitter, jitter, (len(points), 2))
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.column_stack([first, first + 1, first + n + 2, first + n + 1])
    cut = quads[::3]
    tris = np.concatenate([cut[:, [0, 1, 2]], cut[:, [0, 2, 3]]])
    whole = np.delete(quads, np.arange(0, len(quads), 3), axis=0)
    blocks = (
        CellBlock("tri", np.arange(len(tris)), tris),
        CellBlock("quad", len(tris) + np.arange(len(whole)), whole),
    )
    return Mesh(points, blocks, dimension=2)


def thick(mesh):
    """The same cells one unit thick: wedges and hexes."""
    n = len(mesh.points)
    kind = {"tri": "wedge", "quad": "hex"}
    blocks = tuple(
        CellBlock(kind[block.type], block.rows, np.concatenate([block.nodes, block.nodes + n], axis=1))
        for block in mesh.blocks
    )
    return Mesh(np.concatenate([mesh.points, mesh.points + (0, 0, 1)]), blocks)


def test_edges_of_flat_cells_score_what_the_walls_of_the_same_cells_one_thick_do():
    flat, solid = grid(), thick(grid())
    here, there = values(flat), values(solid)
    table, walls = faces(flat), faces(solid)
    n = len(flat.points)
    row = {}
    for f in range(len(walls)):
        loop = walls.nodes[walls.offsets[f] : walls.offsets[f + 1]]
        if (loop < n).sum() == 2:
            row[tuple(sorted(loop[loop < n].tolist()))] = f
    rows = [row[tuple(sorted(pair.tolist()))] for pair in table.nodes.reshape(-1, 2)]
    for id_ in IDS:
        # A pyramid on an edge is a triangle: A.f/2 where the solid has A.f/3.
        factor = 1.5 if id_ == "openfoam.face_pyramid" else 1.0
        np.testing.assert_allclose(here[id_], there[id_][rows] * factor, rtol=1e-9, atol=1e-9, err_msg=id_)


def folded_twice(mesh):
    """The flat mesh as a shell, bent by right angles at the lines y = 2 and y = 4: nothing within a cell changes."""
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    return Mesh(np.column_stack([x, np.where(y > 4, 6 - y, np.minimum(y, 2)), np.clip(y, 2, 4) - 2]), mesh.blocks)


def test_a_shell_folded_along_its_edges_scores_what_it_does_unfolded():
    mesh = grid(6, jitter=0.0)
    points = mesh.points.copy()
    inside = np.isin(points[:, 1], (1.0, 3.0, 5.0))
    points[inside, :2] += np.random.default_rng(3).uniform(-0.2, 0.2, (inside.sum(), 2))
    points[:, 0] += 0.3 * points[:, 1] * (points[:, 1] < 2.5)
    flat = Mesh(points, mesh.blocks, dimension=2)
    folded = folded_twice(flat)
    assert np.ptp(folded.points, axis=0).min() > 1.9
    here, there = values(flat), values(folded)
    assert np.nanmax(here["openfoam.non_orthogonality_deg"]) > 10
    for id_ in IDS:
        np.testing.assert_allclose(there[id_], here[id_], rtol=1e-12, atol=1e-9, err_msg=id_)


def test_the_skin_of_a_cube_is_perfect_though_its_cells_meet_at_right_angles():
    mesh = Mesh(np.array(CUBE, float), (CellBlock("quad", np.arange(6), SIDES),))
    found = values(mesh)
    assert len(faces(mesh)) == 12
    for id_, value in {"fluent.face_squish": 0.0, "openfoam.non_orthogonality_deg": 0.0, "openfoam.face_weight": 0.5,
                       "openfoam.skewness": 0.0, "openfoam.face_twist": 1.0, "face.area": 1.0}.items():  # fmt: skip
        np.testing.assert_allclose(found[id_], value, atol=1e-14, err_msg=id_)


# --- laws


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rotation_changes_nothing(seed):
    mesh = mixed(seed % 4)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    here, there = values(mesh), values(Mesh(mesh.points @ turn.T, mesh.blocks))
    for id_, column in here.items():
        np.testing.assert_allclose(there[id_], column, rtol=1e-9, atol=1e-9, err_msg=id_)


@pytest.mark.parametrize("exponent", [-300, -170, -20, 20, 170, 300])
def test_meshes_of_any_size_score_the_same_bits(exponent):
    for mesh in (mixed(1), grid(), folded_twice(grid(6, jitter=0.0))):
        here = values(mesh)
        there = values(Mesh(mesh.points * 2.0**exponent, mesh.blocks, dimension=mesh.dimension))
        for id_, column in here.items():
            power = POWER.get(METRICS[id_].unit, 0) - (power_less(id_) if mesh.cell_dimension == 2 else 0)
            if abs(power * exponent) < 900:
                np.testing.assert_array_equal(there[id_], column * 2.0 ** (power * exponent), err_msg=id_)


def power_less(id_):
    return 1 if id_ in ("face.area", "openfoam.face_pyramid") else 0


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 3), where=st.tuples(*[st.integers(-10000, 10000)] * 3))
def test_translation_by_ten_thousand_changes_no_bit(seed, where):
    for mesh in (mixed(seed), grid(seed=seed)):
        points = np.round(mesh.points * 2**30) / 2**30
        moved = points + np.array(where, float) * ((1, 1, 0) if mesh.dimension == 2 else 1)
        here = values(Mesh(points, mesh.blocks, dimension=mesh.dimension))
        there = values(Mesh(moved, mesh.blocks, dimension=mesh.dimension))
        for id_, column in here.items():
            assert column.tobytes() == there[id_].tobytes(), id_


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_order_first_nodes_and_owners_of_faces_change_nothing(seed):
    rng = np.random.default_rng(seed)
    mesh = mixed(seed % 4)
    shuffled, order = with_shuffled_faces(mesh, rng)
    here, there = values(mesh), values(shuffled)
    for id_, column in here.items():
        np.testing.assert_allclose(there[id_], column[order], rtol=1e-9, atol=1e-9, err_msg=id_)


def test_any_number_of_threads_gives_the_same_bits():
    n = 41
    axes = np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij")
    points = np.stack([axis.ravel() for axis in axes], axis=1)
    points += np.random.default_rng(4).uniform(-0.2, 0.2, points.shape)
    at = lambda i, j, k: ((i * (n + 1) + j) * (n + 1) + k).ravel()  # noqa: E731
    i, j, k = np.meshgrid(*[np.arange(n)] * 3, indexing="ij")
    nodes = np.stack([at(i + a, j + b, k + c) for a, b, c in CUBE], axis=1)
    mesh = Mesh(points, (CellBlock("hex", np.arange(n**3), nodes),))
    one, two, five = (values(mesh, threads) for threads in (1, 2, 5))
    assert len(one["face.area"]) > 4 * 256 * 192  # several pieces
    for id_, column in one.items():
        assert column.tobytes() == two[id_].tobytes() == five[id_].tobytes(), id_


@pytest.mark.parametrize("name", ["cells/polyhedron-openfoam", "hybrid/hybrid-openfoam", "cells/polygon.fluent.msh"])
def test_no_sound_face_of_a_sample_is_without_a_number(name):
    mesh = read(HERE.parent / "samples" / name)
    inside = faces(mesh).neighbour >= 0
    for id_, column in values(mesh).items():
        on = METRICS[id_].on
        wanted = np.where(inside, "interior" in on, "boundary" in on)
        np.testing.assert_array_equal(np.isfinite(column), wanted, err_msg=id_)


def test_a_face_of_two_nodes_in_a_solid_mesh_has_no_area_and_breaks_nothing():
    mesh = polyhedron(CUBE, [*SIDES, (0, 1)])
    found = values(mesh)
    assert found["face.area"][6] == 0.0
    np.testing.assert_array_equal(found["face.area"][:6], 1.0)
