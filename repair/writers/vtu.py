"""VTU, binary appended, every cell type included: what ParaView reads fastest. A mesh alone, or with fields."""

from __future__ import annotations

from collections.abc import Mapping
from typing import BinaryIO
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.repair.writers.common import zone_of_rows, zones_without_place

__all__ = ["write_grid", "write_mesh"]

_VTK_TYPE = {"f8": "Float64", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}
_POLYHEDRON = 42


def write_mesh(mesh: Mesh, stream: BinaryIO) -> list[str]:
    """Write the mesh; see `write`."""
    rows = np.arange(mesh.n_cells)
    write_grid(mesh, rows, {"zone": mesh.cell_zone_index().astype("<i4")} if mesh.cell_zones else {}, {}, stream)
    return zone_of_rows(mesh, "cell", mesh.n_cells)[2] + zones_without_place(mesh)


class _Appended:
    """Collects arrays for the appended section and hands out the XML tag that points at each."""

    def __init__(self) -> None:
        self.arrays: list[NDArray] = []
        self._at = 0

    def tag(self, name: str, array: NDArray) -> str:
        array = np.ascontiguousarray(array)
        width = f' NumberOfComponents="{array.shape[1]}"' if array.ndim == 2 else ""
        kind = _VTK_TYPE[array.dtype.str[1:]]
        text = f'<DataArray type="{kind}" Name={quoteattr(name)}{width} format="appended" offset="{self._at}"/>\n'
        self.arrays.append(array)
        self._at += 8 + array.nbytes
        return text


def write_grid(
    mesh: Mesh, rows: NDArray, cell_fields: Mapping[str, NDArray], point_fields: Mapping[str, NDArray], stream: BinaryIO
) -> None:
    """Write these cells (rows, in file order) and all points; fields are of the chosen cells and of all points.

    The names of the cell zones stand in the field data.
    """
    sizes, items = _csr(mesh, rows)
    faces, face_offsets, has_polyhedra = _face_stream(mesh, rows)
    types = np.empty(mesh.n_cells, dtype=np.uint8)
    for block in mesh.blocks:
        types[block.rows] = CELL_TYPES[block.type].vtk
    data = _Appended()
    xml = [
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">\n<UnstructuredGrid>\n',
        _zone_names(mesh),
        f'<Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(rows)}">\n<Points>\n',
        data.tag("Points", mesh.points.astype("<f8")),
        "</Points>\n<Cells>\n",
        data.tag("connectivity", items.astype("<i8")),
        data.tag("offsets", np.cumsum(sizes, dtype="<i8")),
        data.tag("types", types[rows]),
    ]
    if has_polyhedra:
        xml += [data.tag("faces", faces), data.tag("faceoffsets", face_offsets)]
    xml.append("</Cells>\n<CellData>\n")
    xml += [data.tag(name, values) for name, values in cell_fields.items()]
    xml.append("</CellData>\n<PointData>\n")
    xml += [data.tag(name, values) for name, values in point_fields.items()]
    xml.append('</PointData>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding="raw">\n_')
    stream.write("".join(xml).encode("utf-8"))
    for array in data.arrays:
        stream.write(np.array([array.nbytes], dtype="<u8").tobytes())
        stream.write(array.tobytes())
    stream.write(b"\n</AppendedData>\n</VTKFile>\n")


def _zone_names(mesh: Mesh) -> str:
    """Names of the cell zones as VTK strings: bytes written as numbers, each string ended by 0."""
    if not mesh.cell_zones:
        return ""
    names = (zone.name.encode("utf-8", "replace").replace(b"\0", b"?") for zone in mesh.cell_zones)
    numbers = " ".join(" ".join(map(str, [*name, 0])) for name in names)
    head = f'<DataArray type="String" Name="zone_names" NumberOfTuples="{len(mesh.cell_zones)}" format="ascii">'
    return f"<FieldData>\n{head}\n{numbers}\n</DataArray>\n</FieldData>\n"


def _block_csr(mesh: Mesh, block: CellBlock) -> tuple[NDArray, NDArray]:
    """Sizes and concatenated nodes of the cells of a block; of a polyhedron all its points, each once."""
    if block.offsets is None or block.items is None:
        n, width = block.nodes.shape
        return np.full(n, width, dtype=np.int64), block.nodes.reshape(-1).astype(np.int64)
    if block.type == "polygon" or mesh.faces is None:
        return np.diff(block.offsets).astype(np.int64), block.items.astype(np.int64)
    owner, nodes = _polyhedron_nodes(mesh, block)
    pairs = np.unique(np.stack([owner, nodes], axis=1), axis=0)
    return np.bincount(pairs[:, 0], minlength=len(block)), pairs[:, 1]


def _ranges(starts: NDArray, lengths: NDArray) -> NDArray:
    """start, start + 1, ... of every range, concatenated."""
    ends = np.cumsum(lengths)
    return np.repeat(starts - (ends - lengths), lengths) + np.arange(ends[-1] if len(ends) else 0)


def _polyhedron_nodes(mesh: Mesh, block: CellBlock) -> tuple[NDArray, NDArray]:
    """For every node of every face of every polyhedron: its place in the block, and the point."""
    assert mesh.faces is not None  # noqa: S101 - Mesh refuses polyhedra without faces
    assert block.offsets is not None  # noqa: S101
    assert block.items is not None  # noqa: S101
    faces = block.items.astype(np.int64)
    lengths = np.diff(mesh.faces.offsets).astype(np.int64)[faces]
    place = np.repeat(np.arange(len(block)), np.diff(block.offsets))
    nodes = mesh.faces.nodes[_ranges(mesh.faces.offsets[faces].astype(np.int64), lengths)]
    return np.repeat(place, lengths), nodes.astype(np.int64)


def _csr(mesh: Mesh, rows: NDArray) -> tuple[NDArray, NDArray]:
    """Sizes and concatenated nodes of these cell rows."""
    sizes = np.zeros(mesh.n_cells, dtype=np.int64)
    starts = np.zeros(mesh.n_cells, dtype=np.int64)
    pools, before = [], 0
    for block in mesh.blocks:
        lengths, nodes = _block_csr(mesh, block)
        sizes[block.rows] = lengths
        starts[block.rows] = before + np.cumsum(lengths) - lengths
        pools.append(nodes)
        before += len(nodes)
    return sizes[rows], np.concatenate(pools)[_ranges(starts[rows], sizes[rows])]


def _face_stream(mesh: Mesh, rows: NDArray) -> tuple[NDArray, NDArray, bool]:
    """VTK's face stream: per polyhedron the number of faces, then per face its size and points; end offsets."""
    offsets = np.full(mesh.n_cells, -1, dtype=np.int64)
    stream: list[NDArray] = []
    at = 0
    wanted = np.zeros(mesh.n_cells, dtype=bool)
    wanted[rows] = True
    for block in mesh.blocks:
        if block.type != "polyhedron" or mesh.faces is None or block.offsets is None or block.items is None:
            continue
        f = mesh.faces
        for place in np.flatnonzero(wanted[block.rows]).tolist():
            faces = block.items[block.offsets[place] : block.offsets[place + 1]]
            parts = [np.array([len(faces)])]
            for face in faces.tolist():
                nodes = f.nodes[f.offsets[face] : f.offsets[face + 1]]
                if f.owner[face] != block.rows[place]:
                    nodes = nodes[::-1]  # as seen from outside of this cell
                parts += [np.array([len(nodes)]), nodes]
            piece = np.concatenate(parts).astype("<i8")
            at += len(piece)
            offsets[block.rows[place]] = at
            stream.append(piece)
    if not stream:
        return np.empty(0, "<i8"), offsets, False
    return np.concatenate(stream), offsets[rows].astype("<i8"), True
