"""The cells of a Fluent file: what their faces enclose, held against the types that section 12 gives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.assembly import AssemblyError, blocks_from_faces
from meshwright.audit.cells import ORDER_OF_TYPES
from meshwright.audit.csr import faces_by_cell, take
from meshwright.audit.errors import ReadError
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, CellBlock, Faces, Ints
from meshwright.audit.readers.fluent.faces import Live
from meshwright.audit.readers.fluent.records import FluentRecords
from meshwright.audit.readers.source import Source

__all__ = ["cell_blocks"]

_POLYHEDRON = 7
_TYPES = ("", "tri", "tet", "quad", "hex", "pyramid", "wedge", "polyhedron")
_NUMBERS = {name: number for number, name in enumerate(_TYPES)}


def cell_blocks(
    source: Source, records: FluentRecords, sides: Faces, live: Live, faces: Faces
) -> tuple[CellBlock, ...]:
    """The cells that take part, one block a type.

    sides: all faces by number.  faces: those that take part.  A cell that the file calls a polyhedron stays one,
    even where its faces are those of a hex, so that counts agree with the program that wrote it.
    Raises ReadError for a cell that its faces do not enclose, and for one of another type than the file says.
    """
    ids = np.flatnonzero(live.cells) + 1
    shape = _shapes(source, sides, live) if live.parents.any() else faces
    dimension = records.dimension
    try:
        blocks = blocks_from_faces(shape.offsets, shape.nodes, shape.owner, shape.neighbour, len(ids), dimension)
    except AssemblyError as error:
        raise ReadError(source.path, f"cell {int(ids[error.cell])}", error.expected, error.found) from error
    said = np.zeros(len(live.cells), np.int8)
    for part in records.cells:
        said[part.first - 1 : part.last] = part.types
    said = said[live.cells]
    for block in blocks:
        own = said[block.rows]
        # A polygon has no number of its own: in 2-D too the file says polyhedron.
        wrong = (own != 0) & (own != _POLYHEDRON) & (own != _NUMBERS.get(block.type, _POLYHEDRON))
        if wrong.any():
            row = int(block.rows[np.argmax(wrong)])
            expected = f"the faces of a {_TYPES[said[row]]}, the type that section 12 gives"
            raise ReadError(source.path, f"cell {int(ids[row])}", expected, f"those of a {block.type}")
    return _with_polyhedra(blocks, said == _POLYHEDRON, faces, shape is not faces, dimension)


def _with_polyhedra(
    blocks: tuple[CellBlock, ...], wanted: NDArray[np.bool_], faces: Faces, rebuild: bool, dimension: int
) -> tuple[CellBlock, ...]:
    """The blocks, with the `wanted` cells moved to the polyhedra (in 2-D polygons).

    rebuild: the polyhedra list rows of other faces than `faces` and are made anew.
    """
    solid = dimension == 3
    name = "polyhedron" if solid else "polygon"
    others = [block for block in blocks if block.type != name]
    if not any(wanted[block.rows].any() for block in others) and not (rebuild and solid):
        return blocks
    rest = [(block, ~wanted[block.rows]) for block in others]
    kept = [CellBlock(block.type, block.rows[stays], block.nodes[stays]) for block, stays in rest if stays.any()]
    loose = [block.rows[~stays] for block, stays in rest] + [block.rows for block in blocks if block.type == name]
    rows = np.concatenate(loose)
    if not len(rows):
        return blocks
    order = np.argsort(rows)
    if solid:
        offsets, items = take(*faces_by_cell(faces.owner, faces.neighbour, len(wanted)), rows[order])
    else:
        loops = [block.nodes[~stays] for block, stays in rest]
        sizes = [np.full(len(loop), loop.shape[1]) for loop in loops]
        around = [loop.ravel() for loop in loops]
        for block in blocks:
            if block.type == name and block.offsets is not None and block.items is not None:
                sizes.append(np.diff(block.offsets))
                around.append(block.items)
        starts = np.concatenate(([0], np.cumsum(np.concatenate(sizes))))
        offsets, items = take(starts, np.concatenate(around), order)
    kept.append(CellBlock(name, rows[order], offsets=offsets, items=items))
    return tuple(sorted(kept, key=lambda block: ORDER_OF_TYPES.index(block.type)))


def _shapes(source: Source, sides: Faces, live: Live) -> Faces:
    """The faces that give each cell its shape: a cell beside smaller ones has the unsplit face, they the pieces.

    With the pieces such a cell would be no closed polyhedron in 3-D, since its other faces do not have the hanging
    nodes on their edges. Raises ReadError for a piece that is not beside such a cell as the unsplit face is.
    """
    split = live.parent[:, None] >= 0
    cells = np.stack((sides.owner, sides.neighbour), axis=1)
    alive = (cells != NO_CELL) & live.cells[cells]
    beside_whole = cells[live.parent]
    has_whole = split & ((cells == beside_whole[:, :1]) | (cells == beside_whole[:, 1:]))
    _check_pieces(source, cells, live, has_whole & alive)
    seen = alive & ~has_whole & (live.faces | live.parents)[:, None]
    rows = np.flatnonzero(seen.any(axis=1))
    seen, cells = seen[rows], cells[rows]
    turned = ~seen[:, 0]
    owner = np.where(turned, cells[:, 1], cells[:, 0])
    neighbour = np.where(seen.all(axis=1), cells[:, 1], NO_CELL)
    offsets, nodes = take(sides.offsets, sides.nodes, rows)
    nodes = _turned(offsets, nodes, turned)
    return Faces(offsets, nodes, live.rows_of_cells(owner), live.rows_of_cells(neighbour))


def _check_pieces(source: Source, cells: Ints, live: Live, has_whole: NDArray[np.bool_]) -> None:
    """cells: (f, 2) on the sides of each face.  has_whole: whether that is a live cell beside the unsplit face too.

    Nothing else would miss a piece that is gone: the cell's shape is that of the unsplit face.
    """
    whole = cells[live.parent]
    wanted = (live.parent[:, None] >= 0) & (whole != NO_CELL) & live.cells[whole]
    lacking = wanted.sum(axis=1) > has_whole.sum(axis=1)
    if lacking.any():
        face = int(np.argmax(lacking))
        expected = f"the unrefined cell beside face {int(live.parent[face]) + 1}, of which it is a piece, beside it too"
        raise ReadError(source.path, f"face {face + 1}", expected, "another")


@kernel
def _turned(offsets: Ints, nodes: Ints, which: NDArray[np.bool_]) -> Ints:
    """The nodes with those of some faces in reverse order."""
    out = nodes.copy()
    for row in range(len(which)):
        if which[row]:
            out[offsets[row] : offsets[row + 1]] = nodes[offsets[row] : offsets[row + 1]][::-1]
    return out
