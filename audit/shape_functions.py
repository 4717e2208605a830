"""Shape functions of cells of first and second order, in Bernstein form, and as tables of their derivatives.

Local axes: r, s, t in 0..1 along the edges of the first corner that are the axes of the linear cell, as in VTK; in a
tetrahedron and across a wedge they end at its corners 1, 2, 3. The pyramid of 13 nodes has Bedrosian's rational
functions (International Journal for Numerical Methods in Engineering 35 (1992), 95). They are polynomials in
collapsed coordinates: u and v across the base, w from the base to the apex, with r - 1/2 = (u - 1/2) (1 - w).
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.bernstein import Domain, Field, Index, Point, derivative, elevated, indices
from meshwright.audit.cells import CELL_TYPES

__all__ = ["DOMAINS", "gradient_table", "nodal_points", "position", "tangents", "values_at"]

DOMAINS: dict[str, Domain] = {
    name: {"tri": (2,), "quad": (1, 1), "tet": (3,), "wedge": (2, 1)}.get(cell.corners, (1, 1, 1))
    for name, cell in CELL_TYPES.items()
    if cell.faces
}
"""The domain on which each type is a polynomial."""

_CORNERS: dict[str, tuple[tuple[int, ...], ...]] = {
    "tri": ((0,), (1,), (2,)),
    "quad": ((0, 0), (1, 0), (1, 1), (0, 1)),
    "tet": ((0,), (1,), (2,), (3,)),
    "wedge": ((0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)),
    "hex": ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
}
"""Vertex of each factor of the domain at which a corner lies."""

_FULL_CENTRES = {"quad9": ((0, 2),), "hex27": ((0, 7), (1, 6), (0, 5), (3, 6), (0, 2), (4, 6), (0, 6))}
"""Opposite corners about the nodes in the middle of faces and body, in node order."""

Rows = dict[Index, NDArray[np.float64]]


def _between(domain: Domain, a: tuple[int, ...], b: tuple[int, ...]) -> Index:
    """The index of degree 2 half-way between two corners."""
    return tuple(tuple((i == p) + (i == q) for i in range(d + 1)) for d, p, q in zip(domain, a, b, strict=True))


def _lattice(name: str) -> Rows:
    """The place of every node on the lattice of degree 2, and weights for the places without one (serendipity)."""
    cell, domain = CELL_TYPES[name], DOMAINS[name]
    at, unit = _CORNERS[cell.corners], np.eye(cell.n_nodes)
    places = [_between(domain, at[c], at[c]) for c in range(cell.n_corners)]
    places += [_between(domain, at[a], at[b]) for a, b in cell.edges]
    places += [_between(domain, at[a], at[b]) for a, b in _FULL_CENTRES.get(name, ())]
    rows = dict(zip(places, unit, strict=True))
    for index in indices(domain, (2,) * len(domain)):
        if index not in rows:
            rows[index] = _serendipity(index, rows)
    return rows


def _serendipity(index: Index, rows: Rows) -> NDArray[np.float64]:
    """The middle of a face is edges / 2 - corners / 4, summed, that of a body edges / 4 - corners / 4."""
    ends = [[v for v, e in enumerate(part) if e] for part in index]  # the two vertices of a factor, or the one
    half = [len(vertices) == 2 for vertices in ends]
    total = np.zeros(len(next(iter(rows.values()))))
    for choice in product(
        *([(v, v) for v in e] + ([(e[0], e[1])] if h else []) for e, h in zip(ends, half, strict=True))
    ):
        crossed = sum(a != b for a, b in choice)
        place = tuple(
            tuple((i == a) + (i == b) for i in range(len(part))) for (a, b), part in zip(choice, index, strict=True)
        )
        if crossed == 0:
            total -= 0.25 * rows[place]
        elif crossed == 1:
            total += (0.5 if sum(half) == 2 else 0.25) * rows[place]
    return total


def _interpolating(domain: Domain, rows: Rows) -> Field:
    """The polynomial of degree 2 with these values on its lattice: an edge's coefficient is 2 m - (a + b) / 2."""

    def end(index: Index, factor: int, vertex: int) -> Index:
        part = tuple(2 * (i == vertex) for i in range(domain[factor] + 1))
        return (*index[:factor], part, *index[factor + 1 :])

    for factor in range(len(domain)):
        done: Rows = {}
        for index, row in rows.items():
            ends = [rows[end(index, factor, v)] for v, e in enumerate(index[factor]) if e == 1]
            done[index] = 2.0 * row - 0.5 * (ends[0] + ends[1]) if ends else row
        rows = done
    degree = (2,) * len(domain)
    return Field(domain, degree, np.array([rows[index] for index in indices(domain, degree)]))


def _pyramid() -> tuple[Field, Field, Field]:
    """Bernstein coefficients along w as fields of degree (2, 2) in u and v: at the base, half-way, at the apex.

    The base is a quadrilateral of 8 nodes; a lateral edge is a parabola, and between the four of them all is bilinear.
    """
    n, domain = 13, (1, 1)
    unit = np.eye(n)
    quad = position("quad8")
    base = Field(domain, (2, 2), np.pad(quad.rows[:, :4], ((0, 0), (0, n - 4))))
    base.rows[:, 5:9] = quad.rows[:, 4:]
    at = _CORNERS["quad"]
    corner = {at[i]: 0.5 * (4.0 * unit[9 + i] - unit[i] - unit[4]) for i in range(4)}
    half = Field(domain, (1, 1), np.array([corner[p] for p in product((0, 1), (0, 1))]))
    apex = Field(domain, (2, 2), np.tile(unit[4], (9, 1)))
    return base, elevated(elevated(half, 0), 1), apex


def _linear(name: str) -> Field:
    """Values at the vertices of the domain; the roof of a pyramid's cube has shrunk to its apex."""
    domain, at = DOMAINS[name], _CORNERS.get(name, _CORNERS["hex"])
    node = {vertex: min(k, CELL_TYPES[name].n_nodes - 1) for k, vertex in enumerate(at)}
    vertices = product(*(range(d + 1) for d in domain))
    return Field(domain, (1,) * len(domain), np.eye(CELL_TYPES[name].n_nodes)[[node[v] for v in vertices]])


def _stacked(*levels: NDArray[np.float64]) -> Field:
    """A field on the cube from its coefficients at each level of w."""
    rows = np.stack(levels, axis=1)
    return Field((1, 1, 1), (2, 2, len(levels) - 1), rows.reshape(-1, rows.shape[-1]))


@cache
def position(name: str) -> Field:
    """The position within a cell."""
    if name == "pyramid13":
        return _stacked(*(level.rows for level in _pyramid()))
    if CELL_TYPES[name].order == 1:
        return _linear(name)
    return _interpolating(DOMAINS[name], _lattice(name))


@cache
def tangents(name: str) -> tuple[Field, ...]:
    """Polynomials whose determinant is the Jacobian: the derivatives along r, s and, of a solid, t.

    Of a pyramid the third one is taken at fixed u and v, which leaves the determinant as it is.
    """
    if name == "pyramid":
        field = position(name)
        base = Field(field.domain, (1, 1, 0), field.rows[0::2])  # at w = 0
        return derivative(base, 0, 1), derivative(base, 1, 1), derivative(field, 2, 1)
    if name == "pyramid13":
        low, half, high = (level.rows for level in _pyramid())
        across = _stacked(low, 2.0 * half)  # the derivatives along u and v, divided by 1 - w
        return derivative(across, 0, 1), derivative(across, 1, 1), _stacked(2.0 * (half - low), 2.0 * (high - half))
    field = position(name)
    return tuple(derivative(field, f, v) for f, d in enumerate(DOMAINS[name]) for v in range(1, d + 1))


def nodal_points(name: str) -> list[Point]:
    """The nodes as points of the domain; the apex of a pyramid as four, the ends of its lateral edges.

    The Jacobian of a pyramid has no value at the apex but one limit along each line that ends there.
    """
    one, zero, half = Fraction(1), Fraction(0), Fraction(1, 2)

    def along(w: Fraction, *corners: int) -> Point:
        u, v = (sum((Fraction(_CORNERS["quad"][c][axis], len(corners)) for c in corners), zero) for axis in (0, 1))
        return ((one - u, u), (one - v, v), (one - w, w))

    cell = CELL_TYPES[name]
    if name == "pyramid13":
        edges = [along(zero, a, b) if b != 4 else along(half, a) for a, b in cell.edges]
        return [along(zero, c) for c in range(4)] + [along(one, c) for c in range(4)] + edges
    places = list(_lattice(name))[: cell.n_nodes]
    return [tuple(tuple(Fraction(e, 2) for e in part) for part in index) for index in places]


def _centres(name: str) -> list[Point]:
    """Centres of the faces and of the body that are no nodes; of a pyramid's body at a quarter of the height."""
    cell = CELL_TYPES[name]
    if name in ("quad9", "hex27"):
        return []
    if name == "pyramid13":
        half, third, one = Fraction(1, 2), Fraction(1, 3), Fraction(1)
        uv = (
            [(half, half, Fraction(0))]
            + [(half, one * k, third) for k in (0, 1)]
            + [(one * k, half, third) for k in (0, 1)]
        )
        return [tuple((1 - x, x) for x in p) for p in [*uv, (half, half, Fraction(1, 4))]]
    nodes = nodal_points(name)[: cell.n_corners]
    groups = [face for face in cell.faces if len(face) < cell.n_corners] + [tuple(range(cell.n_corners))]
    return [
        tuple(
            tuple(sum((nodes[c][f][i] for c in group), Fraction(0)) / len(group) for i in range(d + 1))
            for f, d in enumerate(DOMAINS[name])
        )
        for group in groups
    ]


def values_at(name: str, point: Point) -> list[Fraction]:
    """The n shape functions at a point of the domain."""
    return position(name).at(point)


@cache
def gradient_table(type_name: str) -> NDArray[np.float64]:
    """(p, n, 3) derivatives of the n shape functions along the local axes at p points; empty for a linear type.

    The points: the nodes (see `nodal_points`), then the centres of faces and body that are no nodes: together 7 of a
    triangle, 9 of a quadrilateral, 15 of a tetrahedron, 22 of a pyramid, 21 of a wedge, 27 of a hexahedron.
    A surface cell has zeros for the third axis. Rational numbers, rounded once.
    """
    if CELL_TYPES[type_name].order == 1:
        return np.empty((0, 0, 3))
    fields = tangents(type_name)
    points = nodal_points(type_name) + _centres(type_name)
    table = np.zeros((len(points), CELL_TYPES[type_name].n_nodes, 3))
    for k, point in enumerate(points):
        columns = [field.at(point) for field in fields]
        if type_name == "pyramid13":  # from fixed u, v to fixed r, s
            du, dv = (point[axis][1] - Fraction(1, 2) for axis in (0, 1))
            columns[2] = [w + du * r + dv * s for r, s, w in zip(*columns, strict=True)]
        for axis, column in enumerate(columns):
            table[k, :, axis] = [float(x) for x in column]
    return table
