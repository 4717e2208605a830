"""Checks: what is wrong with a mesh as such, found without a threshold that anyone could argue about.

A check is one function and one row in the `ROWS` of its file; `CHECKS` strings the files together. Adding one means
writing both, and nothing else.
"""

from __future__ import annotations

from meshwright.audit.findings import (
    blocks,
    curved,
    degenerate,
    delaunay,
    features,
    gaps,
    handedness,
    hanging,
    interfaces,
    inversion,
    kinds,
    layers,
    periodic,
    points,
    sizes,
    surfaces,
    walls,
    zones,
)
from meshwright.audit.findings.facts import NEEDS, Facts
from meshwright.audit.findings.finding import Check, Finding
from meshwright.audit.findings.options import Options
from meshwright.audit.findings.signs.sides import face_handedness
from meshwright.audit.findings.zones import census
from meshwright.audit.mesh import Mesh
from meshwright.audit.parallel import in_parallel

__all__ = ["CHECKS", "Check", "Finding", "Options", "census", "face_handedness", "run_checks"]

_FAMILIES = (
    *(points, degenerate, inversion, handedness, curved, surfaces, gaps, interfaces, hanging, periodic),
    *(kinds, zones, blocks, features, sizes, layers, delaunay, walls),
)

CHECKS: dict[str, Check] = {check.code: check for family in _FAMILIES for check in family.ROWS}
"""Every check by its code, in the order in which findings are listed within a severity."""

_ORDER = ("error", "warning", "info")


def run_checks(mesh: Mesh, options: Options | None = None) -> tuple[Finding, ...]:
    """What the checks have to say, errors first. A sound mesh gets no errors and no warnings.

    options: what the user told of the mesh.
    """
    facts = Facts(mesh, options or Options())
    wanted = [check for check in CHECKS.values() if all(NEEDS[word](facts) for word in check.needs)]
    found = in_parallel(lambda check: check.run(facts), wanted)
    return tuple(sorted((f for f in found if f is not None), key=lambda finding: _ORDER.index(finding.severity)))
