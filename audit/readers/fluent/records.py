"""What the sections of a Fluent file say, read one by one and not yet compared with each other."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.errors import ReadError
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints
from meshwright.audit.readers.source import Source
from meshwright.audit.readers.tokens import pass_space, pointer

__all__ = [
    "CELLS",
    "FACES",
    "NODES",
    "CellRange",
    "FaceRange",
    "FluentRecords",
    "Integers",
    "NodeRange",
    "Range",
    "Tree",
    "ZoneName",
]

NODES, CELLS, FACES = "nodes", "cells", "faces"


@dataclass(frozen=True)
class Integers:
    """Integers of a body, flat, and where they stand, so that a late complaint can still name its line."""

    values: Ints
    start: int
    binary: bool

    def error(self, source: Source, index: int, expected: str) -> ReadError:
        """The complaint about integer `index`, at its line or byte."""
        found = str(int(self.values[index])) if index < len(self.values) else "the end of the list"
        if self.binary:
            return source.error(self.start + 4 * index, expected, found, binary=True)
        offset = int(_token_offset(source.data, self.start, len(source), index))
        return source.error(offset, expected, found if index >= len(self.values) else None)


@dataclass(frozen=True)
class Range:
    """The numbers `first` to `last`, counted from 1, of zone `zone`; `start` is the offset of the section."""

    zone: int
    first: int
    last: int
    start: int

    def __len__(self) -> int:
        return self.last - self.first + 1


@dataclass(frozen=True)
class NodeRange(Range):
    """Coordinates (n, 2 or 3)."""

    points: NDArray[np.float64]


@dataclass(frozen=True)
class CellRange(Range):
    """kind: 1 active, 17 solid, 32 parent, ...  types: (n,) element types, or one for all, 0 when not said."""

    kind: int
    types: Ints | int


@dataclass(frozen=True)
class FaceRange(Range):
    """kind: number of the boundary condition.  size: nodes of each face, 0 when they vary.

    integers: per face its length when sizes vary, its nodes, and the cells c0 and c1.
    offsets: (n + 1,) of the nodes alone when sizes vary.
    """

    kind: int
    size: int
    integers: Integers
    offsets: NDArray[np.int64] | None

    @property
    def n_nodes(self) -> int:
        """Nodes of all faces together."""
        return len(self) * self.size if self.offsets is None else int(self.offsets[-1])


@dataclass(frozen=True)
class Tree(Range):
    """Parents `first` to `last` and their children: numbers counted from 1. zone: that of the parents."""

    offsets: NDArray[np.int64]
    integers: Integers

    @property
    def children(self) -> Ints:
        """(m,) all children, parent by parent."""
        lengths = np.zeros(len(self.integers.values), dtype=bool)
        lengths[self.offsets[:-1] + np.arange(len(self))] = True
        return self.integers.values[~lengths]


@dataclass(frozen=True)
class ZoneName:
    """A row of section 39 or 45: the words for what a zone is and is called."""

    role: str
    name: str
    domain: str
    start: int


@dataclass
class FluentRecords:
    """All that was read. declared: what is counted -> (how many, offset of the declaration)."""

    dimension: int = 0
    declared: dict[str, tuple[int, int]] = field(default_factory=dict)
    nodes: list[NodeRange] = field(default_factory=list)
    cells: list[CellRange] = field(default_factory=list)
    faces: list[FaceRange] = field(default_factory=list)
    cell_trees: list[Tree] = field(default_factory=list)
    face_trees: list[Tree] = field(default_factory=list)
    overlaps: list[Integers | Range] = field(default_factory=list)
    names: dict[int, ZoneName] = field(default_factory=dict)
    periodic: list[Integers] = field(default_factory=list)
    n_edges: int = 0


@kernel
def _token_offset(data: NDArray[np.uint8], start: int, stop: int, index: int) -> int:
    """Offset of word `index` of the text from `start` on."""
    text = pointer(data)  # type: ignore[call-arg,var-annotated]
    at = pass_space(text, start, stop)
    for _ in range(index):
        while at < stop and data[at] > 32 and data[at] != 41:
            at += 1
        at = pass_space(text, at, stop)
    return at
