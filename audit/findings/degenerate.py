"""Checks on cells that have lost a dimension or a corner, and on cells and faces listed twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import duplicate_cells as copies_of_cells
from meshwright.audit.connectivity import nodes_of_cells
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.repeats import repeated, repeats
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, Faces, Ints
from meshwright.audit.sets import hash_rows

__all__ = ["ROWS"]


def degenerate_cells(facts: Facts) -> Found | None:
    """Cells without volume (area): |V| < 1e-14 Lmax**3, A < 1e-14 Lmax**2."""
    rows = np.flatnonzero(facts.shapes.flat)
    if not len(rows):
        return None
    what = "volume" if facts.mesh.cell_dimension == 3 else "area"
    return Found(
        rows,
        f"{counted(len(rows), 'cell')} without {what}: solvers divide by it; remove the cell or move its nodes apart",
    )


def collapsed_cells(facts: Facts) -> Found | None:
    """Cells that name a point twice, or have an edge of no length, and yet have a size."""
    shapes = facts.shapes
    rows = np.flatnonzero(shapes.collapsed & ~shapes.flat)
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'cell')} with a collapsed edge (a hex folded into a wedge, a quad into a triangle): some "
        "solvers accept this, others divide by the edge; write the simpler cell type instead",
    )


def duplicate_cells(facts: Facts) -> Found | None:
    """Cells with the corners of an earlier one."""
    mesh = facts.mesh
    if mesh.order == 1 and not len(repeats(hash_rows(*nodes_of_cells(mesh)))):
        return None
    rows = copies_of_cells(mesh)[:, 0]
    if not len(rows):
        return None
    return Found(
        rows, f"{counted(len(rows), 'cell')} with the same nodes as an earlier one: counted twice; delete the copies"
    )


def duplicate_faces(facts: Facts) -> Found | None:
    """Faces of a face-based mesh with the nodes of an earlier one.

    Two boundary faces of different cells back to back are a baffle (a thin wall) and meant so.
    """
    own = facts.mesh.faces
    if own is None:
        return None
    rows = repeated(hash_rows(own.offsets, own.nodes), lambda rows, firsts: _same_faces(own, rows, firsts))
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'face')} with the same nodes as an earlier one, not a baffle: fluxes are counted "
        "twice; delete the copies",
    )


def _same_faces(own: Faces, rows: Ints, firsts: Ints) -> NDArray[np.bool_]:
    same = _same_items(own.offsets, own.nodes, rows, firsts)
    outer = (own.neighbour[rows] == NO_CELL) & (own.neighbour[firsts] == NO_CELL)
    return same & ~(outer & (own.owner[rows] != own.owner[firsts]))


@kernel
def _same_items(offsets: Ints, items: Ints, rows: Ints, others: Ints) -> NDArray[np.bool_]:
    out = np.empty(rows.size, np.bool_)
    for k in range(rows.size):
        a = np.sort(items[offsets[rows[k]] : offsets[rows[k] + 1]])
        b = np.sort(items[offsets[others[k]] : offsets[others[k] + 1]])
        out[k] = a.size == b.size and np.all(a == b)
    return out


ROWS = (
    Check(
        "degenerate-cells", "error", "Cells without size", "cell",
        "division by a zero volume gives no answer at all", degenerate_cells,
    ),
    Check(
        "collapsed-cells", "warning", "Cells with a collapsed edge", "cell",
        "legal in some solvers, fatal in others", collapsed_cells,
    ),
    Check(
        "duplicate-cells", "error", "Cells listed twice", "cell",
        "stiffness and volume are counted twice", duplicate_cells,
    ),
    Check(
        "duplicate-faces", "error", "Faces listed twice", "face",
        "which of them the flux passes is undefined", duplicate_faces, ("own faces",),
    ),
)  # fmt: skip
