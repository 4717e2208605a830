"""ICEM CFD's criteria: closed forms, broken cells, and quality as the smallest of its parts."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.metrics.icem import LEFT_OUT

_GOLDEN = runpy.run_path(str(Path(__file__).with_name("test_golden.py")))
values_of, box = _GOLDEN["values_of"], _GOLDEN["box"]

ROOT2, ROOT3 = math.sqrt(2), math.sqrt(3)
CORNER = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
REGULAR = [(1, 1, 1), (-1, 1, -1), (1, -1, -1), (-1, -1, 1)]
MIRRORED = [CORNER[i] for i in (0, 2, 1, 3)]
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
FLAT_TET = SQUARE
TRIANGLE = [(0, 0, 0), (1, 0, 0), (0.5, ROOT3 / 2, 0)]
RIGHT = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
RIGHT_345 = [(0, 0, 0), (4, 0, 0), (0, 3, 0)]
COLLINEAR = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
RHOMBUS = [(0, 0, 0), (1, 0, 0), (1.5, ROOT3 / 2, 0), (0.5, ROOT3 / 2, 0)]
TRAPEZOID = [(0, 0, 0), (2, 0, 0), (1.5, 1, 0), (0.5, 1, 0)]
SADDLE = [(0, 0, 0.25), (1, 0, -0.25), (1, 1, 0.25), (0, 1, -0.25)]
ONE_UP = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0)]
DART = [(0, 0, 0), (1, 1, 0), (2, 0, 0), (1, 3, 0)]
BOW_TIE = [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)]
CORNER_ON_A_LINE = [(0, 0, 0), (1, 0, 0), (0.5, 0.5, 0), (0, 1, 0)]
SHEARED = [(x + z, y, z) for x, y, z in box(1, 1, 1)]
FRUSTUM = [*SQUARE, (0.25, 0.25, 1), (0.75, 0.25, 1), (0.75, 0.75, 1), (0.25, 0.75, 1)]
TWISTED = [*SQUARE, (1, 0, 1), (1, 1, 1), (0, 1, 1), (0, 0, 1)]
POINTED = [*SQUARE, *[(0.5, 0.5, 1)] * 4]
DART_PRISM = [*DART, *((x, y, z + 1) for x, y, z in DART)]
WEDGE = [*TRIANGLE, *((x, y, z + 1) for x, y, z in TRIANGLE)]

# (what and why, type, points, metric, value)
CLOSED_FORMS = [
    ("equilateral", "tri", TRIANGLE, "icem.skew", 1.0),
    # R = sqrt 2/2, the equilateral in that circle has 3 sqrt 3/4 R^2 = 3 sqrt 3/8, the triangle 1/2
    ("right isosceles", "tri", RIGHT, "icem.skew", 4 / (3 * ROOT3)),
    ("3-4-5: A = 6, R = 5/2", "tri", RIGHT_345, "icem.skew", 6 / (3 * ROOT3 / 4 * 6.25)),
    ("collinear", "tri", COLLINEAR, "icem.skew", 0.0),
    ("square", "quad", SQUARE, "icem.skew", 1.0),
    ("rhombus of 60 degrees: 60/90", "quad", RHOMBUS, "icem.skew", 2 / 3),
    ("trapezoid: its mid-lines are at right angles", "quad", TRAPEZOID, "icem.skew", 1.0),
    ("bow tie: one mid-line has no length", "quad", BOW_TIE, "icem.skew", math.nan),
    ("cube", "hex", box(1, 1, 1), "icem.skew", 1.0),
    ("cube sheared by 45 degrees: 1 - 45/90", "hex", SHEARED, "icem.skew", 0.5),
    ("mirrored cube: 1 - 180/90", "hex", box(1, 1, -1), "icem.skew", -1.0),
    ("cube without height", "hex", box(1, 1, 0), "icem.skew", 0.0),
    ("square", "quad", SQUARE, "icem.max_warp", 0.0),
    # normals of either pair of triangles are (-+1/2, -+1/2, 1)-like: cos = 1/3
    ("saddle of 1/4", "quad", SADDLE, "icem.max_warp", math.degrees(math.acos(1 / 3))),
    # cut from 0 to 2: normals (0, -1/2, 1) and (-1/2, 0, 1), cos = 1/1.25; the other cut gives acos sqrt(2/3) = 35.26
    ("one corner of a square up by 1/2", "quad", ONE_UP, "icem.max_warp", math.degrees(math.acos(0.8))),
    ("dart: one cut turns a triangle over", "quad", DART, "icem.max_warp", 180.0),
    ("bow tie", "quad", BOW_TIE, "icem.max_warp", 180.0),
    ("quad with three corners on a line", "quad", CORNER_ON_A_LINE, "icem.max_warp", math.nan),
    ("pyramid on a square", "pyramid", [*SQUARE, (0.5, 0.5, 1)], "icem.max_warp", 0.0),
    ("pyramid on a saddle", "pyramid", [*SADDLE, (0.5, 0.5, 1)], "icem.max_warp", math.degrees(math.acos(1 / 3))),
    # a side has the corners (0,0,0), (1,0,0), (1,1,1), (1,0,1): cut from the first to the third, its triangles have the
    # normals (0,-1,1) and (1,0,-1), cos = -1/2
    ("cube twisted by 90 degrees", "hex", TWISTED, "icem.max_warp", 120.0),
    ("square", "quad", SQUARE, "icem.angle", 90.0),
    ("rhombus: 60 and 120 degrees", "quad", RHOMBUS, "icem.angle", 60.0),
    ("trapezoid: atan 2 and 180 - atan 2", "quad", TRAPEZOID, "icem.angle", math.degrees(math.atan(2))),
    ("dart: 270 degrees are 180 off", "quad", DART, "icem.angle", -90.0),
    ("mirrored cube: angles know no side", "hex", box(1, 1, -1), "icem.angle", 90.0),
    ("regular tet", "tet", REGULAR, "icem.tetra_special", math.sqrt(1.5)),
    # edge sqrt 2 over the height 1/sqrt 3 above the slanted face
    ("corner of a cube", "tet", CORNER, "icem.tetra_special", math.sqrt(6)),
    ("mirrored corner of a cube", "tet", MIRRORED, "icem.tetra_special", math.sqrt(6)),
    ("flat tet", "tet", FLAT_TET, "icem.tetra_special", math.inf),
    ("box", "hex", box(1, 2, 4), "icem.opp_face_area_ratio", 1.0),
    ("frustum: 1 below, 1/4 above", "hex", FRUSTUM, "icem.opp_face_area_ratio", 4.0),
    ("hex with a top of a single point", "hex", POINTED, "icem.opp_face_area_ratio", math.inf),
    ("cube without height: two sides of no area each", "hex", box(1, 1, 0), "icem.opp_face_area_ratio", math.nan),
    ("box", "hex", box(1, 2, 4), "icem.opp_face_parallelism", 1.0),
    # the sides have the normals (+-1, 0, 1/4): -n1.n2 = (1 - 1/16)/(1 + 1/16)
    ("frustum", "hex", FRUSTUM, "icem.opp_face_parallelism", 15 / 17),
    ("hex with a top of a single point", "hex", POINTED, "icem.opp_face_parallelism", 0.0),
    ("3-4-5: r = 1, R = 5/2", "tri", RIGHT_345, "icem.r_over_R_x2", 0.8),
    ("collinear", "tri", COLLINEAR, "icem.r_over_R_x2", 0.0),
    ("two corners in one", "tri", [(0, 0, 0), (1, 0, 0), (1, 0, 0)], "icem.r_over_R_x2", 0.0),
    # r = 1/(3 + sqrt 3), R = sqrt 3/2: 6/(3 sqrt 3 + 3) = sqrt 3 - 1
    ("corner of a cube", "tet", CORNER, "icem.r_over_R_x3", ROOT3 - 1),
    ("mirrored corner of a cube", "tet", MIRRORED, "icem.r_over_R_x3", 1 - ROOT3),
    ("flat tet", "tet", FLAT_TET, "icem.r_over_R_x3", 0.0),
    ("right isosceles: 4A/(sqrt 3 Lmax^2)", "tri", RIGHT, "icem.quality", 1 / ROOT3),
    ("corner of a cube: V/R^3", "tet", CORNER, "icem.quality", 0.5),
    ("mirrored corner of a cube", "tet", MIRRORED, "icem.quality", -0.5),
    ("trapezoid: J 1 and 2", "quad", TRAPEZOID, "icem.quality", 0.5),
    ("pyramid, a sixth of a cube: four equal corners", "pyramid", [*SQUARE, (0.5, 0.5, 0.5)], "icem.quality", 1.0),
    ("regular wedge", "wedge", WEDGE, "icem.quality", 1.0),
    ("cube sheared by 45 degrees: 1 - 45/90", "hex", SHEARED, "icem.quality", 0.5),
    ("frustum: determinant 1/4", "hex", FRUSTUM, "icem.quality", 0.25),
    ("cube twisted by 90 degrees: 1 - 120/180", "hex", TWISTED, "icem.quality", 1 / 3),
    ("prism over a dart: 1 - 180/90", "hex", DART_PRISM, "icem.quality", -1.0),
    ("mirrored cube: determinant", "hex", box(1, 1, -1), "icem.quality", -1.0),
    ("hex with a top of a single point", "hex", POINTED, "icem.quality", 0.0),
    ("cube without height", "hex", box(1, 1, 0), "icem.quality", 0.0),
    ("all corners in one point", "hex", [(1, 2, 3)] * 8, "icem.quality", 0.0),
    # height 1/sqrt 2 over the base sqrt 2 is 1/2, against sqrt 3/2
    ("right isosceles", "tri", RIGHT, "icem.quality_premesh", 1 / ROOT3),
    ("regular tet", "tet", REGULAR, "icem.quality_premesh", 1.0),
    # height 1/sqrt 3 over sqrt 2 against sqrt(2/3)
    ("corner of a cube", "tet", CORNER, "icem.quality_premesh", 0.5),
    ("mirrored corner of a cube", "tet", MIRRORED, "icem.quality_premesh", -0.5),
    # height 1/2 over the base with edges of 1, the largest face, against sqrt(2/3)
    (
        "low tet on an equilateral base",
        "tet",
        [*TRIANGLE, (0.5, ROOT3 / 6, 0.5)],
        "icem.quality_premesh",
        0.5 * math.sqrt(1.5),
    ),
    ("flat tet", "tet", FLAT_TET, "icem.quality_premesh", 0.0),
]


@pytest.mark.parametrize(
    ("what", "kind", "points", "metric", "value"), CLOSED_FORMS, ids=[f"{r[3]}-{r[1]}-{r[0]}" for r in CLOSED_FORMS]
)
def test_closed_forms(what, kind, points, metric, value):
    got = values_of(kind, points, [metric])[metric]
    assert got == pytest.approx(value, rel=1e-12, abs=1e-12, nan_ok=True)


def test_a_flat_cell_stays_flat_when_it_is_turned():
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    tet = values_of("tet", np.array(FLAT_TET, float) @ turn.T)
    assert tet["icem.tetra_special"] == math.inf
    assert (tet["icem.r_over_R_x3"], tet["icem.quality"], tet["icem.quality_premesh"]) == (0.0, 0.0, 0.0)
    sheet = values_of("hex", np.array(box(1, 2, 0), float) @ turn.T)
    assert (sheet["icem.skew"], sheet["icem.quality"]) == (0.0, 0.0)
    assert math.isnan(sheet["icem.max_warp"])
    assert math.isnan(sheet["icem.opp_face_area_ratio"])
    assert sheet["icem.opp_face_parallelism"] == 0.0


@pytest.mark.parametrize("tilt", [1e-3, 1e-6, 1e-9])
def test_a_hex_almost_at_right_angles_keeps_the_digits_of_its_skew(tilt):
    sheared = [(x + tilt * z, y, z) for x, y, z in box(1, 1, 1)]
    off = 1.0 - values_of("hex", sheared, ["icem.skew"])["icem.skew"]
    assert off == pytest.approx(math.degrees(math.atan(tilt)) / 90, rel=1e-6)


@pytest.mark.parametrize("rise", [1e-3, 1e-6, 1e-9])
def test_a_quad_almost_in_a_plane_keeps_the_digits_of_its_warp(rise):
    # Cut from 0 to 2: normals (0, -rise, 1) and (-rise, 0, 1), whose product has the length rise sqrt(2 + rise^2).
    cell = [(0, 0, 0), (1, 0, 0), (1, 1, rise), (0, 1, 0)]
    wanted = math.degrees(math.atan2(rise * math.sqrt(2 + rise**2), 1.0))
    assert values_of("quad", cell, ["icem.max_warp"])["icem.max_warp"] == pytest.approx(wanted, rel=1e-9)


def random_block(kind, spread, n=3000):
    shape = {"wedge": np.array(WEDGE), "hex": np.array(box(1, 1, 1), float), "tri": np.array(TRIANGLE)}[kind]
    points = shape + np.random.default_rng(2).uniform(-spread, spread, (n, *shape.shape))
    nodes = np.arange(n * len(shape)).reshape(n, -1)
    return Mesh(points.reshape(-1, 3), (CellBlock(kind, np.arange(n), nodes),))


@pytest.mark.parametrize(("kind", "half_circle"), [("wedge", 90.0), ("hex", 180.0)])
@pytest.mark.parametrize("spread", [0.2, 1.0])
def test_quality_of_hexes_and_wedges_is_the_smallest_of_its_parts(kind, half_circle, spread):
    v = {id_: by[kind] for id_, by in measure(random_block(kind, spread), METRICS).values.items() if kind in by}
    parts = [v["icem.determinant"], 1 - v["icem.max_warp"] / half_circle]
    if kind == "hex":
        parts.append(v["icem.angle"] / 90)
    if spread == 1.0:  # among wild cells each part is the smallest somewhere
        assert len(np.unique(np.argmin(parts, axis=0))) == len(parts)
    np.testing.assert_allclose(v["icem.quality"], np.min(parts, axis=0), rtol=1e-12, atol=1e-12)


def test_the_two_help_books_agree_on_triangles_and_not_on_tets():
    v = measure(random_block("tri", 0.3), ["icem.quality", "icem.quality_premesh"]).values
    np.testing.assert_array_equal(v["icem.quality"]["tri"], v["icem.quality_premesh"]["tri"])
    low = [*TRIANGLE, (0.5, ROOT3 / 6, 0.01)]
    got = values_of("tet", low, ["icem.quality", "icem.quality_premesh"])
    # heights vanish with the height, the volume over the cube of the circumradius with its fourth power
    assert got["icem.quality_premesh"] == pytest.approx(0.01 * math.sqrt(1.5), rel=1e-12)
    assert got["icem.quality"] < 1e-6


def test_names_without_a_published_definition_have_a_reason_and_no_row():
    titles = {row.title.lower() for row in METRICS.values() if row.id.startswith("icem.")}
    for name, reason in LEFT_OUT.items():
        assert len(reason) > 10
        assert name.lower() not in titles
        assert "icem." + name.lower().replace(" ", "_").replace("-", "_") not in METRICS
