"""What the 3-D view of a report gets: the shell of the mesh, the entities to show, and their level on every metric."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.places import text
from meshwright.audit.run import Audit
from meshwright.reports.html.items import NOT_DEFINED, Chosen, choose, levels, values_at
from meshwright.reports.html.pack import Packer, quantised, renumbered
from meshwright.reports.html.shell import Shell, shell_of

__all__ = ["ViewPayload", "view_payload"]

_VALUES = 400_000
"""Levels in a payload: entities times metrics."""

_LEAST, _MOST = 2_000, 20_000

_KINDS = ("tri", "quad", "polygon", "tet", "pyramid", "wedge", "hex", "polyhedron", "face", "point")
"""Kinds of items; second-order cells are shown by their corners."""

_FINE = 4096
"""Parts of the box: with an item smaller than one, places take 24 bits instead of 16."""

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class ViewPayload:
    """text: base64, see `pack`.  facts: what is shown of what: "faces", "faces_of", "cells", "cells_of", "thinned"."""

    text: str
    facts: dict[str, Any]


def view_payload(audit: Audit, document: dict[str, Any], *, most_faces: int = 300_000) -> ViewPayload:
    """The payload of an audit and its document; deterministic."""
    mesh = audit.mesh
    ids = [id_ for id_ in document["histograms"] if document["metrics"][id_]]
    of_cells = [id_ for id_ in ids if METRICS[id_].entity == "cell"]
    most = min(_MOST, max(_LEAST, _VALUES // max(1, len(of_cells))))
    shell = shell_of(mesh, most_faces)
    chosen = choose(audit, document, most)
    low, size = _box(mesh)
    packer = Packer()
    _add_shell(packer, shell, low, size)
    bits = _add_items(packer, mesh, chosen, low, size)
    metrics = [_add_metric(packer, audit, document, id_, chosen) for id_ in ids]
    kinds = np.bincount(_kinds_of(mesh, chosen), minlength=len(_KINDS))
    header = {
        "version": 1,
        "low": low.tolist(),
        "size": size.tolist(),
        "flat": mesh.dimension == 2,
        "kinds": list(_KINDS),
        "bits": bits,
        "shellZones": list(shell.names),
        "cellZones": [text(zone.name) for zone in mesh.cell_zones],
        "counts": {"cell": len(chosen.cell), "face": len(chosen.face), "point": len(chosen.point)},
        "metrics": metrics,
    }
    facts = {
        "faces": len(shell.offsets) - 1,
        "faces_of": shell.of,
        "thinned": shell.thinned,
        "shell_zones": "cell" if mesh.cell_dimension == 2 else "face",
        "cells": len(chosen.cell),
        "cells_of": mesh.n_cells,
        "kinds": {kind: int(n) for kind, n in zip(_KINDS, kinds, strict=True) if n},
    }
    return ViewPayload(packer.text(header), facts)


def _box(mesh: Mesh) -> tuple[Floats, Floats]:
    points = mesh.points if not mesh.n_nonfinite else mesh.points[np.isfinite(mesh.points).all(axis=1)]
    if not len(points):
        return np.zeros(3), np.ones(3)
    low, high = points.min(axis=0), points.max(axis=0)
    with np.errstate(over="ignore"):
        size = high - low
    return low, np.where(np.isfinite(size), size, np.finfo(float).max)


def _add_shell(packer: Packer, shell: Shell, low: Floats, size: Floats) -> None:
    used, code = renumbered(shell.nodes)
    packer.add("shell.sizes", np.minimum(np.diff(shell.offsets), 65535), width=2)
    packer.add("shell.nodes", code, width=4)
    for axis, values in enumerate(quantised(shell.points[used], low, size, 16).T):
        packer.add(f"shell.{'xyz'[axis]}", values & 0xFFFF, width=2, delta=True)
    packer.add("shell.zone", shell.zone, width=2)


def _kinds_of(mesh: Mesh, chosen: Chosen) -> Ints:
    """(n,) kind of every item: cells, then faces, then points."""
    kind = np.empty(len(chosen.cell), np.int64)
    for block in mesh.blocks:
        kind[np.isin(chosen.cell, block.rows)] = _KINDS.index(CELL_TYPES[block.type].corners)
    rest = [np.full(len(chosen.face), _KINDS.index("face")), np.full(len(chosen.point), _KINDS.index("point"))]
    return np.concatenate([kind, *rest])


def _add_items(packer: Packer, mesh: Mesh, chosen: Chosen, low: Floats, size: Floats) -> int:
    """Kinds, numbers, zones and corners of the items; the bits of a place."""
    table = faces(mesh) if len(chosen.face) or mesh.faces is not None else None
    kinds = _kinds_of(mesh, chosen)
    lists: list[Any] = []
    sizes: list[int] = []
    where = {block.type: block for block in mesh.blocks}
    names = list(where)
    of_block = np.empty(len(chosen.cell), np.int64)
    place = np.empty(len(chosen.cell), np.int64)
    for k, name in enumerate(names):
        rows = where[name].rows
        at = np.searchsorted(rows, chosen.cell)
        inside = (at < len(rows)) & (rows[np.minimum(at, max(0, len(rows) - 1))] == chosen.cell)
        of_block[inside], place[inside] = k, at[inside]
    for k, row in zip(of_block.tolist(), place.tolist(), strict=True):
        block = where[names[k]]
        if block.items is None or block.offsets is None:
            lists.append(block.nodes[row, : CELL_TYPES[block.type].n_corners])
            continue
        items = block.items[block.offsets[row] : block.offsets[row + 1]]
        if block.type == "polygon" or table is None:
            sizes.append(len(items))
            lists.append(items)
            continue
        sizes.append(len(items))
        for face in items:
            loop = table.nodes[table.offsets[face] : table.offsets[face + 1]]
            sizes.append(len(loop))
            lists.append(loop)
    for face in chosen.face.tolist():
        assert table is not None  # noqa: S101 - made where there are faces
        loop = table.nodes[table.offsets[face] : table.offsets[face + 1]]
        sizes.append(len(loop))
        lists.append(loop)
    lists.append(chosen.point)
    nodes = np.concatenate([np.asarray(part, np.int64) for part in lists])
    used, code = renumbered(nodes)
    bits = 24 if _fine(mesh, lists, size) else 16
    packer.add("item.kind", kinds, width=1)
    packer.add("item.sizes", np.array(sizes, np.int64), width=2)
    packer.add("item.nodes", code, width=4)
    for axis, values in enumerate(quantised(mesh.points[used], low, size, bits).T):
        packer.add(f"item.{'xyz'[axis]}", values, width=bits // 8, delta=True)
    numbers = np.concatenate([_numbers(mesh, table, chosen, entity) for entity in ("cell", "face", "point")])
    packer.add("item.low", numbers & 0xFFFFFFFF, width=4, delta=True)
    packer.add("item.high", (numbers >> 32) & 0xFFFFFFFF, width=4, delta=True)
    zone = mesh.cell_zone_index()[chosen.cell].astype(np.int64) if mesh.cell_zones else np.full(len(chosen.cell), -1)
    packer.add("item.zone", np.where(zone < 0, 0xFFFF, np.minimum(zone, 0xFFFE)), width=2)
    return bits


def _numbers(mesh: Mesh, table: Any, chosen: Chosen, entity: str) -> Ints:
    """The file's own numbers."""
    rows: Ints = getattr(chosen, entity)
    ids = {"cell": mesh.cell_ids, "point": mesh.point_ids, "face": None if table is None else table.ids}[entity]
    return rows if ids is None else np.asarray(ids)[rows].astype(np.int64)


def _fine(mesh: Mesh, lists: list[Any], size: Floats) -> bool:
    """Whether some item is too small for places of 16 bits."""
    longest = float(size.max())
    for part in lists[:-1]:
        with np.errstate(over="ignore"):
            extent = float(np.ptp(mesh.points[part], axis=0).max())
        if 0 < extent < longest / _FINE:
            return True
    return False


def _add_metric(packer: Packer, audit: Audit, document: dict[str, Any], id_: str, chosen: Chosen) -> dict[str, Any]:
    """The levels of one metric on the items of its kind of entity, and what the view has to know about it."""
    metric, entry = METRICS[id_], document["histograms"][id_]
    edges = [float(edge) for edge in entry["edges"]]
    rows: Ints = getattr(chosen, metric.entity)
    if metric.entity == "cell":
        values, defined = values_at(audit, id_, rows)
    else:
        raw = audit.measured.values[id_][metric.entity]
        domain = audit.measured.domain(id_, metric.entity)
        defined = np.ones(len(rows), bool) if domain is None else np.isin(rows, domain)
        values = np.clip(raw[rows], metric.low, metric.high)
    found = levels(values, edges)
    found[~defined] = NOT_DEFINED
    packer.add(f"m.{id_}", found.astype(np.int64), width=1)
    return {"id": id_, "title": metric.title, "entity": metric.entity, "best": metric.best, "unit": metric.unit,
            "edges": entry["edges"], "labels": entry["labels"], "mirrored": entry["mirrored"]}  # fmt: skip
