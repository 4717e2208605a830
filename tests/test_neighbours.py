"""Metrics of cells that look at their neighbours: definitions cell by cell, reference values, closed forms, laws."""

import json
import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from meshwright.audit.connectivity import faces, faces_of_cells
from meshwright.audit.geometry import cell_geometry, face_geometry
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.readers import read

HERE = Path(__file__).parent
_HYBRID = runpy.run_path(str(HERE / "hybrid.py"))
hybrid_mesh, with_shuffled_faces = _HYBRID["hybrid_mesh"], _HYBRID["with_shuffled_faces"]

OQ, ICEM, RATIO, DET = (
    "fluent.orthogonal_quality", "icem.orthogonal_quality", "max_neighbour_volume_ratio", "openfoam.determinant",
)  # fmt: skip
IDS = (OQ, ICEM, RATIO, DET)
CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def values(mesh, ids=IDS, threads=1):
    """One value per cell row and metric; nan where it is not defined."""
    found = measure(mesh, ids, threads=threads).values
    columns = {}
    for id_ in ids:
        columns[id_] = np.full(mesh.n_cells, np.nan)
        for block in mesh.blocks:
            if block.type in found[id_]:
                columns[id_][block.rows] = found[id_][block.type]
    return columns


def box(nx, ny, nz, jitter=0.0, seed=1, spacing=(1, 1, 1)):
    """nx * ny * nz bricks."""
    axes = [np.arange(n + 1.0) for n in (nx, ny, nz)]
    points = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1) * spacing
    points += np.random.default_rng(seed).uniform(-jitter, jitter, points.shape)
    at = lambda i, j, k: ((i * (ny + 1) + j) * (nz + 1) + k).ravel()  # noqa: E731
    i, j, k = np.meshgrid(*[np.arange(n) for n in (nx, ny, nz)], indexing="ij")
    nodes = np.stack([at(i + a, j + b, k + c) for a, b, c in CUBE], axis=1)
    return Mesh(points, (CellBlock("hex", np.arange(len(nodes)), nodes),))


def told_by_faces(mesh):
    offsets, items = faces_of_cells(mesh)
    block = CellBlock("polyhedron", np.arange(mesh.n_cells), offsets=offsets, items=items)
    return Mesh(mesh.points, (block,), faces=faces(mesh))


def by_the_book(mesh):
    """The metrics of every cell from the tables of areas, centres and volumes."""
    table, face, cell = faces(mesh), face_geometry(mesh), cell_geometry(mesh)
    cosine = lambda a, b: a @ b / np.linalg.norm(a) / np.linalg.norm(b)  # noqa: E731
    offsets, items = faces_of_cells(mesh)
    found = {id_: [] for id_ in (OQ, RATIO, DET)}
    for c in range(mesh.n_cells):
        worst, ratio, areas = math.inf, 1.0, []
        for f in items[offsets[c] : offsets[c + 1]].tolist():
            own = table.owner[f] == c
            a = face.area[f] * (1 if own else -1)
            other = int(table.neighbour[f] if own else table.owner[f])
            worst = min(worst, cosine(a, face.centre[f] - cell.centre[c]))
            if other >= 0:
                worst = min(worst, cosine(a, cell.centre[other] - cell.centre[c]))
                v = sorted(abs(cell.volume[[c, other]]))
                ratio = max(ratio, v[1] / v[0])
                areas.append(a)
        mean = np.mean(np.linalg.norm(areas, axis=1)) if areas else 1.0
        tensor = sum((np.outer(a, a) for a in areas), np.zeros((3, 3))) / mean**2
        found[OQ].append(worst)
        found[RATIO].append(ratio)
        found[DET].append(abs(np.linalg.det(tensor)) / 8)
    return {id_: np.array(column) for id_, column in found.items()}


@pytest.mark.parametrize("seed", range(3))
def test_every_cell_of_a_mixed_mesh_has_the_figures_of_the_definitions(seed):
    mesh = hybrid_mesh(seed, n=4, jitter=0.2)
    for one in (mesh, told_by_faces(mesh)):
        found = values(one)
        for id_, column in by_the_book(one).items():
            np.testing.assert_allclose(found[id_], column, rtol=1e-9, atol=1e-12, err_msg=id_)
    assert (found[DET] > 0.1).any()


def test_skew_tells_in_tets_pyramids_and_wedges_and_nowhere_else():
    mesh = hybrid_mesh(1, n=4, jitter=0.2)
    found = values(mesh)
    skew = values(mesh, ["gambit.equisize_skew", "gambit.equiangle_skew"])
    lower = 0
    for block in mesh.blocks:
        rows = block.rows
        by_angle = skew["gambit.equiangle_skew"]
        of_type = {"tet": skew["gambit.equisize_skew"], "pyramid": by_angle, "wedge": by_angle}
        of_type = of_type.get(block.type, np.zeros(mesh.n_cells))
        wanted = np.minimum(found[OQ][rows], 1 - of_type[rows])
        np.testing.assert_array_equal(found[ICEM][rows], wanted)
        lower += np.count_nonzero(wanted < found[OQ][rows])
    assert lower > 10
    told = values(told_by_faces(mesh))
    np.testing.assert_array_equal(told[ICEM], told[OQ])  # polyhedra have no such term


@pytest.mark.parametrize("number", range(4))
def test_the_cells_of_small_meshes_have_the_reference_values(shared, number):
    golden = json.loads((shared / "reference/golden.json").read_text())["meshes"][number]
    types = dict.fromkeys(name for name, _ in golden["cells"])
    rows = {name: [i for i, (other, _) in enumerate(golden["cells"]) if other == name] for name in types}
    blocks = tuple(CellBlock(name, at, [golden["cells"][i][1] for i in at]) for name, at in rows.items())
    found = values(Mesh(np.array(golden["points"]), blocks))
    for row, cell in enumerate(golden["cells_values"]):
        for id_ in (OQ, RATIO, DET):
            assert found[id_][row] == pytest.approx(cell[id_], rel=1e-9, abs=1e-12), (cell["type"], id_)


def test_a_cube_among_cubes_is_perfect():
    found = values(box(3, 3, 3))
    middle = 13
    assert {id_: column[middle] for id_, column in found.items()} == pytest.approx(dict.fromkeys(IDS, 1.0), rel=1e-15)


def test_a_determinant_counts_the_inner_faces_of_each_direction():
    # Of a corner cell one face each way is inner: det = 1 * 1 * 1; of an edge cell 2 * 1 * 1, of a face cell 2 * 2 * 1.
    found = values(box(3, 3, 3))[DET] * 8
    counts = np.array([1, 2, 1])
    wanted = counts[:, None, None] * counts[None, :, None] * counts[None, None, :]
    np.testing.assert_allclose(found, wanted.ravel(), rtol=1e-15)
    assert (values(box(4, 4, 1))[DET] == 0).all()  # nothing inner looks along z
    assert (values(box(5, 1, 1, jitter=0.1))[DET] == 0).all()


def test_bricks_have_the_determinant_of_their_sides():
    # 1 x 2 x 4: areas 8, 4, 2, mean 14/3: (8 * 4 * 2)^2 * 8 / (14/3)^6 / 8.
    middle = values(box(3, 3, 3, spacing=(1, 2, 4)))[DET][13]
    assert middle == pytest.approx(64**2 / (14 / 3) ** 6, rel=1e-14)


def test_the_worst_neighbour_counts_and_none_counts_as_equal():
    mesh = box(3, 1, 1)
    points = mesh.points.copy()
    points[:, 0] = np.array([0, 1, 3, 9])[points[:, 0].astype(int)]  # volumes 1, 2, 6
    np.testing.assert_allclose(values(Mesh(points, mesh.blocks))[RATIO], [2, 3, 3], rtol=1e-15)
    assert values(box(1, 1, 1))[RATIO].tolist() == [1.0]


def test_a_leaning_neighbour_costs_the_cosine_of_the_way_to_it():
    mesh = box(2, 1, 1)
    points = mesh.points.copy()
    points[points[:, 0] == 2, 1] += 1  # the second cube leans by 45 degrees
    found = values(Mesh(points, mesh.blocks))[OQ]
    assert found == pytest.approx([2 / 5**0.5, 0.5**0.5], rel=1e-14)  # of the way to it, of its own faces


def test_an_inverted_cell_has_negative_quality():
    mesh = box(2, 1, 1)
    points = mesh.points.copy()
    points[points[:, 0] == 0, 0] = 2.5  # the first cube turned inside out, over the second
    found = values(Mesh(points, mesh.blocks))
    assert found[OQ][0] == found[ICEM][0] == pytest.approx(-1.0)


def flat(mesh):
    """The mid plane of a mesh one brick thick as quads."""
    n = len(mesh.points) // 2
    nodes = mesh.block("hex").nodes[:, :4] // 2
    points = mesh.points[::2] * (1, 1, 0)
    assert len(points) == n
    return Mesh(points, (CellBlock("quad", np.arange(len(nodes)), nodes),), dimension=2)


def test_quads_score_what_bricks_on_them_do():
    solid = box(5, 4, 1)
    points = solid.points.copy()
    points[:, :2] += np.repeat(np.random.default_rng(1).uniform(-0.2, 0.2, (30, 2)), 2, axis=0)
    solid = Mesh(points, solid.blocks)
    here, there = values(flat(solid)), values(solid)
    assert here[OQ].min() < 0.95
    for id_ in (OQ, ICEM, RATIO):
        np.testing.assert_allclose(here[id_], there[id_], rtol=1e-12, err_msg=id_)
    assert np.isnan(here[DET]).all()  # not defined on them


def test_a_shell_looks_at_its_own_edges_alone():
    quads = flat(box(5, 1, 1))
    points = quads.points.copy()
    points[:, 0] = np.cumsum([0, 1, 1, 1, 1, 5])[points[:, 0].astype(int)]
    points[4:6, 1] += 0.5  # the line x = 2: cells 1 and 2 lean by atan 1/2
    plane, shell = Mesh(points, quads.blocks, dimension=2), Mesh(points, quads.blocks)
    here, there = values(plane)[OQ], values(shell)[OQ]
    assert there[1] == pytest.approx(2 / 5**0.5, rel=1e-14)  # the normal of its two long sides against (0, 1)
    assert (there >= here).all()
    folded = points.copy()
    folded[points[:, 0] > 2] = [(2, y, x - 2) for x, y, _ in points[points[:, 0] > 2]]
    np.testing.assert_allclose(values(Mesh(folded, quads.blocks))[OQ], there, rtol=1e-14)


def test_hexagons_are_perfect_as_polygons_and_as_prisms():
    for name in ("cells/polygon.fluent.msh", "cells/polyhedron-openfoam"):
        mesh = read(HERE.parent / "samples" / name)
        found = values(mesh)
        assert mesh.n_cells == 12
        np.testing.assert_allclose(found[OQ], 1.0, rtol=1e-9)
        np.testing.assert_allclose(found[RATIO], 1.0, rtol=1e-6)


def test_cells_without_extent_have_the_degenerate_values_of_the_registry():
    mesh = hybrid_mesh(1, n=3)
    found = values(Mesh(np.full_like(mesh.points, 7.0), mesh.blocks))
    for id_, column in found.items():
        assert set(column.tolist()) == {METRICS[id_].degenerate}, id_


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_point_that_is_not_finite_spoils_its_cells_and_those_beside_them_alone(bad):
    mesh = box(6, 6, 6, jitter=0.2)
    points, table = mesh.points.copy(), faces(mesh)
    points[0, 2] = bad
    broken = (mesh.blocks[0].nodes == 0).any(axis=1)
    assert broken.sum() == 1
    touched = broken.copy()
    inner = table.neighbour >= 0
    for a, b in ((table.owner, table.neighbour), (table.neighbour, table.owner)):
        touched[a[inner][broken[b[inner]]]] = True
    assert touched.sum() == 4
    good = values(mesh)
    for id_, column in values(Mesh(points, mesh.blocks)).items():
        np.testing.assert_array_equal(column, np.where(touched, np.nan, good[id_]), err_msg=id_)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rotation_changes_nothing(seed):
    mesh = hybrid_mesh(seed % 4, n=3, jitter=0.2)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    here, there = values(mesh), values(Mesh(mesh.points @ turn.T, mesh.blocks))
    for id_, column in here.items():
        np.testing.assert_allclose(there[id_], column, rtol=1e-9, atol=1e-9, err_msg=id_)


@pytest.mark.parametrize("exponent", [-300, -170, -20, 20, 170, 300])
def test_meshes_of_any_size_score_the_same_bits(exponent):
    mesh = hybrid_mesh(1, n=3, jitter=0.2)
    here, there = values(mesh), values(Mesh(mesh.points * 2.0**exponent, mesh.blocks))
    for id_, column in here.items():
        assert column.tobytes() == there[id_].tobytes(), id_


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 3), where=st.tuples(*[st.integers(-10000, 10000)] * 3))
def test_translation_by_ten_thousand_changes_no_bit(seed, where):
    mesh = hybrid_mesh(seed, n=3, jitter=0.2)
    points = np.round(mesh.points * 2**30) / 2**30
    here = values(Mesh(points, mesh.blocks))
    there = values(Mesh(points + np.array(where, float), mesh.blocks))
    for id_, column in here.items():
        assert column.tobytes() == there[id_].tobytes(), id_


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_order_and_owners_of_faces_change_nothing(seed):
    rng = np.random.default_rng(seed)
    mesh = hybrid_mesh(seed % 4, n=3, jitter=0.2)
    shuffled, _ = with_shuffled_faces(mesh, rng)
    here, there = values(mesh), values(shuffled)
    for id_, column in here.items():
        np.testing.assert_allclose(there[id_], column, rtol=1e-9, atol=1e-12, err_msg=id_)


def test_any_number_of_threads_gives_the_same_bits():
    mesh = box(30, 30, 30, jitter=0.2)
    for one_mesh in (mesh, hybrid_mesh(1, n=8, jitter=0.2)):
        one, two, five = (values(one_mesh, threads=threads) for threads in (1, 2, 5))
        for id_, column in one.items():
            assert column.tobytes() == two[id_].tobytes() == five[id_].tobytes(), id_
