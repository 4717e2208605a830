"""Writing meshes: one function for every format that can be written; the suffix says which."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import BinaryIO

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.files import replacing
from meshwright.audit.mesh import Mesh

__all__ = ["WRITERS", "Writer", "check_format", "write"]


@dataclass(frozen=True)
class Writer:
    """A format that can be written. suffix: with its dot. title: for people. module: has `write_mesh(mesh, stream)`,
    which returns a sentence for each thing of the mesh that the format does not hold.
    """

    suffix: str
    title: str
    module: str


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
    run: Callable[[Mesh, BinaryIO], list[str]] = import_module(f"{__name__}.{writer.module}").write_mesh
    with replacing(os.fspath(path)) as stream:
        return tuple(run(mesh, stream))
