"""The checks of FEA systems: closed forms and ugly cells."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import ansys, gauss, hypermesh, shells, structural, tets

ROWS = tuple(row for family in (ansys, hypermesh, gauss, shells, tets, structural) for row in family.ROWS)
IDS = (*(row.id for row in ROWS), "icem.max_warp")  # HyperMesh and ANSYS share ICEM's warp
ROOT2, ROOT3 = math.sqrt(2), math.sqrt(3)


def measured(type_name, cells, ids=IDS):
    cells = np.asarray(cells, dtype=float)
    cells = cells.reshape(-1, *cells.shape[-2:])
    nodes = np.arange(cells.shape[0] * cells.shape[1]).reshape(cells.shape[:2])
    mesh = Mesh(cells.reshape(-1, 3), (CellBlock(type_name, np.arange(len(nodes)), nodes),))
    values = measure(mesh, ids, threads=1).values
    return {id_: by_type[type_name] for id_, by_type in values.items() if type_name in by_type}


def value(type_name, points, id_):
    return float(measured(type_name, points, (id_,))[id_][0])


def box(a, b, c):
    return [(0, 0, 0), (a, 0, 0), (a, b, 0), (0, b, 0), (0, 0, c), (a, 0, c), (a, b, c), (0, b, c)]


SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
TRAPEZOID = [(0, 0, 0), (2, 0, 0), (1.5, 1, 0), (0.5, 1, 0)]
RHOMBUS = [(0, 0, 0), (1, 0, 0), (1.5, ROOT3 / 2, 0), (0.5, ROOT3 / 2, 0)]
SADDLE = [(0, 0, 0.25), (1, 0, -0.25), (1, 1, 0.25), (0, 1, -0.25)]
LIFTED = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0)]
COLLAPSED = [(0, 0, 0), (1, 0, 0), (0.5, 1, 0), (0.5, 1, 0)]
T345 = [(0, 0, 0), (4, 0, 0), (0, 3, 0)]
EQUILATERAL = [(0, 0, 0), (1, 0, 0), (0.5, ROOT3 / 2, 0)]
CORNER_TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
REGULAR_TET = [(1, 1, 1), (-1, 1, -1), (1, -1, -1), (-1, -1, 1)]
PYRAMID = [*SQUARE, (0.5, 0.5, ROOT2 / 2)]
WEDGE = [*EQUILATERAL, *((x, y, 1) for x, y, _ in EQUILATERAL)]
HALF_BOX = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2), (1, 0, 2), (0, 1, 2)]
FRUSTUM = box(1, 1, 1)[:4] + [(0.25, 0.25, 1), (0.75, 0.25, 1), (0.75, 0.75, 1), (0.25, 0.75, 1)]
PUSHED_IN = [*box(1, 1, 1)[:6], (0.2, 0.2, 0.2), (0, 1, 1)]
# bottom sheared one way by 45 degrees, top the other way
SCISSORS = [(0, 0, 0), (1, 0, 0), (2, 1, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (-1, 1, 1)]
BENT = [
    (x / 2 + y * z / 4, y / 2 + x * z / 4, z / 2 + x * y / 4)
    for z in (-1, 1)
    for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
]
SHAPES = {
    "tri": EQUILATERAL,
    "quad": SQUARE,
    "tet": REGULAR_TET,
    "pyramid": PYRAMID,
    "wedge": WEDGE,
    "hex": box(1, 1, 1),
}

CLOSED_FORMS = [
    # 4 A / sum of squared edges: 4 x 2 / (4 + 1 + 4 + 1)
    ("2 x 1 rectangle", "quad", [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], "ansys.element_quality", 0.8),
    # height 1: V = 1/3, sum of squares 4 + 4 x 1.5 = 10, 96 / (3 x 10 sqrt(10)): above 1
    ("pyramid of height 1", "pyramid", [*SQUARE, (0.5, 0.5, 1)], "ansys.element_quality", 32 / (10 * math.sqrt(10))),
    # the longest rectangle of the right isosceles triangle: median^2 / area = 1.25 / 0.5, over sqrt(3)
    ("right isosceles", "tri", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "ansys.aspect_ratio_faces", 2.5 / ROOT3),
    # mid-lines 1 and 1 at 60 degrees: 1 / sin 60
    ("60 degree rhombus", "quad", RHOMBUS, "ansys.aspect_ratio_faces", 2 / ROOT3),
    # an edge 1 and a point sqrt(1/2) away: area sqrt(1/8), longest median^2 (2 x 2.5 - 3 x 0.75) / 4 = 11/16
    ("regular tet", "tet", REGULAR_TET, "ansys.aspect_ratio", 11 / 16 * math.sqrt(8) / ROOT3),
    # sections are as the faces: 1 x 4 is the worst
    ("1 x 2 x 4 box", "hex", box(1, 2, 4), "ansys.aspect_ratio", 4.0),
    # the middle triangle is equilateral; sections at right angles to it are 1/2 wide and 1 high
    ("right prism", "wedge", WEDGE, "ansys.aspect_ratio_faces", 1.0),
    ("right prism", "wedge", WEDGE, "ansys.aspect_ratio", 2.0),
    ("pyramid of equal edges", "pyramid", PYRAMID, "ansys.aspect_ratio_faces", 1.0),
    # a base edge 1 and the middle (3/4, 3/4, sqrt(1/8)) of an opposite edge: squared sides 1, 3/4, 5/4, area
    # sqrt(11/64), longest median^2 (2 x 3 - 3 x 3/4) / 4 = 15/16
    ("pyramid of equal edges", "pyramid", PYRAMID, "ansys.aspect_ratio", 15 / 16 / math.sqrt(11 / 64) / ROOT3),
    # legs at atan(1/2) to the vertical on both sides
    ("trapezoid", "quad", TRAPEZOID, "ansys.parallel_deviation_faces", 2 * math.degrees(math.atan(0.5))),
    # edges of the bottom and the top differ by 45 + 45 degrees where they cross
    ("scissors", "hex", SCISSORS, "ansys.parallel_deviation_faces", 90.0),
    ("box", "hex", box(1, 2, 4), "ansys.parallel_deviation", 0.0),
    ("right prism", "wedge", WEDGE, "ansys.parallel_deviation", 0.0),
    # (r + s t/2, s + r t/2, t + r s/2) / 2: opposite edges are (1, -+1/2, 1/2) of a face, (1, -+1/2, 0) of a section
    ("hex bent in three ways", "hex", BENT, "ansys.parallel_deviation_faces", 2 * math.degrees(math.atan(5**-0.5))),
    ("hex bent in three ways", "hex", BENT, "ansys.parallel_deviation", 2 * math.degrees(math.atan(0.5))),
    # J = 2 at the long side, 1 at the short one
    ("trapezoid", "quad", TRAPEZOID, "ansys.jacobian_ratio", 2.0),
    # J = 1 below, 1/2 x 1/2 x 1 above
    ("frustum with half the top", "hex", FRUSTUM, "ansys.jacobian_ratio", 4.0),
    ("cube upside down", "hex", box(1, 1, -1), "ansys.jacobian_ratio", 1.0),
    ("cube with a corner pushed in", "hex", PUSHED_IN, "ansys.jacobian_ratio", math.inf),
    # ends of an edge at +1/4 and -1/4, area 1
    ("saddle of height 1/4", "quad", SADDLE, "ansys.warping_factor", 0.5),
    ("frustum with half the top", "hex", FRUSTUM, "hm.aspect", 1.5 * ROOT2),
    ("flat triangle of equal halves", "tri", [(0, 0, 0), (1, 0, 0), (0.5, 0, 0)], "hm.aspect", 2.0),
    # (longest^2 - shortest^2) / (4 A) = (25 - 9) / 24
    ("3-4-5 triangle", "tri", T345, "hm.skew", math.degrees(math.atan(2 / 3))),
    ("60 degree rhombus", "quad", RHOMBUS, "hm.skew", 30.0),
    # normals (1/2, 1/2, 1) and (-1/2, -1/2, 1): cosine 1/2 / 3/2
    ("saddle of height 1/4", "quad", SADDLE, "icem.max_warp", math.degrees(math.acos(1 / 3))),
    # cut from 1 to 3 the normals are (0, 0, 1) and (-1/2, -1/2, 1); from 0 to 2 (0, -1/2, 1) and (-1/2, 0, 1)
    ("one corner lifted by 1/2", "quad", LIFTED, "icem.max_warp", math.degrees(math.acos(0.8))),
    # J runs from 2 to 1 across the height: 3/2 -+ 1/2 / sqrt(3)
    ("trapezoid", "quad", TRAPEZOID, "hm.jacobian_gauss", (3 * ROOT3 - 1) / (3 * ROOT3 + 1)),
    # J = width^2 = (3/4 -+ 1/4 / sqrt(3))^2
    ("frustum with half the top", "hex", FRUSTUM, "hm.jacobian_gauss", ((3 * ROOT3 - 1) / (3 * ROOT3 + 1)) ** 2),
    ("frustum with half the top", "hex", FRUSTUM, "volume_gauss2", 7 / 12),
    # area 6, longest edge 5
    ("3-4-5 triangle", "tri", T345, "hm.min_height", 2.4),
    # corner triangles 1 below, 1/2 above, half the area 3/4
    ("trapezoid", "quad", TRAPEZOID, "hm.taper", 1 / 3),
    ("trapezoid", "quad", TRAPEZOID, "nastran.taper", 4 / 3),
    ("trapezoid", "quad", TRAPEZOID, "femap.alternate_taper", 1 / 3),
    # diagonals 1/2 apart at the centre, edges sqrt(1 + 1/4)
    ("saddle of height 1/4", "quad", SADDLE, "hm.warpage_alt", 50 / math.sqrt(1.25)),
    # corners 1/4 off the plane, diagonals sqrt(2)
    ("saddle of height 1/4", "quad", SADDLE, "nastran.warp", 2 * 0.25 / (2 * ROOT2)),
    # corners 1/4 off the plane, half edges sqrt(1.25) / 2
    ("saddle of height 1/4", "quad", SADDLE, "salome.warp", math.degrees(math.asin(0.5 / math.sqrt(1.25)))),
    ("60 degree rhombus", "quad", RHOMBUS, "nastran.skew", 60.0),
    ("3-4-5 triangle", "tri", T345, "nastran.skew", math.degrees(math.atan(3 / 4))),
    # sqrt(3)/2 x 5 / 2.4
    ("3-4-5 triangle", "tri", T345, "patran.aspect_ratio", ROOT3 / 2 * 5 / 2.4),
    # inscribed circle of radius 1
    ("3-4-5 triangle", "tri", T345, "ideas.stretch", math.sqrt(12) / 5),
    ("2 x 1 rectangle", "quad", [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], "ideas.stretch", math.sqrt(2 / 5)),
    ("60 degree rhombus", "quad", RHOMBUS, "seed.quad_diag_ratio_0_1", 1 / ROOT3),
    # heights 1, 1, 1 and 1/sqrt(3); longest edge sqrt(2)
    ("corner of a cube", "tet", CORNER_TET, "femap.tet_collapse", ROOT3),
    ("corner of a cube", "tet", CORNER_TET, "nastran.tetraar", math.sqrt(6)),
    ("corner of a cube", "tet", CORNER_TET, "simlab.collapse_ratio", 1 / math.sqrt(6)),
    # height 1/sqrt(3) over the face of area sqrt(3)/2
    ("corner of a cube", "tet", CORNER_TET, "hm.tet_collapse", 1 / ROOT3 / math.sqrt(ROOT3 / 2) / 1.24),
    # r = 3 x 1/6 / (3/2 + sqrt(3)/2) = (3 - sqrt(3)) / 6
    ("corner of a cube", "tet", CORNER_TET, "simlab.tet_stretch", ROOT3 - 1),
    ("regular tet", "tet", REGULAR_TET, "simlab.tet_stretch", 1.0),
    # faces meet at acos(1/3); at the corner of a cube at 90 and at acos(1/sqrt(3))
    ("regular tet", "tet", REGULAR_TET, "optistruct.edge_angle", 90 - math.degrees(math.acos(1 / 3))),
    ("corner of a cube", "tet", CORNER_TET, "optistruct.edge_angle", 90 - math.degrees(math.acos(1 / ROOT3))),
    ("trapezoid", "quad", TRAPEZOID, "femap.taper", 2.0),
    ("frustum with half the top", "hex", FRUSTUM, "femap.taper", 2.0),
    # 8 over the face of 2 x 4
    ("1 x 2 x 4 box", "hex", box(1, 2, 4), "femap.explicit", 1.0),
    # a third of the height on the largest face
    ("corner of a cube", "tet", CORNER_TET, "femap.explicit", 1 / (3 * ROOT3)),
    ("3-4-5 triangle", "tri", T345, "femap.explicit", 6 / 5),
    # edges 1, 1, sqrt(2) at both ends
    ("half of a 1 x 1 x 2 box", "wedge", HALF_BOX, "pointwise.prism_aspect", 6 / (2 + ROOT2)),
    ("pyramid with the apex below", "pyramid", [*SQUARE, (0.5, 0.5, -0.5)], "pointwise.pyramid_aspect", -0.5),
]  # fmt: skip


@pytest.mark.parametrize(
    ("what", "type_name", "points", "id_", "wanted"), CLOSED_FORMS, ids=lambda v: v if isinstance(v, str) else ""
)
def test_closed_forms(what, type_name, points, id_, wanted):
    assert value(type_name, points, id_) == pytest.approx(wanted, rel=1e-12, abs=1e-12), what


def test_every_check_has_a_closed_form_or_a_golden_value():
    golden_only = {"ansys.max_corner_angle"}
    assert {id_ for _, _, _, id_, _ in CLOSED_FORMS} | golden_only == set(IDS)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.id)
def test_a_perfect_cell_scores_the_ideal(row):
    for type_name in row.on:
        got = value(type_name, SHAPES[type_name], row.id)
        if row.ideal is not None:
            assert got == pytest.approx(row.ideal, rel=2e-9, abs=1e-12), type_name  # constants of 8 digits
        assert row.low - 1e-9 <= got <= row.high + 1e-9, type_name


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.id)
def test_a_cell_that_is_a_point_scores_the_degenerate_value(row):
    for type_name in row.on:
        corners = [(1, 2, 3)] * CELL_TYPES[type_name].n_nodes
        assert value(type_name, corners, row.id) == pytest.approx(row.degenerate, nan_ok=True), type_name


FLAT_TET = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
LINE_QUAD = [(0, 0, 0), (1, 0, 0), (1, 0, 0), (0, 0, 0)]
BOWTIE = [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)]
TWO_CORNERS = [(0, 0, 0), (1, 0, 0), (1, 0, 0)]
HEX_AS_WEDGE = [*box(1, 1, 1)[:6], (1, 1, 0), (0, 1, 0)]
HEX_AS_PYRAMID = [*SQUARE, *[(0.5, 0.5, 1)] * 4]

UGLY = [
    (
        "tet of four points of a square",
        "tet",
        FLAT_TET,
        {
            "ansys.element_quality": 0.0,
            "femap.tet_collapse": math.inf,
            "nastran.tetraar": math.inf,
            "hm.tet_collapse": 0.0,
            "simlab.collapse_ratio": 0.0,
            "simlab.tet_stretch": 0.0,
            "femap.explicit": 0.0,
            "optistruct.edge_angle": 90.0,
            # two edges cross in the middle: their sections are lines
            "ansys.aspect_ratio": math.inf,
        },
    ),
    (
        "hex flattened to a square",
        "hex",
        box(1, 1, 0),
        {
            "ansys.element_quality": 0.0,
            "ansys.aspect_ratio_faces": math.nan,
            "ansys.aspect_ratio": math.inf,
            "hm.skew": math.nan,
            "ansys.parallel_deviation_faces": math.nan,
            "ansys.parallel_deviation": math.nan,
            "ansys.jacobian_ratio": math.inf,
            "hm.aspect": math.inf,
            "icem.max_warp": math.nan,
            "hm.jacobian_gauss": 0.0,
            "volume_gauss2": 0.0,
            "femap.taper": math.inf,
            "femap.explicit": 0.0,
        },
    ),
    (
        "hex collapsed to a pyramid",
        "hex",
        HEX_AS_PYRAMID,
        {
            # the faces that are triangles: mid-lines 1/2 and sqrt(1.25) at right angles
            "ansys.parallel_deviation_faces": math.nan,
            "icem.max_warp": math.nan,
            "hm.aspect": math.inf,
            "femap.taper": math.inf,
            "ansys.jacobian_ratio": math.inf,
            "hm.skew": 0.0,
            "volume_gauss2": 1 / 3,
        },
    ),
    (
        "hex collapsed to a wedge",
        "hex",
        HEX_AS_WEDGE,
        {
            # a triangle as a quadrilateral: mid-lines 1/2 and sqrt(1.25), area 1/2; the edge face is left out
            "ansys.aspect_ratio_faces": 2.5,
            "ansys.parallel_deviation_faces": math.nan,
            "hm.skew": math.degrees(math.atan(0.5)),
        },
    ),
    (
        "quadrilateral folded onto a line",
        "quad",
        LINE_QUAD,
        {
            "ansys.aspect_ratio_faces": math.inf,
            "ansys.parallel_deviation_faces": 0.0,
            "hm.skew": math.nan,
            "hm.taper": math.nan,
            "nastran.taper": math.nan,
            "nastran.skew": math.nan,
            "femap.alternate_taper": math.nan,
            "nastran.warp": math.nan,
            "salome.warp": math.nan,
            "hm.warpage_alt": math.nan,
            "ansys.warping_factor": math.nan,
            "hm.jacobian_gauss": 0.0,
            "ansys.jacobian_ratio": math.inf,
            "ideas.stretch": 0.0,
            "seed.quad_diag_ratio_0_1": 1.0,
            "femap.explicit": 0.0,
        },
    ),
    (
        "quadrilateral collapsed to a triangle",
        "quad",
        COLLAPSED,
        {
            "ansys.aspect_ratio_faces": 2.0,
            "ansys.parallel_deviation_faces": math.nan,
            "hm.taper": 1.0,
            "nastran.taper": 2.0,
            "salome.warp": math.nan,
            "nastran.warp": 0.0,
            "hm.skew": 0.0,
            "nastran.skew": 90.0,
            "icem.max_warp": math.nan,
            "femap.taper": math.inf,
        },
    ),
    (
        "bow tie",
        "quad",
        BOWTIE,
        {
            "ansys.aspect_ratio_faces": math.inf,
            "hm.skew": math.nan,
            "hm.taper": math.nan,
            "ansys.parallel_deviation_faces": 180.0,
            "icem.max_warp": 180.0,
            "ansys.jacobian_ratio": math.inf,
        },
    ),
    (
        "triangle with two corners in one place",
        "tri",
        TWO_CORNERS,
        {
            "ansys.element_quality": 0.0,
            "ansys.aspect_ratio_faces": math.inf,
            "hm.aspect": math.inf,
            "hm.skew": math.nan,
            "hm.min_height": 0.0,
            "patran.aspect_ratio": math.inf,
            "ideas.stretch": 0.0,
            "nastran.skew": math.nan,
        },
    ),
    (
        "triangle of three points on a line",
        "tri",
        [(0, 0, 0), (3, 0, 0), (1, 0, 0)],
        {
            "hm.skew": 90.0,
            "ansys.aspect_ratio_faces": math.inf,
            "patran.aspect_ratio": math.inf,
            "ideas.stretch": 0.0,
            "hm.aspect": 3.0,
            "nastran.skew": 0.0,
        },
    ),
    (
        "prism without height",
        "wedge",
        [*EQUILATERAL, *EQUILATERAL],
        {
            "ansys.element_quality": 0.0,
            "ansys.aspect_ratio_faces": math.inf,
            "ansys.parallel_deviation_faces": 0.0,
            "hm.skew": 0.0,
            "pointwise.prism_aspect": 0.0,
            "ansys.aspect_ratio": math.inf,
            "femap.explicit": 0.0,
        },
    ),
    (
        "pyramid without height",
        "pyramid",
        [*SQUARE, (0.5, 0.5, 0)],
        {
            "ansys.element_quality": 0.0,
            "pointwise.pyramid_aspect": 0.0,
            "ansys.jacobian_ratio": math.inf,
            "femap.explicit": 0.0,
        },
    ),
]


@pytest.mark.parametrize(("what", "type_name", "points", "wanted"), UGLY, ids=[case[0] for case in UGLY])
def test_ugly_cells_have_the_value_that_says_so(what, type_name, points, wanted):
    got = measured(type_name, points, tuple(wanted))
    assert {id_: float(v[0]) for id_, v in got.items()} == pytest.approx(wanted, rel=1e-9, abs=1e-9, nan_ok=True)


def test_flat_cells_are_flat_in_any_position():
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    for type_name, points, wanted in (
        ("tet", FLAT_TET, {"nastran.tetraar": math.inf, "hm.tet_collapse": 0.0, "ansys.element_quality": 0.0}),
        ("tri", [(0, 0, 0), (3, 0, 0), (1, 0, 0)], {"ansys.aspect_ratio_faces": math.inf, "hm.min_height": 0.0}),
        ("quad", [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)], {"ansys.aspect_ratio_faces": math.inf}),
        ("quad", [(0, 0, 0), (1, 0, 0), (0.5, 0.5, 0), (0, 1, 0)], {"icem.max_warp": math.nan, "hm.taper": 1.0}),
    ):
        moved = 0.001 * np.array(points, float) @ turn.T
        got = {id_: float(v[0]) for id_, v in measured(type_name, moved, tuple(wanted)).items()}
        assert got == pytest.approx(wanted, rel=1e-9, abs=1e-9, nan_ok=True), type_name


def test_a_mirrored_cell_keeps_every_unsigned_number():
    signed = {"ansys.element_quality", "hm.jacobian_gauss", "volume_gauss2", "pointwise.pyramid_aspect"}
    rng = np.random.default_rng(5)
    for type_name, shape in SHAPES.items():
        cells = np.array(shape, float) + rng.uniform(-0.15, 0.15, (20, len(shape), 3))
        here, there = measured(type_name, cells), measured(type_name, cells * [1, 1, -1])
        for id_, values in here.items():
            if id_ not in signed:
                np.testing.assert_allclose(there[id_], values, rtol=1e-9, atol=1e-9, err_msg=id_)
        assert type_name in ("tri", "quad") or (np.sign(there["ansys.element_quality"]) == -1).all()
