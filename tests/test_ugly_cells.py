"""What every metric owes to every cell with finite coordinates: a number, or the undefined that its row promises."""

import math
import os
import runpy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.findings.signs.shapes import FLAT, cell_shapes
from meshwright.audit.measurement import measure
from meshwright.audit.metrics import METRICS

ugly = runpy.run_path(str(Path(__file__).parent / "ugly_cells.py"))
SHAPES, random_cells, adversarial_cells, as_mesh = (
    ugly[name] for name in ("SHAPES", "random_cells", "adversarial_cells", "as_mesh")
)

MANY = os.environ.get("MESHWRIGHT_MANY") == "1"
"""`make torture` sets it: the figures that a release has to show."""
RANDOM, ADVERSARIAL = (100_000, 10_000) if MANY else (3_000, 1_500)

UNDEFINED_TOO = {
    "gambit.aspect_ratio": "a triangle with two corners in one place has no circumcircle",
    "icem.skew": "mid-lines of a quadrilateral without length have no directions",
    "icem.opp_face_area_ratio": "two opposite faces without area have no ratio",
}
"""Metrics that may be undefined although a degenerate cell has a value: why."""


def measured(name, cells):
    return {id_: by[name] for id_, by in measure(as_mesh(name, cells), METRICS).values.items() if name in by}


@pytest.mark.parametrize("name", SHAPES)
def test_no_metric_is_undefined_on_a_cell_with_a_shape(name):
    values = measured(name, random_cells(name, RANDOM))
    assert values
    assert {id_: int(np.isnan(v).sum()) for id_, v in values.items() if np.isnan(v).any()} == {}


@pytest.mark.parametrize("name", SHAPES)
def test_only_metrics_that_say_so_are_undefined_on_a_cell_without_one(name):
    values = measured(name, adversarial_cells(name, ADVERSARIAL))
    strays = {
        id_: int(np.isnan(v).sum())
        for id_, v in values.items()
        if np.isnan(v).any() and not math.isnan(METRICS[id_].degenerate) and id_ not in UNDEFINED_TOO
    }
    assert strays == {}


@pytest.mark.parametrize("name", SHAPES)
def test_infinity_comes_only_from_metrics_that_grow_without_bound(name):
    values = measured(name, adversarial_cells(name, ADVERSARIAL))
    for id_, v in values.items():
        assert not np.isinf(v).any() or math.inf in (METRICS[id_].high, -METRICS[id_].low), id_


def exact_sign(cell, faces):
    """(six times the volume, faces fanned about the mean of their corners; square of the longest edge)."""
    at = [[Fraction(float(x)) for x in p] for p in cell]
    at = [[x - y for x, y in zip(p, at[0], strict=True)] for p in at]
    total = Fraction(0)
    for face in faces:
        corners = [at[v] for v in face]
        if len(corners) == 3:
            (a, b, c), share = corners, 1
            total += share * _det(a, b, c)
        else:  # (a + b) . ((b + c) x (c + d)) / 2 adds up the fan
            a, b, c, d = corners
            total += _det(_sum(a, b), _sum(b, c), _sum(c, d)) / 2
    longest2 = max(
        sum((p - q) ** 2 for p, q in zip(at[f[i - 1]], at[f[i]], strict=True)) for f in faces for i in range(len(f))
    )
    return total, longest2


def _sum(a, b):
    return [x + y for x, y in zip(a, b, strict=True)]


def _det(a, b, c):
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@pytest.mark.parametrize("name", ["tet", "pyramid", "wedge", "hex"])
def test_inversion_is_decided_as_in_rational_arithmetic(name):
    cells = np.concatenate(
        [
            random_cells(name, RANDOM // (1 if MANY else 20), 1),
            adversarial_cells(name, ADVERSARIAL // (1 if MANY else 5), 1),
        ]
    )
    shapes = cell_shapes(as_mesh(name, cells))
    faces = CELL_TYPES[name].faces
    limit2 = (6 * Fraction(FLAT)) ** 2
    wrong = []
    for row, cell in enumerate(cells):
        six, longest2 = exact_sign(cell, faces)
        square, bound = six * six, limit2 * longest2**3
        if bound and abs(square / bound - 1) < Fraction(1, 10**6):
            continue  # on the very limit of what counts as flat
        flat = square < bound or not longest2
        state = (bool(shapes.negative[row]), bool(shapes.flat[row]))
        if state != (six < 0 and not flat, flat):
            wrong.append(row)
    assert wrong == []
