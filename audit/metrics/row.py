"""`Metric`: everything the program knows about one quality number, next to the kernel that computes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from meshwright.audit.metrics.tile import Kernel

__all__ = ["Entity", "Metric"]

Entity = Literal["cell", "face", "point"]


@dataclass(frozen=True, eq=False)
class Metric:
    """One row of the registry.

    id: `system.metric`.  title: for people.  entity: what has a value, cells, faces or points.  on: what it is defined
    on; it is "not defined" on all else. Of cells: linear types, which stand for the second-order types with their
    corners, second-order types themselves where the mid-side nodes count, and polytopes. Of faces: "interior",
    "boundary". Of points: "point".  unit: "1", "deg", "L", "L2", "L3".  low, high: documented range; the kernel's raw value may
    leave it, reports clamp.  best: "low" or "high", the end of the scale that is good, or "none" for plain
    sizes.  ideal: the value of a perfect cell, None where it depends on the type or there is none.
    degenerate: value for a cell with no size (may be nan: "undefined").  systems: who uses it, under which
    name.  formula: in one or two lines of text.  source: where the definition stands.  caveat: when the
    number misleads.  kernel: compiled function (tile, out), or one per type; of faces one for `facets.FaceTile`.
    stages: geometry the kernel reads, likewise.  polytope: column of `polytopes.Shapes` with the value of a
    polygon or polyhedron, "" where it is defined on neither.  column: of metrics without a kernel, which come from a
    pass of their own: column of `neighbours.Columns` (cells that look at their neighbours) or of `points`.
    """

    id: str
    title: str
    on: tuple[str, ...]
    unit: str
    low: float
    high: float
    best: Literal["low", "high", "none"]
    ideal: float | None
    degenerate: float
    systems: tuple[str, ...]
    formula: str
    source: str
    kernel: Kernel | Mapping[str, Kernel] | None = None
    stages: tuple[Kernel, ...] | Mapping[str, tuple[Kernel, ...]] = ()
    caveat: str = ""
    polytope: str = ""
    entity: Entity = "cell"
    column: str = ""

    def kernel_for(self, type_name: str) -> Kernel:
        """The compiled function for a cell type (as `on` names it) the metric is defined on."""
        return self.kernel[type_name] if isinstance(self.kernel, Mapping) else self.kernel

    def stages_for(self, type_name: str) -> tuple[Kernel, ...]:
        """The stages that function reads."""
        return self.stages.get(type_name, ()) if isinstance(self.stages, Mapping) else self.stages

    @property
    def worst_is_high(self) -> bool:
        """Whether larger values are worse (sizes: the smallest cells are listed first)."""
        return self.best == "low"
