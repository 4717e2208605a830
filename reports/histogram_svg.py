"""A histogram of a document as an inline SVG: log counts, both scales under each bar, ticks of a baseline.

Colours are CSS variables of the page around it, so that it follows its theme; a file of its own brings them along.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Any

from meshwright.reports.wording import size

__all__ = ["Mark", "bar_class", "histogram_svg"]

Mark = tuple[float, str]
"""A value to mark, and what it is: (0.95, "fail")."""

_LEFT, _RIGHT, _TOP = 54, 8, 18
_LINE = 12
_STYLE = (
    "<style>svg{font:11px system-ui,sans-serif;background:#fff}"
    ".b0{fill:#3d6ea5}.b1{fill:#d98e04}.b2{fill:#c0392b}"
    ".t1{fill-opacity:.78}.t2{fill-opacity:.58}.t3{fill-opacity:.42}.g{stroke:#d9dee3}.l{fill:#1c2733}"
    ".m{fill:#5b6b7b}.k{stroke:#1c2733;stroke-width:2}.w{stroke:#7b3fa0;stroke-dasharray:4 3}</style>"
)


def bar_class(bar: int, edges: Sequence[float], best: str, marks: Sequence[Mark] = ()) -> int:
    """0, 1 or 2: how bad the values of a bar are, by the limits that are marked, else by its place from 0 to 1.

    A bar is as bad as its better end at the least; without limits and without such a scale every bar is 0.
    """
    low, high = edges[bar], edges[bar + 1]
    if best == "none":
        return 0
    found = 0
    for value, kind in marks:
        beyond = low >= value if best == "low" else high <= value
        found = max(found, {"warn": 1, "fail": 2}.get(kind, 0) if beyond else 0)
    if marks:
        return found
    if (edges[0] in (0.0, -1.0)) and edges[-1] == 1.0:
        bad = low if best == "low" else 1 - high
        return 2 if bad >= 0.9 - 1e-9 else 1 if bad >= 0.8 - 1e-9 else 0
    return 0


def histogram_svg(
    histogram: dict[str, Any],
    *,
    title: str,
    best: str = "low",
    baseline: dict[str, Any] | None = None,
    marks: Sequence[Mark] = (),
    width: int = 640,
    height: int = 260,
    alone: bool = False,
) -> str:
    """The SVG of an entry of `document["histograms"]`; its types are stacked.

    baseline: another entry with the same bins; ValueError for others.  marks: values to draw a line at.
    alone: with its own colours and name space, for a file.
    """
    labels, counts = histogram["labels"], histogram["counts"]
    edges = [float(edge) for edge in histogram["edges"]]
    n = len(labels)
    totals = [sum(column) for column in zip(*counts.values(), strict=True)] or [0] * n
    before = None
    if baseline is not None:
        if [float(edge) for edge in baseline["edges"]] != edges:
            raise ValueError("the histogram of a baseline needs the same bins")
        before = [sum(column) for column in zip(*baseline["counts"].values(), strict=True)] or [0] * n
    lines = 2 if histogram["mirrored"] else 1
    turned = n > 11
    bottom = (46 if turned else 8 + _LINE * lines) + 16
    plot, inner = height - _TOP - bottom, width - _LEFT - _RIGHT
    decades = max(1, math.ceil(math.log10(max(*totals, *(before or [0]), 1)) + 1e-9))
    step = inner / n

    def y(count: float) -> float:
        """Half a decade below 1 leaves room for bars of one."""
        return _TOP + plot * (1 - (math.log10(count) + 0.3) / (decades + 0.3)) if count > 0 else _TOP + plot

    parts = [
        f'<svg class="histogram" viewBox="0 0 {width} {height}" role="group" aria-label="{escape(title, quote=True)}"'
    ]
    parts.append(' xmlns="http://www.w3.org/2000/svg">' + _STYLE if alone else ">")
    for power in range(decades + 1):
        at = y(10**power)
        parts.append(f'<path class="g" d="M{_LEFT} {at:.1f}H{width - _RIGHT}"/>')
        parts.append(f'<text class="m" x="{_LEFT - 5}" y="{at + 4:.1f}" text-anchor="end">{_short(10**power)}</text>')
    for k in range(n):
        x, wide = _LEFT + k * step + step * 0.07, step * 0.86
        parts.append(_bar(k, histogram, totals[k], bar_class(k, edges, best, marks), x, wide, y, _TOP + plot))
        if before is not None and before[k]:
            parts.append(f'<path class="k" d="M{x - 1:.1f} {y(before[k]):.1f}h{wide + 2:.1f}"/>')
    for value, kind in marks:
        place = _place(value, edges)
        if place is not None:
            x = _LEFT + place * step
            parts.append(f'<path class="w" d="M{x:.1f} {_TOP - 4}V{_TOP + plot}"/>')
            parts.append(
                f'<text class="m" x="{x:.1f}" y="{_TOP - 7}" text-anchor="middle">{escape(kind)} {value:g}</text>'
            )
    parts.append(_axis(histogram, step, _TOP + plot, turned=turned))
    scales = [s for s in histogram["scales"] if s]
    parts.append(
        f'<text class="m" x="{width - _RIGHT}" y="{height - 3}" text-anchor="end">{escape(" | ".join(scales))}</text>'
    )
    parts.append("</svg>")
    return "".join(parts)


def _bar(k: int, histogram: dict[str, Any], total: int, bad: int, x: float, wide: float, y: Any, floor: float) -> str:
    """The rectangles of one bin; the height of the stack is that of its total, its parts share it by their counts."""
    label, mirrored = histogram["labels"][k], histogram["mirrored"]
    said = f"{label}{f' | {mirrored[k]}' if mirrored else ''}: {size(total)}"
    if len(histogram["counts"]) > 1:
        said += "".join(f", {size(c[k])} {kind}" for kind, c in histogram["counts"].items() if c[k])
    head = f'<g class="bar" data-bar="{k}" aria-label="{escape(said, quote=True)}"><title>{escape(said)}</title>'
    if not total:
        return ""
    top = y(total)
    rects, at = [], floor
    for i, found in enumerate(histogram["counts"].values()):
        tall = (floor - top) * found[k] / total
        if tall > 0:
            at -= tall
            shade = f" t{min(i, 3)}" if i else ""
            place = f'x="{x:.1f}" y="{at:.1f}" width="{wide:.1f}" height="{tall:.1f}"'
            rects.append(f'<rect class="b{bad}{shade}" {place}/>')
    return head + "".join(rects) + "</g>"


def _axis(histogram: dict[str, Any], step: float, floor: float, *, turned: bool) -> str:
    parts = []
    rows = [histogram["labels"]] + ([histogram["mirrored"]] if histogram["mirrored"] else [])
    for k in range(len(rows[0])):
        x = _LEFT + (k + 0.5) * step
        if turned:
            at = f'x="{x + 3:.1f}" y="{floor + 8:.1f}" transform="rotate(-40 {x + 3:.1f} {floor + 8:.1f})"'
            parts.append(f'<text class="l" {at} text-anchor="end">{escape(rows[0][k])}</text>')
            continue
        for line, (row, kind) in enumerate(zip(rows, ("l", "m"), strict=False)):
            at = f'x="{x:.1f}" y="{floor + 13 + _LINE * line:.1f}"'
            parts.append(f'<text class="{kind}" {at} text-anchor="middle">{escape(row[k])}</text>')
    return "".join(parts)


def _place(value: float, edges: list[float]) -> float | None:
    """How many bins lie left of a value, None where it lies outside."""
    for k in range(len(edges) - 1):
        low, high = edges[k], edges[k + 1]
        if low <= value <= high:
            if not (math.isfinite(low) and math.isfinite(high)):
                return float(k) if value == low else k + 0.5
            return k + (value - low) / (high - low)
    return None


def _short(count: int) -> str:
    """1, 10, 100, 1k, 10k, 1M."""
    for power, letter in ((9, "G"), (6, "M"), (3, "k")):
        if count >= 10**power:
            return f"{count // 10**power}{letter}"
    return str(count)
