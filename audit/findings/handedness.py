"""Checks on which way faces look: left-handed faces, surface cells turned against their neighbours, open cells."""

from __future__ import annotations

import numpy as np

from meshwright.audit.connectivity import faces
from meshwright.audit.connectivity import overused_faces as overused_faces_of
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.hulls.chains import chains_of
from meshwright.audit.findings.hulls.shells import mesh_shells
from meshwright.audit.findings.signs.sides import BOTH, FROM_OWNER, face_sides, left_handed_cells
from meshwright.audit.mesh import NO_CELL, Ints
from meshwright.audit.orientation import traversed_alike

__all__ = ["ROWS"]

OPEN = 1e-6
"""|sum A| / sum |A| above which a cell is open: OpenFOAM's limit."""


def left_handed_faces(facts: Facts) -> Found | None:
    """Faces of a face-based mesh that look the wrong way; otherwise the cells that have such faces.

    A cell-based file has no faces of its own that anyone could look up, so its cells are listed. Cells that an
    ordering convention explains are left out.
    """
    mesh = facts.mesh
    cells = left_handed_cells(mesh) & ~facts.reversed_cells
    n_cells = int(np.count_nonzero(cells))
    if not n_cells:
        return None
    advice = "solvers see the cell inside out there; orient the faces (in Fluent: repair-face-handedness)"
    if mesh.faces is None:
        rows = np.flatnonzero(cells)
        return Found(rows, f"{counted(n_cells, 'cell')} with left-handed faces: {advice}", entity="cell")
    own, faults = mesh.faces, face_sides(mesh).faults
    inside = own.neighbour != NO_CELL
    explained = facts.reversed_cells[own.owner] & (faults == np.where(inside, BOTH, FROM_OWNER))
    rows = np.flatnonzero((faults != 0) & ~explained)
    return Found(rows, f"{counted(len(rows), 'left-handed face')} in {counted(n_cells, 'cell')}: {advice}")


def inconsistent_orientation(facts: Facts) -> Found | None:
    """Edges at which two surface cells turn against each other."""
    rows = np.flatnonzero(traversed_alike(facts.mesh))
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'edge')} between surface cells whose normals disagree: pressure and inside/outside flip "
        "there; orient the surface so that neighbours traverse their edge in opposite directions",
        detail=mesh_shells(facts.mesh).table(facts.mesh),
    )


def open_cells(facts: Facts) -> Found | None:
    """Cells whose faces do not close."""
    openness = face_sides(facts.mesh).openness
    rows = np.flatnonzero(openness > OPEN)
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'cell')} whose faces do not close (gap up to {openness[rows].max():.2g} of their area): "
        "mass leaks through the gap; look for a missing, doubled or misnumbered face",
    )


def overused_faces(facts: Facts) -> Found | None:
    """Faces that more than two cells name."""
    rows = facts.crowded_faces
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'face')} shared by more than two cells: cells overlap; remove the extra cells or "
        "separate the parts",
        entity="face" if facts.mesh.cell_dimension == 3 else "edge",
    )


def nonmanifold_edges(facts: Facts) -> Found | None:
    """Edges of a surface that more than two cells share."""
    rows = facts.crowded_faces
    if not len(rows):
        return None
    chains = chains_of(facts.mesh, faces(facts.mesh).nodes.reshape(-1, 2)[rows])
    return Found(
        rows,
        f"{counted(len(rows), 'edge')} shared by more than two surface cells: fine where plates meet in a structure, "
        "an error in a surface that is to enclose a volume",
        detail={"chains": chains.described(), "cells_at_edge": _cells_at(facts, rows)},
    )


def _cells_at(facts: Facts, rows: Ints) -> dict[str, int]:
    """How many edges have three cells, four, and so on."""
    found = faces(facts.mesh)
    ends = np.sort(found.nodes.reshape(-1, 2), axis=1).astype(np.int64)
    key = ends[:, 0] * len(facts.mesh.points) + ends[:, 1]
    every = overused_faces_of(facts.mesh)
    sides = 1 + (found.neighbour[every] != NO_CELL)
    wanted = np.sort(key[rows])
    place = np.minimum(np.searchsorted(wanted, key[every]), len(wanted) - 1)
    mine = wanted[place] == key[every]
    cells = np.bincount(place[mine], weights=sides[mine], minlength=len(wanted)).astype(int)
    numbers, edges = np.unique(cells, return_counts=True)
    return {str(n): int(k) for n, k in zip(numbers, edges, strict=True)}


ROWS = (
    Check(
        "left-handed-faces", "error", "Faces that look the wrong way", "face",
        "fluxes through such a face get the wrong sign; Fluent refuses to run", left_handed_faces, ("signed cells",),
    ),
    Check(
        "inconsistent-orientation", "warning", "Surface cells turned against each other", "edge",
        "a shell solver runs, but pressure and offsets change sides", inconsistent_orientation, ("surface",),
    ),
    Check(
        "open-cells", "error", "Cells whose faces do not close", "cell",
        "a cell that is not closed does not conserve anything", open_cells, ("signed cells", "own faces"),
    ),
    Check(
        "overused-faces", "error", "Faces of more than two cells", "face",
        "overlapping cells have no meaning to any solver", overused_faces, ("signed cells", "derived faces"),
    ),
    Check(
        "nonmanifold-edges", "warning", "Surface edges of more than two cells", "edge",
        "meant in a structure of plates, wrong in a closed surface", nonmanifold_edges, ("surface", "derived faces"),
    ),
)  # fmt: skip
