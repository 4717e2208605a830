"""Zones from what meshio reads beside the cells: sets, integer tags, families."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.mesh import Zone
from meshwright.audit.readers.source import Source

__all__ = ["zones_of"]

Ints = NDArray[np.int64]

_TAGS = {
    "medit:ref": "reference",
    "su2:tag": "marker",
    "gmsh:physical": "physical group",
    "netgen:index": "region",
    "tetgen:ref": "region",
    "ugrid:ref": "surface id",
    "nastran:ref": "property",
    "avsucd:material": "material",
    "flac3d:group": "group",
    "CellEntityIds": "entity",
    "MaterialIDs": "material",
    "MaterialIds": "material",
    "material": "material",
    "Material": "material",
}
_SETS = {"abaqus": "set", "exodus": "node set", "flac3d": "group", "med": "group"}
_MOST_ZONES = 10_000
_VTU_ZONES = re.compile(rb'<DataArray type="String" Name="zone_names"[^<>]*format="ascii">([0-9\s]*)</DataArray>')
_MARKER = re.compile(rb"(?m)^[ \t]*MARKER_TAG[ \t]*=[ \t]*([^\r\n%]*)")


def zones_of(
    source: Source,
    name: str,
    head: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray],
    is_cell: NDArray[np.bool_],
    rows: Ints,
    n_points: int,
    *,
    keep_faces: bool,
) -> tuple[tuple[Zone, ...], list[str]]:
    """Zones and notes.  is_cell, rows: (m,) of meshio's elements.  keep_faces: False in a face-based mesh."""
    zones: list[Zone] = []
    notes: list[str] = []

    def add(label: str, kind: str, elements: Ints, number: int | None = None) -> None:
        inside = elements[(elements >= 0) & (elements < len(rows))]
        for entity, mine in (("cell", inside[is_cell[inside]]), ("face", inside[~is_cell[inside]])):
            if len(mine) and (entity == "cell" or keep_faces):
                zones.append(Zone(label, kind, "", entity, np.unique(rows[mine]), number))

    for i, label in enumerate(head["cell_sets"]):
        add(label, _SETS.get(name, "set"), arrays[f"cell_set{i}"])
    for i, tag in enumerate(head["cell_data"]):
        values = arrays[f"cell_data{i}"]
        if len(values) != len(rows):
            continue
        if tag == "cell_tags":
            for label, elements in _families(values, head["cell_tags"]):
                add(label, "group", elements)
        elif tag == "zone" and name == "vtu":
            for number, label in enumerate(_vtu_zones(source)):
                add(label, "zone", np.flatnonzero(is_cell & (values == number)), number)
        elif tag in _TAGS:
            labels = _su2_markers(source) if tag == "su2:tag" else {}
            for number, elements in _by_value(values, is_cell, notes, tag):
                add(labels.get(number, f"{_TAGS[tag]} {number}"), _TAGS[tag], elements, number)
    for i, label in enumerate(head["point_sets"]):
        members = arrays[f"point_set{i}"]
        members = np.unique(members[(members >= 0) & (members < n_points)])
        zones.append(Zone(label, "node set", "", "point", members))
    for i, tag in enumerate(head["point_data"]):
        if tag == "point_tags" and len(arrays[f"point_data{i}"]) == n_points:
            for label, members in _families(arrays[f"point_data{i}"], head["point_tags"]):
                zones.append(Zone(label, "group", "", "point", np.unique(members)))
    if len(zones) > _MOST_ZONES:
        notes.append(f"of {len(zones)} groups the first {_MOST_ZONES} are kept")
    return tuple(zones[:_MOST_ZONES]), notes


def _by_value(values: np.ndarray, is_cell: NDArray[np.bool_], notes: list[str], tag: str) -> Iterator[tuple[int, Ints]]:
    """(value, elements) for each value; where all cells or all boundary elements have tag 0 it says nothing."""
    order = np.argsort(values, kind="stable")
    numbers, starts = np.unique(values[order], return_index=True)
    if len(numbers) > _MOST_ZONES:
        notes.append(f"the numbers in {tag} are not kept: {len(numbers)} different ones are no groups")
        return
    for number, elements in zip(numbers.tolist(), np.split(order, starts[1:]), strict=True):
        kept = elements
        for side in (is_cell, ~is_cell):
            if number == 0 and np.all(values[side] == 0):
                kept = kept[~side[kept]]
        if len(kept):
            yield int(number), kept


def _families(values: np.ndarray, families: Mapping[str, list[str]]) -> Iterator[tuple[str, Ints]]:
    """(group, members): a family is a combination of groups, and a group the union of its families."""
    of_group: dict[str, list[int]] = {}
    for number, groups in families.items():
        for group in groups:
            of_group.setdefault(group, []).append(int(number))
    for group, numbers in of_group.items():
        members = np.flatnonzero(np.isin(values, numbers))
        if len(members):
            yield group, members


def _vtu_zones(source: Source) -> list[str]:
    """Names of the zones that the cell data `zone` count, as `meshwright repair` writes them; [] without any."""
    end = source.find(b"<AppendedData")
    match = _VTU_ZONES.search(source.data[: len(source) if end < 0 else end].tobytes())
    if match is None:
        return []
    text = bytes(int(word) for word in match[1].split() if len(word) < 4 and int(word) < 256)
    return [name.decode("utf-8", "replace") for name in text.split(b"\0")[:-1]]


def _su2_markers(source: Source) -> dict[int, str]:
    """Names of SU2 markers by the numbers that meshio gives them in file order."""
    names: dict[int, str] = {}
    number = 0
    for match in _MARKER.finditer(source.data.tobytes()):
        name = match[1].strip().decode("utf-8", "replace")
        number = int(name) if re.fullmatch(r"[+-]?[0-9]{1,18}", name) else number + 1
        names.setdefault(number, name)
    return names
