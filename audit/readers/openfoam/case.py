"""Where the mesh of an OpenFOAM case lies: case, region, processor and time folders, marker files.

A case holds constant/polyMesh, or constant/<region>/polyMesh for each region, or processor<i>/constant/polyMesh
for each part of a decomposed case; a moving mesh has <time>/polyMesh as well.
"""

from __future__ import annotations

import re
from os import PathLike, fspath
from pathlib import Path

from meshwright.audit.errors import ReadError

__all__ = ["FILES", "find_file", "find_polymesh", "notes_of_case", "optional_file"]

FILES = ("points", "faces", "owner", "neighbour", "boundary", "cellZones", "faceZones", "pointZones")
"""The files of a polyMesh folder that make the mesh; each may be gzipped, with the suffix .gz."""

_MARKERS = (".foam", ".openfoam")
_REGION_IN_MARKER = re.compile(r".*\{(?P<region>\w[\w.-]*)\}")
_TIME = re.compile(r"\d+(\.\d*)?([eE][-+]?\d+)?")
_PROCESSOR = re.compile(r"processor\d+|processors\d+(_\d+-\d+)?")
_MANY = 5


def find_polymesh(path: str | PathLike[str]) -> Path | None:
    """The polyMesh folder that `path` means, None when it has nothing to do with OpenFOAM.

    path: a case, constant, region or polyMesh folder, a .foam or .OpenFOAM marker (`case{region}.foam` means
    that region), or a file in a polyMesh folder. Raises ReadError for a case without a mesh of its own, naming
    the regions or parts that have one.
    """
    try:
        given = Path(path)
        if given.is_dir():
            return _in_folder(given, given)
        if given.suffix.lower() in _MARKERS and given.is_file():
            region = _REGION_IN_MARKER.fullmatch(given.stem)
            return _in_case(given.parent, given, region["region"] if region else "")
        name = given.name.removesuffix(".gz")
        if name in FILES and (given.parent.name == "polyMesh" or _is_mesh(given.parent)) and given.is_file():
            return given.parent
    except OSError as error:
        raise ReadError(
            fspath(path), "", "a readable file or folder", (error.strerror or str(error)).lower()
        ) from error
    except ValueError:  # a NUL character in the name: nothing of ours
        return None
    return None


def find_file(folder: Path, name: str) -> Path:
    """The file `name` or `name`.gz in the folder. ReadError when there is none."""
    path = optional_file(folder, name)
    if path is not None:
        return path
    others = [other for other in FILES if optional_file(folder, other)]
    found = f"only {', '.join(others)}" if others else "no mesh there (meshing has not been run)"
    if others == ["points"]:
        found = "only points, of a mesh that moves: name the case to read the mesh in constant"
    raise ReadError(str(folder), "", f"a file '{name}' or '{name}.gz'", found)


def optional_file(folder: Path, name: str) -> Path | None:
    """The file `name` or `name`.gz in the folder, None when there is none; the unpacked one goes first."""
    for candidate in (folder / name, folder / f"{name}.gz"):
        try:
            candidate.lstat()  # a link to nowhere counts, so that opening it refuses it with its reason
        except OSError:
            continue
        return candidate
    return None


def notes_of_case(folder: Path) -> tuple[str, ...]:
    """One sentence for each other mesh and each set that lies around the polyMesh folder and is not read."""
    notes = []
    folder = folder.resolve()
    sets = _names(folder / "sets")
    if sets:
        notes.append(f"sets are not read: {_some(sets)}")
    constant = folder.parent
    region = ""
    if constant.name != "constant" and constant.parent.name == "constant":
        constant, region = constant.parent, constant.name
    if constant.name != "constant":
        return tuple(notes)
    case = constant.parent
    others = [name for name in _regions(constant) if name != region]
    if others:
        notes.append(f"other regions of the case are not read: {_some(others)}")
    names = _names(case)
    times = [n for n in names if _TIME.fullmatch(n) and optional_file(case / n / region / "polyMesh", "points")]
    if times:
        times.sort(key=float)
        notes.append(f"the mesh is the one in constant; other times hold another: {_some(times)}")
    parts = sum(_PROCESSOR.fullmatch(name) is not None for name in names)
    if parts:
        notes.append(f"the case is also decomposed: the meshes of {parts} processor folders are not read")
    if _PROCESSOR.fullmatch(case.name):
        notes.append("the mesh is one part of a decomposed case; its processor patches are cuts, not boundaries")
    return tuple(notes)


def _in_folder(folder: Path, given: Path) -> Path | None:
    if _is_mesh(folder):
        return folder
    if (folder / "polyMesh").is_dir():
        return folder / "polyMesh"
    if folder.resolve().name == "polyMesh":
        return folder
    if (folder / "constant").is_dir() or any(_PROCESSOR.fullmatch(name) for name in _names(folder)):
        return _in_case(folder, given, "")
    if folder.resolve().name == "constant" and _regions(folder):
        return _in_case(folder.resolve().parent, given, "")
    return None


def _is_mesh(folder: Path) -> bool:
    return all(optional_file(folder, name) for name in ("points", "faces", "owner"))


def _in_case(case: Path, given: Path, region: str) -> Path:
    constant = case / "constant"
    polymesh = constant / region / "polyMesh"
    if polymesh.is_dir():
        return polymesh
    regions = _regions(constant)
    parts = [name for name in _names(case) if _PROCESSOR.fullmatch(name)]
    found = "none"
    if regions:
        found = f"regions only, name one of their folders constant/<region>: {_some(regions)}"
    elif parts:
        found = f"a decomposed case, name one of its {len(parts)} folders such as {parts[0]}"
    wanted = f"constant/{region}/polyMesh" if region else "constant/polyMesh"
    raise ReadError(fspath(given), "", f"a mesh in {wanted}", found)


def _regions(constant: Path) -> list[str]:
    return [name for name in _names(constant) if name != "polyMesh" and (constant / name / "polyMesh").is_dir()]


def _names(folder: Path) -> list[str]:
    if not folder.is_dir():
        return []
    try:
        return sorted(entry.name for entry in folder.iterdir())
    except OSError as error:
        raise ReadError(str(folder), "", "a readable folder", (error.strerror or str(error)).lower()) from error


def _some(names: list[str]) -> str:
    shown = ", ".join(names[:_MANY])
    return shown if len(names) <= _MANY else f"{shown} and {len(names) - _MANY} more"
