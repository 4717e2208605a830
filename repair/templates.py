"""How a cell is cut when points are put into the middle of its edges: tables of children, by the edges that are cut.

Triangles and tets can be cut at any of their edges. Two cells that share a face must cut it alike, knowing nothing of
each other: their corners are put in the order of their point rows first, and a face of two cut edges then takes the
diagonal from the smaller of the corners that it leaves whole. The interior of a tet is filled by search, with whole
numbers: among all fillings that use no further point, the one of the best worst shape. Faces and interiors so found
tile the cell, since all children are positive and their boundary is that of the cell.

Quads, hexes, wedges and pyramids are cut at all of their edges, with points in the middle of their quads.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.mesh import Ints

__all__ = ["OCTAHEDRON", "tet_children", "tri_children", "whole_children"]

Cut = tuple[int, ...]

_TET_EDGES = CELL_TYPES["tet"].edges
_TRI_EDGES = CELL_TYPES["tri"].edges
OCTAHEDRON = ((4, 9), (5, 7), (6, 8))
"""The diagonals of the octahedron that remains of a tet all of whose edges are cut: its three fillings."""

_PLACES = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]])
_REGULAR = np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]], dtype=float)
_MOST_FILLINGS = 500


def _cut_triangle(a: int, b: int, c: int, middle: dict[frozenset[int], int]) -> list[Cut]:
    """Children of a triangle whose corners are numbered by rank; middle: the node on each cut edge."""
    ab, bc, ca = (middle.get(frozenset(edge)) for edge in ((a, b), (b, c), (c, a)))
    cut = [m is not None for m in (ab, bc, ca)]
    if sum(cut) == 0:
        return [(a, b, c)]
    if ab is not None and bc is not None and ca is not None:
        return [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    if sum(cut) == 1 and ab is not None:
        return [(a, ab, c), (ab, b, c)]
    if bc is not None and ca is not None:
        rest = [(a, b, bc), (a, bc, ca)] if a < b else [(a, b, ca), (b, bc, ca)]
        return [(c, ca, bc), *rest]
    return _cut_triangle(b, c, a, middle)


def _middles(edges: tuple[tuple[int, ...], ...], first: int, mask: int) -> dict[frozenset[int], int]:
    return {frozenset(edge): first + e for e, edge in enumerate(edges) if mask >> e & 1}


@cache
def tri_children(mask: int) -> Ints:
    """(k, 3) children of a triangle with corners 0 to 2 in ascending order and node 3 + e on edge e, for e in mask."""
    return np.array(_cut_triangle(0, 1, 2, _middles(_TRI_EDGES, 3, mask)))


@cache
def tet_children(mask: int, diagonal: int = 0) -> Ints:
    """(k, 4) children of a tet with corners 0 to 3 in ascending order and node 4 + e on edge e, for e in mask.

    diagonal: row of `OCTAHEDRON`, where all six edges are cut.
    """
    middle = _middles(_TET_EDGES, 4, mask)
    front = frozenset(
        _turned(t) for face in CELL_TYPES["tet"].faces for t in _cut_triangle(face[0], face[1], face[2], middle)
    )
    nodes = tuple(range(4)) + tuple(sorted(middle.values()))
    fillings = _fill(front, nodes)
    best: tuple[float, list[Cut]] | None = None
    for _, filling in zip(range(_MOST_FILLINGS), fillings, strict=False):
        if mask == 63 and not any(set(OCTAHEDRON[diagonal]) <= set(tet) for tet in filling):
            continue
        shape = min(_shape(tet) for tet in filling)
        if best is None or shape > best[0] + 1e-12:
            best = shape, filling
    assert best is not None  # noqa: S101 - a test goes through all masks
    return np.array(best[1])


def _turned(t: Cut) -> Cut:
    """The same loop with its smallest node first."""
    i = t.index(min(t))
    return t[i:] + t[:i]


@cache
def _size(tet: Cut) -> int:
    """Six times the volume, in eighths of that of the whole."""
    x = _positions(_PLACES)[list(tet)]
    return round(np.linalg.det((x[1:] - x[0]).astype(float)))


def _positions(corners: Ints) -> Ints:
    return np.concatenate([corners, [(corners[a] + corners[b]) // 2 for a, b in _TET_EDGES]])


@cache
def _shape(tet: Cut) -> float:
    """Volume over the cubed root mean square of the edges, of a child of the regular tet."""
    x = np.concatenate([_REGULAR, [(_REGULAR[a] + _REGULAR[b]) / 2 for a, b in _TET_EDGES]])[list(tet)]
    edges = np.array([x[i] - x[j] for i, j in _TET_EDGES])
    return float(abs(np.linalg.det(x[1:] - x[0])) / np.mean((edges**2).sum(axis=1)) ** 1.5)


def _fill(front: frozenset[Cut], nodes: Cut) -> Iterator[list[Cut]]:
    """All ways to fill the space inside the triangles of `front`, which run outward, with positive tets of `nodes`."""
    if not front:
        yield []
        return
    a, b, c = min(front)
    for p in nodes:
        if p in (a, b, c) or _size((p, a, b, c)) <= 0:
            continue
        rest = set(front) - {(a, b, c)}
        for side in ((p, c, b), (p, a, c), (p, b, a)):
            if _turned(side) in rest:
                rest.remove(_turned(side))
            else:
                rest.add(_turned(side[::-1]))
        # what is added may not run over what is there already from the other side
        if any(_turned(t[::-1]) in rest for t in rest):
            continue
        for filling in _fill(frozenset(rest), nodes):
            yield [(p, a, b, c), *filling]


@cache
def whole_children(name: str) -> dict[str, Ints]:
    """Children, by type, of a quad, hex, wedge or pyramid all of whose edges are cut.

    Nodes: the corners, then the middles of the edges, of the quads and, of a hex, of the cell, in the order of
    `CELL_TYPES`.
    """
    kind = CELL_TYPES[name]
    n = kind.n_nodes
    at = {frozenset((i,)): i for i in range(n)}
    at |= {frozenset(edge): n + e for e, edge in enumerate(kind.edges)}
    quads = [face for face in kind.faces if len(face) == 4]
    at |= {frozenset(face): n + len(kind.edges) + f for f, face in enumerate(quads)}
    at.setdefault(frozenset(range(n)), n + len(kind.edges) + len(quads))

    def node(*corners: int) -> int:
        return at[frozenset(corners)]

    if name == "quad":
        return {"quad": np.array([[node(i), node(i, (i + 1) % 4), node(0, 1, 2, 3), node(i, (i - 1) % 4)]
                                  for i in range(4)])}  # fmt: skip
    if name == "hex":
        return {"hex": np.array([[node(*_box(i, j)) for j in range(8)] for i in range(8)])}
    triangle = [((0,), (0, 1), (2, 0)), ((1,), (1, 2), (0, 1)), ((2,), (2, 0), (1, 2)), ((0, 1), (1, 2), (2, 0))]
    if name == "wedge":
        layers = [lambda c: c, lambda c: (*c, *(i + 3 for i in c)), lambda c: tuple(i + 3 for i in c)]
        return {"wedge": np.array([[node(*level(c)) for level in pair for c in corners]
                                   for pair in (layers[:2], layers[1:]) for corners in triangle])}  # fmt: skip
    ring = [(i, (i + 1) % 4, (i - 1) % 4) for i in range(4)]
    pyramids = [[node(i), node(i, j), node(0, 1, 2, 3), node(i, k), node(i, 4)] for i, j, k in ring]
    top = [node(i, 4) for i in range(4)]
    pyramids += [[*top, 4], [*top[::-1], node(0, 1, 2, 3)]]
    tets = [[node(0, 1, 2, 3), node(i, j), node(j, 4), node(i, 4)] for i, j, _ in ring]
    return {"pyramid": np.array(pyramids), "tet": np.array(tets)}


_CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def _box(i: int, j: int) -> list[int]:
    """Corners of a hex in whose middle corner j of the child at corner i lies."""
    low = [min(a, b) for a, b in zip(_CUBE[i], _CUBE[j], strict=True)]
    high = [max(a, b) for a, b in zip(_CUBE[i], _CUBE[j], strict=True)]
    return [k for k, at in enumerate(_CUBE) if all(p <= x <= q for p, x, q in zip(low, at, high, strict=True))]
