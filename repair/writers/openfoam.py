"""OpenFOAM polyMesh, ASCII: points, faces, owner, neighbour, boundary, cellZones. Source: OpenFOAM user guide, 4.1.

Faces stand in OpenFOAM's order: those between two cells first, by owner and then by neighbour, which has the larger
number; then those of each patch, by owner. A face of no patch is in the patch `defaultFaces`, as OpenFOAM calls it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from meshwright.audit.connectivity import faces
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import NO_CELL, Faces, Ints, Mesh, Zone
from meshwright.repair.pairing import WALL, pair_sides
from meshwright.repair.writers.common import rows_of_text, zone_of_rows

__all__ = ["write_folder"]

_DEFAULT = "defaultFaces"
_TYPES = ("patch", "wall", "symmetry", "symmetryPlane", "empty", "wedge")
"""Types of patches that need nothing but their name; cyclic ones need their partner, which is not kept."""


def write_folder(mesh: Mesh, folder: Path) -> list[str]:
    """Write the files of the mesh into a folder that is there; see `write`."""
    if mesh.cell_dimension != 3:
        raise UsageError("an OpenFOAM mesh holds solid cells; extrude a flat mesh by one layer")
    if mesh.order > 1:
        raise UsageError("an OpenFOAM mesh holds linear cells alone; the pass linearise makes them so")
    sides = faces(mesh)
    outside = np.flatnonzero(sides.neighbour == NO_CELL)
    patch, names, notes = _patches(mesh, sides, outside)
    order, swap = _order(sides, outside, patch)
    inner = len(sides) - len(outside)
    owner = np.where(swap, sides.neighbour, sides.owner)[order]
    neighbour = np.where(swap, sides.owner, sides.neighbour)[order][:inner]
    about = f"nPoints:{len(mesh.points)}  nCells:{mesh.n_cells}  nFaces:{len(sides)}  nInternalFaces:{inner}"
    _write(folder / "points", "vectorField", (f"({row})" for row in rows_of_text(mesh.points)), len(mesh.points))
    _write(folder / "faces", "faceList", _loops(sides, order, swap), len(sides))
    _write(folder / "owner", "labelList", map(str, owner.tolist()), len(owner), about)
    _write(folder / "neighbour", "labelList", map(str, neighbour.tolist()), inner, about)
    words, start = [], inner
    for i, (name, kind) in enumerate(names):
        size = int(np.count_nonzero(patch == i))
        words.append(
            f"    {name}\n    {{\n        type {kind};\n        nFaces {size};\n        startFace {start};\n    }}"
        )
        start += size
    _write(folder / "boundary", "polyBoundaryMesh", words, len(words))
    if mesh.cell_zones:
        zones = [_zone(zone) for zone in mesh.cell_zones]
        _write(folder / "cellZones", "regIOobject", zones, len(zones))
    return notes


def _patches(mesh: Mesh, sides: Faces, outside: Ints) -> tuple[Ints, list[tuple[str, str]], list[str]]:
    """(patch of each face outside, (name, type) of each patch, what is lost)."""
    zones = [zone for zone in mesh.zones if zone.entity == "face" and zone.role != "interior"]
    listed = replace(mesh, zones=tuple(zones))  # faces between cells need no zone to be there
    if mesh.faces is not None:
        every, _, notes = zone_of_rows(listed, "face", len(sides))
        index = every[outside]
        inner = int(np.count_nonzero(every >= 0) - np.count_nonzero(index >= 0))
    else:
        every, _, notes = zone_of_rows(listed, "face", mesh.n_boundary)
        index, inner = _of_elements(mesh, sides, outside, every)
    if inner:
        notes.append(f"{inner} members of zones lie inside the mesh and are left out")
    for zone in mesh.zones:
        if zone.entity == "point":
            notes.append(f"zone {zone.name!r} groups points and is left out")
    place = np.full(len(zones) + 1, -1, np.int64)
    names: list[tuple[str, str]] = []
    taken: set[str] = set()
    for i, zone in enumerate(zones):
        if len(zone.members) and not (index == i).any():
            continue  # all of it inside, or in an earlier zone: told above
        if zone.role and zone.role not in _TYPES:
            notes.append(f"zone {zone.name!r}, {zone.role!r} before, is written as type patch: set what it needs")
        place[i] = len(names)
        names.append((_word(zone.name, taken), zone.role if zone.role in _TYPES else "patch"))
    index = place[index]
    rest = index < 0
    if rest.any():
        if names:
            notes.append(f"{int(rest.sum())} faces are in no zone: they become the patch {_DEFAULT!r}")
        index[rest] = len(names)
        names.append((_word(_DEFAULT, taken), "patch"))
    return index, names, notes


def _of_elements(mesh: Mesh, sides: Faces, outside: Ints, zone: Ints) -> tuple[Ints, int]:
    """(zone of each face outside, number of boundary elements with a zone that are none of these)."""
    width = int(np.diff(sides.offsets).max(initial=3))
    sizes = np.diff(sides.offsets)[outside]
    loops = np.full((len(outside) + mesh.n_boundary, width), -1, np.int64)
    inside = np.arange(width) < sizes[:, None]
    at = sides.offsets[outside].astype(np.int64)[:, None] + np.arange(width)
    loops[: len(outside)][inside] = sides.nodes[at[inside]]
    for block in mesh.boundary:
        if block.items is None and 3 <= block.nodes.shape[1] <= width:
            loops[len(outside) + block.rows, : block.nodes.shape[1]] = block.nodes
    partner = pair_sides(loops, np.arange(width)[None], np.empty((0, width), np.int64))[:, 0]
    met = partner[: len(outside)]
    met = np.where((met == WALL) | (met < len(outside)), -1, met - len(outside))
    found = np.append(zone, -1)[met]
    return found, int(np.count_nonzero(zone >= 0) - np.count_nonzero(found >= 0))


def _order(sides: Faces, outside: Ints, patch: Ints) -> tuple[Ints, Ints]:
    """(rows of the faces in OpenFOAM's order, whether owner and neighbour of a row change places)."""
    swap = (sides.neighbour != NO_CELL) & (sides.neighbour < sides.owner)
    inner = np.flatnonzero(sides.neighbour != NO_CELL)
    low, high = np.minimum(sides.owner, sides.neighbour), np.maximum(sides.owner, sides.neighbour)
    inner = inner[np.lexsort((high[inner], low[inner]))]
    return np.concatenate([inner, outside[np.lexsort((sides.owner[outside], patch))]]), swap


def _loops(sides: Faces, order: Ints, swap: Ints) -> Iterable[str]:
    nodes, offsets, turned = sides.nodes.tolist(), sides.offsets.tolist(), swap.tolist()
    for f in order.tolist():
        loop = nodes[offsets[f] : offsets[f + 1]]
        if turned[f]:
            loop = loop[:1] + loop[:0:-1]
        yield f"{len(loop)}({' '.join(map(str, loop))})"


def _word(name: str, taken: set[str]) -> str:
    """The name as a word of OpenFOAM, which none of `taken` is; it is put there too."""
    word = re.sub(r"[^A-Za-z0-9_.:+-]", "_", name) or "zone"
    fresh, n = word, 1
    while fresh in taken:
        n += 1
        fresh = f"{word}_{n}"
    taken.add(fresh)
    return fresh


def _zone(zone: Zone) -> str:
    members = "\n".join(map(str, zone.members.tolist()))
    return (
        f"{_word(zone.name, set())}\n{{\n    type cellZone;\n    cellLabels List<label>\n{len(zone.members)}\n(\n"
        f"{members}\n)\n;\n}}"
    )


def _write(path: Path, kind: str, rows: Iterable[str], count: int, note: str = "") -> None:
    with path.open("wb") as stream:
        words = f'    note "{note}";\n' if note else ""
        stream.write(
            f"FoamFile\n{{\n    version 2.0;\n    format ascii;\n    class {kind};\n{words}"
            f'    location "constant/polyMesh";\n    object {path.name};\n}}\n\n{count}\n(\n'.encode()
        )
        _pour(rows, stream)
        stream.write(b")\n")


def _pour(rows: Iterable[str], stream: BinaryIO) -> None:
    held: list[str] = []
    for row in rows:
        held.append(row)
        if len(held) == 1 << 16:
            stream.write(("\n".join(held) + "\n").encode())
            held.clear()
    if held:
        stream.write(("\n".join(held) + "\n").encode())
