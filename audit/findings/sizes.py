"""Checks on sizes: neighbours that differ too much, requests that are not met, chords of curved boundaries."""

from __future__ import annotations

from typing import Any

import numpy as np

from meshwright.audit.findings import chords, divisions, requests
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.jumps import Jumps, box_sizes, find_jumps
from meshwright.audit.mesh import Mesh
from meshwright.audit.places import plain

__all__ = ["ROWS"]

_LISTED = 100
_CLASSES = (2.0, 3.0, 4.0, 6.0, 8.0, 16.0)


def size_jump(facts: Facts) -> Found | None:
    """Cells that share an edge or a face with one more than `options.growth` times larger or smaller.

    The size of a cell is the longest edge of its bounding box; a relative 1e-6 is put down to rounding.
    """
    mesh, growth = facts.mesh, facts.options.growth
    jumps = find_jumps(mesh, growth)
    if not len(jumps.cells):
        return None
    edges = [c for c in _CLASSES if c >= growth]
    detail: dict[str, Any] = {
        "growth": growth,
        "max_ratio": plain(float(jumps.ratio.max())),
        "ratio_classes": [growth, *(c for c in edges if c > growth), "inf"],
        "ratio_counts": np.histogram(jumps.ratio, [growth, *(c for c in edges if c > growth), np.inf])[0].tolist(),
        "worst": _worst(mesh, jumps),
    }
    return Found(
        jumps.cells,
        f"{counted(len(jumps.cells), 'cell')} more than {growth:g} times larger or smaller than a neighbour across a "
        f"face or an edge (up to {jumps.ratio.max():.3g} times): an octree mesh must not have them, and gradients are "
        "less exact there; refine the larger cells or spread the change over more of them",
        detail=detail,
    )


def _worst(mesh: Mesh, jumps: Jumps) -> list[dict[str, Any]]:
    """The worst pairs, each once."""
    size = box_sizes(mesh).size
    order = np.lexsort((jumps.cells, -jumps.ratio))
    seen: set[tuple[int, int]] = set()
    found: list[dict[str, Any]] = []
    for k in order.tolist():
        a, b = int(jumps.cells[k]), int(jumps.neighbour[k])
        if (b, a) in seen:
            continue
        seen.add((a, b))
        ids = mesh.ids_of_cells([a, b]).tolist()
        sizes = [float(size[a]), float(size[b])]
        found.append({"cell": ids[0], "neighbour": ids[1], "sizes": sizes, "ratio": plain(float(jumps.ratio[k]))})
        if len(found) == _LISTED:
            break
    return found


ROWS: tuple[Check, ...] = (
    Check(
        "size-jump", "info", "Jumps in size", "cell",
        "a rule of octree meshes; graded tetrahedra and layers break it on purpose", size_jump,
    ),
    *requests.ROWS,
    *divisions.ROWS,
    *chords.ROWS,
)  # fmt: skip
