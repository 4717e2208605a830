"""SU2 native mesh: elements, points, markers. Source: SU2 documentation, "Mesh File"."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import Mesh
from meshwright.repair.writers.common import in_row_order, rows_of_text, zone_of_rows

__all__ = ["write_mesh"]


def write_mesh(mesh: Mesh, stream: BinaryIO) -> list[str]:
    """Write the mesh; see `write`."""
    if mesh.order > 1:
        raise UsageError("an SU2 file holds linear cells alone")
    flat = mesh.dimension == 2
    d = 2 if flat else 3
    if mesh.cell_dimension != d:
        raise UsageError("an SU2 file holds solid meshes, or flat ones in the x-y plane")
    sides, names, notes = zone_of_rows(mesh, "face", mesh.n_boundary)
    notes += [
        f"zone {z.name!r} groups {z.entity}s: an SU2 file has markers alone" for z in mesh.zones if z.entity != "face"
    ]
    if (sides < 0).any():
        notes.append(f"{int((sides < 0).sum())} boundary elements are in no marker and are left out")
    out = [f"NDIME= {d}\nNELEM= {mesh.n_cells}\n"]
    for name, rows, nodes in in_row_order(mesh.blocks, mesh.n_cells):
        kind = CELL_TYPES[name].vtk
        for row, corners in zip(rows.tolist(), nodes.tolist(), strict=True):
            out.append(f"{kind} {' '.join(map(str, corners))} {row}\n")
    out.append(f"NPOIN= {len(mesh.points)}\n")
    out += [f"{row} {i}\n" for i, row in enumerate(rows_of_text(mesh.points[:, :d]))]
    out.append(f"NMARK= {len(names)}\n")
    boundary = list(in_row_order(mesh.boundary, mesh.n_boundary))
    for index, name in enumerate(names):
        out.append(
            f"MARKER_TAG= {''.join('_' if c.isspace() else c for c in name)}\n"
            f"MARKER_ELEMS= {int((sides == index).sum())}\n"
        )
        for kind_name, rows, nodes in boundary:
            chosen = np.flatnonzero(sides[rows] == index)
            kind = CELL_TYPES[kind_name].vtk
            out += [f"{kind} {' '.join(map(str, corners))}\n" for corners in nodes[chosen].tolist()]
    stream.write("".join(out).encode("utf-8", "replace"))
    return notes
