"""What writers share: cells and boundary elements in the order of their rows, and names that a format can hold."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import CellBlock, Floats, Ints, Mesh

__all__ = [
    "in_row_order",
    "only_faces_of_three",
    "rows_of_text",
    "zone_of_rows",
    "zones_as_numbers",
    "zones_without_place",
]


def zone_of_rows(mesh: Mesh, entity: str, n: int) -> tuple[Ints, list[str], list[str]]:
    """(index, names, lost): per cell or boundary element the index of its first zone (-1 for none) into `names`;
    a sentence for each zone that shares members with an earlier one."""
    index = np.full(n, -1, np.int64)
    names: list[str] = []
    lost: list[str] = []
    for zone in mesh.zones:
        if zone.entity != entity:
            continue
        free = zone.members[index[zone.members] < 0]
        if len(free) < len(zone.members):
            lost.append(
                f"zone {zone.name!r} overlaps an earlier one; {len(zone.members) - len(free)} members are only there"
            )
        index[free] = len(names)
        names.append(zone.name)
    return index, names, lost


def in_row_order(blocks: tuple[CellBlock, ...], n: int) -> Iterator[tuple[str, Ints, Ints]]:
    """(type, rows, nodes) of runs of cells of one type, in the order of their rows."""
    which = np.full(n, -1, np.int64)
    place = np.zeros(n, np.int64)
    for i, block in enumerate(blocks):
        which[block.rows] = i
        place[block.rows] = np.arange(len(block))
    cuts = np.flatnonzero(np.diff(which)) + 1
    for rows in np.split(np.arange(n), cuts):
        if len(rows):
            block = blocks[which[rows[0]]]
            if block.items is not None:
                raise UsageError(f"this format cannot hold {CELL_TYPES[block.type].title} cells")
            yield block.type, rows, block.nodes[place[rows]]


def rows_of_text(points: Floats) -> Iterator[str]:
    """The coordinates of each point with spaces, each the shortest that reads back as the same double."""
    for row in points.tolist():
        yield " ".join(map(repr, row))


def only_faces_of_three(mesh: Mesh) -> Ints:
    """(m, 3) the triangles of a surface mesh; UsageError where it has anything else."""
    if mesh.cell_dimension != 2 or any(block.type != "tri" for block in mesh.blocks):
        raise UsageError("this format holds triangles alone")
    return mesh.block("tri").nodes


def zones_as_numbers(mesh: Mesh, words: str) -> list[str]:
    """Sentences for a format that holds the number of the zone of each cell and nothing of other zones."""
    return [f"zone {zone.name!r} {words}" for zone in mesh.cell_zones] + zones_without_place(mesh)


_NAMED = 4
"""Zones that a sentence names one by one."""


def zones_without_place(mesh: Mesh) -> list[str]:
    """Sentences for a format that holds cells and their zones alone."""
    told = []
    for entity, better in (("face", " (.msh and .su2 have it)"), ("point", "")):
        names = [repr(zone.name) for zone in mesh.zones if zone.entity == entity]
        if names:
            some = ", ".join(names[:_NAMED]) + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")
            what = "1 zone" if len(names) == 1 else f"{len(names)} zones"
            told.append(f"no place in a file of cells{better} for {what} of {entity}s: {some}")
    return told
