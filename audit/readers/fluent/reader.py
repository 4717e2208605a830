"""Fluent mesh and case files (.msh, .cas), text and binary, as a `Mesh`.

A Fluent file gives nodes, faces and the two cells beside each face; cells are what their faces enclose. Numbers
count from 1 over all zones, and points, cells and faces are kept in the order of their numbers.
Source: Ansys Fluent User's Guide, appendix "Mesh File Format".
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.mesh import Mesh, Zone
from meshwright.audit.readers.fluent.cells import cell_blocks
from meshwright.audit.readers.fluent.faces import Live, faces_by_number, live_part
from meshwright.audit.readers.fluent.parse import read_records
from meshwright.audit.readers.fluent.records import CELLS, FACES, NODES, FluentRecords, Range
from meshwright.audit.readers.source import Source

__all__ = ["read_fluent", "sniff_fluent"]

FORMAT = "fluent"
_CUT_BY_INTERFACE = 1000

_CELL_ROLES = {0: "dead", 1: "fluid", 17: "solid"}
_FACE_ROLES = {
    2: "interior",
    3: "wall",
    4: "inlet",
    5: "outlet",
    7: "symmetry",
    8: "periodic",
    9: "far-field",
    10: "inlet",
    12: "periodic",
    14: "fan",
    20: "inlet",
    24: "interface",
    36: "outlet",
    37: "axis",
}
_WORDS = {
    **dict.fromkeys(("pressure-inlet", "velocity-inlet", "mass-flow-inlet", "inlet-vent", "intake-fan"), "inlet"),
    **dict.fromkeys(("pressure-outlet", "mass-flow-outlet", "outlet-vent", "exhaust-fan", "outflow"), "outlet"),
    **dict.fromkeys(("shadow", "periodic-shadow"), "periodic"),
    **dict.fromkeys(("porous-jump", "radiator"), "fan"),
    "pressure-far-field": "far-field",
}

# What may follow the number of the first section, and the numbers that files are seen to begin with.
_FIRST_SECTION = re.compile(
    rb"(?:\xef\xbb\xbf)?\s*\(\s*"
    rb"(?:[01]\s*[\"'A-Za-z]|2\s+[23]\s*\)|(?:4|[23]?0?1[0-3]|[23]?0?18|3[789]|4[015]|5[89]|6[0-4])\s*\()"
)


def sniff_fluent(head: bytes, name: str) -> bool:
    """Whether the first bytes of a file are those of a Fluent mesh or case; the name says nothing."""
    return _FIRST_SECTION.match(head) is not None


def read_fluent(source: Source) -> Mesh:
    """The mesh of a Fluent file. Raises ReadError.

    Refined meshes (sections 58, 59): parents are left out. Faces cut out of two interface zones (61, 62) are left
    out in favour of the interface faces themselves. Both are said in `notes`.
    """
    records = read_records(source)
    n_points = _tiled(source, records.nodes, records, NODES)
    n_cells = _tiled(source, records.cells, records, CELLS)
    n_faces = _tiled(source, records.faces, records, FACES)
    most = 2 * n_faces + sum(len(tree.integers.values) for tree in records.cell_trees)
    if n_cells > most:
        raise source.error(records.cells[0].start, f"at most {most} cells beside {n_faces} faces", f"{n_cells}")
    points = np.zeros((n_points, 3))
    for nodes in records.nodes:
        points[nodes.first - 1 : nodes.last, : records.dimension] = nodes.points
    sides = faces_by_number(source, records, n_points, n_cells)
    live = live_part(source, records, sides, n_cells)
    faces = live.kept(sides)
    return Mesh(
        points=points,
        blocks=cell_blocks(source, records, sides, live, faces),
        faces=faces,
        zones=_zones(records, live),
        dimension=records.dimension,
        cell_ids=np.flatnonzero(live.cells) + 1,
        point_ids=np.arange(1, n_points + 1),
        path=source.path,
        format=FORMAT,
        notes=_notes(records, live),
    )


def _tiled(source: Source, ranges: Sequence[Range], records: FluentRecords, what: str) -> int:
    """How many there are, once the ranges are known to give each number from 1 on once, and as many as declared."""
    declared, at = records.declared.get(what, (None, 0))
    if not ranges:
        raise source.error(at or len(source), f"a section that brings {what}", "none" if at else None)
    ordered = sorted(ranges, key=lambda r: r.first)
    if ordered[0].first != 1:
        raise source.error(ordered[0].start, f"{what} from number 1", f"from {ordered[0].first}")
    for before, after in pairwise(ordered):
        if after.first != before.last + 1:
            raise source.error(after.start, f"{what} from number {before.last + 1}", f"from {after.first}")
    n = ordered[-1].last
    if declared is not None and n != declared:
        raise source.error(at, f"as many {what} as the zones bring, {n}", str(declared))
    return n


def _zones(records: FluentRecords, live: Live) -> tuple[Zone, ...]:
    """Cell zones, then face zones, in the order of the file; zones that nothing is left of are omitted."""
    zones = []
    for entity, ranges, alive, roles in (
        ("cell", records.cells, live.cells, _CELL_ROLES),
        ("face", records.faces, live.faces, _FACE_ROLES),
    ):
        rows = np.cumsum(alive) - 1
        members: dict[int, list[NDArray[np.int64]]] = {}
        kinds: dict[int, int] = {}
        for part in ranges:
            kept = alive[part.first - 1 : part.last]
            if kept.any():
                members.setdefault(part.zone, []).append(rows[part.first - 1 : part.last][kept])
                kinds.setdefault(part.zone, part.kind % _CUT_BY_INTERFACE)
        for number, parts in members.items():
            named = records.names.get(number)
            role = roles.get(kinds[number], "") if named is None else _WORDS.get(named.role, named.role)
            name = (named.name if named is not None else "") or f"zone-{number}"
            zones.append(Zone(name, "zone", role, entity, np.concatenate(parts), number))
    return tuple(zones)


def _notes(records: FluentRecords, live: Live) -> tuple[str, ...]:
    """The loss ledger."""
    notes = []
    n_cells, n_faces = (int(np.count_nonzero(what)) for what in (~live.cells, live.parents))
    if n_cells or n_faces:
        notes.append(
            f"{n_cells} parent cells and {n_faces} parent faces of refined ones (sections 58, 59) are left out."
        )
    if live.n_cut:
        notes.append(
            f"{live.n_cut} faces cut out of non-conformal interfaces (sections 61 and 62) are left out; "
            "the faces of the interface zones are the boundary there."
        )
    n_pairs = sum(len(pairs.values) for pairs in records.periodic) // 2
    if n_pairs:
        notes.append(f"The pairing of {n_pairs} periodic faces (section 18) is not kept.")
    if records.n_edges:
        notes.append(f"{records.n_edges} edges (section 11) are not kept.")
    return tuple(notes)
