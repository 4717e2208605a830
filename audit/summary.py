"""`summarise`: an audit as one plain dictionary, the JSON document `meshwright.audit/1`. All outputs are made of it."""

from __future__ import annotations

import datetime as dt
import fnmatch
import math
from collections.abc import Callable, Sequence
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.findings import Finding
from meshwright.audit.fingerprint import fingerprint
from meshwright.audit.histograms import count_into, histogram_for
from meshwright.audit.measurement import Measured, clamp
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics import METRICS, Metric
from meshwright.audit.parallel import in_parallel
from meshwright.audit.places import Places, plain, text
from meshwright.audit.profiles.baseline import Baseline
from meshwright.audit.profiles.evaluate import evaluate
from meshwright.audit.profiles.model import Profile
from meshwright.audit.profiles.rosetta import rosetta
from meshwright.audit.run import Audit
from meshwright.audit.statistics import PERCENTILES, degenerate, statistics, worst_first
from meshwright.audit.tables import BINNINGS, GAMBIT_CLASSES, MEAN_HINTS, Tables, tabulate
from meshwright.audit.verdict import gate_section
from meshwright.audit.zone_rows import ZoneRows

__all__ = ["SCHEMA", "Summary", "cells_of_zones", "summarise"]

SCHEMA = "meshwright.audit/1"
Summary = dict[str, Any]

_MOST_IDS = 100

Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]
Floats = NDArray[np.float64]


def summarise(
    audit: Audit,
    *,
    zone: str | None = None,
    worst: int = 10,
    sha256: str | None = None,
    profiles: Sequence[Profile] = (),
    compare: Sequence[Profile] = (),
    baseline: Baseline | None = None,
    today: dt.date | None = None,
) -> Summary:
    """The document of an audit, ready for `json.dumps`: inf and nan are strings, values clamped to their range.

    zone: count only the cells of cell zones whose name matches this pattern (`*`, `?`, `[...]`); UsageError when
    none does. Findings about points, faces and edges stay those of the whole mesh.  worst: length of the lists of
    worst cells.  sha256: of the file; computed from `mesh.path` when None.  profiles: whose limits the mesh has to
    keep.  compare: profiles to set side by side under "rosetta"; they do not count for the verdict.  baseline: an
    earlier audit, for rules that allow nothing worse.  today: by which waivers expire, the present day when None.

    The verdict (`gate`): "incomplete" when a coordinate is not finite; else "fail" when a check reports an error or a
    rule fails; else "incomplete" when no chosen metric is defined for the type of some cell, a rule cannot be decided,
    or no limit of a profile applies to the mesh; else "warn" for warnings, for rules that warn and for values that are
    undefined; else "pass".
    """
    mesh, measured = audit.mesh, audit.measured
    chosen = None if zone is None else cells_of_zones(mesh, zone)
    work: tuple[Callable[[], Any], ...] = (
        partial(tabulate, measured, chosen),
        partial(_metrics, measured, audit.chosen, chosen, worst),
    )
    tables, counted = in_parallel(lambda part: part(), work)
    if sha256 is None and mesh.path:
        sha256 = fingerprint(mesh.path)
    findings = [_finding(mesh, f) for f in audit.findings if chosen is None or _touches(f, chosen)]
    counts = {finding["code"]: finding["count"] for finding in findings}
    judgements = [
        evaluate(measured, profile, counts, chosen, selection=zone, baseline=baseline, today=today)
        for profile in profiles
    ]
    document: Summary = {
        "schema": SCHEMA,
        "version": version("meshwright"),
        "mesh": _mesh(mesh, sha256),
        "zones": [
            {
                "name": text(z.name),
                "kind": text(z.kind),
                "role": text(z.role),
                "entity": z.entity,
                "count": len(z.members),
            }
            for z in mesh.zones
        ],
        "selection": None if chosen is None else {"zone": zone, "cells": int(np.count_nonzero(chosen))},
        **_table_keys(tables, mesh, 0),
        **counted,
        "definitions": {key: _definition(key) for key in audit.chosen},
        "zone_tables": [_zone_table(tables, mesh, g) for g in range(1, len(tables.groups))],
        "findings": findings,
        "gate": gate_section(mesh, tables, counted["metrics"], findings, judgements, baseline),
        "notes": [text(note) for note in mesh.notes],
    }
    if compare:
        errors = [finding["code"] for finding in findings if finding["severity"] == "error"]
        sides = [evaluate(measured, profile, counts, chosen) for profile in compare]
        document["rosetta"] = rosetta(measured, sides, errors, chosen)
    if audit.surface is not None:
        shell = audit.surface
        document["surface"] = {
            "cells": shell.mesh.counts,
            **_table_keys(tabulate(shell), shell.mesh, 0),
            **_metrics(shell, audit.chosen, None, worst),
        }
    return document


def cells_of_zones(mesh: Mesh, pattern: str) -> Mask:
    """(n_cells,) cells in a cell zone whose name matches the pattern; UsageError when no zone does.

    A pattern that is the very name of a zone means that one, be there brackets in it.
    """
    matching = [zone for zone in mesh.cell_zones if zone.name == pattern]
    matching = matching or [zone for zone in mesh.cell_zones if fnmatch.fnmatchcase(zone.name, pattern)]
    if not matching:
        names = ", ".join(printable(zone.name, 40) for zone in mesh.cell_zones[:20]) or "none"
        raise UsageError(f"no cell zone matches {printable(pattern)!r}; cell zones of this mesh: {names}")
    mask = np.zeros(mesh.n_cells, dtype=bool)
    for zone in matching:
        mask[zone.members] = True
    return mask


def _mesh(mesh: Mesh, sha256: str | None) -> dict[str, Any]:
    finite = mesh.points[np.isfinite(mesh.points).all(axis=1)] if mesh.n_nonfinite else mesh.points
    return {
        "path": text(mesh.path),
        "format": mesh.format,
        "sha256": sha256,
        "dimension": mesh.dimension,
        "order": mesh.order,
        "points": len(mesh.points),
        "cells": mesh.counts,
        "bounds": [finite.min(axis=0).tolist(), finite.max(axis=0).tolist()] if len(finite) else None,
    }


def _table_keys(tables: Tables, mesh: Mesh, group: int) -> dict[str, Any]:
    """The tables of one group: "quality", "distributions" and "gambit_classes"."""
    kinds = [k for k in range(len(tables.types)) if tables.cells[group, k]]
    quality = []
    for k in kinds:
        known = tables.measured[group, k] > 0
        quality.append(
            {
                "type": tables.types[k],
                "count": int(tables.cells[group, k]),
                "worst_equiangle_skew": float(tables.worst[group, k]) if known else None,
                "share_over_0_8": tables.share_over(group, k) if known else None,
                "over_0_8": int(tables.over[group, k]) if tables.skew.defined[k] else None,
            }
        )
    distributions = {}
    for binning in BINNINGS:
        tally = tables.distributions[binning.id]
        defined = [k for k in kinds if tally.defined[k]]
        distributions[binning.id] = {
            "fluent": [plain(edge) for edge in binning.edges],
            "icem": list(binning.mirrored),
            "counts": {tables.types[k]: tally.counts[group, k].tolist() for k in defined},
            "undefined": {tables.types[k]: int(tally.undefined[group, k]) for k in defined},
        }
    mean = tables.mean(group)
    return {
        "quality": quality,
        "distributions": distributions,
        "gambit_classes": {
            "classes": [{"name": c.name, "range": c.range} for c in GAMBIT_CLASSES],
            "counts": {tables.types[k]: tables.classes[group, k].tolist() for k in kinds if tables.skew.defined[k]},
            "mean": None if math.isnan(mean) else mean,
            "hint": MEAN_HINTS[mesh.cell_dimension],
        },
    }


def _zone_table(tables: Tables, mesh: Mesh, group: int) -> dict[str, Any]:
    index = tables.groups[group].zone
    zone = mesh.cell_zones[index] if index is not None and index >= 0 else None
    return {
        "zone": None if zone is None else text(zone.name),
        "kind": "" if zone is None else text(zone.kind),
        "role": "" if zone is None else text(zone.role),
        "count": int(tables.cells[group].sum()),
        **_table_keys(tables, mesh, group),
    }


def _definition(key: str) -> dict[str, Any]:
    metric = METRICS[key]
    return {
        "title": metric.title,
        "unit": metric.unit,
        "low": plain(metric.low),
        "high": plain(metric.high),
        "best": metric.best,
    }


def _metrics(measured: Measured, ids: tuple[str, ...], chosen: Mask | None, n_worst: int) -> dict[str, Any]:
    """The keys "metrics", "histograms" and "zone_metrics"."""
    mesh = measured.mesh
    places = Places(mesh, chosen)
    zones = ZoneRows(mesh, chosen)
    present = [b.type for b in mesh.blocks if len(b) and (chosen is None or chosen[b.rows].any())]
    keys = (*present, "face", "point")

    def of_metric(id_: str) -> tuple[dict[str, Any], dict[str, Any], list[dict[str, Any]]]:
        metric = METRICS[id_]
        figures, values = {}, {}
        tally = zones.tally(metric)
        for key in keys:
            if key not in measured.values[id_]:
                continue
            raw, rows = measured.values[id_][key], places.chosen(key, measured.domain(id_, key))
            values[key] = clamp(metric, raw if rows is None else raw[rows])
            broken = degenerate(mesh, metric, key, values[key], rows)
            figures[key] = _figures(places, metric, key, values[key], rows, broken, n_worst)
            tally.add(key, values[key], broken)
        ends = [float(f[end]) for f in figures.values() if f["count"] for end in ("min", "max")]
        bins = histogram_for(metric, min(ends, default=math.nan), max(ends, default=math.nan))
        counts = {key: count_into(bins.edges, found) for key, found in values.items()}
        return figures, bins.as_json(counts), tally.as_json()

    found = dict(zip(ids, in_parallel(of_metric, ids), strict=True))
    return {
        "metrics": {id_: figures for id_, (figures, _, _) in found.items()},
        "histograms": {id_: bins for id_, (_, bins, _) in found.items()},
        "zone_metrics": {id_: table for id_, (_, _, table) in found.items() if METRICS[id_].entity == "cell"},
    }


def _figures(
    places: Places, metric: Metric, key: str, values: Floats, rows: Rows | None, broken: Mask | None, n_worst: int
) -> dict[str, Any]:
    """What "metrics" holds about a metric on the cells of one type, on faces or on points."""
    found = statistics(values, broken)
    listed = worst_first(values, n_worst, high_is_worse=metric.worst_is_high)
    listed_rows = listed if rows is None else rows[listed]
    return {
        "count": found.count,
        "undefined": found.undefined,
        "degenerate": found.degenerate,
        "min": plain(found.min),
        "max": plain(found.max),
        "mean": plain(found.mean),
        **{f"p{p}": plain(v) for p, v in zip(PERCENTILES, found.percentiles, strict=True)},
        "worst": [
            places.describe(key, row, plain(float(values[at])))
            for row, at in zip(listed_rows.tolist(), listed.tolist(), strict=True)
        ],
    }


def _touches(finding: Finding, chosen: Mask) -> bool:
    """Whether a finding concerns the chosen cells; those about other entities concern the whole mesh."""
    return finding.entity != "cell" or bool(chosen[finding.rows].any())


def _finding(mesh: Mesh, finding: Finding) -> dict[str, Any]:
    return {
        "code": finding.code,
        "severity": finding.severity,
        "count": finding.count,
        "entity": finding.entity,
        "ids": finding.ids(mesh)[:_MOST_IDS].tolist(),
        "places": [[plain(x) for x in where] for where in finding.places(mesh, _MOST_IDS)],
        "message": text(finding.message),
        **({} if finding.detail is None else {"detail": finding.detail}),
    }
