"""Cells into simpler ones on the same points: solids into tets, quads into triangles, second order into first.

A quad that two cells share is cut along the diagonal from its smallest point row, which both know (Dompierre, Labbé,
Vallet, Camarero: How to subdivide pyramids, prisms and hexahedra into tetrahedra, 1999). Each cell is then the cone
from its own smallest point over the faces that do not have it: six tets for a hex, three for a wedge, two for a
pyramid.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import edges
from meshwright.audit.errors import MeshError
from meshwright.audit.mesh import CellBlock, Ints, Mesh
from meshwright.repair.carrying import assignable, with_boundary, with_cells, without_points
from meshwright.repair.outcome import Options, Outcome

__all__ = ["linearise", "split_in_five", "split_to_tets"]

_TRIADS = CELL_TYPES["hex"].triads
_CORNER_TETS = (*(_TRIADS[i] for i in (1, 3, 4, 6)), (0, 2, 7, 5))
"""A hex whose corners 0, 2, 5, 7 keep their diagonals: a tet at each other corner, and the one in the middle."""
_OTHER_TETS = (*(_TRIADS[i] for i in (0, 2, 5, 7)), (1, 3, 4, 6))


def linear_only(mesh: Mesh) -> None:
    """MeshError where the cells are not linear and given by their nodes."""
    assignable(mesh)
    if mesh.order > 1:
        raise MeshError("cells of second order cannot be cut; `linearise` makes linear ones of them")


def split_to_tets(mesh: Mesh, options: Options) -> Outcome:
    """Cut every solid cell into tets and every quad of a flat mesh or surface into triangles.

    Boundary quads are cut along the same diagonals. MeshError for second order, polyhedra and polygons.
    """
    linear_only(mesh)
    wanted = "tet" if mesh.cell_dimension == 3 else "tri"
    if all(block.type == wanted for block in mesh.blocks):
        return Outcome(mesh, 0)
    nodes, parents = [], []
    for block in mesh.blocks:
        children, of = (
            (block.nodes.astype(np.int64), np.arange(len(block))) if block.type == wanted else _children(block)
        )
        nodes.append(children)
        parents.append(block.rows[of])
    cells = {block.type: (block.nodes[:0], block.rows[:0]) for block in mesh.blocks}
    cells[wanted] = np.concatenate(nodes), np.concatenate(parents)
    fresh, cells_from = with_cells(_with_triangles(mesh), cells)
    cut = sum(len(block) for block in mesh.blocks if block.type != wanted)
    return Outcome(fresh, cut, f"cells cut into {wanted}s", cells_from=cells_from)


def _children(block: CellBlock) -> tuple[Ints, Ints]:
    """(children, cell of each): the cones of the cells from their smallest points."""
    if block.type == "quad":
        return _halves(block.nodes.astype(np.int64))
    nodes = block.nodes.astype(np.int64)
    first = nodes.argmin(axis=1)
    out, of = [], []
    for corner in range(nodes.shape[1]):
        cells = np.flatnonzero(first == corner)
        for face in CELL_TYPES[block.type].faces:
            if corner in face or not len(cells):
                continue
            side = nodes[cells][:, list(face)]
            tris, which = (side, np.arange(len(side))) if len(face) == 3 else _halves(side)
            out.append(np.column_stack([nodes[cells[which], corner], tris]))
            of.append(cells[which])
    return np.concatenate(out), np.concatenate(of)


def _halves(quads: Ints) -> tuple[Ints, Ints]:
    """(triangles, quad of each): quads (m, 4) cut along the diagonal from their smallest point."""
    at = quads.argmin(axis=1)
    turned = quads[np.arange(len(quads))[:, None], (at[:, None] + np.arange(4)) % 4]
    which = np.tile(np.arange(len(quads)), 2)
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]]), which


def _with_triangles(mesh: Mesh) -> Mesh:
    """The mesh with its boundary quads cut."""
    found = {block.type: block for block in mesh.boundary}
    if "quad" not in found:
        return mesh
    quads = found["quad"]
    tris, of = _halves(quads.nodes.astype(np.int64))
    rows = quads.rows[of]
    if "tri" in found:
        tris, rows = np.concatenate([found["tri"].nodes, tris]), np.concatenate([found["tri"].rows, rows])
    return with_boundary(mesh, {"quad": (quads.nodes[:0], quads.rows[:0]), "tri": (tris, rows)})


def split_in_five(mesh: Mesh, options: Options) -> Outcome:
    """Cut every hex of a mesh of hexes into five tets.

    Every second point keeps all diagonals; MeshError where the points cannot be told apart so, for then the cells
    would not fit together.
    """
    linear_only(mesh)
    if {block.type for block in mesh.blocks} != {"hex"}:
        raise MeshError("only a mesh of hexes alone can be cut into five tets each; split-to-tets cuts any")
    block = mesh.block("hex")
    nodes = block.nodes.astype(np.int64)
    odd = _two_colours(mesh)
    keeps_first = odd[nodes[:, 0]] == odd[nodes[:, 2]]
    if not keeps_first.all():
        raise MeshError("the points of these hexes cannot be coloured by turns; split-to-tets cuts any mesh")
    own = odd[nodes[:, 0]]  # corners 0, 2, 5, 7 are of the colour of corner 0
    tets = np.where(own[:, None, None], nodes[:, np.array(_OTHER_TETS)], nodes[:, np.array(_CORNER_TETS)])
    fresh, cells_from = with_cells(
        _along_colour(mesh, odd),
        {"hex": (nodes[:0], block.rows[:0]), "tet": (tets.reshape(-1, 4), block.rows.repeat(5))},
    )
    return Outcome(fresh, len(block), "hexes cut into five tets", cells_from=cells_from)


def _two_colours(mesh: Mesh) -> Ints:
    """(n,) 0 or 1, different at both ends of every edge; MeshError where there is no such colouring."""
    ends = edges(mesh).astype(np.int64)
    n = len(mesh.points)
    # in the graph of points and their mirror images an edge leads to the image of its other end
    rows = np.concatenate([ends[:, 0], ends[:, 0] + n])
    columns = np.concatenate([ends[:, 1] + n, ends[:, 1]])
    links = coo_array((np.ones(len(rows), np.int8), (rows, columns)), shape=(2 * n, 2 * n))
    _, label = connected_components(links, directed=False)
    if (label[:n] == label[n:])[np.unique(ends)].any():
        raise MeshError("the points of these hexes cannot be coloured by turns; split-to-tets cuts any mesh")
    return (label[:n] > label[n:]).astype(np.int64)


def _along_colour(mesh: Mesh, odd: Ints) -> Mesh:
    """The mesh with its boundary quads cut along the diagonal whose ends have colour 0."""
    found = {block.type: block for block in mesh.boundary}
    if "quad" not in found:
        return mesh
    quads = found["quad"]
    nodes = quads.nodes.astype(np.int64)
    turned = np.where(odd[nodes[:, :1]] == 1, nodes[:, [1, 2, 3, 0]], nodes)
    tris = np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
    rows = np.tile(quads.rows, 2)
    if "tri" in found:
        tris, rows = np.concatenate([found["tri"].nodes, tris]), np.concatenate([found["tri"].rows, rows])
    return with_boundary(mesh, {"quad": (nodes[:0], quads.rows[:0]), "tri": (tris, rows)})


def linearise(mesh: Mesh, options: Options) -> Outcome:
    """Make linear cells of those of second order; points that were nothing but mid-side nodes go."""
    assignable(mesh)
    if mesh.order == 1:
        return Outcome(mesh, 0)
    off, changed = 0.0, 0
    for block in mesh.blocks:
        kind = CELL_TYPES[block.type]
        if kind.order > 1:
            changed += len(block)
            ends = mesh.points[block.nodes[:, kind.edge_table]].mean(axis=2)
            gap = np.linalg.norm(mesh.points[block.nodes[:, list(kind.mid_edges)]] - ends, axis=2)
            off = max(off, float(gap.max()))
    fresh, cells_from = with_cells(mesh, _corners_of(mesh.blocks))
    fresh = with_boundary(fresh, _corners_of(mesh.boundary))
    named = np.zeros(len(mesh.points), np.bool_)
    for block in (*fresh.blocks, *fresh.boundary):
        named[block.nodes.ravel()] = True
    was = np.zeros(len(mesh.points), np.bool_)
    for block in (*mesh.blocks, *mesh.boundary):
        was[block.nodes.ravel()] = True
    keep = np.flatnonzero(named | ~was)
    into = np.full(len(named), -1, np.int64)
    into[keep] = np.arange(len(keep))
    fresh, points_from = without_points(fresh, keep, into)
    note = f"cells made linear, mid-side nodes up to {off:.3g} off the straight edge dropped"
    return Outcome(fresh, changed, note, points_from=points_from, cells_from=cells_from)


def _corners_of(blocks: tuple[CellBlock, ...]) -> dict[str, tuple[Ints, Ints]]:
    """Cells by their linear types, none of the others."""
    out: dict[str, tuple[Ints, Ints]] = {block.type: (block.nodes[:0], block.rows[:0]) for block in blocks}
    for block in blocks:
        kind = CELL_TYPES[block.type]
        nodes, rows = block.nodes[:, : kind.n_corners].astype(np.int64), block.rows
        if kind.corners in out and len(out[kind.corners][1]):
            nodes = np.concatenate([out[kind.corners][0], nodes])
            rows = np.concatenate([out[kind.corners][1], rows])
        out[kind.corners] = nodes, rows
    return out
