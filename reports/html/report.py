"""The HTML report of one audit: everything in one file, nothing fetched."""

from __future__ import annotations

import base64
import json
import zlib
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from meshwright.audit.metrics import METRICS
from meshwright.audit.run import Audit
from meshwright.audit.summary import Summary, cells_of_zones
from meshwright.reports.histogram_svg import HISTOGRAM_STYLE
from meshwright.reports.html.fragments import metric_panels
from meshwright.reports.html.payload import view_payload
from meshwright.reports.html.sections import page_data
from meshwright.reports.raster import picture, png
from meshwright.reports.saved import EMBEDDED, embedded

__all__ = ["WARN_BYTES", "incomplete_html", "report_html", "static"]

WARN_BYTES = 10 * 2**20
"""Size of a report from which on browsers and mail get slow."""

_PICTURE = (720, 420)
_RED = (192, 57, 43)
_MOST_IN_PICTURE = 400


@cache
def environment() -> Environment:
    """Templates that escape everything and know no undefined names."""
    loader = PackageLoader("meshwright.reports.html", "templates")
    return Environment(autoescape=True, undefined=StrictUndefined, loader=loader, trim_blocks=True, lstrip_blocks=True)


@cache
def static(name: str) -> str:
    """The text of a file that goes into every report."""
    return files("meshwright.reports.html").joinpath("static", name).read_text("utf-8")


@cache
def packed_static(name: str) -> str:
    """The same, deflated and in base64."""
    return packed(static(name))


def packed(text: str) -> str:
    """A text deflated (zlib) and in base64."""
    return base64.b64encode(zlib.compress(text.encode("utf-8", "replace"), 9)).decode("ascii")


def report_html(
    audit: Audit, document: Summary, *, baseline: Summary | None = None, repair: dict[str, Any] | None = None
) -> str:
    """The report of an audit and its document.

    baseline: the document of an earlier audit, for ticks in the histograms.  repair: what a repair did, as
    {"before": Summary, "after": Summary, "passes": [{"name", "changed", "note"}], "moved_points": int,
    "max_deviation": float, "zones_kept": bool, "refused": [str]}.
    """
    payload = view_payload(audit, document)
    panels = metric_panels(environment(), document, baseline)
    data = page_data(document, payload.facts, panels, repair)
    return (
        environment()
        .get_template("report.html.j2")
        .render(
            **data,
            css=Markup(static("report.css") + HISTOGRAM_STYLE),
            script=Markup(static("report.js")),
            viewer=packed_static("viewer.js"),
            view=payload.text,
            picture=base64.b64encode(_picture(audit, document, panels.first)).decode("ascii"),
            panels_packed=packed(json.dumps(panels.html, ensure_ascii=False)),
            embedded_id=EMBEDDED,
            document_json=Markup(embedded(document)),
        )
    )


def _picture(audit: Audit, document: Summary, first: str) -> bytes:
    """The mesh with its worst cells by one metric, for browsers without WebGL and for print; findings on top."""
    mesh, selection = audit.mesh, document["selection"]
    counted = None if selection is None else cells_of_zones(mesh, selection["zone"])
    found = [np.empty(0, np.int64)]
    if first and METRICS[first].entity == "cell":
        for key, raw in audit.measured.values[first].items():
            rows = mesh.block(key).rows
            badness = np.nan_to_num(raw if METRICS[first].worst_is_high else -raw, nan=-np.inf)
            if counted is not None:
                inside = counted[rows]
                rows, badness = rows[inside], badness[inside]
            few = min(_MOST_IN_PICTURE, len(rows))
            worst = np.argpartition(-badness, few - 1)[:few] if few else np.empty(0, np.int64)
            found.append(rows[worst[np.argsort(badness[worst], kind="stable")]].astype(np.int64))
    bad = [f for f in audit.findings if f.severity == "error" and f.entity == "cell"]
    found += [np.asarray(f.rows[:_MOST_IN_PICTURE], np.int64) for f in bad]
    cells = np.concatenate(found)[::-1]
    cells = cells[np.sort(np.unique(cells, return_index=True)[1])][::-1].copy()  # drawn last is on top
    return png(picture(mesh, cells, np.tile(np.array([_RED], np.uint8), (len(cells), 1)), size=_PICTURE))


def incomplete_html(path: str, reason: str) -> str:
    """A page that says why there is no report, so that none of an earlier run stands in its place."""
    template = environment().get_template("unread.html.j2")
    return template.render(path=path[:300], reason=reason, css=Markup(static("report.css")))
