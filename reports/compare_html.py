"""A comparison as a page of its own: overlaid histograms, deltas, what became of the cells."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from meshwright.audit.errors import printable
from meshwright.audit.metrics import DEFAULT, METRICS
from meshwright.reports.compare_text import conclusion, delta_rows, matching_lines
from meshwright.reports.comparison import Comparison
from meshwright.reports.histogram_svg import HISTOGRAM_STYLE, histogram_svg
from meshwright.reports.html.report import environment, static
from meshwright.reports.html.sections import ICONS
from meshwright.reports.wording import figure, size

__all__ = ["render_html"]

_MOST_CHARTS = 12


def render_html(comparison: Comparison) -> str:
    """One file, nothing fetched, no script."""
    ids = list(comparison["histograms"])
    ids.sort(key=lambda id_: (id_ not in DEFAULT, METRICS[id_].best == "none" if id_ in METRICS else True))
    charts = [_chart(id_, comparison["histograms"][id_]) for id_ in ids[:_MOST_CHARTS]]
    zones = comparison["zones"]
    return (
        environment()
        .get_template("compare.html.j2")
        .render(
            css=Markup(static("report.css") + HISTOGRAM_STYLE),
            version=comparison["version"],
            conclusion=conclusion(comparison),
            verdict="fail" if comparison["worse"] else "warn" if comparison["cautions"] else "pass",
            icons=ICONS,
            sides=[_side("before", comparison["before"]), _side("after", comparison["after"])],
            worse=[printable(text, 300) for text in comparison["worse"]],
            cautions=[printable(text, 500) for text in comparison["cautions"]],
            matching=matching_lines(comparison),
            rows=delta_rows(comparison),
            unchanged=comparison["metrics"]["unchanged"],
            charts=charts,
            charts_left=max(0, len(ids) - _MOST_CHARTS),
            zone_rows=[
                [word, z["entity"], printable(z["name"], 100), size(z["count"])]
                for word in ("lost", "new")
                for z in zones[word]
            ]
            + [
                ["resized", z["entity"], printable(z["name"], 100), f"{size(z['before'])} to {size(z['after'])}"]
                for z in zones["resized"]
            ],
            zone_metrics=[
                [
                    printable(z["zone"] or "(no zone)", 100),
                    z["metric"],
                    figure(z["before"]),
                    figure(z["after"]),
                    "worse" if z["worse"] else "better",
                ]
                for z in zones["metrics"][:200]
            ],
            findings=[[f["code"], f["severity"], size(f["before"]), size(f["after"])] for f in comparison["findings"]],
            rules=[
                [
                    printable(r["id"], 100),
                    r["before"] or "absent",
                    r["after"] or "absent",
                    figure(r["measured_before"]),
                    figure(r["measured_after"]),
                ]
                for r in comparison["rules"]
            ],
        )
    )


def _side(word: str, side: dict[str, Any]) -> dict[str, str]:
    return {
        "word": word,
        "path": printable(side["path"] or "mesh", 200),
        "verdict": side["verdict"],
        "cells": ", ".join(f"{size(n)} {kind}" for kind, n in side["cells"].items()),
        "sha256": side["sha256"] or "",
    }


def _chart(id_: str, pair: dict[str, Any]) -> dict[str, Any]:
    metric = METRICS.get(id_)
    title = id_ if metric is None else metric.title
    best = "none" if metric is None else metric.best
    return {
        "title": title,
        "svg": Markup(histogram_svg(pair["after"], title=title, best=best, baseline=pair["before"])),
    }
