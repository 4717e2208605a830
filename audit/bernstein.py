"""Polynomials in Bernstein form on products of simplices: the exact algebra behind proofs about curved cells.

A domain is a tuple of simplex dimensions: (1, 1, 1) a cube of three unit intervals, (2, 1) a prism, (3,) a tetrahedron.
A degree is one number for each of these factors. Coefficients stand in the order of `indices`. A polynomial lies
between its smallest and its largest coefficient, and has its first value at every corner of the domain. See Farin,
Curves and Surfaces for CAGD; Johnen, Remacle, Geuzaine, Journal of Computational Physics 233 (2013), 359.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import product
from math import factorial, prod

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Domain",
    "Field",
    "Index",
    "Point",
    "basis",
    "corners",
    "derivative",
    "elevated",
    "indices",
    "product_terms",
    "split_matrices",
]

Domain = tuple[int, ...]
Degree = tuple[int, ...]
Index = tuple[tuple[int, ...], ...]
Point = tuple[tuple[Fraction, ...], ...]
"""Barycentric coordinates in each factor."""


@dataclass(frozen=True, eq=False)
class Field:
    """A polynomial whose coefficients are linear in the nodes of a cell.

    rows (k, n): coefficient k is the sum of rows[k, j] times node j. Multiples of small powers of two, hence exact.
    """

    domain: Domain
    degree: Degree
    rows: NDArray[np.float64]

    def at(self, point: Point) -> list[Fraction]:
        """Weights of the n nodes in the value at a point."""
        weights = basis(self.domain, self.degree, point)
        used = [k for k, weight in enumerate(weights) if weight]
        return [
            sum((weights[k] * Fraction(self.rows[k, j]) for k in used), Fraction(0)) for j in range(self.rows.shape[1])
        ]


@cache
def _simplex(dimension: int, degree: int) -> tuple[tuple[int, ...], ...]:
    """Exponents of the dimension + 1 barycentric coordinates, the first one's falling."""
    if dimension == 0:
        return ((degree,),)
    return tuple((first, *rest) for first in range(degree, -1, -1) for rest in _simplex(dimension - 1, degree - first))


@cache
def indices(domain: Domain, degree: Degree) -> tuple[Index, ...]:
    """Exponents of every basis function: for each factor those of its barycentric coordinates."""
    return tuple(product(*(_simplex(d, p) for d, p in zip(domain, degree, strict=True))))


def _place(domain: Domain, degree: Degree) -> dict[Index, int]:
    return {index: k for k, index in enumerate(indices(domain, degree))}


def _multinomial(index: Index) -> int:
    return prod(factorial(sum(part)) // prod(map(factorial, part)) for part in index)


def basis(domain: Domain, degree: Degree, point: Point) -> list[Fraction]:
    """Values of the basis functions at a point."""
    return [
        Fraction(_multinomial(index))
        * prod(x**e for part, at in zip(index, point, strict=True) for e, x in zip(part, at, strict=True))
        for index in indices(domain, degree)
    ]


@cache
def corners(domain: Domain, degree: Degree) -> tuple[int, ...]:
    """Rows of the coefficients that are values at the corners of the domain, in the order of `product` of vertices."""
    place = _place(domain, degree)
    vertices = product(*(range(d + 1) for d in domain))
    return tuple(
        place[tuple(tuple(p * (i == v) for i in range(d + 1)) for d, p, v in zip(domain, degree, vertex, strict=True))]
        for vertex in vertices
    )


def _raised(index: Index, factor: int, vertex: int) -> Index:
    part = tuple(e + (i == vertex) for i, e in enumerate(index[factor]))
    return (*index[:factor], part, *index[factor + 1 :])


def derivative(field: Field, factor: int, vertex: int) -> Field:
    """Along the edge from vertex 0 to another vertex of one factor, whose length counts as 1."""
    p = field.degree[factor]
    degree = (*field.degree[:factor], p - 1, *field.degree[factor + 1 :])
    place = _place(field.domain, field.degree)
    rows = [
        p * (field.rows[place[_raised(index, factor, vertex)]] - field.rows[place[_raised(index, factor, 0)]])
        for index in indices(field.domain, degree)
    ]
    return Field(field.domain, degree, np.array(rows))


def elevated(field: Field, factor: int) -> Field:
    """The same polynomial written with one degree more in a factor."""
    degree = (*field.degree[:factor], field.degree[factor] + 1, *field.degree[factor + 1 :])
    place = _place(field.domain, field.degree)
    rows = np.zeros((len(indices(field.domain, degree)), field.rows.shape[1]))
    for k, index in enumerate(indices(field.domain, degree)):
        for vertex, exponent in enumerate(index[factor]):
            if exponent:
                part = tuple(e - (i == vertex) for i, e in enumerate(index[factor]))
                lower = place[(*index[:factor], part, *index[factor + 1 :])]
                rows[k] += exponent / degree[factor] * field.rows[lower]
    return Field(field.domain, degree, rows)


def product_terms(domain: Domain, first: Degree, second: Degree) -> list[tuple[int, int, int, Fraction]]:
    """(row of the product, row of the first, row of the second, weight), sorted; the weights of a row add up to 1."""
    total = tuple(p + q for p, q in zip(first, second, strict=True))
    place = _place(domain, total)
    terms = []
    for i, a in enumerate(indices(domain, first)):
        for j, b in enumerate(indices(domain, second)):
            both = tuple(tuple(e + f for e, f in zip(s, t, strict=True)) for s, t in zip(a, b, strict=True))
            terms.append((place[both], i, j, Fraction(_multinomial(a) * _multinomial(b), _multinomial(both))))
    return sorted(terms)


@cache
def split_matrices(
    dimension: int, degree: int
) -> tuple[tuple[NDArray[np.float64], ...], tuple[tuple[tuple[Fraction, ...], ...], ...]]:
    """How a polynomial on a simplex of dimension 1 to 3 is written on its 2, 4 or 8 congruent or equally large parts.

    Returns (matrices, parts): a matrix (k, k) for each part, exact in floats, and the part's vertices in barycentric
    coordinates of the whole.
    """
    half = {
        (i, j): tuple(Fraction((k == i) + (k == j), 2) for k in range(dimension + 1))
        for i in range(dimension + 1)
        for j in range(i, dimension + 1)
    }
    names = {1: ["00 01", "01 11"], 2: ["00 01 02", "01 11 12", "02 12 22", "01 12 02"],
             3: ["00 01 02 03", "01 11 12 13", "02 12 22 23", "03 13 23 33",
                 "01 02 03 13", "01 12 02 13", "02 03 13 23", "02 13 12 23"]}[dimension]  # fmt: skip
    parts = tuple(tuple(half[int(v[0]), int(v[1])] for v in name.split()) for name in names)
    return tuple(np.array(_blossom(dimension, degree, part), dtype=np.float64) for part in parts), parts


def _blossom(dimension: int, degree: int, part: Sequence[tuple[Fraction, ...]]) -> list[list[Fraction]]:
    """Coefficient k on the part is the polar form at its vertices, each as often as exponent k says."""
    place = {index: k for k, index in enumerate(_simplex(dimension, degree))}
    rows = []
    for exponents in place:
        # multiply out the product of the vertices as linear forms; each monomial belongs to one coefficient
        form = {(0,) * (dimension + 1): Fraction(1)}
        for vertex, times in zip(part, exponents, strict=True):
            for _ in range(times):
                following: dict[tuple[int, ...], Fraction] = {}
                for index, weight in form.items():
                    for i, x in enumerate(vertex):
                        if x:
                            key = tuple(e + (k == i) for k, e in enumerate(index))
                            following[key] = following.get(key, Fraction(0)) + weight * x
                form = following
        rows.append([form.get(index, Fraction(0)) for index in place])
    return rows
