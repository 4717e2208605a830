"""SU2 files of several zones: each is a mesh of its own, with its own points; together they are one mesh of parts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.readers.source import Source

__all__ = ["joined", "part", "spans"]

_MOST_ZONES = 256
"""Each is read by a process of its own."""
_HEAD = re.compile(rb"(?m)^[ \t]*NZONE[ \t]*=[ \t]*([0-9]{1,9})[ \t]*(?:%[^\r\n]*)?\r?$")
_ZONE = re.compile(rb"(?m)^[ \t]*IZONE[ \t]*=[ \t]*([^\r\n%]*)[^\r\n]*")


def spans(source: Source) -> list[tuple[int, int]]:
    """(start, stop) of the bytes of each zone; none where the file does not say NZONE.

    Raises ReadError where NZONE and the IZONE lines do not agree.
    """
    text = source.data.tobytes()
    head = _HEAD.search(text)
    if head is None:
        return []
    count = int(head[1])
    starts = list(_ZONE.finditer(text))
    if not 1 <= count <= _MOST_ZONES:
        raise source.error(head.start(1), f"1 to {_MOST_ZONES} zones")
    for i, match in enumerate(starts):
        if i >= count or match[1].strip() != b"%d" % (i + 1):
            raise source.error(match.start(), f"IZONE= {i + 1}" if i < count else f"{count} zones, as NZONE says")
    if len(starts) != count:
        raise source.error(len(text), f"{count} zones, as NZONE says", f"{len(starts)} with IZONE")
    if head.start() > starts[0].start() or b"=" in text[head.end() : starts[0].start()].replace(b"%", b""):
        raise source.error(head.start(), "NZONE, then IZONE= 1 and what the zone holds")
    stops = [match.start() for match in starts[1:]] + [len(text)]
    return [(match.end(), stop) for match, stop in zip(starts, stops, strict=True)]


def part(source: Source, span: tuple[int, int]) -> Source:
    """One zone as a source. Empty lines in place of what stands before it: an error then names the line of the file."""
    lines = b"\n" * (source.line(span[0]) - 1)
    return Source(source.path, np.frombuffer(lines + source.data[slice(*span)].tobytes(), np.uint8), source.skipped)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """The zones as one mesh: cells and elements behind one another by type, a zone of cells for each.

    A zone whose name an earlier zone of the file has gets the number of its own behind it.
    """
    first = meshes[0]
    points = np.concatenate([mesh.points for mesh in meshes])
    begin = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cells = np.cumsum([0, *(mesh.n_cells for mesh in meshes)])
    elements = np.cumsum([0, *(mesh.n_boundary for mesh in meshes)])
    blocks = _behind([mesh.blocks for mesh in meshes], begin, cells)
    boundary = _behind([mesh.boundary for mesh in meshes], begin, elements)
    zones: list[Zone] = []
    taken: set[str] = set()
    for i, mesh in enumerate(meshes):
        zones.append(Zone(f"zone {i + 1}", "zone", "", "cell", np.arange(cells[i], cells[i + 1]), i + 1))
        for zone in mesh.zones:
            shift = {"cell": cells, "face": elements, "point": begin}[zone.entity][i]
            name = f"{zone.name} ({i + 1})" if zone.name in taken else zone.name
            zones.append(replace(zone, name=name, members=zone.members.astype(np.int64) + shift))
        taken |= {zone.name for zone in mesh.zones}
    notes = [f"{note} (zone {i + 1})" for i, mesh in enumerate(meshes) for note in mesh.notes]
    return Mesh(
        points, blocks, boundary, zones=tuple(zones), dimension=max(mesh.dimension for mesh in meshes),
        path=first.path, format=first.format, notes=tuple(notes),
    )  # fmt: skip


def _behind(parts: Sequence[tuple[CellBlock, ...]], points: np.ndarray, rows: np.ndarray) -> tuple[CellBlock, ...]:
    out = []
    for name in CELL_TYPES:
        mine = [(block, i) for i, blocks in enumerate(parts) for block in blocks if block.type == name]
        if mine:
            nodes = np.concatenate([block.nodes.astype(np.int64) + points[i] for block, i in mine])
            out.append(
                CellBlock(name, np.concatenate([block.rows.astype(np.int64) + rows[i] for block, i in mine]), nodes)
            )
    return tuple(out)
