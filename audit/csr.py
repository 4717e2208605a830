"""Ragged tables as two arrays (offsets into items): building, inverting and picking rows of them.

Row r of a table is `items[offsets[r]:offsets[r + 1]]`. All of it is int32, built by counting sorts, so the items
of a row ascend whenever they stand for things that were visited in ascending order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.errors import MeshError
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import CellBlock, Ints, index_array

__all__ = ["faces_by_cell", "invert", "ragged", "sort_keys", "take", "uniform_offsets"]

_GAPS = (701, 301, 132, 57, 23, 10, 4, 1)
"""Ciura's (2001), enough for the keys of a cell."""
_SHORT = 2048
_WIDE_GAPS = np.array(
    [59724290, 26544129, 11797391, 5243285, 2330349, 1035711, 460316, 204585, 90927, 40412, 17961, 7983, 3548, 1577]
)
"""Those before them, each 2.25 times the next, for more keys."""


@inner
def sort_keys(keys: NDArray[np.int64], n: int) -> None:
    """Sort keys[:n] in place by Shell's method: faster on a cell's few keys than a library call, quick to compile."""
    if n > _SHORT:
        for k in range(_WIDE_GAPS.size):
            _sort_at(keys, n, _WIDE_GAPS[k])
    for gap in _GAPS:
        _sort_at(keys, n, gap)


@inner
def _sort_at(keys: NDArray[np.int64], n: int, gap: int) -> None:
    """One round of Shell's method."""
    for i in range(gap, n):
        key = keys[i]
        j = i
        while j >= gap and keys[j - gap] > key:
            keys[j] = keys[j - gap]
            j -= gap
        keys[j] = key


@kernel
def _faces_by_cell(owner: Ints, neighbour: Ints, offsets: Ints, items: Ints) -> None:
    n_cells = offsets.size - 1
    for f in range(owner.size):
        offsets[owner[f] + 1] += 1
        if neighbour[f] >= 0:
            offsets[neighbour[f] + 1] += 1
    for c in range(n_cells):
        offsets[c + 1] += offsets[c]
    # offsets[c] serves as the write cursor of row c and ends as the start of row c + 1: shift back afterwards.
    for f in range(owner.size):
        c = owner[f]
        items[offsets[c]] = f
        offsets[c] += 1
        c = neighbour[f]
        if c >= 0:
            items[offsets[c]] = f
            offsets[c] += 1
    for c in range(n_cells, 0, -1):
        offsets[c] = offsets[c - 1]
    offsets[0] = 0


def faces_by_cell(owner: Ints, neighbour: Ints, n_cells: int) -> tuple[Ints, Ints]:
    """(offsets (n_cells + 1,), items): the rows of the faces of every cell, ascending.

    owner (f,) within 0 .. n_cells - 1 and neighbour (f,) within -1 .. n_cells - 1: checked by the caller.
    """
    offsets = np.zeros(n_cells + 1, np.int32)
    items = np.empty(len(owner) + np.count_nonzero(neighbour >= 0), np.int32)
    _faces_by_cell(index_array(owner), index_array(neighbour), offsets, items)
    return index_array(offsets), index_array(items)


@kernel
def _invert(offsets: Ints, items: Ints, n_targets: int) -> tuple[Ints, Ints]:
    starts = np.zeros(n_targets + 1, np.int32)
    for i in range(items.size):
        starts[items[i] + 1] += 1
    for t in range(n_targets):
        starts[t + 1] += starts[t]
    rows = np.empty(items.size, np.int32)
    for r in range(offsets.size - 1):
        for i in range(offsets[r], offsets[r + 1]):
            t = items[i]
            rows[starts[t]] = r
            starts[t] += 1
    for t in range(n_targets, 0, -1):
        starts[t] = starts[t - 1]
    starts[0] = 0
    return starts, rows


def invert(offsets: Ints, items: Ints, n_targets: int) -> tuple[Ints, Ints]:
    """The table the other way round: for each of the `n_targets` items the rows that list it, ascending.

    items within 0 .. n_targets - 1, checked by the caller. A row that lists an item twice appears twice.
    """
    starts, rows = _invert(index_array(offsets), index_array(items), n_targets)
    return index_array(starts), index_array(rows)


@kernel
def _take(offsets: Ints, items: Ints, rows: Ints) -> tuple[Ints, Ints]:
    starts = np.zeros(rows.size + 1, np.int32)
    for r in range(rows.size):
        starts[r + 1] = starts[r] + offsets[rows[r] + 1] - offsets[rows[r]]
    out = np.empty(starts[rows.size], np.int32)
    for r in range(rows.size):
        base = offsets[rows[r]]
        for i in range(starts[r + 1] - starts[r]):
            out[starts[r] + i] = items[base + i]
    return starts, out


def take(offsets: Ints, items: Ints, rows: Ints) -> tuple[Ints, Ints]:
    """The table that holds these rows of another, in that order."""
    starts, out = _take(index_array(offsets), index_array(items), index_array(rows))
    return index_array(starts), index_array(out)


def uniform_offsets(n_rows: int, width: int) -> Ints:
    """Offsets of a table whose every row has `width` items."""
    return index_array(np.arange(0, n_rows * width + 1, width) if width else np.zeros(n_rows + 1, np.int32))


def ragged(block: CellBlock) -> tuple[Ints, Ints]:
    """(offsets, items) of a block of polygons or polyhedra; MeshError for a type of fixed size."""
    if block.offsets is None or block.items is None:
        raise MeshError(f"{block.type} cells have nodes, not items")
    return block.offsets, block.items
