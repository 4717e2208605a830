"""One small mesh a cell type: lone cells in a row, the first ones sound, the rest each with one known defect."""

from __future__ import annotations

import numpy as np
from generate.grid import Cells, Floats, Grid
from generate.sample import Sample, row_of_cells

__all__ = ["samples"]

S2, S3, S5 = 2.0**0.5, 3.0**0.5, 5.0**0.5
UP = np.array([0.0, 0.0, 1.0])
GOOD, BAD = "sound", "defective"
FLAT = {"dimension": 2}


def flat(*corners: tuple[float, float]) -> Floats:
    return np.array([(x, y, 0.0) for x, y in corners])


def solid(*corners: tuple[float, float, float]) -> Floats:
    return np.array(corners, dtype=float)


def angle_skew(degrees: float, ideal: float) -> float:
    """Equi-angle skew that one angle alone stands for."""
    return max((degrees - ideal) / (180.0 - ideal), (ideal - degrees) / ideal)


EQUILATERAL = flat((0, 0), (1, 0), (0.5, S3 / 2))
SQUARE = flat((0, 0), (1, 0), (1, 1), (0, 1))
CUBE = np.concatenate([SQUARE, SQUARE + UP])
PRISM = np.concatenate([EQUILATERAL, EQUILATERAL + UP])
REGULAR_TET = solid((0, 0, 0), (1, 0, 0), (0.5, S3 / 2, 0), (0.5, S3 / 6, (2 / 3) ** 0.5))
CORNER_TET = solid((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
PYRAMID = np.concatenate([SQUARE, solid((0.5, 0.5, S2 / 2))])


def _tri() -> Sample:
    cells = [
        (GOOD, EQUILATERAL),
        (GOOD, flat((0, 0), (1, 0), (0, 1))),
        (GOOD, flat((0, 0), (1, 0), (0, S3))),
        (BAD, flat((0, 0), (2, 0), (1, np.tan(np.radians(2))))),  # angles 2, 2, 176
        (BAD, EQUILATERAL[::-1]),
        (BAD, flat((0, 0), (1, 0), (2, 0))),
    ]
    skew = [0.0, 0.25, 0.5, angle_skew(176, 60), 0.0, 1.0]
    ratio = [1.0, (1 + S2) / 2, 1 / (S3 - 1), _tri_ratio(2, 2, 176), 1.0, "inf"]
    return Sample(
        "cells/tri.msh",
        "triangles: a flat one of 2-2-176 degrees, one clockwise, one with its corners in line",
        row_of_cells("tri", cells, **FLAT),
        findings={"inverted-cells": 1, "degenerate-cells": 1, "left-handed-faces": 1},
        values={"gambit.equiangle_skew": {"tri": skew}, "gambit.aspect_ratio": {"tri": ratio}},
    )


def _tri_ratio(*degrees: float) -> float:
    """R / 2r from the angles: r = 4 R sin(A/2) sin(B/2) sin(C/2)."""
    return float(1 / (8 * np.prod(np.sin(np.radians(degrees) / 2))))


def _quad() -> Sample:
    c, s = np.cos(np.radians(5)), np.sin(np.radians(5))
    cells = [
        (GOOD, SQUARE),
        (GOOD, flat((0, 0), (2, 0), (2, 1), (0, 1))),
        (GOOD, flat((0, 0), (1, 0), (1.5, S3 / 2), (0.5, S3 / 2))),  # rhombus of 60 degrees
        (GOOD, flat((0, 0), (2, 0), (1.5, 1), (0.5, 1))),  # trapezoid, bases 2 and 1, height 1
        (BAD, flat((0, 0), (1, 0), (1 + c, s), (c, s))),  # rhombus of 5 degrees
        (BAD, SQUARE[::-1]),
        (BAD, flat((0, 0), (1, 0), (1, 1), (1, 1))),  # two corners in one place
    ]
    # trapezoid: base angles atan 2; collapsed: its zero edge
    base = float(np.degrees(np.arctan(2.0)))
    skew = [0.0, 0.0, 1 / 3, angle_skew(base, 90), 85 / 90, 0.0, 1.0]
    ratio = [1.0, 2.0, 1.0, 1.5 / (S5 / 2), 1.0, 1.0, 1 + S2]
    return Sample(
        "cells/quad.v41.msh",
        "quadrilaterals: a rhombus of 5 degrees, one clockwise, one with two corners in one place",
        row_of_cells("quad", cells, **FLAT),
        findings={"inverted-cells": 1, "left-handed-faces": 1, "duplicate-points": 1, "collapsed-cells": 1},
        values={"gambit.equiangle_skew": {"quad": skew}, "gambit.aspect_ratio": {"quad": ratio}},
    )


def _tet() -> Sample:
    h = 0.02
    cells = [
        (GOOD, REGULAR_TET),
        (GOOD, CORNER_TET),
        (BAD, solid((1, 0, -h / 2), (-1, 0, -h / 2), (0, -1, h / 2), (0, 1, h / 2))),  # sliver
        (BAD, REGULAR_TET * (1, 1, 30)),  # needle
        (BAD, REGULAR_TET[[1, 0, 2, 3]]),
        (BAD, solid((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))),
    ]
    # needle: three isosceles faces, base 1, height from the apex
    apex = float(np.degrees(2 * np.arctan(0.5 / np.hypot(S3 / 6, 30 * (2 / 3) ** 0.5))))
    # sliver: four equal faces, edges 2, s, s with s^2 = 2 + h^2
    edge = (2 + h * h) ** 0.5
    top = float(np.degrees(2 * np.arcsin(1 / edge)))
    sliver = max(angle_skew(top, 60), angle_skew((180 - top) / 2, 60))
    skew = [0.0, 0.25, sliver, angle_skew(apex, 60), 0.0, 0.25]
    # sliver: volume 2 * 2 * h / 6, corners at sqrt(1 + (h/2)^2) from the middle; needle: R = (H^2 + 1/3) / 2H
    tall = 30 * (2 / 3) ** 0.5
    thin = 1 - (S3 / 12 * tall) / _largest_tet((tall**2 + 1 / 3) / (2 * tall))
    size = [0.0, 0.5, 1 - (2 * h / 3) / _largest_tet((1 + h * h / 4) ** 0.5), thin, 0.0, 1.0]
    return Sample(
        "cells/tet.msh",
        "tetrahedra: a sliver (all four corners nearly on one circle), a needle, one inverted, one flat",
        row_of_cells("tet", cells),
        findings={"inverted-cells": 1, "degenerate-cells": 1, "left-handed-faces": 1},
        values={"gambit.equiangle_skew": {"tet": skew}, "gambit.equisize_skew": {"tet": size}},
    )


def _largest_tet(radius: float) -> float:
    """Volume of the regular tetrahedron in a sphere."""
    return 8 * S3 / 27 * radius**3


def _pyramid() -> Sample:
    cells = [
        (GOOD, PYRAMID),
        (GOOD, np.concatenate([SQUARE, solid((0.5, 0.5, 0.5))])),  # a sixth of a cube
        (BAD, np.concatenate([SQUARE, solid((0.5, 0.5, 10.0))])),
        (BAD, PYRAMID * (1, 1, -1)),
        (BAD, np.concatenate([SQUARE, solid((0.5, 0.5, 0.0))])),
    ]
    sixth = float(np.degrees(np.arctan(S2)))  # base angle of a face of the sixth
    needle = float(np.degrees(2 * np.arctan(0.5 / np.hypot(0.5, 10.0))))
    skew = [0.0, angle_skew(sixth, 60), angle_skew(needle, 60), 0.0, 0.25]
    return Sample(
        "cells/pyramid.v41.msh",
        "pyramids: a needle, one upside down, one with its apex in its base",
        row_of_cells("pyramid", cells),
        findings={"inverted-cells": 1, "degenerate-cells": 1, "left-handed-faces": 1},
        values={"gambit.equiangle_skew": {"pyramid": skew}},
    )


def _wedge() -> Sample:
    lean = np.concatenate([EQUILATERAL, EQUILATERAL + UP])
    lean[3:, 0] += 9.0  # the roof slides far along x
    right = np.concatenate([flat((0, 0), (1, 0), (0, 1)), flat((0, 0), (1, 0), (0, 1)) + UP])
    cells = [
        (GOOD, PRISM),
        (GOOD, right),
        (BAD, lean),
        (BAD, PRISM[[3, 4, 5, 0, 1, 2]]),
        (BAD, PRISM * (1, 1, 0)),
    ]
    slide = float(np.degrees(np.arctan2(1.0, 9.0)))  # face along x: the smallest angle
    return Sample(
        "cells/wedge.msh",
        "wedges: one whose roof slid away, one inverted, one without height (each of its three upright edges closed)",
        row_of_cells("wedge", cells, gap=12.0),
        findings={"inverted-cells": 1, "degenerate-cells": 1, "left-handed-faces": 1, "duplicate-points": 3},
        values={"gambit.equiangle_skew": {"wedge": [0.0, 0.25, angle_skew(slide, 90), 0.0, None]}},
    )


def _hex() -> Sample:
    sheared = CUBE.copy()
    sheared[4:, 0] += 1.0
    warped = CUBE.copy()
    warped[6, 2] += 0.5
    pushed = CUBE.copy()
    pushed[6] = (0.3, 0.3, 0.3)  # beyond the plane of its three neighbours
    steep = CUBE.copy()
    steep[4:, 0] += np.tan(np.radians(84.0))
    collapsed = CUBE[[0, 1, 2, 2, 4, 5, 6, 6]]  # one face closed to a line: a prism in a hexahedron's clothes
    cells = [
        (GOOD, CUBE),
        (GOOD, CUBE * (1, 2, 4)),
        (GOOD, sheared),
        (BAD, warped),
        (BAD, steep),
        (BAD, collapsed),
        (BAD, pushed),
        (BAD, CUBE[[4, 5, 6, 7, 0, 1, 2, 3]]),
    ]
    return Sample(
        "cells/hex.v41.msh",
        "hexahedra: a warped face, a 6 degree lean, a face closed to a line, a corner pushed through, one inverted",
        row_of_cells("hex", cells, gap=12.0),
        findings={
            "inverted-cells": 1,
            "negative-jacobian-cells": 1,
            "left-handed-faces": 1,
            "duplicate-points": 2,
            "collapsed-cells": 1,
        },
        values={
            "gambit.equiangle_skew": {"hex": [0.0, 0.0, 0.5, None, 84 / 90, 1.0, None, 0.0]},
            "gambit.aspect_ratio": {"hex": [1.0, 4.0, S2, None, None, None, None, 1.0]},
            "gambit.warpage": {"hex": [0.0, 0.0, 0.0, 0.125 / (9 / 8 * 17 / 16) ** 0.5, 0.0, None, None, 0.0]},
            "icem.determinant": {"hex": [1.0, 1.0, 1.0, None, 1.0, 0.0, -1.0, -1.0]},
        },
    )


def _second_order(kind: str, corners: Floats, edges: list[tuple[int, int]], path: str) -> Sample:
    """Two cells: one with straight edges, one with its first mid-edge node 0.1 off the middle, both sound."""
    middles = np.array([(corners[a] + corners[b]) / 2 for a, b in edges])
    straight = np.concatenate([corners, middles])
    bulged = straight.copy()
    n = len(corners)
    bulged[n, 1] -= 0.1
    swapped = {"tri6": [2, 1, 0, 4, 3, 5], "quad8": [3, 2, 1, 0, 6, 5, 4, 7]}.get(kind)
    inverted = straight * (1, 1, -1) if swapped is None else straight[swapped]
    grid = row_of_cells(kind, [(GOOD, straight), (GOOD, bulged), (BAD, inverted)], dimension=2 if swapped else 3)
    return Sample(
        path,
        f"second order {kind}: one straight, one with a mid-edge node moved by a tenth, one inverted",
        grid,
        findings={"inverted-cells": 1, "left-handed-faces": 1},
        values={"gambit.equiangle_skew": {kind: [0.0, 0.0, 0.0]}},
    )


def samples() -> list[Sample]:
    """The meshes of cells/."""
    ring3, ring4 = [(0, 1), (1, 2), (2, 0)], [(0, 1), (1, 2), (2, 3), (3, 0)]
    tet = [*ring3, (0, 3), (1, 3), (2, 3)]
    hexa = [*ring4, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    saddle = SQUARE.copy()
    saddle[:, 2] = (0.25, -0.25, 0.25, -0.25)
    return [
        _tri(), _quad(), _tet(), _pyramid(), _wedge(), _hex(),
        Sample(
            "cells/shell.msh",
            "a shell in space: one quadrilateral warped into a saddle of plus and minus a quarter",
            Grid(saddle, (Cells("quad", np.array([[0, 1, 2, 3]]), "plate"),)),
            values={"gambit.warpage": {"quad": [0.25]}},
        ),
        _second_order("tri6", EQUILATERAL, ring3, "cells/tri6.msh"),
        _second_order("quad8", SQUARE, ring4, "cells/quad8.v41.msh"),
        _second_order("tet10", REGULAR_TET, tet, "cells/tet10.v41.msh"),
        _second_order("hex20", CUBE, hexa, "cells/hex20.msh"),
    ]  # fmt: skip
