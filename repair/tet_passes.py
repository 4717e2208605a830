"""The passes on tets: swap, smooth, and the schedule of both."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from meshwright.audit.cache import forget
from meshwright.audit.mesh import Mesh
from meshwright.repair.carrying import assignable, with_cells, with_more_points, with_points, without_gone
from meshwright.repair.held import held_points, sliding, zone_walls
from meshwright.repair.listing import listed_anew
from meshwright.repair.outcome import FREE, Options, Outcome
from meshwright.repair.tet_tables import TetTables
from meshwright.repair.tets import free_tets, improve_tets, raise_worst_tets, smooth_tets, swap_tets

__all__ = ["improve", "raise_worst", "smooth", "swap"]

_ROOM = 0.25
"""New points that a pass may put in, as a part of those there are."""


def _on_tets(mesh: Mesh, options: Options, work: Callable[[TetTables], tuple[int, int]]) -> Outcome:
    """Run `work` on the tets of the mesh; cells of other types are not touched."""
    if mesh.faces is not None or not any(block.type == "tet" and len(block) for block in mesh.blocks):
        return Outcome(mesh, 0)
    assignable(mesh)
    block = mesh.block("tet")
    slides = sliding(mesh, options)
    n = len(mesh.points)
    room = _ROOM if options.nodes == FREE else 0.0
    walls, held = zone_walls(mesh), held_points(mesh, options)
    forget(mesh)  # its faces would stand beside the tables
    tables = TetTables.of(mesh.points, block.nodes, walls, held, slides, options.sheet, room)
    swaps, moves = work(tables)
    if not swaps and not moves:
        return Outcome(mesh, 0)
    points, tets, origin = tables.result()
    flips = tables.flips
    del tables
    fresh, cells_from, points_from = with_more_points(with_points(mesh, points[:n]), points[n:]), None, None
    moved = int(np.count_nonzero((points[:n] != mesh.points).any(axis=1)))
    note = f"{swaps:,} swaps, {moved:,} points moved" + (f", {flips:,} boundary edges turned" if flips else "")
    if swaps:
        fresh, cells_from = with_cells(fresh, {"tet": (tets, block.rows[origin])})
    if flips:
        fresh = listed_anew(fresh)
    lost = np.zeros(len(points), np.bool_)
    lost[block.nodes] = True
    lost[n:] = True
    lost[tets] = False
    gone = np.flatnonzero(lost)
    if len(gone) or len(points) > n:
        fresh, points_from, told = without_gone(fresh, gone, n)
        note += told
    return Outcome(fresh, swaps + moved, note, points_from=points_from, cells_from=cells_from)


def swap(mesh: Mesh, options: Options) -> Outcome:
    """Swap edges and faces of tets: 2-3, 3-2, 4-4 and general edge removal."""
    return _on_tets(mesh, options, lambda tables: (swap_tets(tables), 0))


def smooth(mesh: Mesh, options: Options) -> Outcome:
    """Move inner points of tets to lower the cost of their star."""
    return _on_tets(mesh, options, lambda tables: (0, smooth_tets(tables)))


def improve(mesh: Mesh, options: Options) -> Outcome:
    """Swap and smooth tets in turn, then raise the worst, with points put in and taken away where that is allowed."""

    def work(tables: TetTables) -> tuple[int, int]:
        swaps, moves = improve_tets(tables, options.tell)
        if options.nodes == FREE:
            more, further = free_tets(tables, options.tell)
            swaps, moves = swaps + more, moves + further
        return swaps, moves

    return _on_tets(mesh, options, work)


def raise_worst(mesh: Mesh, options: Options) -> Outcome:
    """Swap and move only where tets are bad, and only to raise the worst of those touched."""
    return _on_tets(mesh, options, lambda tables: raise_worst_tets(tables, options.tell))
