"""Bounds of the Jacobian over whole curved cells: its Bernstein coefficients, with a bound of their rounding.

The derivatives along the local axes are polynomials whose Bernstein coefficients are exact dyadic combinations of the
nodes, and so the determinant's are sums, with positive weights, of products of those. The determinant lies between the
smallest and the largest of them (Johnen, Remacle, Geuzaine, Journal of Computational Physics 233 (2013), 359).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.bezier.tables import Bends, Formula
from meshwright.audit.jit import inner, kernel
from meshwright.audit.metrics.tile import SAFE_HIGH, SAFE_LOW, rescale

__all__ = ["FLAT", "SHELL", "SOLID", "determinants", "gather", "new_scratch", "prove"]

Floats = NDArray[np.float64]

SOLID, FLAT, SHELL = 0, 1, 2
"""What a cell is: a solid, in the x-y plane, or a surface in space, seen along the normal of its corners."""

_GROUP = 32
"""Cells that are worked on side by side: their 20,000 numbers stay in the second-level cache."""

_UNIT = 2.0**-53

_ORDERS = np.array([(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)])


@inner
def gather(points, nodes, row, x, lane):  # type: ignore[no-untyped-def]
    """Nodes of one cell into x[:, :, lane], relative to the first, in units that keep products finite.

    False for a cell with a coordinate that is not finite.
    """
    extent = 0.0
    for j in range(x.shape[0]):
        for d in range(3):
            x[j, d, lane] = points[nodes[row, j], d] - points[nodes[row, 0], d]
            extent += abs(x[j, d, lane])
    if SAFE_LOW < extent < SAFE_HIGH:
        return True
    unit = rescale(x[:, :, lane], points, nodes[row])
    return unit == unit


@inner
def determinants(x, way, kind, t, c, out, largest, rounding):  # type: ignore[no-untyped-def]
    """Bernstein coefficients of the determinants of cells side by side.

    x (n, 3, L): nodes.  way: a `Formula`.  t (k, 3, L), c (b, 3, L): scratch for derivatives and cross product.
    out (m, L).  largest (4, 3, L): of each component, the largest of the three derivatives and of the nodes.
    rounding (L,): no coefficient is off by more.

    Rounding, with u = 2**-53, e the largest coordinates, a, b, c the largest components of the three derivatives, each
    with its own error added: a derivative is off by s u e, s the largest (m + 1) sum |weight| over its rows of m
    weights. A determinant is the sum of six products of an x, a y and a z, so that it is off by u times the sum, over
    the orders (i, j, k) of the axes, of s_a e_i b_j c_k + s_b a_i e_j c_k + s_c a_i b_j e_k + r a_i b_j c_k. Here r is
    the number of roundings from derivatives to a coefficient, the weights of which add up to 1. A quarter more covers
    the roundings of the bound. Kept apart by axes, it is as sharp for a flat cell along the axes as for a cube.
    """
    lanes = x.shape[2]
    t[:] = 0.0
    for k in range(len(way.derivative)):
        row, node, weight = way.derivative[k, 0], way.derivative[k, 1], way.derivative_weight[k]
        for d in range(3):
            to, of = t[row, d], x[node, d]
            for i in range(lanes):
                to[i] += weight * of[i]
    first, second = way.counts[0], way.counts[1]
    third = first + second
    if kind != SOLID:
        _normals(x, way, kind, t[third])
    c[:] = 0.0
    for k in range(len(way.cross)):
        a, b, to, weight = t[way.cross[k, 1]], t[first + way.cross[k, 2]], c[way.cross[k, 0]], way.cross_weight[k]
        for i in range(lanes):
            to[0, i] += weight * (a[1, i] * b[2, i] - a[2, i] * b[1, i])
            to[1, i] += weight * (a[2, i] * b[0, i] - a[0, i] * b[2, i])
            to[2, i] += weight * (a[0, i] * b[1, i] - a[1, i] * b[0, i])
    out[:] = 0.0
    for k in range(len(way.dot)):
        a, b, to, weight = c[way.dot[k, 1]], t[third + way.dot[k, 2]], out[way.dot[k, 0]], way.dot_weight[k]
        for i in range(lanes):
            to[i] += weight * (a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i])
    largest[:] = 0.0
    for j in range(x.shape[0]):
        _widen(largest[3], x[j])
    for k in range(len(t)):
        _widen(largest[0 if k < first else (1 if k < third else 2)], t[k])
    rounding[:] = 0.0
    sa, sb, sc, every = way.rounding[0], way.rounding[1], way.rounding[2], way.rounding[3]
    for order in range(len(_ORDERS)):
        p, q, r = _ORDERS[order, 0], _ORDERS[order, 1], _ORDERS[order, 2]
        for i in range(lanes):
            ea, eb, ec = sa * largest[3, p, i], sb * largest[3, q, i], sc * largest[3, r, i]
            a1, b1, c1 = largest[0, p, i] + _UNIT * ea, largest[1, q, i] + _UNIT * eb, largest[2, r, i] + _UNIT * ec
            rounding[i] += 1.25 * _UNIT * (ea * b1 * c1 + a1 * eb * c1 + a1 * b1 * ec + every * a1 * b1 * c1)


@inner
def _widen(largest, vector):  # type: ignore[no-untyped-def]
    for d in range(3):
        for i in range(largest.shape[1]):
            size = abs(vector[d, i])
            largest[d, i] = size if size > largest[d, i] else largest[d, i]


@inner
def _normals(x, way, kind, out):  # type: ignore[no-untyped-def]
    """The direction from which surfaces are seen: up, or the area vector of their corners."""
    last = way.n_corners[0] - 1
    p, q, r, s = (0, 1, 0, 2) if last == 2 else (0, 2, 1, 3)
    for i in range(x.shape[2]):
        ux, uy, uz = x[q, 0, i] - x[p, 0, i], x[q, 1, i] - x[p, 1, i], x[q, 2, i] - x[p, 2, i]
        vx, vy, vz = x[s, 0, i] - x[r, 0, i], x[s, 1, i] - x[r, 1, i], x[s, 2, i] - x[r, 2, i]
        out[0, i] = uy * vz - uz * vy if kind == SHELL else 0.0
        out[1, i] = uz * vx - ux * vz if kind == SHELL else 0.0
        out[2, i] = ux * vy - uy * vx if kind == SHELL else 1.0


@inner
def new_scratch(way, kind, lanes):  # type: ignore[no-untyped-def]
    """Room for the derivatives, the cross product and the determinant of cells side by side."""
    derivatives = way.counts.sum() + (1 if kind != SOLID else 0)
    return np.empty((derivatives, 3, lanes)), np.empty((way.size[0], 3, lanes)), np.empty((way.size[1], lanes))


@inner
def _lowest(out, sign, low):  # type: ignore[no-untyped-def]
    """Smallest coefficient of each cell, seen from its sign."""
    low[:] = np.inf
    for k in range(len(out)):
        for i in range(len(low)):
            value = out[k, i] * sign[i]
            low[i] = low[i] if value >= low[i] else value


@inner
def _bent(x, bend, slack, largest, change):  # type: ignore[no-untyped-def]
    """How much the bends of a cell can change the determinants of its linear cell; slack, `largest` are that one's."""
    lanes = len(change)
    row, most, off = -1, np.zeros((3, lanes)), np.zeros((3, lanes))
    for k in range(len(bend.node)):
        if bend.node[k, 0] != row:
            row = bend.node[k, 0]
            _widen(most, off)
            off[:] = 0.0
        for d in range(3):
            for i in range(lanes):
                off[d, i] += bend.weight[k] * x[bend.node[k, 1], d, i]
    _widen(most, off)
    for d in range(3):
        for i in range(lanes):  # at most nine terms, with weights of 2 in all
            most[d, i] += 20.0 * _UNIT * largest[3, d, i]
    change[:] = 0.0
    for order in range(len(_ORDERS)):
        j, k, m = _ORDERS[order, 0], _ORDERS[order, 1], _ORDERS[order, 2]
        for i in range(lanes):
            p = largest[0, j, i] + _UNIT * slack[0] * largest[3, j, i]
            q = largest[1, k, i] + _UNIT * slack[1] * largest[3, k, i]
            r = largest[2, m, i] + _UNIT * slack[2] * largest[3, m, i]
            a, b, c = bend.reach[0] * most[j, i], bend.reach[1] * most[k, i], bend.reach[2] * most[m, i]
            more = a * q * r + p * b * r + p * q * c + a * b * r + a * q * c + p * b * c + a * b * c
            change[i] += 1.25 * more


@kernel
def prove(
    points: Floats,
    nodes: NDArray[np.integer],
    way: Formula,
    linear: Formula,
    bend: Bends,
    kind: int,
    sign: NDArray[np.int8],
    proven: NDArray[np.bool_],
) -> None:
    """proven[k]: the determinant of cell k, times its sign, has only coefficients above their rounding.

    nodes (cells, n): all nodes of cells of one type; linear: the formula of their corners; bend: `bends` of the type.
    A group of cells so straight that their linear cells prove it is done at once.  Releases the GIL.
    """
    n, lanes = nodes.shape[1], _GROUP
    x, largest = np.zeros((n, 3, lanes)), np.empty((4, 3, lanes))
    t, c, out = new_scratch(way, kind, lanes)
    t1, c1, out1 = new_scratch(linear, kind, lanes)
    rounding, change, low = np.empty(lanes), np.empty(lanes), np.empty(lanes)
    sound, side = np.empty(lanes, np.bool_), np.empty(lanes)
    for start in range(0, len(nodes), lanes):
        used = min(lanes, len(nodes) - start)
        for i in range(lanes):  # the last cell fills the group
            row = start + min(i, used - 1)
            sound[i], side[i] = gather(points, nodes, row, x, i), sign[row]
        determinants(x, linear, kind, t1, c1, out1, largest, rounding)
        _bent(x, bend, linear.rounding, largest, change)
        _lowest(out1, side, low)
        done = 0
        for i in range(used):
            proven[start + i] = sound[i] and low[i] > rounding[i] + change[i]
            done += proven[start + i]
        if done < used:
            determinants(x, way, kind, t, c, out, largest, rounding)
            _lowest(out, side, low)
            for i in range(used):
                proven[start + i] = sound[i] and low[i] > rounding[i]
