"""How the Bernstein coefficients of a curved cell's Jacobian follow from its nodes, as tables for kernels."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.bernstein import corners, product_terms
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.shape_functions import DOMAINS, nodal_points, position, tangents

__all__ = ["Bends", "Formula", "bends", "formula"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Formula(NamedTuple):
    """How the coefficients of a type's determinant follow from its nodes.

    derivative (a, 2), derivative_weight: (row, node) of the sparse matrix that makes the coefficients of the two or
    three derivatives.  counts (3,): how many each has, 0 for the third of a surface.  cross (b, 3), cross_weight:
    (row, of the first, of the second) of their cross product.  dot (c, 3), dot_weight: (row, of the cross product, of
    the third) of the determinant.  size (2,): coefficients of cross product and determinant.  corner: rows of the
    determinant that are values at the corners of the domain.  rounding (4,): see `determinants`.  n_corners (1,): nodes
    of the linear cell.
    """

    derivative: Ints
    derivative_weight: Floats
    counts: Ints
    cross: Ints
    cross_weight: Floats
    dot: Ints
    dot_weight: Floats
    size: Ints
    corner: Ints
    rounding: Floats
    n_corners: Ints


def _terms(terms: Sequence[tuple[int, int, int, Fraction]]) -> tuple[Ints, Floats, int, int]:
    """Rows, weights, number of results, most terms of one result."""
    rows = np.array([term[:3] for term in terms], dtype=np.int64)
    weights = np.array([float(term[3]) for term in terms])
    counts = np.bincount(rows[:, 0])
    return rows, weights, len(counts), int(counts.max())


@cache
def formula(name: str) -> Formula:
    """Of a type of first or second order."""
    domain, fields = DOMAINS[name], tangents(name)
    matrix = np.concatenate([field.rows for field in fields])
    where = np.argwhere(matrix != 0.0)
    degree = tuple(p + q for p, q in zip(fields[0].degree, fields[1].degree, strict=True))
    cross, cross_weight, n_cross, most_cross = _terms(product_terms(domain, fields[0].degree, fields[1].degree))
    if len(fields) == 3:
        dot, dot_weight, n_dot, most_dot = _terms(product_terms(domain, degree, fields[2].degree))
        degree = tuple(p + q for p, q in zip(degree, fields[2].degree, strict=True))
    else:
        dot, dot_weight = np.array([(k, k, 0) for k in range(n_cross)], dtype=np.int64), np.ones(n_cross)
        n_dot, most_dot = n_cross, 1
    # a sum of m products of a node's coordinate (off by one rounding) is off by m + 1 roundings of its terms
    slack = [float(max((np.count_nonzero(row) + 1) * np.abs(row).sum() for row in field.rows)) for field in fields]
    slack += [0.0] * (3 - len(slack))
    products = float(most_cross + 4 + most_dot + 5)
    counts = [len(field.rows) for field in fields] + [0] * (3 - len(fields))
    return Formula(
        np.ascontiguousarray(where),
        matrix[where[:, 0], where[:, 1]],
        np.array(counts, dtype=np.int64),
        cross,
        cross_weight,
        dot,
        dot_weight,
        np.array([n_cross, n_dot], dtype=np.int64),
        np.array(corners(domain, degree), dtype=np.int64),
        np.array([*slack, products]),
        np.array([CELL_TYPES[name].n_corners], dtype=np.int64),
    )


class Bends(NamedTuple):
    """How far a cell of second order is from the linear one of its corners.

    node (a, 2), weight: (row, node) of the sparse matrix that subtracts from each node that is no corner where it would
    be in the linear cell.  reach (3,): a bend of 1 changes no derivative by more.
    """

    node: Ints
    weight: Floats
    reach: Floats


@cache
def bends(name: str) -> Bends:
    """Of a second-order type."""
    cell, matrix = CELL_TYPES[name], np.eye(CELL_TYPES[name].n_nodes)
    linear = position(cell.corners)
    for j, point in enumerate(nodal_points(name)[-cell.n_nodes + cell.n_corners :], start=cell.n_corners):
        matrix[j, : cell.n_corners] -= [float(x) for x in linear.at(point)]
    matrix[: cell.n_corners] = 0.0
    where = np.argwhere(matrix != 0.0)
    reach = [float(np.abs(field.rows[:, cell.n_corners :]).sum(1).max()) for field in tangents(name)]
    weight = matrix[where[:, 0], where[:, 1]]
    where[:, 0] -= cell.n_corners
    return Bends(np.ascontiguousarray(where), weight, np.array(reach + [0.0] * (3 - len(reach))))
