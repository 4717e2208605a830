"""Reference cells: every "which corners make face 3" fact of the program, as tables.

Node order is VTK's (meshio, Gmsh and Exodus agree for linear cells). Faces are listed so that their
right-hand normal leaves a cell of positive volume. A wedge is positive when the normal of 0-1-2 points
towards 3-4-5; its faces below follow from that (VTK 9 code; older VTK text says the opposite).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["CELL_TYPES", "LINEAR_TYPES", "ORDER_OF_TYPES", "POLYTOPES", "CellType", "cell_type"]

Table = NDArray[np.int64]
Rows = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class CellType:
    """One reference cell.

    name: the spelling used everywhere, JSON included.  dimension: topological, 0 to 3.
    n_nodes: nodes of a cell, 0 for polygon and polyhedron (any number).  order: 1 or 2.
    corners: name of the linear type with the same corners (itself when linear).
    edges (m, 2), faces (tuples of 3 or 4 corners, outward), corner_triads (k, 4): corner and its three
    edge neighbours, right-handed; empty at the apex of a pyramid, where the Jacobian is singular.
    diagonals (m, 2): of a quad or the body of a hex.  mid_edges: for second order, the node on each row
    of `edges`.  vtk: VTK cell number.  meshio: meshio's name.  title: for people.
    """

    name: str
    title: str
    dimension: int
    n_nodes: int
    vtk: int
    meshio: str
    order: int = 1
    corners: str = ""
    edges: Rows = ()
    faces: Rows = ()
    triads: Rows = ()
    diagonals: Rows = ()
    mid_edges: tuple[int, ...] = field(default=())

    @cached_property
    def edge_table(self) -> Table:
        """(m, 2) corners of each edge."""
        return np.array(self.edges, dtype=np.int64).reshape(-1, 2)

    @cached_property
    def tri_faces(self) -> Table:
        """(a, 3) corners of each triangular face, outward."""
        return np.array([f for f in self.faces if len(f) == 3], dtype=np.int64).reshape(-1, 3)

    @cached_property
    def quad_faces(self) -> Table:
        """(b, 4) corners of each quadrilateral face, outward."""
        return np.array([f for f in self.faces if len(f) == 4], dtype=np.int64).reshape(-1, 4)

    @cached_property
    def triad_table(self) -> Table:
        """(k, 4) corner, then its three edge neighbours, right-handed in a positive cell."""
        return np.array(self.triads, dtype=np.int64).reshape(-1, 4)

    @cached_property
    def diagonal_table(self) -> Table:
        """(m, 2) corners of each diagonal."""
        return np.array(self.diagonals, dtype=np.int64).reshape(-1, 2)

    @property
    def n_corners(self) -> int:
        """Corner nodes of a cell, 0 for polygon and polyhedron."""
        return CELL_TYPES[self.corners].n_nodes


def _rows(text: str) -> Rows:
    """'01 12 20' -> ((0, 1), (1, 2), (2, 0)), the notation of the reference tables."""
    return tuple(tuple(int(c) for c in word) for word in text.split())


_TRI: dict[str, Any] = dict(edges=_rows("01 12 20"), faces=_rows("012"))
_QUAD: dict[str, Any] = dict(edges=_rows("01 12 23 30"), faces=_rows("0123"), diagonals=_rows("02 13"))
_TET: dict[str, Any] = dict(edges=_rows("01 12 20 03 13 23"), faces=_rows("021 013 123 032"), triads=_rows("0123"))
_PYRAMID: dict[str, Any] = dict(
    edges=_rows("01 12 23 30 04 14 24 34"),
    faces=_rows("0321 014 124 234 304"),
    triads=_rows("0134 1204 2314 3024"),
)
_WEDGE: dict[str, Any] = dict(
    edges=_rows("01 12 20 34 45 53 03 14 25"),
    faces=_rows("021 345 0143 1254 2035"),
    triads=_rows("0123 1204 2015 3540 4351 5432"),
)
_HEX: dict[str, Any] = dict(
    edges=_rows("01 12 23 30 45 56 67 74 04 15 26 37"),
    faces=_rows("0321 4567 0154 1265 2376 3047"),
    triads=_rows("0134 1205 2316 3027 4750 5461 6572 7643"),
    diagonals=_rows("06 17 24 35"),
)

_ALL = (
    CellType("vertex", "vertex", 0, 1, 1, "vertex", corners="vertex"),
    CellType("line", "line", 1, 2, 3, "line", corners="line", edges=_rows("01")),
    CellType("line3", "quadratic line", 1, 3, 21, "line3", order=2, corners="line", edges=_rows("01"), mid_edges=(2,)),
    CellType("tri", "triangle", 2, 3, 5, "triangle", corners="tri", **_TRI),
    CellType("quad", "quadrilateral", 2, 4, 9, "quad", corners="quad", **_QUAD),
    CellType("polygon", "polygon", 2, 0, 7, "polygon", corners="polygon"),
    CellType("tet", "tetrahedron", 3, 4, 10, "tetra", corners="tet", **_TET),
    CellType("pyramid", "pyramid", 3, 5, 14, "pyramid", corners="pyramid", **_PYRAMID),
    CellType("wedge", "prism/wedge", 3, 6, 13, "wedge", corners="wedge", **_WEDGE),
    CellType("hex", "hexahedron", 3, 8, 12, "hexahedron", corners="hex", **_HEX),
    CellType("polyhedron", "polyhedron", 3, 0, 42, "polyhedron", corners="polyhedron"),
    CellType("tri6", "quadratic triangle", 2, 6, 22, "triangle6", 2, "tri", **_TRI, mid_edges=(3, 4, 5)),
    CellType("quad8", "quadratic quadrilateral (8)", 2, 8, 23, "quad8", 2, "quad", **_QUAD, mid_edges=(4, 5, 6, 7)),
    CellType("quad9", "quadratic quadrilateral (9)", 2, 9, 28, "quad9", 2, "quad", **_QUAD, mid_edges=(4, 5, 6, 7)),
    CellType("tet10", "quadratic tetrahedron", 3, 10, 24, "tetra10", 2, "tet", **_TET, mid_edges=tuple(range(4, 10))),
    CellType(
        "pyramid13",
        "quadratic pyramid",
        3,
        13,
        27,
        "pyramid13",
        2,
        "pyramid",
        **_PYRAMID,
        mid_edges=tuple(range(5, 13)),
    ),
    CellType(
        "wedge15", "quadratic prism/wedge", 3, 15, 26, "wedge15", 2, "wedge", **_WEDGE, mid_edges=tuple(range(6, 15))
    ),
    CellType(
        "hex20", "quadratic hexahedron (20)", 3, 20, 25, "hexahedron20", 2, "hex", **_HEX, mid_edges=tuple(range(8, 20))
    ),
    CellType(
        "hex27", "quadratic hexahedron (27)", 3, 27, 29, "hexahedron27", 2, "hex", **_HEX, mid_edges=tuple(range(8, 20))
    ),
)

CELL_TYPES: dict[str, CellType] = {row.name: row for row in _ALL}
"""Every cell type by name."""

LINEAR_TYPES = ("tri", "quad", "tet", "pyramid", "wedge", "hex")
"""The six types the classic quality metrics are defined on."""

POLYTOPES = ("polygon", "polyhedron")
"""The types with any number of corners."""

ORDER_OF_TYPES = tuple(CELL_TYPES)
"""The order in which tables list cell types."""


def cell_type(name: str) -> CellType:
    """The reference cell of that name; KeyError for an unknown one."""
    return CELL_TYPES[name]
