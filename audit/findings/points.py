"""Checks on points: not finite, in one place, not used."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import unused_points as unused_by_cells
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.repeats import repeated
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Mesh

__all__ = ["ROWS"]

_MINUS_ZERO = np.uint64(1 << 63)
"""Bits of -0.0, which is the same place as 0.0."""


def nonfinite_points(facts: Facts) -> Found | None:
    """Points with a coordinate that is nan or infinite."""
    mesh = facts.mesh
    if not mesh.n_nonfinite:
        return None
    rows = np.flatnonzero(~np.isfinite(mesh.points).all(axis=1))
    return Found(
        rows,
        f"{counted(len(rows), 'point')} with a coordinate that is not a finite number: nothing around them can be "
        "measured; write the mesh again or restore the coordinates",
    )


def duplicate_points(facts: Facts) -> Found | None:
    """Points used by cells that lie exactly where an earlier one lies."""
    points = facts.mesh.points
    keys = np.empty(len(points), np.uint64)
    _hash_points(points.view(np.uint64), keys)
    idle = unused_by_cells(facts.mesh)
    used = np.ones(len(points), dtype=bool)
    used[idle] = False
    inside = np.flatnonzero(used)
    rows = repeated(keys[inside], lambda a, b: np.all(points[inside[a]] == points[inside[b]], axis=1))
    if not len(rows):
        return None
    return Found(
        inside[rows],
        f"{counted(len(rows), 'point')} exactly where another one lies: the cells on both sides are not connected "
        "there; merge the points unless the gap is meant (a baffle, an interface, contact)",
    )


@kernel
def _hash_points(points: NDArray[np.uint64], out: NDArray[np.uint64]) -> None:
    """One number a point, given as the bits of its coordinates, the same for the same place."""
    for p in range(out.size):
        h = np.uint64(0)
        for d in range(3):
            bits = points[p, d]
            if bits == _MINUS_ZERO:
                bits = np.uint64(0)
            x = (h ^ bits) + np.uint64(0x9E3779B97F4A7C15)
            x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            h = x ^ (x >> np.uint64(31))
        out[p] = h


def unused_points(facts: Facts) -> Found | None:
    """Points that neither a cell nor a boundary element uses, spare nodes of higher order apart."""
    rows = _unused(facts.mesh)
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'point')} that no cell uses: harmless to most finite-volume solvers, a singular matrix "
        "to finite elements; delete them",
    )


def _unused(mesh: Mesh) -> NDArray[np.intp]:
    idle = np.zeros(len(mesh.points), dtype=bool)
    idle[unused_by_cells(mesh)] = True
    for block in mesh.boundary:
        idle[block.nodes] = False
        if block.items is not None and block.type == "polygon":
            idle[block.items] = False
    if mesh.spare_points is not None:
        idle[mesh.spare_points] = False
    return np.flatnonzero(idle)


ROWS = (
    Check(
        "nonfinite-points", "error", "Points without a place", "point",
        "every number measured around such a point is undefined", nonfinite_points,
    ),
    Check(
        "duplicate-points", "warning", "Points in one place", "point",
        "a crack in most meshes, but baffles, interfaces and contact are made this way", duplicate_points,
    ),
    Check(
        "unused-points", "warning", "Points without a cell", "point",
        "nothing is wrong with the cells, but the file carries debris that some solvers stop at", unused_points,
    ),
)  # fmt: skip
