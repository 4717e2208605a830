"""The sign of a cell against rational arithmetic, on cells that floating point gets wrong."""

from fractions import Fraction

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.findings import run_checks
from meshwright.audit.findings.signs.shapes import FLAT, cell_shapes
from meshwright.audit.mesh import CellBlock, Faces, Mesh

UNIT = {
    "tet": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}


def det(a, b, c):
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def exact_volume(points, sides):
    """Volume inside faces fanned about their vertex mean, as a fraction."""
    at = [[Fraction(float(x)) for x in p] for p in points]
    total = Fraction(0)
    for side in sides:
        mean = [sum(at[v][d] for v in side) / len(side) for d in range(3)]
        total += sum(det(at[side[i - 1]], at[side[i]], mean) for i in range(len(side)))
    return total / 6


def exact_relative(points, sides):
    """The same over the cube of the longest edge."""
    edges = {frozenset((s[i - 1], s[i])) for s in sides for i in range(len(s))}
    longest = max(
        sum((Fraction(float(points[a][d])) - Fraction(float(points[b][d]))) ** 2 for d in range(3))
        for a, b in (tuple(e) for e in edges)
    )
    # divide before leaving the rationals: a cubed length may not fit a float
    scale = Fraction(2) ** (longest.numerator.bit_length() - longest.denominator.bit_length())
    edge = float(longest / scale) ** 0.5
    volume = exact_volume(points, sides)
    square = volume * volume / scale**3  # V**2 / scale**3, so that no root of the scale is needed
    return float(np.sign(float(volume > 0) - float(volume < 0))) * float(square) ** 0.5 / edge**3


def near_flat(name, rng, offset, thickness):
    """A unit cell squashed to about `thickness`, turned at random and put `offset` away from the origin."""
    x = np.array(UNIT[name], float) + rng.uniform(-0.2, 0.2, (len(UNIT[name]), 3))
    x[:, 2] *= thickness
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return x @ turn + offset * rng.uniform(-1, 1, 3)


def isolated(name, cells, scale=1.0):
    points = np.concatenate(cells) * scale
    nodes = np.arange(len(points)).reshape(len(cells), -1)
    return Mesh(points, (CellBlock(name, np.arange(len(cells)), nodes),))


def agrees(mesh, cells, sides, scale=1.0):
    """Cells whose state (negative, flat, positive) is not that of exact arithmetic; those on the threshold aside."""
    shapes = cell_shapes(mesh)
    wrong = hard = 0
    for row, points in enumerate(cells):
        exact = exact_relative(points * scale, sides)
        if abs(abs(exact) - FLAT) < 1e-6 * FLAT:
            continue
        hard += abs(exact) < 1e-12
        state = (bool(shapes.negative[row]), bool(shapes.flat[row]))
        wrong += state != (exact <= -FLAT, abs(exact) < FLAT)
    return wrong, hard


@pytest.mark.parametrize("name", list(UNIT))
@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6, 1e9])
def test_no_near_flat_cell_gets_another_sign_than_in_rational_arithmetic(name, offset):
    rng = np.random.default_rng(int(offset) % 1000 + len(name))
    cells = [near_flat(name, rng, offset, 10.0 ** rng.uniform(-17, -11)) for _ in range(60)]
    wrong, hard = agrees(isolated(name, cells), cells, CELL_TYPES[name].faces)
    assert wrong == 0
    assert offset > 1e4 or hard > 10


@pytest.mark.parametrize("name", list(UNIT))
@pytest.mark.parametrize("scale", [1e-110, 1e-30, 1e110])
def test_the_sign_does_not_depend_on_the_unit_of_length(name, scale):
    rng = np.random.default_rng(4)
    cells = [near_flat(name, rng, 0.0, 10.0 ** rng.uniform(-16, 0)) for _ in range(40)]
    wrong, _ = agrees(isolated(name, cells, scale), cells, CELL_TYPES[name].faces, scale)
    assert wrong == 0


@pytest.mark.parametrize("offset", [0.0, 1e9])
def test_near_flat_polyhedra_get_the_exact_sign_too(offset):
    rng = np.random.default_rng(9)
    cells = [near_flat("hex", rng, offset, 10.0 ** rng.uniform(-17, -9)) for _ in range(60)]
    sides = np.array(CELL_TYPES["hex"].faces)
    n = len(cells)
    nodes = (sides[None] + 8 * np.arange(n)[:, None, None]).ravel()
    faces = Faces(np.arange(0, 24 * n + 1, 4), nodes, np.repeat(np.arange(n), 6), np.full(6 * n, -1))
    block = CellBlock("polyhedron", np.arange(n), offsets=np.arange(0, 6 * n + 1, 6), items=np.arange(6 * n))
    wrong, hard = agrees(Mesh(np.concatenate(cells), (block,), faces=faces), cells, CELL_TYPES["hex"].faces)
    assert wrong == 0
    assert offset > 0 or hard > 10


def test_near_flat_polygons_get_the_exact_sign_too():
    rng = np.random.default_rng(3)
    rings = []
    for _ in range(200):
        angle = np.sort(rng.uniform(0, 2 * np.pi, 9))
        flat = np.stack([np.cos(angle), 10.0 ** rng.uniform(-17, -11) * np.sin(angle)], axis=1)
        c, s = np.cos(angle[0]), np.sin(angle[0])
        ring = flat @ np.array([[c, s], [-s, c]]) + 100.0 * rng.uniform(-1, 1, 2)
        rings.append(ring[:: rng.choice([-1, 1])])
    points = np.concatenate(rings)
    block = CellBlock("polygon", np.arange(200), offsets=np.arange(0, 1801, 9), items=np.arange(1800))
    shapes = cell_shapes(Mesh(np.column_stack([points, np.zeros(1800)]), (block,), dimension=2))
    wrong = 0
    for row, ring in enumerate(rings):
        p = [[Fraction(float(x)) for x in q] for q in ring]
        area = sum(p[i - 1][0] * p[i][1] - p[i - 1][1] * p[i][0] for i in range(9)) / 2
        longest = max(float((p[i][0] - p[i - 1][0]) ** 2 + (p[i][1] - p[i - 1][1]) ** 2) for i in range(9))
        exact = float(area) / longest
        if abs(abs(exact) - FLAT) > 1e-6 * FLAT:
            wrong += (bool(shapes.negative[row]), bool(shapes.flat[row])) != (exact <= -FLAT, abs(exact) < FLAT)
    assert wrong == 0


def test_ordinary_cells_have_the_relative_volume_of_closed_form():
    # unit cells: V = 1/6, 1/3, 1/2, 1; longest edges sqrt 2, sqrt 1.5 (to the apex), sqrt 2, 1
    expected = {"tet": 2**-1.5 / 6, "pyramid": 1.5**-1.5 / 3, "wedge": 2**-1.5 / 2, "hex": 1.0}
    for name, value in expected.items():
        mesh = isolated(name, [np.array(UNIT[name], float)])
        assert cell_shapes(mesh).relative[0] == pytest.approx(value, rel=1e-15)


def test_a_cell_without_extent_is_degenerate_whatever_its_type():
    for name, corners in UNIT.items():
        cells = [np.array(corners, float), np.full((len(corners), 3), 7.0)]
        found = {f.code: f.rows.tolist() for f in run_checks(isolated(name, cells))}
        assert found["degenerate-cells"] == [1]
        assert "inverted-cells" not in found
