"""Angles between faces: closed forms, cells that have none, and the same angles found another way."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh

_GOLDEN = runpy.run_path(str(Path(__file__).with_name("test_golden.py")))
values_of, box = _GOLDEN["values_of"], _GOLDEN["box"]

IDS = ("dihedral.min", "dihedral.max")
ROOT2, ROOT3 = math.sqrt(2), math.sqrt(3)
CORNER = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
REGULAR = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)][::-1]
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
TRIANGLE = [(0, 0, 0), (1, 0, 0), (0.5, ROOT3 / 2, 0)]


def lifted(points, height=1.0):
    return [*points, *((x, y, z + height) for x, y, z in points)]


# A wedge of 30 degrees between two faces that meet in the z axis: corners 0 and 2 on it, 1 and 3 a right angle off it.
THIRTY = [(0, 0, -4), (4, 0, 0), (0, 0, 4), (4 * ROOT3 / 2, 2, 0)]

CLOSED_FORMS = [
    ("regular tet: acos 1/3", "tet", REGULAR, math.degrees(math.acos(1 / 3)), math.degrees(math.acos(1 / 3))),
    ("corner of a cube: atan sqrt 2 along the slanted face", "tet", CORNER, math.degrees(math.atan(ROOT2)), 90.0),
    ("four corners of a square, folded flat", "tet", SQUARE, 0.0, 180.0),
    (
        "equilateral pyramid: acos 1/sqrt 3 at the base, acos -1/3 at the sides",
        "pyramid",
        [*SQUARE, (0.5, 0.5, ROOT2 / 2)],
        math.degrees(math.acos(1 / ROOT3)),
        math.degrees(math.acos(-1 / 3)),
    ),
    ("regular wedge", "wedge", lifted(TRIANGLE), 60.0, 90.0),
    ("right isosceles wedge", "wedge", lifted([(0, 0, 0), (1, 0, 0), (0, 1, 0)]), 45.0, 90.0),
    ("box", "hex", box(1, 2, 4), 90.0, 90.0),
    ("mirrored cube", "hex", box(1, 1, -1), 90.0, 90.0),
    ("cube sheared by 45 degrees", "hex", [(x + z, y, z) for x, y, z in box(1, 1, 1)], 45.0, 135.0),
    # the outer angle of the dart is 270 degrees, which the normals show as 360 - 270 = 90
    ("prism over a dart", "hex", lifted([(0, 0, 0), (2, -1, 0), (1, 0, 0), (2, 1, 0)]), None, 90.0),
]


@pytest.mark.parametrize(("what", "kind", "points", "low", "high"), CLOSED_FORMS, ids=[row[0] for row in CLOSED_FORMS])
def test_dihedral_angles_have_their_closed_form(what, kind, points, low, high):
    got = values_of(kind, points, IDS)
    assert got["dihedral.max"] == pytest.approx(high, rel=1e-12, abs=1e-12)
    if low is not None:
        assert got["dihedral.min"] == pytest.approx(low, rel=1e-12, abs=1e-12)


def test_the_angle_along_an_edge_is_the_one_the_cell_was_built_with():
    # The angles along all other edges are larger.
    assert values_of("tet", THIRTY, IDS)["dihedral.min"] == pytest.approx(30.0, rel=1e-12)


@pytest.mark.parametrize("height", [1e-3, 1e-6, 1e-9])
def test_an_almost_flat_tet_keeps_the_digits_of_its_small_angle(height):
    # The apex stands over the middle of an equilateral triangle whose inscribed circle has the radius 1/(2 sqrt 3).
    apex = (0.5, ROOT3 / 6, height)
    got = values_of("tet", [*TRIANGLE, apex], IDS)
    assert got["dihedral.min"] == pytest.approx(math.degrees(math.atan(height * 2 * ROOT3)), rel=1e-6)


ONE_FACE_WITHOUT_AREA = [
    ("tet with a corner in the middle of an edge", "tet", [(0, 0, 0), (2, 0, 0), (1, 0, 0), (1, 1, 1)]),
    ("pyramid over a segment", "pyramid", [(0, 0, 0), (1, 0, 0), (1, 0, 0), (0, 0, 0), (0.5, 1, 1)]),
    ("wedge without height", "wedge", lifted(TRIANGLE, 0.0)),
    ("hex with a collapsed edge", "hex", [*box(1, 1, 1)[:6], (1, 1, 1), (1, 1, 1)]),
    ("hex with a top of a single point", "hex", [*SQUARE, *[(0.5, 0.5, 1)] * 4]),
    ("hex with a top in a figure of eight", "hex", [*SQUARE, (0, 0, 1), (1, 1, 1), (1, 0, 1), (0, 1, 1)]),
    ("all corners in one point", "hex", [(3, 4, 5)] * 8),
]


@pytest.mark.parametrize(
    ("what", "kind", "points"), ONE_FACE_WITHOUT_AREA, ids=[row[0] for row in ONE_FACE_WITHOUT_AREA]
)
def test_a_face_or_an_edge_without_size_has_no_dihedral_angle(what, kind, points):
    # Turned and moved, so that rounding gives the face an area of about 1e-17 and a direction that means nothing.
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    for cell in (np.array(points, float), np.array(points, float) @ turn.T):
        got = values_of(kind, cell, IDS)
        assert all(math.isnan(value) for value in got.values()), got


def test_a_small_but_sound_face_keeps_its_angles():
    # A frustum whose top has a side of 1e-9: its area is far below 1e-14 of the cell's, but its direction is exact.
    top = [(0.5 + 1e-9 * (x - 0.5), 0.5 + 1e-9 * (y - 0.5), 1.0) for x, y, _ in SQUARE]
    got = values_of("hex", [*SQUARE, *top], IDS)
    # The sides lean inwards by 1/2 per unit of height: atan 2 at the base.
    assert got["dihedral.min"] == pytest.approx(math.degrees(math.atan(2)), rel=1e-7)


@pytest.mark.parametrize("kind", ["tet", "pyramid", "wedge"])
def test_on_planar_faces_the_angle_is_the_one_seen_along_the_edge(kind):
    # A second way: look along each edge, and measure the angle between the directions into its two faces.
    shape = np.array({"tet": CORNER, "pyramid": [*SQUARE, (0.5, 0.5, 1)], "wedge": lifted(TRIANGLE)}[kind], float)
    rng = np.random.default_rng(8)
    faces, edges = CELL_TYPES[kind].faces, CELL_TYPES[kind].edges
    for _ in range(50):
        cell = shape @ (np.eye(3) + rng.uniform(-0.4, 0.4, (3, 3)))  # affine: keeps faces planar
        seen = []
        for a, b in edges:
            along = (cell[b] - cell[a]) / np.linalg.norm(cell[b] - cell[a])
            into = []
            for face in faces:
                if {a, b} <= set(face):
                    inner = cell[[v for v in face if v not in (a, b)]].mean(axis=0) - cell[a]
                    into.append(inner - along * (inner @ along))
            u, v = into
            seen.append(math.degrees(math.atan2(np.linalg.norm(np.cross(u, v)), u @ v)))
        got = values_of(kind, cell, IDS)
        assert [got[id_] for id_ in IDS] == pytest.approx([min(seen), max(seen)], rel=1e-9)


def test_quadratic_cells_are_measured_by_their_corners():
    points = np.array([*CORNER, *[(9, 9, 9)] * 6], dtype=float)
    mesh = Mesh(points, (CellBlock("tet10", [0], np.arange(10)[None]),))
    assert measure(mesh, ["dihedral.max"]).values["dihedral.max"]["tet10"][0] == pytest.approx(90.0, rel=1e-12)
