"""Every metric against reference values computed by other programs and by hand."""

import json
import math

import numpy as np
import pytest

from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import METRICS

# Perfect cells in rotated millimetres score the rounding of their coordinates, and no two programs round alike.
# The reference takes the skew angle between middles in absolute coordinates: 2e-11 degrees off in such a cell.
NOISE = {"1": 1e-12, "deg": 1e-12, "hm.skew": 3e-11}


# (element, metric): the exact value, which ours must be, and why the reference is off by 1.3e-8.
KNOWN = {
    ("hex.ideal_mm_rotated", "icem.skew"): (
        1.0,
        "an arc cosine of 1 - 2e-16, which turns an angle of 0 into 1.2e-6 degrees",
    ),
    ("hex.twisted_90", "icem.skew"): (1.0, "an arc cosine of 1 - 2e-16, which turns an angle of 0 into 1.2e-6 degrees"),
}


def one_cell(type_name, points):
    points = np.asarray(points, dtype=float)
    return Mesh(points, (CellBlock(type_name, [0], np.arange(len(points))[None]),))


def values_of(type_name, points, metrics=tuple(METRICS)):
    measured = measure(one_cell(type_name, points), metrics, threads=1)
    return {id_: float(by_type[type_name][0]) for id_, by_type in measured.values.items() if type_name in by_type}


def same(id_, got, want):
    both_undefined = math.isnan(want) and math.isnan(got)
    return both_undefined or math.isclose(
        got, want, rel_tol=1e-9, abs_tol=NOISE.get(id_, NOISE.get(METRICS[id_].unit, 0.0))
    )


def test_every_golden_value_is_met_to_nine_digits(shared):
    golden = json.loads((shared / "reference" / "golden.json").read_text())
    wrong, checked = [], 0
    for element in golden["elements"]:
        got = values_of(element["type"], element["points"])
        wanted = {id_: float(value) for id_, value in element["values"].items() if id_ in METRICS}
        assert wanted.keys() <= got.keys(), element["name"]
        for id_ in [id_ for id_ in wanted if (element["name"], id_) in KNOWN]:
            exact, _ = KNOWN[element["name"], id_]
            assert abs(wanted[id_] - exact) < 2e-8
            wanted[id_] = exact
        checked += len(wanted)
        wrong += [
            (element["name"], id_, got[id_], wanted[id_]) for id_ in wanted if not same(id_, got[id_], wanted[id_])
        ]
    assert checked > 1300
    assert wrong == []


ROOT2, ROOT3 = math.sqrt(2), math.sqrt(3)
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
CORNER_TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
REGULAR_TET = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)][::-1]


def box(a, b, c):
    return [(0, 0, 0), (a, 0, 0), (a, b, 0), (0, b, 0), (0, 0, c), (a, 0, c), (a, b, c), (0, b, c)]


SHEARED = [(x + z, y, z) for x, y, z in box(1, 1, 1)]
FRUSTUM = box(1, 1, 1)[:4] + [(0.25, 0.25, 1), (0.75, 0.25, 1), (0.75, 0.75, 1), (0.25, 0.75, 1)]
TWISTED = box(1, 1, 1)[:4] + [(1, 0, 1), (1, 1, 1), (0, 1, 1), (0, 0, 1)]
PYRAMID = [*SQUARE, (0.5, 0.5, 0.5)]

RHOMBUS = [(0, 0, 0), (1, 0, 0), (1.5, ROOT3 / 2, 0), (0.5, ROOT3 / 2, 0)]
COLLAPSED = [(0, 0, 0), (1, 0, 0), (0.5, 1, 0), (0.5, 1, 0)]
SADDLE = [(0, 0, 0.25), (1, 0, -0.25), (1, 1, 0.25), (0, 1, -0.25)]
SIDE = math.sin(math.radians(60)) / math.sin(math.radians(80))
T406080 = [(0, 0, 0), (1, 0, 0), (SIDE * math.cos(math.radians(40)), SIDE * math.sin(math.radians(40)), 0)]

# (what, type, points, metric, value): each value follows from the picture with pencil and paper.
CLOSED_FORMS = [
    ("right isosceles triangle", "tri", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "gambit.aspect_ratio", (1 + ROOT2) / 2),
    ("3-4-5 triangle", "tri", [(0, 0, 0), (3, 0, 0), (0, 4, 0)], "gambit.aspect_ratio", 1.25),
    ("right isosceles triangle", "tri", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "icem.aspect_ratio", 1 / ROOT3),
    ("right isosceles triangle", "tri", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "gambit.equiangle_skew", 0.25),
    ("right isosceles triangle", "tri", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "gambit.equisize_skew", 1 - 4 / (3 * ROOT3)),
    ("collinear triangle", "tri", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], "gambit.aspect_ratio", math.inf),
    ("collinear triangle", "tri", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], "gambit.equisize_skew", 1.0),
    ("2 x 1 rectangle", "quad", [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], "gambit.aspect_ratio", 2.0),
    ("2 x 1 rectangle", "quad", [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], "gambit.stretch", 1 - math.sqrt(2 / 5)),
    ("60 degree rhombus", "quad", RHOMBUS, "gambit.diagonal_ratio", ROOT3),
    ("60 degree rhombus", "quad", RHOMBUS, "gambit.midangle_skew", 0.5),
    ("60 degree rhombus", "quad", RHOMBUS, "icem.aspect_ratio", ROOT3 / 2),
    ("trapezoid 2 / 1 / height 1", "quad", [(0, 0, 0), (2, 0, 0), (1.5, 1, 0), (0.5, 1, 0)], "gambit.taper", 1 / 3),
    ("trapezoid 2 / 1 / height 1", "quad", [(0, 0, 0), (2, 0, 0), (1.5, 1, 0), (0.5, 1, 0)], "icem.determinant", 0.5),
    ("saddle of height 1/4", "quad", SADDLE, "gambit.warpage", 0.25),
    ("quad collapsed to a triangle", "quad", COLLAPSED, "gambit.equiangle_skew", 1.0),
    ("concave dart", "quad", [(0, 0, 0), (1, 1, 0), (2, 0, 0), (1, 3, 0)], "angle.max", 270.0),
    ("regular tet", "tet", REGULAR_TET, "gambit.aspect_ratio", 1.0),
    ("corner of a cube", "tet", CORNER_TET, "gambit.aspect_ratio", ROOT3 * (3 + ROOT3) / 6),
    ("corner of a cube", "tet", CORNER_TET, "icem.aspect_ratio", 0.5),
    ("corner of a cube", "tet", CORNER_TET, "gambit.equisize_skew", 0.5),
    ("corner of a cube", "tet", CORNER_TET, "volume", 1 / 6),
    ("mirrored corner of a cube", "tet", [CORNER_TET[i] for i in (0, 2, 1, 3)], "volume", -1 / 6),
    ("mirrored corner of a cube", "tet", [CORNER_TET[i] for i in (0, 2, 1, 3)], "icem.aspect_ratio", -0.5),
    ("pyramid, a sixth of a cube", "pyramid", PYRAMID, "volume", 1 / 6),
    ("right prism", "wedge", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2), (1, 0, 2), (0, 1, 2)], "volume", 1.0),
    ("1 x 2 x 4 box", "hex", box(1, 2, 4), "gambit.aspect_ratio", 4.0),
    ("1 x 2 x 4 box", "hex", box(1, 2, 4), "gambit.stretch", 1 - ROOT3 / math.sqrt(21)),
    ("1 x 2 x 4 box", "hex", box(1, 2, 4), "gambit.diagonal_ratio", 1.0),
    ("cube sheared by 45 degrees", "hex", SHEARED, "gambit.midangle_skew", 1 / ROOT2),
    ("cube sheared by 45 degrees", "hex", SHEARED, "gambit.equiangle_skew", 0.5),
    ("frustum with half the top", "hex", FRUSTUM, "volume", 7 / 12),
    ("frustum with half the top", "hex", FRUSTUM, "gambit.taper", 1 / 3),
    ("frustum with half the top", "hex", FRUSTUM, "icem.determinant", 0.25),
    ("cube twisted by 90 degrees", "hex", TWISTED, "icem.determinant", 1.0),
    ("cube twisted by 90 degrees", "hex", TWISTED, "icem.determinant_3x3x3", 0.5),
    ("cube upside down", "hex", box(1, 1, -1), "icem.determinant", -1.0),
    ("cube upside down", "hex", box(1, 1, -1), "gambit.equiangle_skew", 0.0),
    ("40-60-80 triangle", "tri", T406080, "seed.internal_angle_deviation", 20.0),
]  # fmt: skip


@pytest.mark.parametrize(
    ("what", "type_name", "points", "metric", "value"), CLOSED_FORMS, ids=lambda v: v if isinstance(v, str) else ""
)
def test_closed_forms(what, type_name, points, metric, value):
    assert values_of(type_name, points, [metric])[metric] == pytest.approx(value, rel=1e-12, abs=1e-12), what


@pytest.mark.parametrize("type_name", ["tri", "quad", "tet", "pyramid", "wedge", "hex"])
def test_a_cell_with_a_non_finite_corner_has_no_number_at_all(type_name):
    points = np.array({"tri": CORNER_TET[:3], "quad": SQUARE, "tet": CORNER_TET, "pyramid": PYRAMID,
                       "wedge": CORNER_TET + PYRAMID[:2], "hex": box(1, 1, 1)}[type_name], dtype=float)  # fmt: skip
    for bad in (math.nan, math.inf, -math.inf):
        broken = points.copy()
        broken[-1, 1] = bad
        assert all(math.isnan(value) for value in values_of(type_name, broken).values())


def test_cells_of_any_size_from_1e_minus_100_to_1e_plus_100_score_the_same():
    rng = np.random.default_rng(7)
    cell = np.array(box(1, 1, 1), dtype=float) + rng.uniform(-0.2, 0.2, (8, 3))
    here = values_of("hex", cell)
    for exponent in (-300, -100, 100, 300):
        there = values_of("hex", cell * 2.0**exponent)
        for id_, value in here.items():
            power = {"L": 1, "L2": 2, "L3": 3}.get(METRICS[id_].unit, 0)
            assert there[id_] == value * 2.0 ** (power * exponent) if abs(power * exponent) < 1000 else True


def test_the_table_of_parameters_and_types_is_the_article_s():
    from meshwright.audit.metrics import APPLICABILITY

    article = """
        Area            y y x x x x
        Aspect Ratio    y y y y y y
        Diagonal Ratio  y x y x x x
        Edge Ratio      y y y y y y
        Equi-Angle Skew y y y y y y
        Equi-Size Skew  x y x y x x
        Mid-Angle Skew  y x y x x x
        Stretch         y x y x x x
        Taper           y x y x x x
        Volume          x x y y y y
        Warpage         y x y x x x
    """
    wanted = {}
    for line in article.strip().splitlines():
        words = line.split()
        defined = [word == "y" for word in words[-6:]]
        columns = ("quad", "tri", "hex", "tet", "pyramid", "wedge")
        wanted[" ".join(words[:-6])] = dict(zip(columns, defined, strict=True))
    assert {title: row for title, _, row in APPLICABILITY} == wanted


def test_a_metric_is_absent_where_it_is_not_defined():
    tet = values_of("tet", CORNER_TET)
    assert "area" not in tet
    assert "gambit.warpage" not in tet
    assert "gambit.equisize_skew" in tet
