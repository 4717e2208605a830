"""Figures for notebooks and papers, drawn with matplotlib (the extra `plot`); all functions return the Axes drawn on.

    from meshwright.audit import audit, read
    from meshwright.reports import plot

    found = audit(read("wing.msh"))
    plot.histogram(found, "gambit.equiangle_skew").figure.savefig("skewness.pdf")

Documents, also those of `saved.read_saved`, will do wherever no mesh is needed. Types differ by hatching as well as by
grey, limits and baselines by line, so that a figure bears a copier.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.histograms import aligned
from meshwright.audit.measurement import clamp
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.mirrors import scale_of
from meshwright.audit.run import Audit
from meshwright.audit.summary import Summary, summarise
from meshwright.audit.tables import ASPECT, SKEW
from meshwright.reports.bad_entities import RAMP, colours_of, range_of, shown_of
from meshwright.reports.histogram_svg import cut, totals
from meshwright.reports.raster import LIGHT, Theme, picture
from meshwright.reports.wording import figure, name, number, plural

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["bad_cells", "cumulative", "distributions", "histogram", "zones_heat"]

Scale = Literal["fluent", "icem"]
Source = Audit | Summary

_GREYS = ("0.35", "0.75", "0.55", "0.9", "0.2", "0.65")
_HATCHES = ("", "///", "...", "xxx", "\\\\\\", "++")
_LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))
_UNITS = {"1": "", "deg": "degrees", "L": "length", "L2": "area", "L3": "volume"}
_MOST_ZONES = 40


def histogram(
    source: Source,
    metric: str,
    ax: Axes | None = None,
    *,
    types: Sequence[str] | None = None,
    baseline: Source | None = None,
    scale: Scale | None = None,
) -> Axes:
    """How many cells (faces, points) lie in each bin of a metric, on a logarithmic axis, each type beside the other.

    source: an audit, or a document.  types: keys of its counts, all where None.  baseline: another, drawn as black
    ticks on the bins of both.  scale: that of the lower axis, the stored one where None; the other stands above.
    UsageError for a metric, type or scale that is not there.
    """
    entry, before = _entry(source, metric), None if baseline is None else _entry(baseline, metric)
    if before is not None:
        entry, before = aligned(entry, before)
    kinds = _kinds(entry, types)
    labels, title, other = _scales(entry, metric, scale)
    ax = _axes(ax)
    at, wide = np.arange(len(labels)), 0.84 / max(len(kinds), 1)
    for k, kind in enumerate(kinds):
        place = at + (k - (len(kinds) - 1) / 2) * wide
        grey, hatch = _GREYS[k % 6], _HATCHES[k % 6]
        ax.bar(place, entry["counts"][kind], wide, label=cut(kind), color=grey, hatch=hatch, edgecolor="black", lw=0.5)
        ticks = None if before is None else np.array(before["counts"].get(kind, [0] * len(labels)), float)
        if ticks is not None:
            said = "baseline" if k == 0 else "_"  # told once
            ticks[ticks == 0] = np.nan
            ax.hlines(ticks, place - wide / 2, place + wide / 2, colors="black", lw=2.2, label=said)
    most = max(*totals(entry), *(totals(before) if before is not None else ()), 1)
    ax.set_yscale("log")
    ax.set_ylim(0.5, 2.0 * most)
    _label_bins(ax, at, labels, title)
    if other is not None:
        _label_bins(ax.secondary_xaxis("top"), at, *other)
    ax.set_ylabel(_counted(kinds))
    ax.set_title(_title(metric), pad=12)
    if len(kinds) > 1 or before is not None:
        ax.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def cumulative(source: Source, metric: str, ax: Axes | None = None, *, types: Sequence[str] | None = None) -> Axes:
    """The share of cells (faces, points) with a value of at most x, by type: of an audit exact, of a document by bins.

    Ratios and sizes that span more than a decade have a logarithmic axis. Undefined values are left out and
    told in the legend. UsageError for a metric or type that is not there.
    """
    entry = _entry(source, metric)
    kinds = _kinds(entry, types)
    ax = _axes(ax)
    spans: list[float] = []
    for k, kind in enumerate(kinds):
        x, y, lost = _steps(source, entry, metric, kind)
        words = cut(kind) + (f" ({plural(lost, 'value')} undefined)" if lost else "")
        ax.step(x, y, where="post", color="black", ls=_LINES[k % 6], lw=1.3, label=words)
        spans += [float(v) for v in x[np.isfinite(x)]]
    without_end = metric not in METRICS or METRICS[metric].high == np.inf
    if without_end and spans and min(spans) > 0 and max(spans) > 10 * min(spans):
        ax.set_xscale("log")
    ax.set_ylim(0.0, 1.0)
    ax.grid(visible=True, color="0.85", lw=0.6)
    unit = _UNITS[METRICS[metric].unit] if metric in METRICS else ""
    ax.set_xlabel(_title(metric) + (f" [{unit}]" if unit else ""))
    ax.set_ylabel(f"share of {_counted(kinds)} with at most this value")
    if kinds:
        ax.legend(frameon=False)
    return ax


def distributions(source: Source, axes: Sequence[Axes] | None = None) -> tuple[Axes, Axes]:
    """The two distributions of the article, equi-angle skewness and aspect ratio, on Fluent's and ICEM CFD's scale."""
    if axes is None:
        axes = _pyplot().subplots(2, 1, figsize=(8, 8.4), layout="constrained")[1]
    if len(axes) != 2:
        raise UsageError(f"two distributions need two axes, got {len(axes)}")
    document = _document(source, SKEW, ASPECT)
    return histogram(document, SKEW, axes[0]), histogram(document, ASPECT, axes[1])


def zones_heat(source: Source, ax: Axes | None = None, *, metrics: Sequence[str] | None = None) -> Axes:
    """The worst value of every metric in every zone of cells; the darker, the worse.

    Metrics that end at 1 are as dark as their value is far from the good end; others from the best zone, white, to the
    worst. metrics: ids, all with a good end where None. At most 40 zones are shown, the first ones, which the title
    tells. UsageError where the mesh has no zones of cells.
    """
    document = _document(source)
    tables = document.get("zone_metrics", {})
    ids = [id_ for id_ in metrics or tables if tables.get(id_)]
    if metrics is None:
        ids = [id_ for id_ in ids if document["definitions"][id_]["best"] != "none"]
    if not ids:
        raise UsageError("no zone of cells with a value of any of these metrics")
    zones = list(dict.fromkeys(row["zone"] for id_ in ids for row in tables[id_]))
    shown = zones[:_MOST_ZONES]
    darkness, words = np.full((len(shown), len(ids)), np.nan), np.full((len(shown), len(ids)), "-", object)
    for j, id_ in enumerate(ids):
        found = {row["zone"]: row for row in tables[id_]}
        values = np.array([number(found[zone]["worst"]) if zone in found else np.nan for zone in shown])
        darkness[:, j] = _darkness(document["definitions"][id_], values)
        unit = document["definitions"][id_]["unit"]
        words[:, j] = [figure(found[zone]["worst"], unit) if zone in found else "-" for zone in shown]
    size = (2.6 + 0.85 * len(ids), 1.8 + 0.32 * len(shown))
    ax = _axes(ax, size=size)
    ax.imshow(np.nan_to_num(darkness), cmap="Greys", vmin=0.0, vmax=1.25, aspect="auto")
    for i, j in np.ndindex(*words.shape):
        dark = np.nan_to_num(darkness[i, j]) > 0.7
        ax.text(j, i, str(words[i, j]), ha="center", va="center", fontsize=8, color="white" if dark else "black")
    ax.set_xticks(range(len(ids)), [_plain(id_) for id_ in ids], rotation=40, ha="right", fontsize=8)
    ax.set_yticks(range(len(shown)), [_zone_name(document, zone) for zone in shown], fontsize=8)
    left = f"; {len(shown)} of {len(zones)} zones" if len(shown) < len(zones) else ""
    ax.set_title(f"Worst value by zone, the darker the worse{left}")
    return ax


def bad_cells(
    audit: Audit, metric: str, ax: Axes | None = None, *, worst: int | None = None, beyond: float | None = None,
    zone: str | None = None, view: str = "all", size: tuple[int, int] = (1200, 750), theme: Theme = LIGHT,
) -> Axes:  # fmt: skip
    """The mesh with its worst cells (faces, points) by a metric, coloured by their value, with a colour bar.

    worst, beyond, zone: which, as of `bad_entities.shown_of`.  view, size, theme: as of `raster.picture`.
    """
    shown = shown_of(audit, metric, worst=worst, beyond=beyond, zone=zone)
    best_end, worst_end = range_of(shown.values, high_is_worse=METRICS[metric].worst_is_high)
    tints = colours_of(shown, best_end, worst_end)
    image = picture(
        audit.mesh, shown.rows[::-1], tints[::-1], entity=shown.entity, size=size, view=view, theme=theme
    )  # the worst on top
    ax = _axes(ax, size=(size[0] / 120 + 1.2, size[1] / 120 + 0.6))
    ax.imshow(image, interpolation="lanczos")
    ax.set_axis_off()
    lost = f", {shown.undefined:,} without a value (violet)" if shown.undefined else ""
    ax.set_title(f"{len(shown.rows):,} of {plural(shown.of, shown.entity)} by {_title(metric)}{lost}", fontsize=10)
    if np.isfinite(best_end):
        _colour_bar(ax, metric, best_end, worst_end)
    return ax


def _colour_bar(ax: Axes, metric: str, best_end: float, worst_end: float) -> None:
    from matplotlib.cm import ScalarMappable  # noqa: PLC0415 - optional
    from matplotlib.colors import LinearSegmentedColormap, Normalize  # noqa: PLC0415

    ends = [tuple(c / 255 for c in colour) for colour in RAMP]
    low, high = min(best_end, worst_end), max(best_end, worst_end)
    ramp = LinearSegmentedColormap.from_list("badness", ends if best_end <= worst_end else ends[::-1])
    if low == high:  # one value, and the colour of the worst
        ramp, low, high = LinearSegmentedColormap.from_list("badness", [ends[1]] * 2), low - 0.5, high + 0.5
    bar = ax.figure.colorbar(ScalarMappable(Normalize(low, high), ramp), ax=ax, shrink=0.7, pad=0.02)
    unit = _UNITS[METRICS[metric].unit]
    bar.set_label(_title(metric) + (f" [{unit}]" if unit else ""))


def _pyplot() -> Any:
    try:
        from matplotlib import pyplot as plt  # noqa: PLC0415 - optional
    except ImportError:
        raise UsageError("figures need matplotlib: pip install 'meshwright[plot]'") from None
    return plt


def _axes(ax: Axes | None, size: tuple[float, float] = (8.0, 4.2)) -> Axes:
    return _pyplot().subplots(figsize=size, layout="constrained")[1] if ax is None else ax


def _document(source: Source, *metrics: str) -> Summary:
    """The document of a source; of an audit that of these metrics alone, all of them where none is named."""
    if not isinstance(source, Audit):
        return source
    chosen = tuple(id_ for id_ in metrics or source.chosen if id_ in source.measured.values)
    return summarise(replace(source, chosen=chosen, findings=()), sha256="", worst=0)


def _entry(source: Source, metric: str) -> dict[str, Any]:
    """The histogram of a metric; UsageError where there is none."""
    found = _document(source, metric).get("histograms", {})
    if metric not in found:
        known = ", ".join(printable(id_, 60) for id_ in list(found)[:12]) or "none"
        raise UsageError(f"no histogram of {printable(metric)}; there are those of {known}")
    entry: dict[str, Any] = found[metric]
    totals(entry)
    return entry


def _kinds(entry: dict[str, Any], types: Sequence[str] | None) -> list[str]:
    there = [kind for kind, row in entry["counts"].items() if any(row)]
    for kind in types or ():
        if kind not in entry["counts"]:
            raise UsageError(f"no type {printable(kind)} here; there are {', '.join(entry['counts']) or 'none'}")
    return there if types is None else list(types)


def _scales(
    entry: dict[str, Any], metric: str, scale: Scale | None
) -> tuple[list[str], str, tuple[list[str], str] | None]:
    """Labels and name of the lower axis, and of the upper one where there are two scales."""
    stored = (entry["labels"], entry["scales"][0])
    other = (entry["mirrored"], entry["scales"][1] or "") if entry["mirrored"] else None
    own = scale_of(METRICS[metric]) if metric in METRICS else ""
    if scale is not None and (not own or (scale != own and other is None)):
        raise UsageError(f"{printable(metric)} has no {printable(scale)} scale")
    if scale in (None, own) or other is None:
        return (*stored, other)
    return (*other, stored)


def _label_bins(axis: Any, at: Any, labels: list[str], title: str) -> None:
    turned = max(map(len, labels), default=0) * len(labels) > 90
    axis.set_xticks(at, [_plain(text) for text in labels])
    axis.tick_params(axis="x", labelsize=8, length=0)
    if turned:
        for label in axis.get_xticklabels():
            label.set(rotation=40, ha="left" if axis.xaxis.get_ticks_position() == "top" else "right")
    axis.set_xlabel(_plain(title))


def _plain(text: str) -> str:
    """Text that matplotlib does not take for formulas."""
    return cut(text, 40).replace("$", r"\$")


def _title(metric: str) -> str:
    return METRICS[metric].title if metric in METRICS else _plain(metric)


def _counted(kinds: list[str]) -> str:
    return {"face": "faces", "point": "points"}.get(kinds[0] if kinds else "", "cells")


def _steps(source: Source, entry: dict[str, Any], metric: str, kind: str) -> tuple[Any, Any, int]:
    """Places and shares of the steps, and how many values are undefined."""
    if isinstance(source, Audit):
        raw = source.measured.values[metric][kind]
        domain = source.measured.domain(metric, kind)
        values = clamp(METRICS[metric], raw if domain is None else raw[domain])
        known = np.sort(values[~np.isnan(values)])
        x, last = np.unique(known, return_index=True)
        n = max(len(known), 1)
        return (
            np.append(x[:1], x),
            np.append(0.0, np.append(last[1:], len(known))[: len(x)] / n),
            len(values) - len(known),
        )
    counts = np.array(entry["counts"][kind], float)
    edges = np.array([float(edge) for edge in entry["edges"]])
    keep = np.isfinite(edges)
    share = np.concatenate([[0.0], np.cumsum(counts)]) / max(counts.sum(), 1.0)
    lost = source["metrics"].get(metric, {}).get(kind, {}).get("undefined", 0)
    return edges[keep], share[keep], int(lost)


def _zone_name(document: Summary, zone: Any) -> str:
    """The name of a zone by its place among all zones, None for cells in no zone."""
    if zone is None:
        return name(None)
    zones = document["zones"]
    if not isinstance(zone, int) or not 0 <= zone < len(zones):
        raise UsageError(f"the document names a zone {printable(str(zone))} that it does not list")
    return _plain(name(zones[zone]["name"], 30))


def _darkness(definition: dict[str, Any], values: Any) -> Any:
    """0 for the good end, 1 for the bad one; nan where there is no value."""
    high_is_worse = definition["best"] == "low"
    known = np.isfinite(values)
    if definition["high"] == 1 and (definition["low"] == 0 or not high_is_worse):
        return np.clip(values if high_is_worse else 1.0 - values, 0.0, 1.0)
    found = np.full(len(values), np.nan)
    found[np.isinf(values)] = 1.0
    if known.any():
        low, high = values[known].min(), values[known].max()
        share = (values[known] - low) / (high - low) if high > low else np.zeros(int(known.sum()))
        found[known] = share if high_is_worse else 1.0 - share if high > low else share
    return found
