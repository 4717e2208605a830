"""Which values of a mesh a limit is on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.measurement import Measured, clamp
from meshwright.audit.mesh import NO_CELL, Floats, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.places import Places
from meshwright.audit.profiles.model import Limit
from meshwright.audit.profiles.quantities import QUANTITIES

__all__ = ["Sample", "matches", "samples"]

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Sample:
    """Values of one key of `Measured.values`: (n,) clamped to the range of the metric, and the rows they stand in."""

    key: str
    values: Floats
    rows: Rows | None

    def row(self, at: int) -> int:
        """Row of the value at that position."""
        return at if self.rows is None else int(self.rows[at])


def matches(kind: str, limit: Limit) -> bool:
    """Whether a limit on cells is on those of this type."""
    cell = CELL_TYPES[kind]
    if limit.order and cell.order != limit.order:
        return False
    return not limit.types or kind in limit.types or cell.corners in limit.types


def samples(measured: Measured, places: Places, limit: Limit) -> Iterator[Sample]:
    """The values a limit is on, one set per cell type."""
    mesh = measured.mesh
    if limit.metric in QUANTITIES:
        values = QUANTITIES[limit.metric].values(mesh)
        rows = places.chosen("face", np.flatnonzero(~np.isnan(values)))
        yield _of_faces(mesh, limit, values, rows)
        return
    metric = METRICS[limit.metric]
    for key, raw in measured.values[limit.metric].items():
        if key in CELL_TYPES and not matches(key, limit):
            continue
        rows = places.chosen(key, measured.domain(limit.metric, key))
        if key == "face":
            sample = _of_faces(mesh, limit, raw, rows)
        else:
            sample = Sample(key, raw if rows is None else raw[rows], rows)
        yield Sample(key, clamp(metric, sample.values), sample.rows)


def _of_faces(mesh: Mesh, limit: Limit, values: Floats, rows: Rows | None) -> Sample:
    if limit.faces:
        outside = faces(mesh).neighbour == NO_CELL
        wanted = outside if limit.faces == "boundary" else ~outside
        rows = np.flatnonzero(wanted) if rows is None else rows[wanted[rows]]
    return Sample("face", values if rows is None else values[rows], rows)
