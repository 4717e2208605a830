"""Writing meshes: one function for every format that can be written; the suffix says which."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import BinaryIO

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.files import new_folder, replacing
from meshwright.audit.mesh import Mesh

__all__ = ["WRITERS", "Writer", "check_format", "write"]


@dataclass(frozen=True)
class Writer:
    """A format that can be written. suffix: with its dot. title: for people. module: has `write_mesh(mesh, stream)`,
    which returns a sentence for each thing of the mesh that the format does not hold; where the format is a folder of
    files, `write_folder(mesh, folder)`. folder: the name of that folder beside the file that was named.
    """

    suffix: str
    title: str
    module: str
    folder: str = ""


WRITERS = {
    row.suffix: row
    for row in (
        Writer(".msh", "Gmsh 2.2 text", "gmsh"),
        Writer(".su2", "SU2", "su2"),
        Writer(".vtk", "VTK legacy", "vtk"),
        Writer(".vtu", "VTK XML", "vtu"),
        Writer(".stl", "STL binary", "stl"),
        Writer(".obj", "Wavefront OBJ", "obj"),
        Writer(".off", "OFF", "off"),
        Writer(".foam", "OpenFOAM polyMesh", "openfoam", "constant/polyMesh"),
    )
}


def check_format(path: str | os.PathLike[str]) -> Writer:
    """The writer for this path; UsageError where its suffix is none that can be written."""
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        known = ", ".join(WRITERS)
        raise UsageError(f"cannot write {printable(os.fspath(path), 200)}: its suffix must be one of {known}")
    return WRITERS[suffix]


def write(mesh: Mesh, path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Write a mesh, whole or not at all; returns a sentence for each thing that the format does not hold.

    Raises UsageError for a suffix that is not known, a mesh that the format cannot hold, or where the file system
    refuses.
    """
    writer = check_format(path)
    module = import_module(f"{__name__}.{writer.module}")
    if not writer.folder:
        run: Callable[[Mesh, BinaryIO], list[str]] = module.write_mesh
        with replacing(os.fspath(path)) as stream:
            return tuple(run(mesh, stream))
    fill: Callable[[Mesh, Path], list[str]] = module.write_folder
    with replacing(os.fspath(path)) as stream, new_folder(Path(path).parent / writer.folder) as folder:
        notes = fill(mesh, folder)
        for file in sorted(folder.iterdir()):
            # viewers open the folder by this file and do not read it: its hash stands for those of the mesh
            with file.open("rb") as written:
                digest = hashlib.file_digest(written, "sha256").hexdigest()
            stream.write(f"{digest}  {writer.folder}/{file.name}\n".encode())
    return tuple(notes)
