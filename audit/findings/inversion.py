"""Checks on the sign of cells: inverted, ordered by another convention, folded at a corner."""

from __future__ import annotations

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted

__all__ = ["ROWS"]


def inverted_cells(facts: Facts) -> Found | None:
    """Cells of negative volume (clockwise ones in a flat mesh) that no convention explains."""
    rows = np.flatnonzero(facts.shapes.negative & ~facts.reversed_cells)
    if not len(rows):
        return None
    what = "negative volume" if facts.mesh.cell_dimension == 3 else "clockwise node order"
    return Found(
        rows,
        f"{counted(len(rows), 'cell')} of {what}: no solver accepts {'it' if len(rows) == 1 else 'them'}; move the "
        "misplaced nodes or remesh there, or reverse the node order where a cell's shape is sound",
    )


def node_order_convention(facts: Facts) -> Found | None:
    """Every cell of a type is negative: the writer orders nodes the other way round."""
    types = facts.reversed_types
    if not types:
        return None
    rows = np.flatnonzero(facts.reversed_cells)
    what = ", ".join(counted(n, name, CELL_TYPES[name].name) for name, n in types.items())
    sized = np.count_nonzero(~facts.shapes.flat & np.isfinite(facts.shapes.relative))
    if facts.mesh.cell_dimension == 2 and len(rows) == sized:
        return Found(
            rows,
            f"all {what} run clockwise: the mesh was drawn looking from below; reverse the node order of all cells "
            "before solving, or look from the other side",
        )
    if len(rows) == sized:
        return Found(
            rows,
            f"the whole mesh is mirrored (all {what} negative): either the writer orders nodes the other way round or "
            "one axis was flipped; reverse the node order of all cells before solving",
        )
    return Found(
        rows,
        f"all {what} are negative while the rest is not: the writer orders the nodes of this type the other way round; "
        "reverse their node order before handing the mesh to a solver",
    )


def negative_jacobian_cells(facts: Facts) -> Found | None:
    """Cells of positive volume that are concave or folded at a corner."""
    shapes = facts.shapes
    upright = ~shapes.negative | facts.reversed_cells
    rows = np.flatnonzero(shapes.folded & upright & ~shapes.flat & ~shapes.collapsed)
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'cell')} of positive size but with a corner Jacobian of 0 or less: finite-element "
        "solvers refuse such cells and finite-volume ones lose accuracy; smooth the nodes around them",
    )


ROWS = (
    Check(
        "inverted-cells", "error", "Cells of negative volume", "cell",
        "a negative volume stops every solver or makes it diverge", inverted_cells, ("signed cells",),
    ),
    Check(
        "node-order-convention", "warning", "All cells of a type mirrored", "cell",
        "the shapes are sound and reversing the order mends all of them, but a solver fed with this file fails",
        node_order_convention, ("signed cells",),
    ),
    Check(
        "negative-jacobian-cells", "warning", "Cells folded at a corner", "cell",
        "fatal to finite elements, merely inaccurate in finite volumes; a gate for the former makes it fail",
        negative_jacobian_cells,
    ),
)  # fmt: skip
