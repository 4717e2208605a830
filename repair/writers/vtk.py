"""VTK legacy, binary: cells and the index of their zone. Source: VTK file formats, "Simple Legacy Formats"."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.mesh import Mesh
from meshwright.repair.writers.common import in_row_order, zones_as_numbers

__all__ = ["write_mesh"]


def write_mesh(mesh: Mesh, stream: BinaryIO) -> list[str]:
    """Write the mesh; see `write`."""
    stream.write(b"# vtk DataFile Version 3.0\nmeshwright\nBINARY\nDATASET UNSTRUCTURED_GRID\n")
    stream.write(f"POINTS {len(mesh.points)} double\n".encode())
    stream.write(mesh.points.astype(">f8").tobytes())
    pieces, size = [], 0
    types = np.empty(mesh.n_cells, ">i4")
    for name, rows, nodes in in_row_order(mesh.blocks, mesh.n_cells):
        table = np.empty((len(rows), nodes.shape[1] + 1), ">i4")
        table[:, 0] = nodes.shape[1]
        table[:, 1:] = nodes
        types[rows] = CELL_TYPES[name].vtk
        size += table.size
        pieces.append(table.tobytes())
    stream.write(f"\nCELLS {mesh.n_cells} {size}\n".encode())
    stream.write(b"".join(pieces))
    stream.write(f"\nCELL_TYPES {mesh.n_cells}\n".encode())
    stream.write(types.tobytes())
    stream.write(f"\nCELL_DATA {mesh.n_cells}\nSCALARS zone int 1\nLOOKUP_TABLE default\n".encode())
    stream.write(mesh.cell_zone_index().astype(">i4").tobytes() + b"\n")
    return zones_as_numbers(mesh, "is kept as its number alone: a VTK legacy file has no names")
