"""SHA-256 of what was audited: a file's bytes, or of a case folder the mesh files in it."""

from __future__ import annotations

import hashlib
from pathlib import Path

from meshwright.audit.errors import ReadError

__all__ = ["fingerprint", "weight"]

_CHUNK = 1 << 20
_MESH_FOLDER = "constant/polyMesh"


def fingerprint(path: str | Path) -> str | None:
    """Hexadecimal SHA-256, or None where `path` is neither a file nor a folder that holds a mesh.

    A file: of its bytes, as `sha256sum` prints it. An OpenFOAM case (the folder, or a `.foam` marker in it): of the
    lines "<sha256>  <name>\\n" for every file directly in constant/polyMesh, by name. ReadError where a file
    cannot be read.
    """
    path = Path(path)
    folder = _mesh_folder(path)
    if folder is not None:
        return _of_folder(folder)
    return _of_file(path) if path.is_file() else None


def weight(path: str | Path) -> int:
    """Bytes of what `fingerprint` would read, 0 where there is nothing."""
    path = Path(path)
    folder = _mesh_folder(path)
    try:
        files = [path] if folder is None else [file for file in folder.iterdir() if file.is_file()]
        return sum(file.stat().st_size for file in files)
    except OSError:
        return 0


def _mesh_folder(path: Path) -> Path | None:
    """The folder that holds the mesh of an OpenFOAM case."""
    case = path.parent if path.suffix == ".foam" else path
    for folder in (case / _MESH_FOLDER, case):
        if folder.is_dir() and (folder / "faces").exists() | (folder / "faces.gz").exists():
            return folder
    return None


def _of_file(path: Path) -> str:
    digest = hashlib.sha256()
    try:
        with path.open("rb") as stream:
            while chunk := stream.read(_CHUNK):
                digest.update(chunk)
    except OSError as error:
        raise ReadError(path, "", "a readable file", error.strerror or "input/output error") from None
    return digest.hexdigest()


def _of_folder(folder: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(p for p in folder.iterdir() if p.is_file()):
        digest.update(f"{_of_file(path)}  {path.name}\n".encode("utf-8", "surrogateescape"))
    return digest.hexdigest()
