"""Checks on shells: open edges and holes, whether they are watertight, whether they are inside out."""

from __future__ import annotations

import numpy as np

from meshwright.audit.connectivity import faces, overused_faces
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, Severity, counted
from meshwright.audit.findings.hulls.chains import chains_of
from meshwright.audit.findings.hulls.contacts import mesh_contacts
from meshwright.audit.findings.hulls.shells import Shells, mesh_shells
from meshwright.audit.mesh import NO_CELL, Ints, Mesh

__all__ = ["ROWS"]

_SMALL_HOLE = 0.05
"""Holes below this share of the size of their shell are gaps in a surface; larger ones may be its rim."""


def open_edges(facts: Facts) -> Found | None:
    """Edges of one cell, in loops, without those of a branch cut."""
    mesh = facts.mesh
    rows = _free_edges(mesh)
    if not len(rows):
        return None
    contacts = mesh_contacts(mesh)
    cut = contacts.hull.rows[contacts.facets("cut")]
    rows = rows[~np.isin(rows, cut)]
    if not len(rows):
        return None
    chains = chains_of(mesh, _ends(mesh, rows))
    loops = int(np.count_nonzero(chains.closed))
    on_others = int(np.isin(rows, contacts.hull.rows[contacts.facets("unmerged")]).sum())
    message = f"{counted(len(rows), 'edge')} of one surface cell only, in {_loops(loops, len(chains) - loops)}"
    if on_others:
        message += f"; {on_others:,} of them lie on another one and close when coincident points are merged"
    detail = {
        "closed_chains": loops,
        "open_chains": len(chains) - loops,
        "edges_on_another": on_others,
        "chains": chains.described(),
    }
    return Found(
        rows,
        f"{message}: the rim of a sheet, or a hole to be closed where the surface is to hold a volume",
        detail=detail,
    )


def _free_edges(mesh: Mesh) -> Ints:
    alone = faces(mesh).neighbour == NO_CELL
    alone[overused_faces(mesh)] = False
    return np.flatnonzero(alone)


def _ends(mesh: Mesh, rows: Ints) -> Ints:
    return faces(mesh).nodes.reshape(-1, 2)[rows]


def _loops(loops: int, chains: int) -> str:
    words = [counted(loops, "loop")] if loops else []
    return " and ".join(words + ([counted(chains, "open chain")] if chains else []))


def not_watertight(facts: Facts) -> Found | None:
    """Edges that keep shells from being watertight: those of one cell and those of more than two."""
    mesh = facts.mesh
    shells = mesh_shells(mesh)
    bad = int(np.count_nonzero(~shells.watertight))
    if not bad:
        return None
    free = _free_edges(mesh)
    gaps = _gaps(mesh, shells, free)
    rows = np.union1d(free, overused_faces(mesh))
    n = len(shells.cells)
    message = f"{bad:,} of {counted(n, 'shell')} not watertight"
    severity: Severity = "info"
    if gaps:
        severity = "warning"
        message += f", {gaps:,} of them closed but for holes that are small beside them: close the holes"
    elif facts.options.discipline == "cfd" and shells.free.any():
        severity = "warning"
        message += ": a flow domain needs a closed surface; close the holes, loops are listed under open-edges"
    else:
        message += ": right for sheets and plates; a surface that is to hold a volume must be closed first"
    return Found(rows, message, severity=severity, detail=shells.table(mesh))


def _gaps(mesh: Mesh, shells: Shells, free: Ints) -> int:
    """Shells all of whose open edges are in loops that are small beside the shell."""
    if not len(free):
        return 0
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.sqrt(((shells.high - shells.low) ** 2).sum(axis=1))
    chains = chains_of(mesh, _ends(mesh, free))
    largest = np.zeros(len(size))
    shell = shells.shell[faces(mesh).owner[free[chains.first]]]
    extent = np.where(chains.closed & ~np.isnan(chains.extent), chains.extent, np.inf)
    np.maximum.at(largest, shell, extent)
    return int(np.count_nonzero((shells.free > 0) & (largest < _SMALL_HOLE * size)))


def watertight_shells(facts: Facts) -> Found | None:
    """Cells of the shells that are watertight: closed, with two cells at every edge."""
    mesh = facts.mesh
    shells = mesh_shells(mesh)
    good = shells.watertight
    if not good.any():
        return None
    rows = np.flatnonzero(good[shells.shell])
    n = int(np.count_nonzero(good))
    known = shells.volume[good & ~np.isnan(shells.volume)]
    message = f"{n:,} of {counted(len(good), 'shell')} watertight"
    if len(known) == n:
        message += f", of area {shells.area[good].sum():.6g}, enclosing {np.abs(known).sum():.6g}"
    else:
        message += "; normals must agree before the volume inside is known"
    return Found(rows, message, detail=shells.table(mesh))


def inside_out_shell(facts: Facts) -> Found | None:
    """Cells of watertight shells, not inside another one, whose normals look inward."""
    mesh = facts.mesh
    shells = mesh_shells(mesh)
    wrong = (shells.sense < 0.0) & (shells.depth == 0)
    if not wrong.any():
        return None
    rows = np.flatnonzero(wrong[shells.shell])
    return Found(
        rows,
        f"{counted(int(np.count_nonzero(wrong)), 'closed shell')} of {counted(len(rows), 'cell')} inside out: normals "
        "look inward, so that its volume counts as negative; reverse the cells, unless it bounds a domain from outside",
        detail=shells.table(mesh),
    )


ROWS = (
    Check(
        "open-edges", "info", "Free edges of a surface", "edge",
        "every sheet has a rim; only who made the surface knows whether it was to close", open_edges, ("surface",),
    ),
    Check(
        "not-watertight", "info", "Shells that enclose no volume", "edge",
        "normal in a structure of plates; a warning where a shell is closed but for small holes, or the flow is solved",
        not_watertight, ("surface",),
    ),
    Check(
        "watertight-shells", "info", "Shells that enclose a volume", "cell",
        "nothing is wrong: it is what a surface for a mesher or a printer has to be", watertight_shells, ("surface",),
    ),
    Check(
        "inside-out-shell", "warning", "Closed shells turned inside out", "cell",
        "inside and outside change places for programs that go by normals", inside_out_shell, ("surface",),
    ),
)  # fmt: skip
