"""The receipt of a repair on a page of text: what was done, before and after, what is left."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import Any

import click

from meshwright.audit.errors import printable
from meshwright.audit.metrics import METRICS
from meshwright.audit.summary import Summary

__all__ = ["METRICS_SHOWN", "render_text"]

METRICS_SHOWN = (
    "verdict.scaled_jacobian", "gambit.equiangle_skew", "dihedral.min", "dihedral.max", "angle.min", "angle.max",
)  # fmt: skip
"""Metrics of the table; each is shown for the types that it is defined for, angles of faces for surfaces alone."""

_SOLID = ("tet", "pyramid", "wedge", "hex")


def render_text(
    path: str, target: str | None, document: dict[str, Any], first: Summary, last: Summary, *, width: int, colour: bool
) -> str:
    """The page, ended by a newline."""

    def bold(text: str) -> str:
        return click.style(text, bold=True) if colour else text

    def red(text: str) -> str:
        return click.style(text, fg="red") if colour else text

    out = [bold(f"Repair of {printable(path, 80)}") + ("" if target else "  (dry run: nothing was written)"), ""]
    kept = [s for s in document["steps"] if s["state"] == "kept"]
    back = [s for s in document["steps"] if s["state"] == "rolled back"]
    room = max(20, min(max((len(s["note"]) for s in kept), default=0), width - 61))
    if kept:
        out.append(f"  {'pass':<16}{'changed':>8}  {'what':<{room}}  {'worst quality':>15}  {'bad cells':>13}")
        for step in kept:
            before, after = step["worst_quality"]
            bad = step["inverted_or_degenerate"]
            note, *more = textwrap.wrap(step["note"], room) or [""]
            out.append(
                f"  {step['pass']:<16}{step['changed']:>8,}  {note:<{room}}  {f'{before:.3f} > {after:.3f}':>15}"
                f"  {f'{bad[0]:,} > {bad[1]:,}':>13}"
            )
            out += [f"{'':<28}{line}" for line in more]
    else:
        out.append("  Nothing to do: no pass found a change that is worth one.")
    out += ["", bold("  before and after") + "                                 worst                      mean"]
    for id_ in METRICS_SHOWN:
        a, b = first["metrics"].get(id_, {}), last["metrics"].get(id_, {})
        for kind in a:
            if kind in b and not (id_.startswith("angle") and kind in _SOLID):
                end = "max" if METRICS[id_].worst_is_high else "min"
                out.append(
                    f"  {METRICS[id_].title[:30]:<31}{kind:<8}{_figure(a[kind][end]):>10} > {_figure(b[kind][end]):<10}"
                    f"{_figure(a[kind]['mean']):>12} > {_figure(b[kind]['mean'])}"
                )
    shape = document["before"], document["after"]
    out += [
        "",
        f"  cells {_cells(shape[0])} > {_cells(shape[1])}, points {shape[0]['points']:,} > {shape[1]['points']:,}",
    ]
    names = [[zone["name"] for zone in side["zones"]] for side in shape]
    zones = "all zones kept" if names[0] == names[1] else "ZONES LOST: " + ", ".join(sorted({*names[0]} - {*names[1]}))
    moved = f"{document['moved_points']:,} points moved, by {document['max_deviation']:.3g} at most"
    along = document["boundary"]
    if along:
        out.append(
            f"  {moved}; {along['moved']:,} of them on the boundary, volume {along['volume']:+.2g}; "
            f"{printable(zones, width)}"
        )
    else:
        out.append(f"  {moved}, none of a boundary or a border between zones; {printable(zones, width)}")
    apart = document["surface"]
    if apart:
        side = "there" if apart["there"] >= apart["back"] else "back"
        x, y, z = apart[f"{side}_at"]
        out.append(
            f"  the surface is {apart['hausdorff']:.3g} from what it was at most (Hausdorff distance), "
            f"at ({x:.5g}, {y:.5g}, {z:.5g})"
        )
    left = document["after"]["inverted_or_degenerate"]
    if left:
        out.append(red(f"  {left:,} inverted or degenerate cells are left"))
    if document["target"]:
        out += _target(document["target"], width, bold)
    if document["refused"]:
        out += ["", bold("  not done")] + [f"  - {printable(text, width)}" for text in document["refused"]]
    elif back:
        out.append("  A further attempt of each pass gained nothing and was rolled back: the result is settled.")
    if document["limits"]:
        out += ["", bold("  limits")] + [f"  - {printable(text, 2 * width)}" for text in document["limits"]]
    if document["notes"]:
        out += ["", bold("  not in the output")] + [f"  - {printable(text, width)}" for text in document["notes"][:20]]
    if target:
        out += ["", f"  written: {printable(target, 200)}"]
    return "\n".join(out) + "\n"


def _target(target: dict[str, Any], width: int, bold: Callable[[str], str]) -> list[str]:
    """What the profile said before and after, what it called for, and what is left."""
    before, after = target["verdict"]
    out = ["", bold(f"  target {printable(target['profile'], 60)}: {before} > {after}")]
    for step in target["plan"]:
        first, *more = step["because"]
        others = f" and {len(more)} more reasons" if len(more) > 1 else " and 1 more reason" if more else ""
        out.append(f"  - {step['pass']}, for {printable(first, width)}{others}")
    if not target["plan"]:
        out.append("  - no pass was called for: " + ("the mesh keeps it" if after == "pass" else "none can mend it"))
    if target["left"]:
        out += ["", bold("  left")] + [f"  - {printable(left['words'], 3 * width)}" for left in target["left"]]
    return out


def _figure(value: Any) -> str:
    return value if isinstance(value, str) else "-" if value is None else f"{value:.4g}"


def _cells(mesh: dict[str, Any]) -> str:
    return " + ".join(f"{count:,} {kind}" for kind, count in mesh["cells"].items())
