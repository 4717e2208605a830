"""Gmsh's element numbers: dimension, node count, the cell of this program each becomes, node permutation.

Source: table "MSH file format" of the Gmsh reference manual, and its section "Node ordering".
Gmsh always writes the corners first, in the order used here; only the mid-edge and mid-face nodes differ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["DIMENSIONS", "ELEMENTS", "NODE_COUNTS", "GmshElement"]

_DIMENSION = {"vertex": 0, "line": 1, "tri": 2, "quad": 2, "tet": 3, "pyramid": 3, "wedge": 3, "hex": 3}
_CORNERS = {"vertex": 1, "line": 2, "tri": 3, "quad": 4, "tet": 4, "pyramid": 5, "wedge": 6, "hex": 8}
_TITLES = {
    "line": "lines",
    "tri": "triangles",
    "quad": "quadrilaterals",
    "tet": "tetrahedra",
    "pyramid": "pyramids",
    "wedge": "prisms",
    "hex": "hexahedra",
}

# Gmsh number -> nodes, for the elements of order 3 and more; their corners alone are kept.
_HIGH_ORDER = {
    "line": {26: 4, 27: 5, 28: 6, 62: 7, 63: 8, 64: 9, 65: 10, 66: 11},
    "tri": {20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 42: 28, 43: 36, 44: 45, 45: 55, 46: 66}
    | {52: 18, 53: 21, 54: 24, 55: 27, 56: 30},
    "quad": {36: 16, 37: 25, 38: 36, 39: 12, 40: 16, 41: 20, 47: 49, 48: 64, 49: 81, 50: 100, 51: 121}
    | {57: 24, 58: 28, 59: 32, 60: 36, 61: 40},
    "tet": {29: 20, 30: 35, 31: 56, 32: 22, 33: 28, 71: 84, 72: 120, 73: 165, 74: 220, 75: 286}
    | {79: 34, 80: 40, 81: 46, 82: 52, 83: 58, 137: 16},
    "pyramid": {118: 30, 119: 55, 120: 91, 121: 140, 122: 204, 123: 285, 124: 385}
    | {125: 21, 126: 29, 127: 37, 128: 45, 129: 53, 130: 61, 131: 69},
    "wedge": {90: 40, 91: 75, 106: 126, 107: 196, 108: 288, 109: 405, 110: 550}
    | {111: 24, 112: 33, 113: 42, 114: 51, 115: 60, 116: 69, 117: 78},
    "hex": {92: 64, 93: 125, 94: 216, 95: 343, 96: 512, 97: 729, 98: 1000}
    | {99: 32, 100: 44, 101: 56, 102: 68, 103: 80, 104: 92, 105: 104},
}


@dataclass(frozen=True)
class GmshElement:
    """One element number of Gmsh.

    type: the cell type it becomes.  n_nodes: nodes in the file.  columns: which of them make the cell, in
    VTK order.  loss: what the cell lacks, for the ledger, or "".
    """

    number: int
    type: str
    dimension: int
    n_nodes: int
    columns: tuple[int, ...]
    loss: str = ""


def _tail(first: int, text: str) -> tuple[int, ...]:
    return (*range(first), *(int(word) for word in text.split()))


def _elements() -> dict[int, GmshElement]:
    rows: list[GmshElement] = []

    def add(number: int, name: str, family: str, columns: tuple[int, ...], n_nodes: int = 0, loss: str = "") -> None:
        rows.append(GmshElement(number, name, _DIMENSION[family], n_nodes or len(columns), columns, loss))

    for number, family in {
        15: "vertex",
        1: "line",
        2: "tri",
        3: "quad",
        4: "tet",
        5: "hex",
        6: "wedge",
        7: "pyramid",
    }.items():
        add(number, family, family, tuple(range(_CORNERS[family])))
    for number, name, family, n in (
        (8, "line3", "line", 3),
        (9, "tri6", "tri", 6),
        (16, "quad8", "quad", 8),
        (10, "quad9", "quad", 9),
    ):
        add(number, name, family, tuple(range(n)))
    # Mid-edge nodes of VTK's edge i stand in this column of Gmsh's line.
    hex_edges = "8 11 13 9 16 18 19 17 10 12 14 15"
    wedge = _tail(6, "6 9 7 12 14 13 8 10 11")
    pyramid = _tail(5, "5 8 10 6 7 9 11 12")
    add(11, "tet10", "tet", _tail(8, "9 8"))
    add(17, "hex20", "hex", _tail(8, hex_edges))
    add(12, "hex27", "hex", _tail(8, hex_edges + " 22 23 21 24 20 25 26"))
    add(18, "wedge15", "wedge", wedge)
    add(13, "wedge15", "wedge", wedge, 18, "prisms of 18 nodes are read without their 3 face nodes")
    add(19, "pyramid13", "pyramid", pyramid)
    add(14, "pyramid13", "pyramid", pyramid, 14, "pyramids of 14 nodes are read without the node of their base")
    for family, sizes in _HIGH_ORDER.items():
        for number, n in sizes.items():
            loss = f"{_TITLES[family]} of {n} nodes (third order or higher) are measured by their corners"
            add(number, family, family, tuple(range(_CORNERS[family])), n, loss)
    return {row.number: row for row in rows}


ELEMENTS: dict[int, GmshElement] = _elements()
"""Every element number that can be read."""

_TABLE_END = max(ELEMENTS) + 1


def _table(field: str) -> NDArray[np.int64]:
    values = np.full(_TABLE_END, -1, dtype=np.int64)
    for number, row in ELEMENTS.items():
        values[number] = getattr(row, field)
    values.flags.writeable = False
    return values


NODE_COUNTS = _table("n_nodes")
"""Nodes by element number, -1 where there is no such element: what the compiled scanners look up."""

DIMENSIONS = _table("dimension")
"""Dimension by element number, -1 where there is no such element."""
