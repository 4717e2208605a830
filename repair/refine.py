"""Refinement: cells are cut at the middle of their edges, conforming with all around them.

Which edges are cut decides everything; the children of a cell stand in `templates`. Boundary elements are cut with the
faces that they lie on, new cells are in the zones of their parents.
"""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import MeshError, UsageError
from meshwright.audit.mesh import CellBlock, Floats, Ints, Mesh
from meshwright.repair.carrying import with_boundary, with_cells, with_more_points
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.split import linear_only
from meshwright.repair.templates import OCTAHEDRON, tet_children, tri_children, whole_children

__all__ = ["bisect", "chosen_cells", "insert_centroids", "refine"]

Mask = NDArray[np.bool_]

_MOST_CELLS = 2**31 - 1
_MOST_ROUNDS = 200
_SIMPLICES = ("line", "tri", "tet")
_WHOLE = ("quad", "pyramid", "wedge", "hex")


@dataclass(frozen=True, eq=False)
class _Edges:
    """The edges of the cells and boundary elements of a mesh. keys (m,): ascending; ends (m, 2); n: of points."""

    keys: Ints
    n: int

    @classmethod
    def of(cls, mesh: Mesh) -> _Edges:
        n = len(mesh.points)
        every = [_keys(block, n).ravel() for block in (*mesh.blocks, *mesh.boundary)]
        return cls(np.unique(np.concatenate(every)), n)

    @property
    def ends(self) -> Ints:
        return np.stack([self.keys // self.n, self.keys % self.n], axis=1)

    def rows(self, block: CellBlock) -> Ints:
        """(cells, edges of each) their rows here."""
        return np.searchsorted(self.keys, _keys(block, self.n))


def _keys(block: CellBlock, n: int) -> Ints:
    ends = block.nodes[:, CELL_TYPES[block.type].edge_table].astype(np.int64)
    return ends.min(axis=2) * n + ends.max(axis=2)


def chosen_cells(mesh: Mesh, options: Options) -> Mask:
    """(n_cells,) the cells that are to be refined; UsageError for a glob that matches no zone of cells."""
    if not options.refine:
        return np.ones(mesh.n_cells, np.bool_)
    out: Mask = np.zeros(mesh.n_cells, np.bool_)
    for pattern in options.refine:
        matching = [zone for zone in mesh.cell_zones if fnmatchcase(zone.name, pattern)]
        if not matching:
            names = ", ".join(sorted(zone.name for zone in mesh.cell_zones)[:10]) or "none"
            raise UsageError(f"no zone of cells matches {pattern!r}; the mesh has: {names}")
        for zone in matching:
            out[zone.members] = True
    return out


def _lengths(mesh: Mesh, edges: _Edges) -> Floats:
    ends = mesh.points[edges.ends]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def _of_chosen(mesh: Mesh, edges: _Edges, chosen: Mask) -> Mask:
    """(edges,) the edges of chosen cells."""
    out: Mask = np.zeros(len(edges.keys), np.bool_)
    for block in mesh.blocks:
        out[edges.rows(block)[chosen[block.rows]]] = True
    return out


def refine(mesh: Mesh, options: Options) -> Outcome:
    """Cut the edges of the chosen cells, all of them or, with `max_edge`, round by round those that are longer.

    Cells around that have such an edge are cut to fit, where they are triangles and tets; MeshError where others have
    an edge that is cut and one that is not.
    """
    linear_only(mesh)
    current, origin, cells_from, cut = mesh, np.arange(len(mesh.points)), np.arange(mesh.n_cells), 0
    for _ in range(_MOST_ROUNDS if options.max_edge is not None else 1):
        edges = _Edges.of(current)
        marked = _of_chosen(current, edges, chosen_cells(current, options))
        if options.max_edge is not None:
            marked &= _lengths(current, edges) > options.max_edge
        if not marked.any():
            break
        current, points_from, of = _cut(current, edges, marked)
        origin, cells_from = np.where(points_from >= 0, origin[points_from], -1), cells_from[of]
        cut += int(marked.sum())
    note = f"edges cut: {mesh.n_cells:,} cells became {current.n_cells:,}"
    return Outcome(current, cut, note, points_from=origin, cells_from=cells_from) if cut else Outcome(mesh, 0)


def bisect(mesh: Mesh, options: Options) -> Outcome:
    """Cut triangles and tets at their longest edges until none of the chosen ones has an edge longer than `max_edge`.

    An edge is cut when it is the longest of every cell around it. Where it is not, the longer edge of a cell beside it
    is cut first, and so on (Rivara's longest-edge propagation paths, 1997): no cell has to be cut to make another fit.
    """
    linear_only(mesh)
    if options.max_edge is None:
        raise UsageError("bisect cuts edges down to a length: give it with --max-edge")
    if not {block.type for block in mesh.blocks} <= set(_SIMPLICES):
        raise MeshError("only triangles and tets can be bisected; split-to-tets makes them of other cells")
    current, origin, cells_from, cut = mesh, np.arange(len(mesh.points)), np.arange(mesh.n_cells), 0
    while True:
        edges = _Edges.of(current)
        length = _lengths(current, edges)
        rank = np.empty(len(length), np.int64)
        rank[np.lexsort((np.arange(len(length)), length))] = np.arange(len(length))
        wanted = (length > options.max_edge) & _of_chosen(current, edges, chosen_cells(current, options))
        if not wanted.any():
            break
        tables = [edges.rows(block) for block in current.blocks]
        longest = [rows[np.arange(len(rows)), rank[rows].argmax(axis=1)] for rows in tables]
        last: Mask = np.ones(len(length), np.bool_)
        for rows, most in zip(tables, longest, strict=True):
            last[rows[rows != most[:, None]]] = False
        before = 0
        while before != (now := int(wanted.sum())):
            before = now
            for rows, most in zip(tables, longest, strict=True):
                wanted[most[wanted[rows].any(axis=1)]] = True
        marked = wanted & last
        current, points_from, of = _cut(current, edges, marked)
        origin, cells_from = np.where(points_from >= 0, origin[points_from], -1), cells_from[of]
        cut += int(marked.sum())
        options.tell("bisect", cut, 0)
    note = f"edges cut: {mesh.n_cells:,} cells became {current.n_cells:,}"
    return Outcome(current, cut, note, points_from=origin, cells_from=cells_from) if cut else Outcome(mesh, 0)


def insert_centroids(mesh: Mesh, options: Options) -> Outcome:
    """Cut each chosen triangle into three and each chosen tet into four at its middle."""
    linear_only(mesh)
    chosen = chosen_cells(mesh, options)
    if not {block.type for block in mesh.blocks} <= set(_SIMPLICES):
        raise MeshError("only triangles and tets can be cut at their middle; split-to-tets makes them of other cells")
    points: list[Floats] = []
    cells: dict[str, tuple[Ints, Ints]] = {}
    n = len(mesh.points)
    for block in mesh.blocks:
        here = chosen[block.rows]
        nodes = block.nodes.astype(np.int64)
        inside = nodes[here]
        middle = n + sum(map(len, points)) + np.arange(len(inside))
        points.append(mesh.points[inside].mean(axis=1))
        width = nodes.shape[1]
        children = np.repeat(inside[:, None, :], width, axis=1)
        children[:, np.arange(width), np.arange(width)] = middle[:, None]
        rows = np.concatenate([block.rows[~here], block.rows[here].repeat(width)])
        cells[block.type] = np.concatenate([nodes[~here], children.reshape(-1, width)]), rows
    count = int(chosen.sum())
    _check_size(mesh.n_cells + 3 * count)
    fresh, cells_from = with_cells(with_more_points(mesh, np.concatenate(points)), cells)
    origin = np.concatenate([np.arange(n), np.full(count, -1)])
    return Outcome(fresh, count, "points put in the middle of cells", points_from=origin, cells_from=cells_from)


def _check_size(cells: int) -> None:
    if cells > _MOST_CELLS:
        raise MeshError(f"this would make {cells:,} cells; {_MOST_CELLS:,} is the most there can be")


def _cut(mesh: Mesh, edges: _Edges, marked: Mask) -> tuple[Mesh, Ints, Ints]:
    """(mesh, points_from, cells_from): every cell cut at its marked edges."""
    n = len(mesh.points)
    middle = np.full(len(marked), -1, np.int64)
    middle[marked] = n + np.arange(int(marked.sum()))
    ends = edges.ends[marked]
    points = [0.5 * (mesh.points[ends[:, 0]] + mesh.points[ends[:, 1]])]
    fresh = mesh
    whole = [b for b in (*mesh.blocks, *mesh.boundary) if b.type in _WHOLE]
    quads = np.empty((0, 4), np.int64)
    if whole:
        if not all(marked[edges.rows(block)].all() for block in whole):
            if any(marked[edges.rows(block)].any() for block in whole):
                raise MeshError(
                    "only triangles and tets can be refined in part: refine the whole mesh, or cut it to tets first"
                )
            whole = []
        else:
            quads = np.unique(np.concatenate([_quads_of(b) for b in whole]), axis=0)
            points.append(mesh.points[quads].mean(axis=1))
    at = n + sum(map(len, points))
    is_whole = {id(block) for block in whole}
    new: list[dict[str, list[tuple[Ints, Ints]]]] = [{}, {}]
    for found, blocks in zip(new, (mesh.blocks, mesh.boundary), strict=True):
        for block in blocks:
            if id(block) not in is_whole:
                children = {block.type: _of_simplex(mesh, block, edges, middle)} if block.type in _SIMPLICES else {}
            else:
                centres = mesh.points[block.nodes].mean(axis=1) if block.type == "hex" else np.empty((0, 3))
                first = n + int(marked.sum()) if len(quads) else 0
                children = _of_whole(block, edges, middle, quads, first, at)
                points.append(centres)
                at += len(centres)
            for name, pair in children.items():
                found.setdefault(name, []).append(pair)
    cells, elements = (
        {
            name: (np.concatenate([p[0] for p in pairs]), np.concatenate([p[1] for p in pairs]))
            for name, pairs in d.items()
        }
        for d in new
    )
    _check_size(sum(len(rows) for _, rows in cells.values()))
    fresh = with_more_points(fresh, np.concatenate(points))
    fresh, cells_from = with_cells(fresh, cells)
    if mesh.boundary:
        fresh = with_boundary(fresh, elements)
    return fresh, np.concatenate([np.arange(n), np.full(len(fresh.points) - n, -1)]), cells_from


def _joined(pairs: list[tuple[Ints, Ints]]) -> tuple[Ints, Ints]:
    return np.concatenate([nodes for nodes, _ in pairs]), np.concatenate([rows for _, rows in pairs])


def _of_simplex(mesh: Mesh, block: CellBlock, edges: _Edges, middle: Ints) -> tuple[Ints, Ints]:
    """(children, row of the cell each comes from) of lines, triangles and tets."""
    nodes = block.nodes.astype(np.int64)
    order = np.argsort(nodes, axis=1, kind="stable")
    ranked = np.take_along_axis(nodes, order, axis=1)
    ends = ranked[:, CELL_TYPES[block.type].edge_table]
    rows = np.searchsorted(edges.keys, ends.min(axis=2) * edges.n + ends.max(axis=2))
    between = middle[rows]
    mask = ((between >= 0) << np.arange(between.shape[1])).sum(axis=1)
    both = np.hstack([ranked, between])
    odd = _is_odd(order)
    children, parents = [], []
    for value in np.unique(mask):
        cells = np.flatnonzero(mask == value)
        for part, table in _tables(mesh, block.type, int(value), cells, both):
            found = both[part][:, table]
            if block.type != "line":
                # ranking may have turned the cell over: its children are turned back
                found[odd[part]] = found[odd[part]][:, :, [*range(table.shape[1] - 2), -1, -2]]
            else:
                found[odd[part]] = found[odd[part]][:, :, ::-1]
            children.append(found.reshape(-1, table.shape[1]))
            parents.append(block.rows[part].repeat(len(table)))
    if not children:
        return nodes, block.rows
    return np.concatenate(children), np.concatenate(parents)


def _tables(mesh: Mesh, kind: str, mask: int, cells: Ints, both: Ints) -> list[tuple[Ints, Ints]]:
    """(cells, children) for the cells of a mask; an octahedron is filled around its shortest diagonal."""
    if kind == "line":
        return [(cells, np.array([[0, 2], [2, 1]]) if mask else np.array([[0, 1]]))]
    if kind == "tri":
        return [(cells, tri_children(mask))]
    if mask != 63:
        return [(cells, tet_children(mask))]
    corners = both[cells]
    at = 0.5 * (mesh.points[corners[:, [a for a, _ in _TET_ENDS]]] + mesh.points[corners[:, [b for _, b in _TET_ENDS]]])
    long = np.stack([np.linalg.norm(at[:, i - 4] - at[:, j - 4], axis=1) for i, j in OCTAHEDRON], axis=1)
    shortest = long.argmin(axis=1)
    return [(cells[shortest == d], tet_children(63, d)) for d in range(3)]


_TET_ENDS = CELL_TYPES["tet"].edges


def _is_odd(order: Ints) -> Mask:
    """(m,) whether each row is an odd permutation."""
    width = order.shape[1]
    turns = np.zeros(len(order), np.int64)
    for i in range(width):
        for j in range(i + 1, width):
            turns += order[:, i] > order[:, j]
    out: Mask = turns % 2 == 1
    return out


def _quads_of(block: CellBlock) -> Ints:
    """(m, 4) the quads of the cells, each with its points ascending."""
    faces = CELL_TYPES[block.type].quad_faces
    return np.sort(block.nodes[:, faces].reshape(-1, 4).astype(np.int64), axis=1)


def _of_whole(
    block: CellBlock, edges: _Edges, middle: Ints, quads: Ints, first: int, centre: int
) -> dict[str, tuple[Ints, Ints]]:
    """Children, by type, of cells all of whose edges are cut. first: point of quads[0]; centre: of the first cell."""
    nodes = block.nodes.astype(np.int64)
    every = [nodes, middle[edges.rows(block)]]
    mine = _quads_of(block)
    joined = np.concatenate([quads, mine])
    _, name = np.unique(joined, axis=0, return_inverse=True)
    every.append(first + name.ravel()[len(quads) :].reshape(len(nodes), -1))
    if block.type == "hex":
        every.append(centre + np.arange(len(nodes))[:, None])
    table = np.hstack(every)
    return {
        kind: (table[:, children].reshape(-1, children.shape[1]), block.rows.repeat(len(children)))
        for kind, children in whole_children(block.type).items()
    }
