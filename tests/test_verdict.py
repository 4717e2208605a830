"""Verdict's metrics: closed forms, broken cells, laws."""

import itertools
import math
import runpy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from scipy.spatial.transform import Rotation

from meshwright.audit.cells import CELL_TYPES, LINEAR_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.metrics.roots import cube_roots
from meshwright.audit.metrics.tile import LANES
from meshwright.audit.metrics.verdict import LEFT_OUT, ROWS

_filter = runpy.run_path(str(Path(__file__).parent / "verdict_filter.py"))
IDEAL, families = _filter["IDEAL"], _filter["families"]
ROOT2, ROOT3, ROOT5 = math.sqrt(2), math.sqrt(3), math.sqrt(5)
POWER = {"1": 0, "L": 1}


def measured(type_name, cells):
    """{id: (n,) values} of all of Verdict's metrics on this type."""
    points = np.asarray(cells, dtype=float).reshape(-1, 3)
    nodes = np.arange(len(points)).reshape(-1, CELL_TYPES[type_name].n_nodes)
    mesh = Mesh(points, (CellBlock(type_name, np.arange(len(nodes)), nodes),))
    values = measure(mesh, [row for row in ROWS if type_name in row.on], threads=1).values
    return {id_: by_type[type_name] for id_, by_type in values.items()}


def box(a, b, c):
    return [(x, y, z) for z in (0, c) for x, y in ((0, 0), (a, 0), (a, b), (0, b))]


RECTANGLE = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]
TRAPEZOID = [(0, 0, 0), (2, 0, 0), (1.5, 1, 0), (0.5, 1, 0)]  # slanted sides sqrt(1.25), corner cross products 2 and 1
SADDLE = [(0, 0, 0.25), (1, 0, -0.25), (1, 1, 0.25), (0, 1, -0.25)]
RIGHT = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
CORNER = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
TALL = [*IDEAL["pyramid"][:4], (0.5, 0.5, 1)]
PRISM = [*RIGHT, (0, 0, 1), (1, 0, 1), (0, 1, 1)]
SHEARED = [(x + z, y, z) for x, y, z in box(1, 1, 1)]
TWISTED = box(1, 1, 1)[:4] + [(1, 0, 1), (1, 1, 1), (0, 1, 1), (0, 0, 1)]
UNIT_FROBENIUS = 4 / (3 * 1.5 ** (1 / 3))
"""Frobenius aspect at a corner of the unit wedge: (1.5 * 3 - 1/2) / (3 (2 * 3/4)^(1/3))."""

# (what, type, cell, metric without its system, value): each value follows from the picture with pencil and paper.
CLOSED_FORMS = [
    ("right isosceles triangle: sin 45 / sin 60", "tri", RIGHT, "scaled_jacobian", ROOT2 / ROOT3),
    ("right isosceles triangle: 4 sqrt(3) / 2 over 4", "tri", RIGHT, "shape", ROOT3 / 2),
    ("right isosceles triangle", "tri", RIGHT, "condition", 2 / ROOT3),
    ("right isosceles triangle: L P = sqrt(2) (2 + sqrt(2))", "tri", RIGHT, "aspect_ratio", (ROOT2 + 1) / ROOT3),
    ("right isosceles triangle: 2r/R", "tri", RIGHT, "normalized_inradius", 2 / (1 + ROOT2)),
    ("2 x 1 rectangle: 2 * 6 / 8", "quad", RECTANGLE, "aspect_ratio", 1.5),
    ("2 x 1 rectangle", "quad", RECTANGLE, "max_edge_ratio", 2),
    ("2 x 1 rectangle: 2 * 2 / 5", "quad", RECTANGLE, "shape", 0.8),
    ("2 x 1 rectangle", "quad", RECTANGLE, "condition", 1.25),
    ("2 x 1 rectangle: (4 - 1)^2 / (2 * 4)", "quad", RECTANGLE, "oddy", 9 / 8),
    ("2 x 1 rectangle: edges 10, diagonal sqrt(5), corner 2", "quad", RECTANGLE, "radius_ratio", 1.25),
    ("trapezoid: 2 / (2 sqrt(1.25)) and 1 / sqrt(1.25)", "quad", TRAPEZOID, "scaled_jacobian", 2 / ROOT5),
    ("trapezoid: 1 over the area 1.5", "quad", TRAPEZOID, "distortion", 2 / 3),
    ("trapezoid: hour-glass vector 1/4 over half of 1", "quad", TRAPEZOID, "taper", 0.5),
    ("trapezoid: (4 + 1.25) / 4 and (1 + 1.25) / 2", "quad", TRAPEZOID, "max_aspect_frobenius", 1.3125),
    ("trapezoid: mean of the two", "quad", TRAPEZOID, "med_aspect_frobenius", (1.3125 + 1.125) / 2),
    ("saddle: corner normals (1/2, 1/2, 1) and (-1/2, -1/2, 1)", "quad", SADDLE, "warpage", (0.5 / 1.5) ** 3),
    ("saddle: 1 along the mean normal over 1.25", "quad", SADDLE, "shear", 0.8),
    ("corner of a cube: sqrt(2) over 1 * sqrt(2) * sqrt(2)", "tet", CORNER, "scaled_jacobian", 1 / ROOT2),
    ("corner of a cube: 12 (1/2)^(2/3) / 9", "tet", CORNER, "shape", 12 * 0.5 ** (2 / 3) / 9),
    ("corner of a cube", "tet", CORNER, "aspect_frobenius", 9 / (12 * 0.5 ** (2 / 3))),
    ("corner of a cube: sqrt(9 * 1.5) / 3", "tet", CORNER, "condition", math.sqrt(13.5) / 3),
    ("corner of a cube: 1.5^1.5 / sqrt(2)", "tet", CORNER, "aspect_gamma", 1.5**1.5 / ROOT2),
    ("corner of a cube", "tet", CORNER, "mean_ratio", ROOT2 / 1.5**1.5),
    ("corner of a cube: sqrt(2) (1.5 + sqrt(3)/2) / sqrt(6)", "tet", CORNER, "aspect_ratio", (3 + ROOT3) / (2 * ROOT3)),
    ("corner of a cube: 1/sqrt(3) over sqrt(2)", "tet", CORNER, "collapse_ratio", 1 / math.sqrt(6)),
    ("corner of a cube: face angles 45, 90; between faces 54.7, 90", "tet", CORNER, "equiangle_skew", 0.25),
    ("regular tet: all twelve inner tets are as good", "tet", IDEAL["tet"], "normalized_inradius", 1),
    ("equilateral pyramid", "pyramid", IDEAL["pyramid"], "scaled_jacobian", 1),
    ("pyramid of height 1: 2 over 1.5^1.5, turned back at 1", "pyramid", TALL, "scaled_jacobian", 2 - 2 / 1.5**1.5),
    ("pyramid of height 1: longest edge sqrt(1.5) over sqrt(2)", "pyramid", TALL, "shape", ROOT3 / 2),
    ("right prism: sin 45 / sin 60", "wedge", PRISM, "scaled_jacobian", ROOT2 / ROOT3),
    ("right prism: 3 (2 / sqrt(3))^(2/3) / 4 at the 45 degrees", "wedge", PRISM, "shape",
     3 * (2 / ROOT3) ** (2 / 3) / 4),
    ("right prism: 1 over 2 V", "wedge", PRISM, "distortion", 1),
    ("right prism: (1.5 * 4 - 1) / (3 * 2^(1/3)) at the 45 degrees", "wedge", PRISM, "condition",
     5 / (3 * 2 ** (1 / 3)) / UNIT_FROBENIUS),
    ("right prism: 4.5 at the right angle, twice 5", "wedge", PRISM, "med_aspect_frobenius",
     (4.5 + 5 + 5) / 3 / (3 * 2 ** (1 / 3)) / UNIT_FROBENIUS),
    ("1 x 2 x 4 box: 3 * 8^(2/3) / 21", "hex", box(1, 2, 4), "shape", 12 / 21),
    ("1 x 2 x 4 box: sqrt(21 (4 + 16 + 64)) / 24", "hex", box(1, 2, 4), "condition", math.sqrt(21 * 84) / 24),
    ("1 x 2 x 4 box: (1 + 16 + 256 - 441/3) / 8^(4/3)", "hex", box(1, 2, 4), "oddy", 126 / 16),
    ("1 x 2 x 4 box: 1 / sqrt(1 + 1/4 + 1/16)", "hex", box(1, 2, 4), "dimension", 4 / math.sqrt(21)),
    ("cube sheared by 45 degrees", "hex", SHEARED, "shear", 1 / ROOT2),
    ("cube sheared by 45 degrees: |G|^2 = 1 + 1 + 4 + 2, trace 4", "hex", SHEARED, "oddy", 8 - 16 / 3),
    ("cube sheared by 45 degrees", "hex", SHEARED, "distortion", 1),
    ("cube twisted by 90 degrees: edges leave their faces at 45", "hex", TWISTED, "scaled_jacobian", 1 / ROOT2),
    ("cube twisted by 90 degrees: mixed mode as long as the axis", "hex", TWISTED, "taper", 1),
]  # fmt: skip


@pytest.mark.parametrize(("what", "type_name", "cell", "name", "value"), CLOSED_FORMS, ids=lambda v: str(v)[:40])
def test_closed_forms(what, type_name, cell, name, value):
    assert measured(type_name, cell)[f"verdict.{name}"][0] == pytest.approx(value, rel=1e-13, abs=1e-13), what


def test_the_equilateral_cell_of_each_type_has_the_ideal_value_of_every_metric():
    for type_name in LINEAR_TYPES:
        for id_, value in measured(type_name, IDEAL[type_name]).items():
            if METRICS[id_].ideal is not None:
                assert value[0] == pytest.approx(METRICS[id_].ideal, rel=1e-14, abs=1e-14), (type_name, id_)


def test_a_cell_of_one_point_has_the_degenerate_value_of_every_metric():
    for type_name in LINEAR_TYPES:
        for id_, value in measured(type_name, np.ones((CELL_TYPES[type_name].n_nodes, 3))).items():
            assert np.array_equal(value, [METRICS[id_].degenerate], equal_nan=True), (type_name, id_)


def test_flat_solids_and_cells_on_a_line_are_degenerate_in_any_position():
    """But for taper and the ratio of axes, which a flat hex still has."""
    rng = np.random.default_rng(2)
    for type_name in LINEAR_TYPES:
        n, solid = CELL_TYPES[type_name].n_nodes, CELL_TYPES[type_name].dimension == 3
        for kept in ((1, 0, 0), (1, 1, 0)) if solid else ((1, 0, 0),):
            cells = rng.integers(-9, 10, (300, n, 3)) * kept @ Rotation.random(rng=rng).as_matrix()
            for id_, value in measured(type_name, cells).items():
                row = METRICS[id_]
                if id_ in ("verdict.taper", "verdict.max_edge_ratio"):
                    assert not np.isnan(value).any()
                elif math.isnan(row.degenerate):
                    assert np.isnan(value).all()
                elif row.degenerate == 0:  # a signed number of a flat cell is the rounding of its corners
                    assert np.abs(value).max() < 1e-12, (type_name, id_)
                else:
                    assert np.array_equal(value, np.full_like(value, row.degenerate)), (type_name, id_)


def test_no_cell_of_finite_corners_has_a_nan_but_a_quadrilateral_without_a_normal():
    rng = np.random.default_rng(1)
    for type_name in LINEAR_TYPES:
        n = CELL_TYPES[type_name].n_nodes
        lattice = rng.integers(0, 3, (20_000, n, 3)).astype(float)  # collapsed, folded and flat in every way
        thin = rng.normal(size=(5000, n, 3)) * 10.0 ** rng.uniform(-8, 0, (5000, 1, 3))
        for cells in (lattice, thin):
            for id_, value in measured(type_name, cells).items():
                if id_ == "verdict.warpage":
                    quads = np.roll(cells, -1, axis=1) - cells
                    normals = np.linalg.norm(np.cross(quads, np.roll(quads, 1, axis=1)), axis=2)
                    assert not np.isnan(value[(normals > 1e-12).all(axis=1)]).any()
                else:
                    assert not np.isnan(value).any(), (type_name, id_)


@pytest.mark.parametrize("type_name", ["tet", "pyramid", "wedge", "hex"])
def test_a_mirrored_cell_keeps_the_size_of_signed_and_unsigned_numbers_and_fails_the_others(type_name):
    """Signed: negative. Barriers: 0 or inf, as for a cell folded all over. The rest is blind to the mirror."""
    signed = {
        f"verdict.{name}"
        for name in ("scaled_jacobian", "distortion", "mean_ratio", "collapse_ratio", "normalized_inradius")
    }
    barriers = {"verdict.shape", "verdict.condition", "verdict.shear", "verdict.oddy"}
    barriers |= {"verdict.max_aspect_frobenius", "verdict.med_aspect_frobenius"} if type_name == "hex" else set()
    cells = families(type_name)["random"]
    here, there = measured(type_name, cells), measured(type_name, cells * (1, 1, -1))
    for id_, value in here.items():
        if id_ in barriers:
            assert np.array_equal(there[id_], np.full_like(value, METRICS[id_].degenerate)), id_
        elif id_ not in signed:
            np.testing.assert_allclose(there[id_], value, rtol=1e-12, err_msg=id_)
        elif type_name == "tet":
            np.testing.assert_allclose(there[id_], -value, rtol=1e-12, err_msg=id_)
        else:  # the corner that is worst is another one
            assert (there[id_] < 0).all()


def canonical(face):
    start = face.index(min(face))
    return (*face[start:], *face[:start])


def renumberings(type_name):
    """The cell's own rotations: renumberings that map outward faces to outward faces."""
    cell = CELL_TYPES[type_name]
    if cell.dimension == 2:
        return [tuple((k + s) % cell.n_nodes for k in range(cell.n_nodes)) for s in range(cell.n_nodes)]
    faces = {canonical(tuple(face)) for face in cell.faces}
    every = itertools.permutations(range(cell.n_nodes))
    return [p for p in every if {canonical(tuple(p[i] for i in face)) for face in cell.faces} == faces]


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
def test_rotation_scale_and_renumbering_change_nothing_and_moving_not_a_bit(type_name):
    rng = np.random.default_rng(9)
    for family in families(type_name).values():
        cells = np.round(family * 2**30) / 2**30  # exact under the move
        here = measured(type_name, cells)
        turned = measured(type_name, cells @ Rotation.random(rng=rng).as_matrix())
        scaled, moved = measured(type_name, cells * 1.7e-3), measured(type_name, cells + (-4096.0, 17.0, 9999.0))
        renumbered = [measured(type_name, cells[:, list(order)]) for order in renumberings(type_name)]
        for id_, value in here.items():
            factor = 1.7e-3 ** POWER[METRICS[id_].unit]
            for other in (turned[id_], scaled[id_] / factor, *(one[id_] for one in renumbered)):
                np.testing.assert_allclose(other, value, rtol=1e-10, atol=1e-12, err_msg=id_)
            assert moved[id_].tobytes() == value.tobytes(), id_


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
def test_cells_of_any_size_score_the_same_bits(type_name):
    cells = families(type_name)["random"][:20]
    here = measured(type_name, cells)
    for exponent in (-300, -150, -99, 99, 150, 300):
        for id_, value in measured(type_name, cells * 2.0**exponent).items():
            assert np.array_equal(value, here[id_] * 2.0 ** (exponent * POWER[METRICS[id_].unit])), (id_, exponent)


def test_cube_roots_are_right_to_two_units_in_the_last_place_from_the_smallest_to_the_largest_number():
    @njit(error_model="numpy")
    def run(values, out):
        cube_roots(values, out)

    rng, out = np.random.default_rng(0), np.empty(LANES)
    for _ in range(200):
        values = 10.0 ** rng.uniform(-307, 307, LANES)
        run(values, out)
        for value, root in zip(values.tolist(), out.tolist(), strict=True):
            assert abs(Fraction(root) ** 3 / Fraction(value) - 1) < 3 * 2 * np.finfo(float).eps, "by exact rationals"
    values[:5] = 0.0, math.inf, 1.0, 8.0, math.nan
    run(values, out)
    assert np.array_equal(out[:5], [0.0, math.inf, 1.0, 2.0, math.nan], equal_nan=True)


def test_what_is_left_out_has_no_row_of_its_own():
    for names, reason in LEFT_OUT.items():
        if " of " not in names:
            assert not {f"verdict.{name}" for name in names.split(", ")} & METRICS.keys()
        assert reason
