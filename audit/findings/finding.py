"""`Finding` (what a check reports) and `Check` (one row of the registry)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from meshwright.audit.mesh import Ints, Mesh, index_array
from meshwright.audit.places import place

if TYPE_CHECKING:
    from meshwright.audit.findings.facts import Facts

__all__ = ["Check", "Entity", "Finding", "Found", "Severity", "counted"]

Severity = Literal["error", "warning", "info"]
Entity = Literal["cell", "face", "point", "edge", "zone"]


@dataclass(frozen=True, eq=False)
class Finding:
    """Something a check has to say about a mesh.

    code: stable word.  entity: what `rows` are rows of: "cell", "point", "face" (of `connectivity.faces`), "edge"
    (the faces of a 2-D or surface mesh, which are edges of two nodes), "zone" (of `Mesh.zones`), or "face" of
    `Mesh.boundary` where `of_boundary` is true.  rows: all of them, ascending.  message: one sentence that says
    what it means and what to do.  detail: figures behind it as JSON holds them (loops, layers, a histogram), or None.
    """

    code: str
    severity: Severity
    entity: Entity
    rows: Ints
    message: str
    of_boundary: bool = False
    detail: dict[str, Any] | None = None

    @property
    def count(self) -> int:
        """How many entities are concerned."""
        return len(self.rows)

    def ids(self, mesh: Mesh) -> Ints:
        """The file's own numbers of `rows`; rows themselves where the file has none."""
        numbers: Ints | None = None
        if self.entity == "cell":
            numbers = mesh.cell_ids
        elif self.entity == "point":
            numbers = mesh.point_ids
        elif self.of_boundary:
            numbers = mesh.boundary_ids
        elif self.entity in ("face", "edge") and mesh.faces is not None:
            numbers = mesh.faces.ids
        elif self.entity == "zone":
            numbers = np.array([i if zone.id is None else zone.id for i, zone in enumerate(mesh.zones)], dtype=np.int64)
        return self.rows if numbers is None else numbers[self.rows]

    def places(self, mesh: Mesh, most: int) -> list[list[float]]:
        """Coordinates of the first `most` entities, the mean of their corners; zones have none."""
        if self.entity == "zone":
            return []
        return [place(mesh, self.entity, row, self.of_boundary) for row in self.rows[:most].tolist()]


@dataclass(frozen=True)
class Found:
    """What the function of a check returns: rows (any order, each once) and the sentence for people.

    entity, severity: where they differ from those of the check.  detail: see `Finding`.
    """

    rows: ArrayLike
    message: str
    entity: Entity | None = None
    of_boundary: bool = False
    severity: Severity | None = None
    detail: dict[str, Any] | None = None


@dataclass(frozen=True)
class Check:
    """One row of the registry.

    code, severity, title: what is looked for.  reason: why it has that severity.  entity: of its rows, unless the
    function says otherwise.  needs: words of `facts.NEEDS`; without one of them the check has nothing to look at.
    find: `(facts) -> Found`, or None when all is well.
    """

    code: str
    severity: Severity
    title: str
    entity: Entity
    reason: str
    find: Callable[[Facts], Found | None]
    needs: tuple[str, ...] = ()

    def run(self, facts: Facts) -> Finding | None:
        """The finding, or None; an empty one counts as none."""
        found = self.find(facts)
        if found is None:
            return None
        rows = index_array(np.sort(np.asarray(found.rows)))
        if not len(rows):
            return None
        severity, entity = found.severity or self.severity, found.entity or self.entity
        return Finding(self.code, severity, entity, rows, found.message, found.of_boundary, found.detail)


def counted(n: int, thing: str, plural: str = "") -> str:
    """'1 cell', '12 cells'."""
    return f"{n:,} {thing if n == 1 else plural or thing + 's'}"
