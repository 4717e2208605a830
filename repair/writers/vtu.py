"""VTK XML, binary appended: cells, and zones as an array of indices with their names in the field data."""

from __future__ import annotations

from typing import BinaryIO
from xml.sax.saxutils import quoteattr

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.mesh import Mesh
from meshwright.repair.writers.common import in_row_order

__all__ = ["write_mesh"]

_VTK_TYPE = {"f8": "Float64", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


def write_mesh(mesh: Mesh, stream: BinaryIO) -> list[str]:
    """Write the mesh; see `write`."""
    types = np.empty(mesh.n_cells, "u1")
    sizes = np.zeros(mesh.n_cells, "<i8")
    items = []
    for name, rows, nodes in in_row_order(mesh.blocks, mesh.n_cells):
        types[rows] = CELL_TYPES[name].vtk
        sizes[rows] = nodes.shape[1]
        items.append(nodes.astype("<i8").ravel())
    arrays: list[bytes] = []
    at = 0

    def tag(name: str, array: np.ndarray) -> str:
        nonlocal at
        width = f' NumberOfComponents="{array.shape[1]}"' if array.ndim == 2 else ""
        kind = _VTK_TYPE[array.dtype.str[1:]]
        text = f'<DataArray type="{kind}" Name={quoteattr(name)}{width} format="appended" offset="{at}"/>\n'
        data = np.ascontiguousarray(array).tobytes()
        arrays.append(np.array([len(data)], "<u8").tobytes() + data)
        at += len(data) + 8
        return text

    xml = [
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">\n<UnstructuredGrid>\n',
        f'<Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{mesh.n_cells}">\n<Points>\n',
        tag("Points", mesh.points.astype("<f8")),
        "</Points>\n<Cells>\n",
        tag("connectivity", np.concatenate(items)),
        tag("offsets", np.cumsum(sizes, dtype="<i8")),
        tag("types", types),
        "</Cells>\n<CellData>\n",
        tag("zone", mesh.cell_zone_index().astype("<i4")) if mesh.cell_zones else "",
        "</CellData>\n</Piece>\n</UnstructuredGrid>\n",
        '<AppendedData encoding="raw">\n_',
    ]
    stream.write("".join(xml).encode())
    for data in arrays:
        stream.write(data)
    stream.write(b"\n</AppendedData>\n</VTKFile>\n")
    notes = [f"zone {z.name!r} is kept as its number alone" for z in mesh.cell_zones]
    notes += [
        f"zone {z.name!r} groups {z.entity}s: a VTU file of cells has no place for it"
        for z in mesh.zones
        if z.entity != "cell"
    ]
    return notes
