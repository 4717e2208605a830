"""Index lines across a branch cut: whether they come back to it from the other side, and after how many cells."""

from __future__ import annotations

from typing import Any

import numpy as np

from meshwright.audit.connectivity import faces, faces_of_cells
from meshwright.audit.mesh import NO_CELL, Ints, Mesh

__all__ = ["closing_rings"]

_TRIED = 16
_MOST_STEPS = 100_000


def closing_rings(mesh: Mesh, first: Ints, second: Ints) -> dict[str, Any]:
    """Follow quadrilaterals or hexahedra across the mesh from faces `first` of a cut, each of which lies on `second`.

    closed_lines, lines: how many of those tried (16, spread over the cut) come back to the face they left from, on its
    other side.  cells_around: how many cells each of these crossed, None unless all agree.
    """
    chosen = np.unique(np.linspace(0, len(first) - 1, min(_TRIED, len(first))).astype(int))
    lengths = []
    steps = _MOST_STEPS
    for i in chosen.tolist():
        last, n = _follow(mesh, int(first[i]), steps)
        steps -= n
        if last == second[i]:
            lengths.append(n)
    agree = len(lengths) == len(chosen) and len(set(lengths)) == 1
    return {"lines": len(chosen), "closed_lines": len(lengths), "cells_around": lengths[0] if agree else None}


def _follow(mesh: Mesh, face: int, most: int) -> tuple[int, int]:
    """(the boundary face an index line ends at, cells crossed); face -1 where a cell has no opposite face."""
    found = faces(mesh)
    starts, of_cell = faces_of_cells(mesh)
    cell = int(found.owner[face])
    for n in range(1, most + 1):
        corners = found.nodes[found.offsets[face] : found.offsets[face + 1]]
        across = -1
        around = of_cell[starts[cell] : starts[cell + 1]].tolist()
        if len(around) not in (4, 6):
            return -1, n
        for other in around:
            if not np.isin(found.nodes[found.offsets[other] : found.offsets[other + 1]], corners).any():
                across = other if across < 0 else -2
        if across < 0:
            return -1, n
        face = across
        if found.neighbour[face] == NO_CELL:
            return face, n
        cell = int(found.owner[face] + found.neighbour[face] - cell)
    return -1, most
