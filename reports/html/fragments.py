"""The panel of each metric: histogram, statistics, worst entities, definition. All are made; the page shows one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from jinja2 import Environment
from markupsafe import Markup

from meshwright.audit.errors import printable
from meshwright.audit.histograms import aligned
from meshwright.audit.metrics import METRICS
from meshwright.audit.parallel import in_parallel
from meshwright.audit.summary import Summary
from meshwright.reports.histogram_marks import marks_of
from meshwright.reports.histogram_svg import histogram_svg
from meshwright.reports.wording import figure, number, size

__all__ = ["Panels", "metric_panels", "mirrored"]

_MOST_WORST = 12


@dataclass(frozen=True)
class Panels:
    """html: by metric id, in the order of the document.  titles, entities: likewise.  first: the one shown at first."""

    html: dict[str, str]
    titles: dict[str, str]
    entities: dict[str, str]
    first: str


def metric_panels(environment: Environment, document: Summary, baseline: Summary | None) -> Panels:
    """The panels of all metrics that have a value somewhere."""
    template = environment.get_template("metric.html.j2")
    ids = [id_ for id_, figures in document["metrics"].items() if figures]

    def panel(id_: str) -> str:
        return template.render(_panel(document, baseline, id_))

    html = dict(zip(ids, in_parallel(panel, ids), strict=True))
    titles = {id_: document["definitions"][id_]["title"] for id_ in ids}
    first = "gambit.equiangle_skew" if "gambit.equiangle_skew" in html else next(iter(html), "")
    return Panels(html, titles, {id_: METRICS[id_].entity for id_ in ids}, first)


def _panel(document: Summary, baseline: Summary | None, id_: str) -> dict[str, Any]:
    metric, definition = METRICS[id_], document["definitions"][id_]
    entry = document["histograms"][id_]
    before = None if baseline is None else baseline.get("histograms", {}).get(id_)
    if before is not None and before["edges"] != entry["edges"]:
        entry_shown, before = aligned(entry, before)
    else:
        entry_shown = entry
    same_bins = entry_shown is entry
    svg = histogram_svg(entry_shown, title=f"Distribution of {definition['title']}", best=metric.best, baseline=before,
                        marks=marks_of(document, id_))  # fmt: skip
    figures = document["metrics"][id_]
    missing = any(f["undefined"] or f["degenerate"] for f in figures.values())
    worst = [(kind, w) for kind, f in figures.items() for w in f["worst"]]
    sign = -1.0 if metric.worst_is_high else 1.0
    worst.sort(key=lambda pair: sign * number(pair[1]["value"]))
    return {
        "id": id_,
        "metric": metric,
        "svg": Markup(svg),
        "clickable": same_bins,
        "baseline": before is not None,
        "scales": entry["scales"],
        "rows": [_row(kind, f, definition["unit"], missing=missing) for kind, f in figures.items()],
        "worst": [worst_row(kind, w, id_, definition["unit"]) for kind, w in worst[:_MOST_WORST]],
        "mirror": mirror_name(id_),
        "undefined": sum(f["undefined"] for f in figures.values()),
        "degenerate": sum(f["degenerate"] for f in figures.values()),
        "size": size,
    }


def _row(kind: str, figures: dict[str, Any], unit: str, *, missing: bool) -> list[str]:
    values = [figure(figures[item], unit) for item in ("min", "p50", "mean", "p95", "p99", "max")]
    lost = [size(figures["undefined"]), size(figures["degenerate"])] if missing else []
    return [kind, size(figures["count"]), *values, *lost]


def mirror_name(id_: str) -> str:
    """The other scale of a metric that has two, "" for none."""
    metric = METRICS[id_]
    if metric.best == "none":
        return ""
    if (metric.low, metric.high) == (0.0, 1.0):
        return "ICEM (1 best)" if metric.best == "low" else "Fluent (0 best)"
    return "1/x (1 best)" if metric.low == 1.0 and metric.best == "low" else ""


def mirrored(id_: str, value: Any) -> str:
    """A value on the other scale, spelled."""
    x = number(value)
    return figure((1 / x if x else "inf") if METRICS[id_].low == 1.0 else 1 - x)


def worst_row(kind: str, entry: dict[str, Any], id_: str, unit: str) -> dict[str, Any]:
    """A line of a list of worst entities."""
    entity = next(key for key in ("cell", "face", "point") if key in entry)
    return {
        "entity": entity,
        "id": entry[entity],
        "type": kind,
        "zone": "" if entry["zone"] is None else printable(entry["zone"], 200),
        "value": figure(entry["value"], unit),
        "mirror": mirrored(id_, entry["value"]) if mirror_name(id_) else "",
        "place": ", ".join(f"{float(x):.4g}" for x in entry["centroid"]),
    }
