"""Gmsh 2.2 text: nodes, elements, zones as physical groups. Source: Gmsh manual, "MSH file format version 2"."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import Mesh
from meshwright.repair.writers.common import in_row_order, rows_of_text, zone_of_rows

__all__ = ["write_mesh"]

_TYPE = {"line": 1, "tri": 2, "quad": 3, "tet": 4, "hex": 5, "wedge": 6, "pyramid": 7, "line3": 8, "tri6": 9,
         "quad9": 10, "vertex": 15, "quad8": 16}  # fmt: skip


def write_mesh(mesh: Mesh, stream: BinaryIO) -> list[str]:
    """Write the mesh; see `write`."""
    for block in (*mesh.blocks, *mesh.boundary):
        if block.type not in _TYPE:
            raise UsageError(f"Gmsh files with {CELL_TYPES[block.type].title} cells are not written")
    cells, names, lost = zone_of_rows(mesh, "cell", mesh.n_cells)
    sides, side_names, lost_too = zone_of_rows(mesh, "face", mesh.n_boundary)
    notes = lost + lost_too
    notes += [
        f"zone {z.name!r} groups points: a Gmsh file holds no such group" for z in mesh.zones if z.entity == "point"
    ]
    groups: dict[tuple[int, int, str], int] = {}

    def tag(dimension: int, index: int, names: list[str]) -> int:
        return groups.setdefault((dimension, index, names[index]), len(groups) + 1) if index >= 0 else 0

    lines, count = [], 0
    for blocks, n, index, labels in (
        (mesh.boundary, mesh.n_boundary, sides, side_names), (mesh.blocks, mesh.n_cells, cells, names),
    ):  # fmt: skip
        for name, rows, nodes in in_row_order(blocks, n):
            kind, dimension = _TYPE[name], CELL_TYPES[name].dimension
            for row, corners in zip(rows.tolist(), (nodes.astype(np.int64) + 1).tolist(), strict=True):
                count += 1
                group = tag(dimension, int(index[row]), labels)
                lines.append(f"{count} {kind} 2 {group} {group} {' '.join(map(str, corners))}\n")
    head = ["$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"]
    if groups:
        head.append(f"$PhysicalNames\n{len(groups)}\n")
        head += [f'{d} {number} "{_quoted(name)}"\n' for (d, _, name), number in groups.items()]
        head.append("$EndPhysicalNames\n")
    head.append(f"$Nodes\n{len(mesh.points)}\n")
    stream.write("".join(head).encode())
    stream.write("".join(f"{i} {row}\n" for i, row in enumerate(rows_of_text(mesh.points), 1)).encode())
    stream.write(f"$EndNodes\n$Elements\n{count}\n".encode())
    stream.write("".join(lines).encode())
    stream.write(b"$EndElements\n")
    return notes


def _quoted(name: str) -> str:
    return "".join("_" if c in '"\r\n' else c for c in name)[:127]
