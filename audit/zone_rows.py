"""Every metric by zone of cells: how many values, the worst, the mean."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints, Mesh
from meshwright.audit.metrics.row import Metric
from meshwright.audit.places import plain

__all__ = ["MOST_ZONES", "ZoneRows", "ZoneTally"]

MOST_ZONES = 200
"""Zones listed of a metric at most: the worst ones of a mesh that has more."""

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


class ZoneRows:
    """Which values of which cell type belong to which zone.

    chosen: (n_cells,) the cells to count, None for all. A cell in two zones counts in both; cells in none make a group
    of their own, the last.
    """

    def __init__(self, mesh: Mesh, chosen: Mask | None) -> None:
        self._mesh = mesh
        self._chosen = chosen

    @cached_property
    def _pairs(self) -> dict[str, tuple[Ints, Ints]]:
        """By cell type: rows into its counted values, ascending within a zone, and the zone of each."""
        mesh = self._mesh
        zones = [zone.members for zone in mesh.cell_zones]
        homeless = np.ones(mesh.n_cells, dtype=bool)
        for members in zones:
            homeless[members] = False
        cells = np.concatenate([*zones, np.flatnonzero(homeless)])
        group = np.repeat(np.arange(len(zones) + 1, dtype=np.int32), [*(len(z) for z in zones), int(homeless.sum())])
        if self._chosen is not None:
            keep = self._chosen[cells]
            cells, group = cells[keep], group[keep]
        found = {}
        block_of, place = np.empty(mesh.n_cells, np.int8), np.empty(mesh.n_cells, np.int32)
        for code, block in enumerate(mesh.blocks):
            rows = block.rows if self._chosen is None else block.rows[self._chosen[block.rows]]
            block_of[block.rows] = code
            place[rows] = np.arange(len(rows), dtype=np.int32)
        for code, block in enumerate(mesh.blocks):
            here = block_of[cells] == code
            found[block.type] = (place[cells[here]], group[here])
        return found

    def tally(self, metric: Metric) -> ZoneTally:
        """An empty table for a metric."""
        return ZoneTally(self, metric)

    def pairs(self, key: str) -> tuple[Ints, Ints]:
        """(rows into the counted values of a cell type, zone of each)."""
        return self._pairs[key]

    @property
    def places(self) -> list[int | None]:
        """Where the zones of cells stand among all zones of the mesh, then None; nothing for a mesh without them."""
        found = [k for k, zone in enumerate(self._mesh.zones) if zone.entity == "cell"]
        return [*found, None] if found else []


class ZoneTally:
    """Values of one metric by zone; one call of `add` for each cell type."""

    def __init__(self, zones: ZoneRows, metric: Metric) -> None:
        self._zones = zones
        self._places = zones.places if metric.entity == "cell" else []
        self._high = metric.worst_is_high
        n = len(self._places)
        self._counts = np.zeros((n, 3), np.int64)
        self._worst = np.full(n, -math.inf if self._high else math.inf)
        self._sums = np.zeros(n)

    def add(self, key: str, values: Floats, broken: Mask | None) -> None:
        """Count the values of a type, those of `broken` cells for the worst but not for the mean."""
        if self._places and key in CELL_TYPES:
            skip = np.zeros(0, bool) if broken is None else broken
            _add(*self._zones.pairs(key), values, skip, self._high, self._counts, self._worst, self._sums)

    def as_json(self) -> list[dict[str, Any]]:
        """The entry of a document: zones in their order, those without such cells left out."""
        rows = [k for k in range(len(self._places)) if self._counts[k, :2].any()]
        if len(rows) > MOST_ZONES:
            sign = -1.0 if self._high else 1.0
            rows = sorted(sorted(rows, key=lambda k: (sign * self._worst[k], k))[:MOST_ZONES])
        return [self._row(k) for k in rows]

    def _row(self, k: int) -> dict[str, Any]:
        known, undefined, sound = self._counts[k].tolist()
        return {
            "zone": self._places[k],
            "count": known,
            "undefined": undefined,
            "worst": plain(float(self._worst[k])) if known else None,
            "mean": plain(float(self._sums[k] / sound)) if sound else None,
        }


@kernel
def _add(
    rows: Ints, zones: Ints, values: Floats, broken: Mask, high: bool, counts: Ints, worst: Floats, sums: Floats
) -> None:
    """counts: (zones, 3) values that are known, undefined, and known of sound cells."""
    for i in range(rows.size):
        v, z = values[rows[i]], zones[i]
        if v != v:
            counts[z, 1] += 1
            continue
        counts[z, 0] += 1
        if (v > worst[z]) if high else (v < worst[z]):
            worst[z] = v
        if broken.size == 0 or not broken[rows[i]]:
            counts[z, 2] += 1
            sums[z] += v
