"""Checks on zones and on which cell types they hold."""

from __future__ import annotations

import numpy as np

from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.mesh import Mesh, Zone

__all__ = ["ROWS", "census"]

_SHOWN = 5


def census(mesh: Mesh) -> dict[str, dict[str, int]]:
    """Cells by type in every cell zone, by zone name; the cells of zones of one name are added up."""
    code = np.zeros(mesh.n_cells, dtype=np.uint8)
    for i, block in enumerate(mesh.blocks):
        code[block.rows] = i
    found: dict[str, dict[str, int]] = {}
    for zone in mesh.cell_zones:
        counts = found.setdefault(zone.name, {})
        for block, n in zip(mesh.blocks, np.bincount(code[zone.members], minlength=len(mesh.blocks)), strict=True):
            if n:
                counts[block.type] = counts.get(block.type, 0) + int(n)
    return found


def mixed_element_types(facts: Facts) -> Found | None:
    """The cells that are not of the most frequent type, with a census of the zones."""
    mesh = facts.mesh
    main = max(mesh.blocks, key=len)
    rows = np.concatenate([block.rows for block in mesh.blocks if block is not main])
    text = [f"{len(block):,} {block.type}" for block in mesh.blocks if len(block)]
    message = f"the mesh mixes {len(text)} element types ({', '.join(text)})"
    by_zone = census(mesh)
    if by_zone:
        shown = [f"{name}: {_purity(counts)}" for name, counts in list(by_zone.items())[:_SHOWN]]
        more = len(by_zone) - len(shown)
        message += f"; zones: {', '.join(shown)}" + (f" and {more} more" if more else "")
    return Found(rows, f"{message}; nothing to do unless the solver asks for one type")


def _purity(counts: dict[str, int]) -> str:
    if not counts:
        return "empty"
    if len(counts) == 1:
        return f"pure {next(iter(counts))}"
    return " + ".join(f"{n:,} {name}" for name, n in counts.items())


def empty_zones(facts: Facts) -> Found | None:
    """Zones without a member."""
    rows = [i for i, zone in enumerate(facts.mesh.zones) if not len(zone.members)]
    if not rows:
        return None
    return Found(
        rows, f"{counted(len(rows), 'zone')} without a member ({_names(facts.mesh.zones, rows)}): delete or fill them"
    )


def unzoned_cells(facts: Facts) -> Found | None:
    """Cells in no cell zone of a mesh that has cell zones."""
    rows = np.flatnonzero(facts.mesh.cell_zone_index() < 0)
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'cell')} in no cell zone although others are: check that a material is assigned to them",
    )


def faces_in_two_zones(facts: Facts) -> Found | None:
    """Faces in two or more boundary zones; OpenFOAM's faceZones only select, and may overlap patches."""
    mesh = facts.mesh
    zones = [i for i, zone in enumerate(mesh.zones) if zone.entity == "face" and zone.kind != "faceZone"]
    uses = np.zeros(mesh.n_boundary if mesh.faces is None else len(mesh.faces), dtype=np.int32)
    for i in zones:
        uses[mesh.zones[i].members] += 1  # a face listed twice by one zone counts once
    rows = np.flatnonzero(uses > 1)
    if not len(rows):
        return None
    inside = uses > 1
    names = [i for i in zones if inside[mesh.zones[i].members].any()]
    return Found(
        rows,
        f"{counted(len(rows), 'face')} in more than one boundary zone ({_names(mesh.zones, names)}): which condition "
        "holds there is undefined; leave each face in one zone",
        of_boundary=mesh.faces is None,
    )


def _names(zones: tuple[Zone, ...], rows: list[int]) -> str:
    shown = ", ".join(zones[i].name for i in rows[:_SHOWN])
    return shown + (f" and {len(rows) - _SHOWN} more" if len(rows) > _SHOWN else "")


ROWS = (
    Check(
        "mixed-element-types", "info", "Element types by zone", "cell",
        "hybrid meshes are normal; some solvers want one type", mixed_element_types, ("several types",),
    ),
    Check(
        "empty-zones", "info", "Zones without members", "zone",
        "left-overs of an export, nothing is lost", empty_zones, ("zones",),
    ),
    Check(
        "unzoned-cells", "info", "Cells in no zone", "cell",
        "normal where zones only select; worth knowing where they carry the material", unzoned_cells, ("cell zones",),
    ),
    Check(
        "faces-in-two-zones", "warning", "Faces in two boundary zones", "face",
        "a solver takes one of the two conditions, and not always the one meant", faces_in_two_zones, ("face zones",),
    ),
)  # fmt: skip
