"""Reader of OpenFOAM's polyMesh: points, faces, owner, neighbour, boundary and zones.

Format: OpenFOAM user guide, "Mesh description"; polyMesh and primitiveMesh of the OpenFOAM source. Faces keep
the file's numbers; a face's normal points from owner to neighbour, boundary faces come last, patch by patch.
Cells in a 2-D case (empty or wedge patches) are solid cells one layer deep, and stay that.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from os import PathLike, fspath
from pathlib import Path

import numpy as np

from meshwright.audit.assembly import AssemblyError, blocks_from_faces
from meshwright.audit.errors import ReadError
from meshwright.audit.mesh import NO_CELL, Faces, Floats, Ints, Mesh, Zone
from meshwright.audit.readers.openfoam.case import find_file, find_polymesh, notes_of_case, optional_file
from meshwright.audit.readers.openfoam.file import FoamFile, open_foam
from meshwright.audit.readers.openfoam.groups import read_patches, read_zones
from meshwright.audit.readers.openfoam.lists import read_compact_faces, read_faces, read_labels, read_vectors

__all__ = ["find_polymesh", "read_openfoam"]

_COUNT_IN_NOTE = re.compile(r"\b(nPoints|nCells|nFaces|nInternalFaces)\s*:\s*(\d{1,18})\b")
_VECTORS = ("vectorField", "pointField")
_LABELS = ("labelList",)
_COMPACT = "faceCompactList"


def read_openfoam(path: str | PathLike[str]) -> Mesh:
    """The mesh of a case, a region or a polyMesh folder, of a .foam marker file or a file of the polyMesh.

    Raises ReadError for whatever is missing, cut, out of range or in contradiction to another file.
    """
    folder = find_polymesh(path)
    if folder is None:
        found = "something else" if Path(path).exists() else "nothing"
        raise ReadError(fspath(path), "", "an OpenFOAM case, its polyMesh folder or a file of that", found)
    points = _read_points(folder)
    offsets, nodes = _read_faces(folder, len(points))
    n_faces = len(offsets) - 1
    owner_file, owner = _read_owner(folder, n_faces)
    neighbour_file, neighbour, n_internal = _read_neighbour(folder, owner)
    n_cells = int(max(owner.max(), neighbour.max())) + 1
    for file in (owner_file, neighbour_file):
        _check_note(file, len(points), n_cells, n_faces, n_internal)
    boundary = open_foam(find_file(folder, "boundary"), ("polyBoundaryMesh",))
    patches, dropped = read_patches(boundary, n_internal, n_faces)
    zones, losses = _read_all_zones(folder, {"cell": n_cells, "face": n_faces, "point": len(points)})
    if dropped:
        losses = (f"settings of patches are not kept: {_listed(dropped)}", *losses)
    try:
        blocks = blocks_from_faces(offsets, nodes, owner, neighbour, n_cells, 3)
    except AssemblyError as error:
        raise ReadError(str(folder), f"cell {error.cell}", error.expected, error.found) from error
    return Mesh(
        points=points,
        blocks=blocks,
        faces=Faces(offsets, nodes, owner, neighbour),
        zones=(*patches, *zones),
        path=fspath(path),
        format="openfoam",
        notes=(*losses, *notes_of_case(folder)),
    )


def _read_points(folder: Path) -> Floats:
    file = open_foam(find_file(folder, "points"), _VECTORS)
    points, stop = read_vectors(file, file.body, "point")
    file.end(stop, "the list of points")
    if len(points) < 4:
        raise file.error(file.body, "at least 4 points", str(len(points)))
    return points


def _read_faces(folder: Path, n_points: int) -> tuple[Ints, Ints]:
    file = open_foam(find_file(folder, "faces"), ("faceList", _COMPACT))
    read = read_compact_faces if file.header["class"] == _COMPACT else read_faces
    offsets, nodes, stop = read(file, file.body, n_points)
    file.end(stop, "the list of faces")
    if len(offsets) < 5:
        raise file.error(file.body, "at least 4 faces", str(len(offsets) - 1))
    return offsets, nodes


def _read_owner(folder: Path, n_faces: int) -> tuple[FoamFile, Ints]:
    file = open_foam(find_file(folder, "owner"), _LABELS)
    owner, stop = read_labels(file, file.body, "owner of a face", n_faces, n_faces)
    file.end(stop, "the list of owners")
    if len(owner) != n_faces:
        raise file.error(file.body, f"an owner for each of {n_faces} faces", f"{len(owner)} owners")
    return file, owner


def _read_neighbour(folder: Path, owner: Ints) -> tuple[FoamFile, Ints, int]:
    """(file, neighbour of every face with NO_CELL on the boundary, number of internal faces)."""
    n_faces = len(owner)
    file = open_foam(find_file(folder, "neighbour"), _LABELS)
    listed, stop = read_labels(file, file.body, "neighbour of a face", n_faces, n_faces, least=NO_CELL)
    file.end(stop, "the list of neighbours")
    inside = listed != NO_CELL
    n_internal = int(np.count_nonzero(inside))
    if n_internal < len(listed):
        # Old releases list every face, with -1 on the boundary; -1 has no meaning in the shorter list.
        if len(listed) != n_faces:
            expected = f"neighbours of internal faces only, or of all {n_faces} faces"
            raise file.error(file.body, expected, f"{len(listed)}, some of them -1")
        if not inside[:n_internal].all():
            first = int(np.argmin(inside))
            raise file.error(
                file.body, "internal faces before boundary faces", f"face {first} without neighbour too early"
            )
    twice = np.flatnonzero(listed[:n_internal] == owner[:n_internal])
    if len(twice):
        raise file.error(file.body, "two different cells at a face", f"cell {owner[twice[0]]} twice at face {twice[0]}")
    neighbour = np.full(n_faces, NO_CELL, listed.dtype)
    neighbour[:n_internal] = listed[:n_internal]
    return file, neighbour, n_internal


def _check_note(file: FoamFile, n_points: int, n_cells: int, n_faces: int, n_internal: int) -> None:
    """The counts in the note of the owner or neighbour file, which OpenFOAM renews whenever it writes the mesh."""
    counted = {"nPoints": n_points, "nCells": n_cells, "nFaces": n_faces, "nInternalFaces": n_internal}
    for name, stated in _COUNT_IN_NOTE.findall(file.header.get("note", "")):
        if int(stated) != counted[name]:
            place = max(file.source.find(b"note", 0, file.body), 0)
            raise file.error(place, f"{name} {counted[name]} as in the lists", f"{name} {stated} in the note")


def _read_all_zones(folder: Path, counts: dict[str, int]) -> tuple[tuple[Zone, ...], tuple[str, ...]]:
    zones: list[Zone] = []
    losses: list[str] = []
    for entity, n in counts.items():
        path = optional_file(folder, f"{entity}Zones")
        if path is None:
            continue
        found, flipped, dropped = read_zones(open_foam(path, ()), entity, n)
        zones += found
        if flipped:
            losses.append("the orientation of faces in face zones (flipMap) is not kept")
        if dropped:
            losses.append(f"settings of {entity} zones are not kept: {_listed(dropped)}")
    return tuple(zones), tuple(losses)


def _listed(words: Iterable[str]) -> str:
    return ", ".join(sorted(words))
