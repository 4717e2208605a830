"""Which cells, faces and points a report can show, and where on each metric's histogram they lie."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.parallel import in_parallel
from meshwright.audit.places import Places
from meshwright.audit.run import Audit
from meshwright.audit.summary import cells_of_zones

__all__ = ["NOT_DEFINED", "UNDEFINED", "Chosen", "choose", "levels", "levels_of_bin"]

UNDEFINED, NOT_DEFINED = 255, 254
"""Bytes in place of a level: a value that is nan, and a metric that does not exist for this entity."""

_BAR = 24
"""Entities shown of a bar of a histogram at the least, where there are so many."""

Rows = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Chosen:
    """Ascending rows of cells, faces and points to show."""

    cell: Rows
    face: Rows
    point: Rows


def levels_of_bin(n_bins: int) -> int:
    """How many levels a bin has, so that all fit into a byte beside the two special ones."""
    return NOT_DEFINED // n_bins


def levels(values: Floats, edges: list[float]) -> NDArray[np.uint8]:
    """(n,) the bin of each value and how far it lies in it: bin * levels of a bin + level; 255 for nan.

    A bin without end has its levels by the ratio of its bound and the value.
    """
    n = len(edges) - 1
    within = levels_of_bin(n)
    bins = np.clip(np.searchsorted(np.array(edges[1:-1]), values, side="right"), 0, n - 1)
    low, high = np.array(edges[:-1])[bins], np.array(edges[1:])[bins]
    with np.errstate(all="ignore"):
        part = (values - low) / (high - low)
        part = np.where(np.isinf(high), 1 - np.where(low > 0, low, 1.0) / np.maximum(values, 1e-300), part)
        part = np.where(np.isneginf(low), 0.0, part)
    level = np.clip(np.nan_to_num(part, nan=0.0, posinf=1.0, neginf=0.0) * within, 0, within - 1).astype(np.int64)
    found = (bins * within + level).astype(np.uint8)
    found[np.isnan(values)] = UNDEFINED
    return found


@kernel
def _sample(values: Floats, inner: Floats, counts: Rows, most: int) -> Rows:
    """Positions of up to `most` values of every bin, evenly spread; counts: how many each has."""
    n = counts.size
    seen, taken = np.zeros(n, np.int64), np.zeros(n, np.int64)
    out = np.empty(n * most, np.int64)
    k, full = 0, 0
    for b in range(n):
        full += counts[b] == 0
    for i in range(values.size):
        v = values[i]
        if v != v:
            continue
        b = 0
        for j in range(inner.size):
            b += v >= inner[j]
        if taken[b] < most and seen[b] * most >= taken[b] * counts[b]:
            out[k] = i
            k += 1
            taken[b] += 1
            if taken[b] == min(most, counts[b]):
                full += 1
                if full == n:
                    break
        seen[b] += 1
    return out[:k]


def choose(audit: Audit, document: dict[str, Any], most: int) -> Chosen:
    """Up to about `most` entities: all cells, or those of findings, the worst of every metric, and some of every bar.

    Sound geometry alone: what has a coordinate that is not finite cannot be shown.
    """
    mesh = audit.mesh
    found: dict[str, list[Rows]] = {"cell": [], "face": [], "point": []}
    wanted = {"error": most // 4, "warning": most // 8}
    for finding in audit.findings:
        if finding.severity in wanted and finding.entity in found:
            rows = np.asarray(finding.rows)[: wanted[finding.severity]]
            found[finding.entity].append(rows.astype(np.int64))
    for entity, numbers in _worst(document).items():
        found[entity].append(_rows_of(mesh, entity, numbers))
    ids = [id_ for id_ in document["histograms"] if document["metrics"][id_]]
    bar = max(4, min(_BAR, most // (4 * max(1, len(ids)))))
    selection = document["selection"]
    places = Places(mesh, None if selection is None else cells_of_zones(mesh, selection["zone"]))
    for samples in in_parallel(lambda id_: _samples(audit, document, places, id_, bar), ids):
        for entity, rows in samples:
            found[entity].append(rows)
    if mesh.n_cells <= most:
        found["cell"].append(np.arange(mesh.n_cells))
    made = {entity: _counted(mesh, places, entity, _some(rows, most)) for entity, rows in found.items()}
    return Chosen(**{entity: _sound(mesh, entity, rows) for entity, rows in made.items()})


def _some(parts: list[Rows], most: int) -> Rows:
    """The rows, each once; of too many, those that were asked for first."""
    everything = np.concatenate([np.empty(0, np.int64), *parts])
    rows, first = np.unique(everything, return_index=True)
    if len(rows) > most:
        rows = np.sort(rows[np.argsort(first, kind="stable")[:most]])
    return rows


def _worst(document: dict[str, Any]) -> dict[str, set[int]]:
    """Numbers of the entities in lists of worst values and of rules."""
    found: dict[str, set[int]] = {"cell": set(), "face": set(), "point": set()}
    entries: list[dict[str, Any]] = [w for f in document["metrics"].values() for k in f.values() for w in k["worst"]]
    for rule in document["gate"]["rules"]:
        entries += [w for w in (rule["worst"], *(z["worst"] for z in rule["zones"])) if w is not None]
    for entry in entries:
        entity = next(key for key in found if key in entry)
        found[entity].add(entry[entity])
    return found


def _rows_of(mesh: Mesh, entity: str, numbers: Iterable[int]) -> Rows:
    """Rows of entities by the numbers of the file."""
    wanted = np.array(sorted(numbers), np.int64)
    ids = {"cell": mesh.cell_ids, "point": mesh.point_ids}.get(entity)
    if entity == "face":
        ids = faces(mesh).ids if len(wanted) else None
    if ids is None:
        return wanted
    return np.flatnonzero(np.isin(ids, wanted)).astype(np.int64)


def _counted(mesh: Mesh, places: Places, entity: str, rows: Rows) -> Rows:
    """The rows that the document counts: all, or those of the zones it is about."""
    if entity != "cell":
        kept = places.chosen(entity, rows)
        return rows if kept is None else kept.astype(np.int64)
    masks = [(block.rows, places.chosen(block.type, None)) for block in mesh.blocks]
    if any(chosen is None for _, chosen in masks):
        return rows
    counted = np.zeros(mesh.n_cells, bool)
    for cells, chosen in masks:
        counted[cells[chosen]] = True
    return rows[counted[rows]]


def _samples(audit: Audit, document: dict[str, Any], places: Places, id_: str, bar: int) -> list[tuple[str, Rows]]:
    """Some of every bar of a metric, by kind of entity."""
    entry, mesh = document["histograms"][id_], audit.mesh
    inner = np.array([float(edge) for edge in entry["edges"][1:-1]], float)
    found = []
    for key, counts in entry["counts"].items():
        values, rows = audit.measured.values[id_][key], places.chosen(key, audit.measured.domain(id_, key))
        at = _sample(values if rows is None else values[rows], inner, np.array(counts, np.int64), bar)
        at = at if rows is None else rows[at].astype(np.int64)
        if key in CELL_TYPES:
            found.append(("cell", mesh.block(key).rows[at].astype(np.int64)))
        else:
            found.append((key, at))
    return found


def _sound(mesh: Mesh, entity: str, rows: Rows) -> Rows:
    """The rows without those that have a point that is not finite."""
    if not mesh.n_nonfinite or not len(rows):
        return rows
    sound = np.asarray(np.isfinite(mesh.points).all(axis=1))
    if entity == "point":
        return rows[sound[rows]]
    if entity == "face":
        table = faces(mesh)
        return rows[[bool(sound[table.nodes[table.offsets[r] : table.offsets[r + 1]]].all()) for r in rows]]
    bad = np.zeros(mesh.n_cells, bool)
    for block in mesh.blocks:
        if block.items is None:
            bad[block.rows] = ~sound[block.nodes].all(axis=1)
        elif block.type == "polygon" and block.offsets is not None:
            bad[block.rows] = ~np.logical_and.reduceat(sound[block.items], block.offsets[:-1])
        elif mesh.faces is not None and block.offsets is not None:
            table = mesh.faces
            good = np.logical_and.reduceat(sound[table.nodes], table.offsets[:-1])
            bad[block.rows] = ~np.logical_and.reduceat(good[block.items], block.offsets[:-1])
    return rows[~bad[rows]]


def values_at(audit: Audit, id_: str, rows: Rows) -> tuple[Floats, NDArray[np.bool_]]:
    """(n,) clamped values of a metric of cells at these cell rows, and where it is defined."""
    metric = METRICS[id_]
    values, defined = np.full(len(rows), math.nan), np.zeros(len(rows), bool)
    for key, raw in audit.measured.values[id_].items():
        block = audit.mesh.block(key)
        at = np.searchsorted(block.rows, rows)
        inside = (at < len(block)) & (block.rows[np.minimum(at, len(block) - 1)] == rows)
        values[inside] = np.clip(raw[at[inside]], metric.low, metric.high)
        defined |= inside
    return values, defined
