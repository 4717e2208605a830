"""`Sample`: one file of the collection with everything that is known about it, and how."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from generate.grid import Cells, Floats, Grid, Polymesh, polymesh
from generate.write_fluent import write_fluent
from generate.write_gmsh import write_gmsh
from generate.write_openfoam import write_openfoam

__all__ = ["Sample", "row_of_cells", "write"]


@dataclass(frozen=True)
class Sample:
    """One file (or case folder) of the collection.

    path: below samples/.  shows: one sentence.  grid, or mesh where the file is made of faces.
    findings: finding code -> count; these and no others of severity error.
    values: metric id -> cell type -> the value of each of its cells in order of the file, or {"max": x}.
    format: "fluent", "openfoam", "2.2" or "4.1" (Gmsh); by the path unless given.
    how: where the values come from: "closed form", "checkMesh", "VTK".
    """

    path: str
    shows: str
    grid: Grid | None = None
    mesh: Polymesh | None = None
    findings: dict[str, int] = field(default_factory=dict)
    values: dict[str, dict[str, Any]] = field(default_factory=dict)
    how: str = "closed form"
    format: str = ""


def write(folder: Path, sample: Sample) -> None:
    """Write the sample below `folder`, in its format."""
    path = folder / sample.path
    form = sample.format or _format_of(path.name)
    if form in ("fluent", "openfoam"):
        mesh = sample.mesh if sample.mesh is not None else polymesh(sample.grid)
        {"fluent": write_fluent, "openfoam": write_openfoam}[form](path, mesh)
    else:
        write_gmsh(path, sample.grid, form)


def _format_of(name: str) -> str:
    if name.endswith("-openfoam"):
        return "openfoam"
    if ".fluent." in name:
        return "fluent"
    return "4.1" if ".v41." in name else "2.2"


def row_of_cells(kind: str, cells: list[tuple[str, Floats]], gap: float = 3.0, dimension: int = 3) -> Grid:
    """Lone cells in a row along x; `cells` are (zone, corners in VTK order). Zones in order of appearance."""
    points: list[Floats] = []
    parts: list[Cells] = []
    at = 0
    for place, (zone, corners) in enumerate(cells):
        points.append(np.asarray(corners, dtype=float) + np.array([gap * place, 0.0, 0.0]))
        parts.append(Cells(kind, at + np.arange(len(corners))[None, :], zone))
        at += len(corners)
    merged: list[Cells] = []
    for part in parts:
        if merged and merged[-1].zone == part.zone:
            merged[-1] = Cells(kind, np.vstack([merged[-1].nodes, part.nodes]), part.zone)
        else:
            merged.append(part)
    return Grid(np.concatenate(points), tuple(merged), dimension=dimension)
