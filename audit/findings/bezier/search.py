"""The cells whose Bernstein coefficients leave their sign open: cut into parts until it shows, or the budget ends."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.bernstein import indices, split_matrices
from meshwright.audit.findings.bezier.proof import SHELL, determinants, gather, new_scratch
from meshwright.audit.findings.bezier.tables import Formula
from meshwright.audit.jit import inner, kernel
from meshwright.audit.shape_functions import DOMAINS, tangents

__all__ = [
    "FIRST_BUDGET",
    "INVALID",
    "LEVELS",
    "UNDECIDED",
    "VALID",
    "Cuts",
    "budget_for",
    "cuts",
    "search",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

VALID, INVALID, UNDECIDED = 1, 2, 3

LEVELS = 36
"""Cuts on the way to the smallest part: 12 along each axis of a hexahedron, parts of 1/4096 of it."""

FIRST_BUDGET = 64
"""Parts to look at in each open cell; enough for nearly all."""

_MOST, _ALL = 1 << 11, 1 << 22
"""Parts to look at in a cell still open then, and in all of those together: a minute on one processor at the most."""

_MOST_PARTS = 8

_UNIT = 2.0**-53


class Cuts(NamedTuple):
    """How the coefficients of a polynomial are written on parts of its domain, one factor cut at a time.

    parts (f,): into how many a factor is cut.  shape (f, 3): coefficients as (before the factor, of it, after it).
    matrix (f, 8, k, k): for each part, padded with zeros.
    """

    parts: Ints
    shape: Ints
    matrix: Floats


@cache
def cuts(name: str) -> Cuts:
    """For the determinant of a second-order type."""
    domain, degree = DOMAINS[name], _degree(name)
    sizes = [len(indices((d,), (p,))) for d, p in zip(domain, degree, strict=True)]
    matrix = np.zeros((len(domain), _MOST_PARTS, max(sizes), max(sizes)))
    for f, (d, p, size) in enumerate(zip(domain, degree, sizes, strict=True)):
        for k, part in enumerate(split_matrices(d, p)[0]):
            matrix[f, k, :size, :size] = part
    shape = [(int(np.prod(sizes[:f])), sizes[f], int(np.prod(sizes[f + 1 :]))) for f in range(len(domain))]
    return Cuts(np.array([2**d for d in domain]), np.array(shape), matrix)


def _degree(name: str) -> tuple[int, ...]:
    return tuple(sum(powers) for powers in zip(*(field.degree for field in tangents(name)), strict=True))


@inner
def _cut(whole, part, cut, factor, child):  # type: ignore[no-untyped-def]
    """Coefficients (m, q) of a polynomial on a part of its domain."""
    before, size, after = cut.shape[factor, 0], cut.shape[factor, 1], cut.shape[factor, 2]
    for o in range(before):
        for a in range(size):
            to = (o * size + a) * after
            for i in range(after):
                for k in range(whole.shape[1]):
                    part[to + i, k] = 0.0
            for b in range(size):
                weight = cut.matrix[factor, child, a, b]
                if weight != 0.0:
                    of = (o * size + b) * after
                    for i in range(after):
                        for k in range(whole.shape[1]):
                            part[to + i, k] += weight * whole[of + i, k]


@inner
def _least(values, off):  # type: ignore[no-untyped-def]
    """Smallest coefficient less its rounding; of normals (q = 3) along their own mean direction."""
    low = np.inf
    if values.shape[1] == 1:
        for k in range(len(values)):
            low = min(low, values[k, 0])
        return low - off
    nx, ny, nz = 0.0, 0.0, 0.0
    for k in range(len(values)):
        nx, ny, nz = nx + values[k, 0], ny + values[k, 1], nz + values[k, 2]
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if size == 0.0:
        return -np.inf
    largest = 0.0
    for k in range(len(values)):
        low = min(low, (values[k, 0] * nx + values[k, 1] * ny + values[k, 2] * nz) / size)
        largest = max(largest, abs(values[k, 0]), abs(values[k, 1]), abs(values[k, 2]))
    # three components are off by `off` each, and the sum by ten roundings; the direction itself needs no accuracy
    return low - 2.0 * off - 16.0 * _UNIT * largest


@inner
def _copy(of, to):  # type: ignore[no-untyped-def]
    for k in range(of.shape[0]):
        for d in range(of.shape[1]):
            to[k, d] = of[k, d]


@inner
def _witness(values, off, corner, known):  # type: ignore[no-untyped-def]
    """(corner, value) where a polynomial is surely negative, or, unless one is known, may be; else (-1, 0)."""
    found, there = -1, 0.0
    for v in range(len(corner)):
        value = values[corner[v], 0]
        if value < -off:
            return v, value
        if value <= off and not known and found < 0:
            found, there = v, value
    return found, there


@inner
def _explore(first, off, cut, corner, budget, path):  # type: ignore[no-untyped-def]
    """Depth first, the worst part next. Returns (state, levels of `path`, corner of that part, value there).

    first (m, q): coefficients of the whole cell, none off by more than `off`.  path (LEVELS,): filled with the cuts
    that lead to a part with a corner at which the polynomial is 0 or less; of an UNDECIDED cell, to one at which it is
    so small that its sign does not show, if there is one (levels -1 otherwise).
    """
    m, q = first.shape
    levels, v, value = -1, -1, 0.0
    if q == 1:
        v, value = _witness(first, off, corner, False)
        levels = 0 if v >= 0 else -1
        if value < -off:
            return INVALID, levels, v, value
    if _least(first, off) > 0.0:
        return VALID, -1, -1, 0.0
    room = LEVELS * (_MOST_PARTS - 1) + _MOST_PARTS
    values, part, offs, low = (
        np.empty((room, m, q)),
        np.empty((_MOST_PARTS, m, q)),
        np.empty(room),
        np.empty(_MOST_PARTS),
    )
    level, ways, way = np.empty(room, np.int64), np.empty((room, LEVELS), np.int64), np.empty(LEVELS, np.int64)
    _copy(first, values[0])
    offs[0], level[0] = off, 0
    top, looked, opened = 0, 1, False
    while top >= 0 and looked < budget:
        here, factor = level[top], level[top] % len(cut.parts)
        if here == LEVELS:
            opened = True
            top -= 1
            continue
        for k in range(here):
            way[k] = ways[top, k]
        largest, worst = 0.0, 0
        for k in range(m):
            for d in range(q):
                largest = max(largest, abs(values[top, k, d]))
        # the weights of a part are exact, not negative and add up to 1
        part_off = offs[top] + (cut.shape[factor, 1] + 2) * _UNIT * largest
        for child in range(cut.parts[factor]):
            _cut(values[top], part[child], cut, factor, child)
            looked += 1
            low[child] = _least(part[child], part_off)
            worst = child if low[child] < low[worst] else worst
            if q == 1 and low[child] <= 0.0:
                at, there = _witness(part[child], part_off, corner, levels >= 0)
                if at >= 0:
                    levels, v, value, way[here] = here + 1, at, there, child
                    for k in range(here + 1):
                        path[k] = way[k]
                    if there < -part_off:
                        return INVALID, levels, v, value
        top -= 1
        for turn in range(2):  # the worst one last, so that it comes next
            for child in range(cut.parts[factor]):
                if low[child] <= 0.0 and (child == worst) == (turn == 1):
                    top += 1
                    _copy(part[child], values[top])
                    offs[top], level[top] = part_off, here + 1
                    for k in range(here):
                        ways[top, k] = way[k]
                    ways[top, here] = child
    if opened or top >= 0:
        return UNDECIDED, levels, v, value
    return VALID, -1, -1, 0.0


@inner
def _off_normals(way, largest):  # type: ignore[no-untyped-def]
    """Rounding of the components of the cross product: as in `determinants`, of two products in place of six."""
    e = largest[3, :, 0].max()
    ea, eb = way.rounding[0] * e, way.rounding[1] * e
    a, b = largest[0, :, 0].max() + _UNIT * ea, largest[1, :, 0].max() + _UNIT * eb
    return 2.5 * _UNIT * (ea * b + eb * a + way.rounding[3] * a * b)


@kernel
def search(
    points: Floats,
    nodes: NDArray[np.integer],
    way: Formula,
    cut: Cuts,
    kind: int,
    budget: int,
    sign: NDArray[np.int8],
    state: NDArray[np.int8],
    path: NDArray[np.int8],
    place: NDArray[np.int64],
    value: Floats,
) -> None:
    """Judge cells of one type one by one.

    nodes (cells, n), sign (cells,).  budget: parts of a cell to look at.  Filled: state (cells,), path (cells, LEVELS),
    place (cells, 2): length of the path and corner of the part; see `exact.point_of`.  value (cells,):
    determinant there over the largest absolute coefficient.
    A surface in space that turns away from the normal of its corners is VALID if it has a normal throughout.
    Releases the GIL.
    """
    x, largest, rounding = np.zeros((nodes.shape[1], 3, 1)), np.empty((4, 3, 1)), np.empty(1)
    t, c, out = new_scratch(way, kind, 1)
    normals, aside = np.empty((way.size[0], 3)), np.empty(LEVELS, np.int8)
    for k in range(len(nodes)):
        state[k], place[k, 0], place[k, 1], value[k] = UNDECIDED, -1, -1, np.nan
        if not gather(points, nodes, k, x, 0):
            continue
        determinants(x, way, kind, t, c, out, largest, rounding)
        mean, most = 0.0, 0.0
        for j in range(len(out)):
            out[j, 0] *= sign[k]
            mean += out[j, 0]
            most = max(most, abs(out[j, 0]))
        found, levels, v, there = _explore(out, rounding[0], cut, way.corner, budget, path[k])
        if found != VALID and kind == SHELL and mean > 0.0:
            for j in range(len(c)):
                for d in range(3):
                    normals[j, d] = c[j, d, 0]
            regular, _, _, _ = _explore(normals, _off_normals(way, largest), cut, way.corner, budget, aside)
            found = VALID if regular == VALID else found
        state[k], place[k, 0], place[k, 1], value[k] = found, levels, v, there / most if most > 0.0 else 0.0


def budget_for(n: int) -> int:
    """Parts to look at in each of n cells that the first budget left open."""
    return max(FIRST_BUDGET, min(_MOST, _ALL // max(n, 1)))
