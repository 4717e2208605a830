"""Wavefront OBJ: points and faces, cell zones as groups."""

from __future__ import annotations

from typing import BinaryIO

from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import Mesh
from meshwright.repair.writers.common import in_row_order, rows_of_text, zone_of_rows

__all__ = ["write_mesh"]


def write_mesh(mesh: Mesh, stream: BinaryIO) -> list[str]:
    """Write the mesh; see `write`."""
    if mesh.cell_dimension != 2 or mesh.order > 1:
        raise UsageError("an OBJ file holds linear surface cells alone")
    index, names, notes = zone_of_rows(mesh, "cell", mesh.n_cells)
    notes += [
        f"zone {z.name!r} groups {z.entity}s: an OBJ file has groups of faces alone"
        for z in mesh.zones
        if z.entity != "cell"
    ]
    out = [f"v {row}\n" for row in rows_of_text(mesh.points)]
    now = -1
    for _, rows, nodes in in_row_order(mesh.blocks, mesh.n_cells):
        for row, corners in zip(rows.tolist(), (nodes + 1).tolist(), strict=True):
            if index[row] != now:
                now = int(index[row])
                out.append(f"g {'_'.join(names[now].split()) if now >= 0 else 'default'}\n")
            out.append(f"f {' '.join(map(str, corners))}\n")
    stream.write("".join(out).encode("utf-8", "replace"))
    return notes
