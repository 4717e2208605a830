"""Checks on curved cells: proven valid, proven invalid or undecided, by Bernstein bounds of the Jacobian."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.bernstein import Point
from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.findings.bezier.exact import exact_sign, point_of
from meshwright.audit.findings.bezier.proof import FLAT, SHELL, SOLID, prove
from meshwright.audit.findings.bezier.search import (
    FIRST_BUDGET,
    INVALID,
    LEVELS,
    UNDECIDED,
    VALID,
    budget_for,
    cuts,
    search,
)
from meshwright.audit.findings.bezier.tables import bends, formula
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.mesh import CellBlock, Ints, Mesh
from meshwright.audit.parallel import in_parallel
from meshwright.audit.shape_functions import values_at

__all__ = ["INVALID", "ROWS", "UNDECIDED", "UNJUDGED", "VALID", "Curved", "curved_cells"]

UNJUDGED = 0
"""State of cells of first order, and of those whose corners other checks already report."""

_CHUNK = 1 << 14
_FEW = 256
"""Cells that a thread searches at a time."""

_EXACT = 5000
"""Cells of a block decided in rational arithmetic at the most, half a millisecond each; more stay undecided."""

_SHOWN = 20
"""Cells whose witness a finding shows."""


@dataclass(frozen=True, eq=False)
class Curved:
    """One value per cell row.

    state (n,): VALID, INVALID, UNDECIDED or UNJUDGED.  witness: of the first invalid cells, row -> (place (3,) in the
    file's coordinates, Jacobian there as a share of its largest coefficient); it is 0 or less.
    """

    state: NDArray[np.int8]
    witness: dict[int, tuple[NDArray[np.float64], float]]


_one_at_a_time = Lock()


def curved_cells(mesh: Mesh) -> Curved:
    """Judge every second-order cell that is sound as far as its corners go. Computed once per mesh.

    VALID: the Jacobian is positive everywhere, in spite of all rounding.  INVALID: it is 0 or less at a point, by more
    than the rounding there or by rational arithmetic.  UNDECIDED: neither could be shown.
    A type whose cells the file mirrors throughout is seen mirrored; a flat mesh from above; a surface in space from the
    normal of its corners, and such a cell may turn away from it as long as it has a normal.
    """
    with _one_at_a_time:  # two checks ask for this side by side
        return _curved_cells(mesh)


@once_per_mesh
def _curved_cells(mesh: Mesh) -> Curved:
    facts = Facts(mesh)
    shapes, reversed_cells = facts.shapes, facts.reversed_cells
    sound = ~shapes.flat & ~shapes.folded & ~shapes.collapsed & np.isfinite(shapes.relative)
    sound &= ~shapes.negative | reversed_cells
    curved = Curved(np.zeros(mesh.n_cells, dtype=np.int8), {})
    for block in mesh.blocks:
        if CELL_TYPES[block.type].order == 2 and CELL_TYPES[block.type].dimension >= 2:
            _judge(mesh, block, sound[block.rows], np.where(reversed_cells[block.rows], -1, 1).astype(np.int8), curved)
    return curved


def _judge(mesh: Mesh, block: CellBlock, sound: NDArray[np.bool_], sign: NDArray[np.int8], curved: Curved) -> None:
    name = block.type
    kind = SOLID if CELL_TYPES[name].dimension == 3 else (FLAT if mesh.dimension == 2 else SHELL)
    way, linear, bend = formula(name), formula(CELL_TYPES[name].corners), bends(name)
    proven = np.zeros(len(block), dtype=np.bool_)

    def clear(start: int) -> None:
        part = slice(start, start + _CHUNK)
        prove(mesh.points, block.nodes[part], way, linear, bend, kind, sign[part], proven[part])

    for _ in in_parallel(clear, range(0, len(block), _CHUNK)):
        pass
    curved.state[block.rows[proven & sound]] = VALID
    rest = np.flatnonzero(sound & ~proven)
    rest = rest[np.isfinite(mesh.points[block.nodes[rest]]).all(axis=(1, 2))]
    for first in (True, False):
        if not len(rest):
            break
        found = _search(mesh, block, rest, sign[rest], kind, FIRST_BUDGET if first else budget_for(len(rest)))
        curved.state[block.rows[rest]] = found.state
        for k in np.flatnonzero(found.state == INVALID)[:_SHOWN].tolist():
            weights = np.array(values_at(name, found.point(name, k)), dtype=np.float64)
            at = weights @ mesh.points[block.nodes[rest[k]]]
            curved.witness[int(block.rows[rest[k]])] = (at, min(0.0, float(found.value[k])))
        rest = rest[found.state == UNDECIDED]


@dataclass(frozen=True, eq=False)
class _Searched:
    """What `search` fills."""

    state: NDArray[np.int8]
    path: NDArray[np.int8]
    place: NDArray[np.int64]
    value: NDArray[np.float64]

    def point(self, name: str, k: int) -> Point:
        """Where the determinant of cell k is 0 or less, or may be."""
        levels, corner = self.place[k].tolist()
        return point_of(name, self.path[k], levels, corner)


def _search(mesh: Mesh, block: CellBlock, rows: Ints, sign: NDArray[np.int8], kind: int, budget: int) -> _Searched:
    """Search those rows of a block; points at which the sign does not show are decided in rational arithmetic."""
    name, n = block.type, len(rows)
    found = _Searched(
        np.empty(n, dtype=np.int8), np.empty((n, LEVELS), dtype=np.int8), np.empty((n, 2), dtype=np.int64), np.empty(n)
    )
    way, cut = formula(name), cuts(name)

    def look(start: int) -> None:
        part = slice(start, start + _FEW)
        results = (found.state[part], found.path[part], found.place[part], found.value[part])
        search(mesh.points, block.nodes[rows[part]], way, cut, kind, budget, sign[part], *results)

    for _ in in_parallel(look, range(0, n, _FEW)):
        pass
    for k in np.flatnonzero((found.state == UNDECIDED) & (found.place[:, 0] >= 0))[:_EXACT].tolist():
        side = exact_sign(name, mesh.points[block.nodes[rows[k]]], found.point(name, k), kind)
        if side * int(sign[k]) <= 0:
            found.state[k] = INVALID
    return found


def curved_invalid_cells(facts: Facts) -> Found | None:
    """Cells whose curved shape is folded although their corners are sound."""
    if facts.mesh.order == 1:
        return None
    found = curved_cells(facts.mesh)
    rows = np.flatnonzero(found.state == INVALID)
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'curved cell')} whose Jacobian is 0 or less somewhere, though the corners are sound: "
        "finite-element solvers fail there; move the mid-side nodes towards the middle of their edges, or refine",
        detail={
            "witnesses": _witnesses(facts.mesh, found),
            "proven_valid": int(np.count_nonzero(found.state == VALID)),
        },
    )


def _witnesses(mesh: Mesh, found: Curved) -> list[dict[str, Any]]:
    """Where the Jacobian is 0 or less, for the first cells."""
    rows = sorted(found.witness)[:_SHOWN]
    numbers = mesh.ids_of_cells(np.array(rows, dtype=np.intp)).tolist()
    return [
        {"cell": number, "at": found.witness[row][0].tolist(), "share_of_largest": found.witness[row][1]}
        for row, number in zip(rows, numbers, strict=True)
    ]


def curved_undecided_cells(facts: Facts) -> Found | None:
    """Cells whose Jacobian comes too close to 0 to tell."""
    if facts.mesh.order == 1:
        return None
    found = curved_cells(facts.mesh)
    rows = np.flatnonzero(found.state == UNDECIDED)
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'curved cell')} that could be proven neither valid nor invalid: somewhere the Jacobian "
        "is positive by no more than its rounding, or all but 0; treat as invalid and straighten the edges there",
        detail={"proven_valid": int(np.count_nonzero(found.state == VALID))},
    )


ROWS = (
    Check(
        "curved-invalid-cells", "error", "Curved cells folded inside", "cell",
        "a point is known at which the Jacobian is 0 or less; quadrature near it makes a finite-element solver stop",
        curved_invalid_cells,
    ),
    Check(
        "curved-undecided-cells", "warning", "Curved cells neither proven valid nor invalid", "cell",
        "what cannot be proven is not called valid, but nothing is known against it either", curved_undecided_cells,
    ),
)  # fmt: skip
