"""The sign of a curved cell's Jacobian at one point, in rational arithmetic."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.bernstein import Point, split_matrices
from meshwright.audit.findings.bezier.proof import SHELL, SOLID
from meshwright.audit.shape_functions import DOMAINS, tangents

__all__ = ["exact_sign", "point_of"]

Floats = NDArray[np.float64]


def point_of(name: str, path: NDArray[np.int8], levels: int, corner: int) -> Point:
    """The corner of the part to which a path leads, as a point of the type's domain."""
    domain = DOMAINS[name]
    parts = [[tuple(Fraction(int(i == v)) for i in range(d + 1)) for v in range(d + 1)] for d in domain]
    for level, child in enumerate(path[:levels].tolist()):
        f = level % len(domain)
        whole = parts[f]
        parts[f] = [
            tuple(
                sum((w * v[i] for w, v in zip(weights, whole, strict=True)), Fraction(0)) for i in range(domain[f] + 1)
            )
            for weights in split_matrices(domain[f], 1)[1][child]
        ]
    vertex = list(product(*(range(d + 1) for d in domain)))[corner]
    return tuple(part[v] for part, v in zip(parts, vertex, strict=True))


def exact_sign(name: str, nodes: Floats, point: Point, kind: int) -> int:
    """Sign of the determinant at a point, in rational arithmetic.

    nodes (n, 3): coordinates.  kind: SOLID, FLAT (seen from above) or SHELL (from the normal of the corners).
    """
    x = [[Fraction(value) for value in row] for row in nodes.tolist()]
    rows = [
        [sum((w * x[j][d] for j, w in weights), Fraction(0)) for d in range(3)] for weights in _weights(name, point)
    ]
    if kind != SOLID:
        rows.append(_normal(name, x) if kind == SHELL else [Fraction(0), Fraction(0), Fraction(1)])
    value = sum(a * b for a, b in zip(_cross(rows[0], rows[1]), rows[2], strict=True))
    return (value > 0) - (value < 0)


@lru_cache(4096)
def _weights(name: str, point: Point) -> list[list[tuple[int, Fraction]]]:
    """Nodes and their weights in the derivatives at a point."""
    return [[(j, w) for j, w in enumerate(field.at(point)) if w] for field in tangents(name)]


def _cross(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _normal(name: str, x: list[list[Fraction]]) -> list[Fraction]:
    p, q, r, s = (0, 1, 0, 2) if name == "tri6" else (0, 2, 1, 3)
    return _cross([b - a for a, b in zip(x[p], x[q], strict=True)], [b - a for a, b in zip(x[r], x[s], strict=True)])
