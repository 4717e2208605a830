"""Laws that hold for every cell: rigid motion, scale and admissible renumbering change nothing."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from meshwright.audit.cells import CELL_TYPES, LINEAR_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import METRICS

UNIT = {
    "tri": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0)],
    "quad": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    "tet": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0.5, 0.29, 0.82)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0.7)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0, 0, 1), (1, 0, 1), (0.5, 0.87, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}
POWER = {"L": 1, "L2": 2, "L3": 3}
CELL_METRICS = tuple(row for row in METRICS.values() if row.entity == "cell" and not row.column)
NOT_INVARIANT = {
    "openfoam.aspect_ratio": "compares the areas of the faces seen along the axes, as checkMesh does",
}
"""Metrics that a rotation may change, and why."""


def measured(type_name, points):
    nodes = np.arange(len(points)).reshape(-1, len(UNIT[type_name]))
    mesh = Mesh(np.asarray(points), (CellBlock(type_name, np.arange(len(nodes)), nodes),))
    values = measure(mesh, CELL_METRICS, threads=1).values
    return {id_: by_type[type_name] for id_, by_type in values.items() if type_name in by_type}


def random_cells(type_name, seed, n=50):
    shape = np.array(UNIT[type_name])
    return shape + np.random.default_rng(seed).uniform(-0.25, 0.25, (n, *shape.shape))


def orderings(type_name):
    """Every renumbering of the corners that maps outward faces to outward faces: the cell's own rotations."""
    cell = CELL_TYPES[type_name]
    if type_name in ("tri", "quad"):
        n = cell.n_nodes
        return [tuple((k + s) % n for k in range(n)) for s in range(n)]
    faces = {canonical(face) for face in cell.faces}
    return [
        p
        for p in itertools.permutations(range(cell.n_nodes))
        if {canonical([p[i] for i in f]) for f in cell.faces} == faces
    ]


def canonical(face):
    start = face.index(min(face)) if isinstance(face, list) else list(face).index(min(face))
    return tuple(face[start:]) + tuple(face[:start])


def assert_same(got, want, tolerance):
    for id_, value in want.items():
        np.testing.assert_allclose(got[id_], value, rtol=tolerance, atol=tolerance, err_msg=id_)


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rotation_changes_nothing(type_name, seed):
    cells = random_cells(type_name, seed)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    turned, straight = (measured(type_name, x.reshape(-1, 3)) for x in (cells @ turn.T, cells))
    assert_same(turned, {id_: value for id_, value in straight.items() if id_ not in NOT_INVARIANT}, 1e-9)


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), where=st.tuples(*[st.integers(-10000, 10000)] * 3))
def test_translation_by_ten_thousand_changes_nothing(type_name, seed, where):
    # Coordinates on a grid of 2^-30 stay exact under the move, so the numbers must be the same bits.
    cells = np.round(random_cells(type_name, seed) * 2**30) / 2**30
    here, there = (
        measured(type_name, cells.reshape(-1, 3)),
        measured(type_name, (cells + np.array(where, float)).reshape(-1, 3)),
    )
    for id_, value in here.items():
        assert value.tobytes() == there[id_].tobytes(), id_


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(1e-9, 1e9))
def test_scale_changes_sizes_by_its_power_and_ratios_not_at_all(type_name, seed, scale):
    cells = random_cells(type_name, seed).reshape(-1, 3)
    here, there = measured(type_name, cells), measured(type_name, cells * scale)
    for id_, value in here.items():
        factor = scale ** POWER.get(METRICS[id_].unit, 0)
        np.testing.assert_allclose(there[id_] / factor, value, rtol=1e-9, atol=1e-9, err_msg=id_)


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_admissible_renumbering_changes_nothing(type_name, seed):
    cells = random_cells(type_name, seed, n=5)
    want = measured(type_name, cells.reshape(-1, 3))
    all_orderings = orderings(type_name)
    assert len(all_orderings) == {"tri": 3, "quad": 4, "tet": 12, "pyramid": 4, "wedge": 6, "hex": 24}[type_name]
    for order in all_orderings:
        assert_same(measured(type_name, cells[:, list(order)].reshape(-1, 3)), want, 1e-9)


@pytest.mark.parametrize("type_name", ["tet", "pyramid", "wedge", "hex"])
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_mirror_turns_the_sign_of_volume_and_leaves_unsigned_numbers(type_name, seed):
    cells = random_cells(type_name, seed).reshape(-1, 3)
    here, there = measured(type_name, cells), measured(type_name, cells * [1.0, 1.0, -1.0])
    np.testing.assert_array_equal(there["volume"], -here["volume"])
    for id_ in ("gambit.equiangle_skew", "gambit.edge_ratio", "gambit.aspect_ratio", "edge.min"):
        np.testing.assert_allclose(there[id_], here[id_], rtol=1e-12)


def test_any_number_of_threads_gives_the_same_bits():
    cells = random_cells("hex", 3, n=100_003).reshape(-1, 3)
    nodes = np.arange(len(cells)).reshape(-1, 8)
    mesh = Mesh(cells, (CellBlock("hex", np.arange(len(nodes)), nodes),))
    one, two, five = (measure(mesh, CELL_METRICS, threads=n).values for n in (1, 2, 5))
    for id_, by_type in one.items():
        for type_name, value in by_type.items():
            assert value.tobytes() == two[id_][type_name].tobytes() == five[id_][type_name].tobytes()


def test_random_cells_never_give_nan():
    for type_name in LINEAR_TYPES:
        cells = np.random.default_rng(11).uniform(-1, 1, (20_000 * len(UNIT[type_name]), 3))
        for id_, value in measured(type_name, cells).items():
            assert not np.isnan(value).any(), (type_name, id_)
