"""OFF (Object File Format): points and faces."""

from __future__ import annotations

from typing import BinaryIO

from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import Mesh
from meshwright.repair.writers.common import in_row_order, rows_of_text

__all__ = ["write_mesh"]


def write_mesh(mesh: Mesh, stream: BinaryIO) -> list[str]:
    """Write the mesh; see `write`."""
    if mesh.cell_dimension != 2 or mesh.order > 1:
        raise UsageError("an OFF file holds linear surface cells alone")
    out = [f"OFF\n{len(mesh.points)} {mesh.n_cells} 0\n"]
    out += [f"{row}\n" for row in rows_of_text(mesh.points)]
    for _, _, nodes in in_row_order(mesh.blocks, mesh.n_cells):
        out += [f"{len(corners)} {' '.join(map(str, corners))}\n" for corners in nodes.tolist()]
    stream.write("".join(out).encode())
    return [f"zone {z.name!r} is not kept: OFF has no groups" for z in mesh.zones]
