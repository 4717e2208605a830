"""`histogram_svg`: a histogram of the document as a small inline SVG that can be pressed bar by bar, or as a file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Literal, NamedTuple

from markupsafe import escape

from meshwright.audit.errors import UsageError, printable
from meshwright.reports.histogram_layout import Labels, Layout, labels_for, lanes_for, short
from meshwright.reports.wording import number, plural

__all__ = ["HISTOGRAM_STYLE", "Mark", "histogram_svg", "totals"]

Histogram = dict[str, Any]
"""An entry of the document's "histograms"."""

HISTOGRAM_STYLE = (
    ".histogram{font-family:system-ui,sans-serif}.histogram text{fill:var(--ink,#1c2733)}"
    ".histogram .axis{stroke:var(--line,#cfd6dc);fill:none}.histogram .bar-plain{fill:var(--bp,#5b7083)}"
    ".histogram .bar-ok{fill:var(--b0,#3d6ea5)}.histogram .bar-warn{fill:var(--b1,#d98e04)}"
    ".histogram .bar-bad{fill:var(--b2,#c0392b)}.histogram .bar path{stroke:var(--card,#fff);stroke-width:.6}"
    ".histogram .hit{fill:transparent;stroke:none!important}.histogram .back{fill:var(--card,#fff)}"
    ".histogram .t1{fill-opacity:.66}.histogram .t2{fill-opacity:.42}.histogram .t3{fill-opacity:.84}"
    ".histogram .t4{fill-opacity:.54}.histogram .t5{fill-opacity:.3}"
    ".histogram .tick{stroke:var(--ink,#000);stroke-width:2.4;fill:none}"
    ".histogram .mark{stroke:var(--ink,#1c2733);stroke-width:1.2;stroke-dasharray:4 3;fill:none}"
    ".histogram .bar:focus-visible{outline:none}.histogram .bar:hover .hit{stroke:var(--line,#cfd6dc)!important}"
    ".histogram .bar:focus-visible .hit,.histogram .bar[aria-pressed=true] .hit"
    "{stroke:var(--ink,#000)!important;stroke-width:1.8}"
)
"""The style sheet of all histograms of a page, which sets the variables --ink, --line, --card and, for bars that are
good, suspect, bad or neither, --b0, --b1, --b2 and --bp; without them it is one for light paper."""

_BASE = 0.35
"""Decades below 1 at which the count axis begins, so that a single cell has a bar."""

_ROUND = 1e-9
_SHADES = 6
_NARROW = 480
_NAMES = 120
_LONGEST_LABEL = 24


class Mark(NamedTuple):
    """A limit to draw into a histogram.

    value: on the stored scale.  level: what lies beyond it.  label: a few words for people, "" for level and value.
    bad: the side on which the bad values lie, "" for the bad end of the scale.
    """

    value: float
    level: Literal["warn", "fail"]
    label: str = ""
    bad: Literal["", "above", "below"] = ""


def histogram_svg(
    histogram: Histogram,
    *,
    title: str,
    baseline: Histogram | None = None,
    marks: Sequence[Mark | tuple[float, Any]] = (),
    best: str = "none",
    width: int = 640,
    height: int = 300,
    alone: bool = False,
) -> str:
    """A picture of one entry of the document's "histograms", one bar a bin.

    Every bin with anything in it is a `<g class="bar" data-bar="k" tabindex="0" role="button">` whose `<title>` tells
    the counts; both scales stand under each. The height of a bar is the logarithm of its count; in it the cell types
    share that height as they share the count, in shades (`t0` to `t5`, explained above the bars).

    title: what is counted, for people and screen readers; it is drawn in a alone picture alone.  baseline: an
    entry over the same bins (see `histograms.aligned`), drawn as one tick a bar; UsageError for other bins.
    marks: limits. A bar beyond one is `bar-bad` or `bar-warn`, one that a limit for failures cuts `bar-warn`.
    best: of the metric's definition, "low" or "high". Without marks, bars of a scale that ends at 1 are `bar-bad` where
    they lie 0.9 or more from its good end and `bar-warn` from 0.8 on; bars of other scales are `bar-plain`.
    width, height: of the view box; text is 11 units high, 10 below a width of 480. A phone wants about 360.
    alone: a file of its own, with name space, style and light paper; without, a page adds `HISTOGRAM_STYLE`.
    UsageError for an entry that is none.
    """
    counts = totals(histogram)
    before = None if baseline is None else totals(baseline)
    if baseline is not None and baseline["edges"] != histogram["edges"]:
        raise UsageError("the histogram of the baseline has other bins; `histograms.aligned` brings two together")
    limits = [_told(Mark(*mark), best) for mark in marks]
    kinds = [key for key, row in histogram["counts"].items() if any(row)]
    size = 10 if width < _NARROW else 11
    labels = labels_for([[cut(text) for text in row] for row in _rows(histogram)], width, size)
    legend = kinds if len(kinds) > 1 else []
    lanes = lanes_for([_position(histogram, mark.value) for mark in limits])
    top = size + 4 + (size + 6) * bool(legend) + (size + 2) * (max(lanes, default=-1) + 1)
    top += (size + 9) * alone
    layout = Layout.fitting(width, height, size, top, labels, max((*counts, *(before or ()), 1)), _BASE)
    parts = [_opening(title, layout, alone), _axis(layout)]
    parts += [_title(title, layout)] if alone else []
    parts += [_legend(legend, layout, alone)] if legend else []
    classes = _classes(histogram, limits, best)
    for k, n in enumerate(counts):
        if n:
            parts.append(_bar(histogram, k, kinds, classes[k], layout, before))
    parts.append(_labels(histogram, labels, layout))
    parts += [_ticks(before, layout)] if before is not None and any(before) else []
    for mark, lane in zip(limits, lanes, strict=True):
        parts.append(_mark(mark, lane, _position(histogram, mark.value), layout))
    return "".join(parts) + "</svg>\n"


def _told(mark: Mark, best: str) -> Mark:
    """The mark with its words and its bad side."""
    return mark._replace(
        label=cut(mark.label, 40) if mark.label else f"{mark.level} {mark.value:g}",
        bad=mark.bad or ("below" if best == "high" else "above"),
    )


def totals(histogram: Histogram) -> list[int]:
    """(n bins,) counts of all types together; UsageError where the entry contradicts itself."""
    edges, labels, rows = (histogram.get(key) for key in ("edges", "labels", "counts"))
    if (
        isinstance(edges, list)
        and isinstance(labels, list)
        and isinstance(rows, dict)
        and len(labels) == len(edges) - 1 > 0
        and all(len(row) == len(labels) for row in rows.values())
    ):
        other = histogram.get("mirrored")
        if (other is None or len(other) == len(labels)) and all(
            isinstance(n, int) and n >= 0 for row in rows.values() for n in row
        ):
            return [sum(column) for column in zip(*rows.values(), strict=True)] if rows else [0] * len(labels)
    raise UsageError("a histogram needs n + 1 edges, n labels and n counts of every type")


def cut(text: str, longest: int = _LONGEST_LABEL) -> str:
    """A text of the document as one short line."""
    return printable(str(text), longest)


def _f(x: float) -> str:
    return f"{x:.1f}".removesuffix(".0")


def _rows(histogram: Histogram) -> list[list[str]]:
    return [histogram["labels"], *([histogram["mirrored"]] if histogram["mirrored"] else [])]


def _opening(title: str, layout: Layout, alone: bool) -> str:
    name = escape(cut(title, _NAMES))
    box = f'viewBox="0 0 {layout.width} {layout.height}" font-size="{layout.size}" text-anchor="middle"'
    if not alone:
        return f'<svg class="histogram" {box} role="group" aria-label="{name}">'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="histogram" width="{layout.width}" height="{layout.height}" '
        f'{box} role="group" aria-label="{name}"><style>{HISTOGRAM_STYLE}</style>'
        f'<rect width="{layout.width}" height="{layout.height}" fill="#fff"/>'
    )


def _title(title: str, layout: Layout) -> str:
    fits = int(layout.width / (0.6 * (layout.size + 2)))
    text = escape(cut(title, min(_NAMES, fits)))
    font = f'font-size="{layout.size + 2}" font-weight="600"'
    return f'<text class="label" text-anchor="start" x="8" y="{layout.size + 7}" {font}>{text}</text>'


def _axis(layout: Layout) -> str:
    """The lines of the decades and what they stand for."""
    left, right = layout.left, layout.right
    lines = f"M{_f(left)} {_f(layout.floor)}H{_f(right)}"
    texts = []
    for decade in layout.decades:
        y = layout.y(10**decade)
        lines += f"M{_f(left)} {_f(y)}H{_f(right)}"
        texts.append(f'<text x="{left - 5:.0f}" y="{y + 0.35 * layout.size:.0f}">{short(10**decade)}</text>')
    return f'<path class="axis" d="{lines}"/><g class="label" text-anchor="end">{"".join(texts)}</g>'


def _legend(kinds: list[str], layout: Layout, alone: bool) -> str:
    """The shades of the types, as many as fit on a line; all of them stand in the titles of the bars."""
    y = layout.size + 4 + (layout.size + 9) * alone
    x, parts = layout.left, []
    for t, kind in enumerate(kinds):
        room = 1.4 * layout.size + 0.62 * layout.size * len(kind)
        if x + room > layout.right:
            parts.append(f'<text x="{x:.0f}" y="{y}">…</text>')
            break
        square = f'<path class="t{t % _SHADES}" d="M{x:.0f} {y}v-8h8v8"/>'
        parts.append(f'{square}<text x="{x + 11:.0f}" y="{y}">{escape(cut(kind))}</text>')
        x += room + 6
    return f'<g class="legend label bar-plain" text-anchor="start">{"".join(parts)}</g>'


def _bar(histogram: Histogram, k: int, kinds: list[str], badness: str, layout: Layout, before: list[int] | None) -> str:
    """One bar: a place to press over its whole column, a piece for each type, its count above it."""
    found = {kind: histogram["counts"][kind][k] for kind in kinds if histogram["counts"][kind][k]}
    total = sum(found.values())
    noun = next((key for key in ("face", "point") if list(found) == [key]), "cell")
    name = f"{cut(histogram['labels'][k])}: {plural(total, noun)}"
    facts = [f"{cut(kind)} {n:,}" for kind, n in found.items()] if len(kinds) > 1 else []
    if histogram["mirrored"]:
        facts.append(f"{cut(str(histogram['scales'][1] or 'other scale'))}: {cut(histogram['mirrored'][k])}")
    facts += [f"baseline {before[k]:,}"] if before is not None else []
    title = f"<title>{escape('; '.join([name, *facts]))}</title>"
    x, w = layout.x(k), layout.step
    left, right = round(x + 0.07 * w), round(x + 0.93 * w)
    y, pieces, done = layout.floor, [], 0
    tall = layout.floor - layout.y(total)
    if list(found) != kinds[:1]:  # shades let the lines of the axis through
        pieces.append(f'<path class="back" d="M{left} {_f(y)}V{_f(y - tall)}H{right}V{_f(y)}"/>')
    for kind, n in found.items():
        done += n
        above = layout.floor - tall * done / total
        if y - above >= 0.05 or done == total:
            shade = kinds.index(kind) % _SHADES
            pieces.append(f'<path class="t{shade}" d="M{left} {_f(y)}V{_f(above)}H{right}V{_f(y)}"/>')
            y = above
    text = short(total)
    if 0.6 * layout.size * len(text) <= w:
        pieces.append(f'<text x="{x + w / 2:.0f}" y="{layout.y(total) - 3:.0f}">{text}</text>')
    hit = f'<path class="hit" d="M{x:.0f} {layout.top - layout.size:.0f}H{x + w:.0f}V{layout.floor:.0f}H{x:.0f}"/>'
    return (
        f'<g class="bar {badness}" data-bar="{k}" tabindex="0" role="button" aria-label="{escape(name)}">'
        f"{title}{hit}{''.join(pieces)}</g>"
    )


def _labels(histogram: Histogram, labels: Labels, layout: Layout) -> str:
    """The rows of labels under the bars, each with the name of its scale."""
    parts, y = [], layout.floor
    scales = [cut(str(scale), 60) for scale in histogram["scales"] if scale]
    for r, row in enumerate(labels.rows):
        texts = []
        at = y + (layout.size + 2 if not labels.turned else 0.75 * layout.size)
        for k in range(0, len(row), labels.every):
            x = layout.x(k) + layout.step / 2
            if labels.turned:
                x += 0.3 * layout.size
                texts.append(f'<text transform="translate({x:.0f} {at:.0f})rotate(-45)">{escape(row[k])}</text>')
            else:
                texts.append(f'<text x="{x:.0f}" y="{at:.0f}">{escape(row[k])}</text>')
        y += labels.depths[r]
        parts.append(f'<g text-anchor="end">{"".join(texts)}</g>' if labels.turned else "".join(texts))
        if r < len(scales):
            parts.append(
                f'<text font-style="italic" x="{(layout.left + layout.right) / 2:.0f}" y="{y + layout.size:.0f}">'
                f"{escape(scales[r])}</text>"
            )
        y += layout.size + 4
    return f'<g class="label">{"".join(parts)}</g>'


def _ticks(before: list[int], layout: Layout) -> str:
    d = "".join(f"M{_f(layout.x(k))} {layout.y(n):.1f}h{_f(layout.step)}" for k, n in enumerate(before) if n)
    return f'<path class="tick" d="{d}"><title>baseline</title></path>'


def _mark(mark: Mark, lane: int, position: float, layout: Layout) -> str:
    """A line over all bars at a limit, and what it is."""
    x = layout.left + position * layout.step
    y = layout.top - layout.size - 4 - lane * (layout.size + 2)
    right = x > (layout.left + layout.right) / 2
    anchor = "end" if right else "start"
    text = escape(mark.label)
    return (
        f'<path class="mark mark-{mark.level}" d="M{_f(x)} {_f(y - layout.size + 2)}V{_f(layout.floor)}"/>'
        f'<text class="label" text-anchor="{anchor}" x="{_f(x + (-4 if right else 4))}" y="{_f(y)}">{text}</text>'
    )


def _position(histogram: Histogram, value: float) -> float:
    """Where a value lies, in bins from the left end: linear inside a bin, in the middle of one without end."""
    edges = [number(edge) for edge in histogram["edges"]]
    if not edges[0] <= value <= edges[-1]:
        return 0.0 if value < edges[0] else float(len(edges) - 1)
    k = min(max(sum(edge <= value for edge in edges) - 1, 0), len(edges) - 2)
    low, high = edges[k], edges[k + 1]
    if not math.isfinite(high - low):
        return k + (0.0 if value == low else 0.5 if math.isfinite(value) else float(value == high))
    return k + (value - low) / (high - low)


def _classes(histogram: Histogram, marks: Sequence[Mark], best: str) -> list[str]:
    """How bad each bin is."""
    edges = [number(edge) for edge in histogram["edges"]]
    n = len(edges) - 1
    if not marks:
        if best not in ("low", "high") or edges[0] not in (0.0, -1.0) or edges[-1] != 1.0:
            return ["bar-plain"] * n
        away = [low if best == "low" else 1 - high for low, high in pairwise(edges)]
        return ["bar-bad" if d > 0.9 - _ROUND else "bar-warn" if d > 0.8 - _ROUND else "bar-ok" for d in away]
    found = []
    for low, high in pairwise(edges):
        worst = 0
        for mark in marks:
            above = mark.bad == "above"
            whole = low >= mark.value if above else high <= mark.value
            some = high > mark.value if above else low < mark.value
            worst = max(worst, 2 if whole and mark.level == "fail" else 1 if some else 0)
        found.append(("bar-ok", "bar-warn", "bar-bad")[worst])
    return found
