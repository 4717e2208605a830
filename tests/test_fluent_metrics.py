"""Fluent's cell metrics: closed forms, broken cells, digits near the ideal."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.metrics import METRICS

_GOLDEN = runpy.run_path(str(Path(__file__).with_name("test_golden.py")))
values_of, box = _GOLDEN["values_of"], _GOLDEN["box"]

AR, SQUISH, ORTHO = "fluent.aspect_ratio", "fluent.cell_squish", "fluent.ortho_cell_face"
ROOT2, ROOT3 = math.sqrt(2), math.sqrt(3)
CORNER = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
REGULAR = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)][::-1]
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
TRIANGLE = [(0, 0, 0), (1, 0, 0), (0.5, ROOT3 / 2, 0)]
WEDGE = [*TRIANGLE, *((x, y, z + 1) for x, y, z in TRIANGLE)]
POINTED = [*SQUARE, *[(0.5, 0.5, 1)] * 4]

CLOSED_FORMS = [
    # half the diagonal over half the side
    ("cube: sqrt 3/2 over 1/2", "hex", box(1, 1, 1), AR, ROOT3),
    ("1 x 2 x 4 box: sqrt 21/2 over 1/2", "hex", box(1, 2, 4), AR, math.sqrt(21)),
    ("mirrored cube: distances know no side", "hex", box(1, 1, -1), AR, ROOT3),
    ("regular tet: R/r", "tet", REGULAR, AR, 3.0),
    # centroid to a corner sqrt(1/3 + 1/4), to a side of the triangle 1/(2 sqrt 3): sqrt 7
    ("regular wedge", "wedge", WEDGE, AR, math.sqrt(7)),
    # centroid at height 1/4: apex 3/4, base 1/4
    ("pyramid of height 1 on the unit square", "pyramid", [*SQUARE, (0.5, 0.5, 1)], AR, 3.0),
    ("cube without height", "hex", box(1, 1, 0), AR, math.inf),
    ("hex with a top of a single point", "hex", POINTED, AR, math.inf),
    ("cube", "hex", box(1, 1, 1), SQUISH, 0.0),
    ("cube sheared by 45 degrees", "hex", [(x + z, y, z) for x, y, z in box(1, 1, 1)], SQUISH, 1 - 1 / ROOT2),
    # centroid (1/4, 1/4, 1/4), face x = 0 with centre (0, 1/3, 1/3): cos = (1/4)/sqrt(1/16 + 2/144) = 3/sqrt 11
    ("corner of a cube", "tet", CORNER, ORTHO, 3 / math.sqrt(11)),
    ("corner of a cube", "tet", CORNER, SQUISH, 1 - 3 / math.sqrt(11)),
    # seen from the centroid at 1/3 the middle of a leg is 1/3 away and 1/6 aside: cos = 2/sqrt 5
    ("right isosceles wedge", "wedge", [(x, y, z) for z in (0, 1) for x, y, _ in CORNER[:3]], ORTHO, 2 / math.sqrt(5)),
    ("mirrored cube", "hex", box(1, 1, -1), SQUISH, 2.0),
    ("mirrored cube", "hex", box(1, 1, -1), ORTHO, -1.0),
    ("cube without height", "hex", box(1, 1, 0), SQUISH, 1.0),
    ("cube without height", "hex", box(1, 1, 0), ORTHO, 0.0),
    ("four corners of a square, folded flat", "tet", SQUARE, SQUISH, 1.0),
    ("hex with a top of a single point", "hex", POINTED, SQUISH, 1.0),
    ("all corners in one point", "wedge", [(1, 2, 3)] * 6, AR, math.inf),
    ("all corners in one point", "wedge", [(1, 2, 3)] * 6, SQUISH, 1.0),
    ("all corners in one point", "wedge", [(1, 2, 3)] * 6, ORTHO, 0.0),
]  # fmt: skip


@pytest.mark.parametrize(
    ("what", "kind", "points", "metric", "value"), CLOSED_FORMS, ids=[f"{r[3]}-{r[1]}-{r[0]}" for r in CLOSED_FORMS]
)
def test_closed_forms(what, kind, points, metric, value):
    assert values_of(kind, points, [metric])[metric] == pytest.approx(value, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("kind", ["tet", "pyramid", "wedge", "hex"])
def test_a_flat_cell_has_the_degenerate_values_whichever_way_it_lies(kind):
    points = {"tet": SQUARE, "pyramid": [*SQUARE, (0.3, 0.2, 0)], "wedge": [*TRIANGLE] * 2, "hex": box(1, 2, 0)}[kind]
    for seed in range(20):
        turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        got = values_of(kind, np.array(points, float) @ turn.T, [AR, SQUISH, ORTHO])
        assert got == {id_: METRICS[id_].degenerate for id_ in got}


@pytest.mark.parametrize("tilt", [1e-3, 1e-6, 1e-9])
def test_a_hex_almost_at_right_angles_keeps_the_digits_of_its_squish(tilt):
    # 1 - 1/sqrt(1 + tilt^2) is tilt^2/2, which a cosine rounded to 1 has lost for tilts below 1e-8.
    sheared = [(x + tilt * z, y, z) for x, y, z in box(1, 1, 1)]
    assert values_of("hex", sheared, [SQUISH])[SQUISH] == pytest.approx(tilt**2 / 2, rel=1e-5)


def test_squish_and_orthogonality_add_up_to_one():
    rng = np.random.default_rng(4)
    for _ in range(50):
        cell = np.array(box(1, 1, 1), float) + rng.uniform(-0.6, 0.6, (8, 3))
        got = values_of("hex", cell, [SQUISH, ORTHO])
        assert got[SQUISH] + got[ORTHO] == pytest.approx(1.0, rel=1e-14)
