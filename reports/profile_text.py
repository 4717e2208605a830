"""Profiles as text and JSON, and which profiles limit a metric."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from meshwright.audit.gate.files import EXPORTS
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.loading import PROFILES, read_profile
from meshwright.audit.profiles.model import Limit, Profile
from meshwright.audit.profiles.quantities import QUANTITIES
from meshwright.reports.layout import Column, Grid, page_text
from meshwright.reports.limits import Sources, limit_text
from meshwright.reports.text_tables import section
from meshwright.reports.writing import page_width, wants_colour

__all__ = ["SCHEMA", "export_profile", "limits_on", "list_profiles", "show_profile"]

SCHEMA = "meshwright.profile/1"


def list_profiles(output: str) -> str:
    """A line per profile, or JSON with the same."""
    profiles = [read_profile(name) for name in PROFILES]
    if output == "json":
        rows = [
            {"name": p.name, "title": p.title, "discipline": p.discipline, "limits": len(p.limits),
             "verified": sum(limit.verified for limit in p.limits), "description": p.description}
            for p in profiles
        ]  # fmt: skip
        return json.dumps(rows, indent=2, ensure_ascii=False) + "\n"
    grid = Grid(
        (Column("profile"), Column("for"), Column("limits", "r"), Column("verified", "r"), Column("what")), indent=0
    )
    for p in profiles:
        verified = sum(limit.verified for limit in p.limits)
        grid.add(p.name, p.discipline or "both", str(len(p.limits)), str(verified), p.title)
    note = "\nverified: read in the source that the limit names. meshwright profiles show NAME tells more."
    return page_text((grid, Text(note, style="dim")), page_width(), colour=wants_colour())


def show_profile(name: str, output: str) -> str:
    """Everything about one profile; UsageError for an unknown one."""
    profile = read_profile(name)
    if output == "json":
        document = {"schema": SCHEMA, **asdict(profile)}
        for key in ("file", "notes", "unmeasurable", "waivers", "presets", "baseline"):
            del document[key]  # of files of limits alone
        for limit in document["limits"]:
            for key in ("where", "each", "no_worse", "on_missing", "on_no_match", "own", "severity", "scale", "side"):
                del limit[key]  # of gate files alone
        return json.dumps(document, indent=2, ensure_ascii=False) + "\n"
    return page_text(_page(profile), page_width(), colour=wants_colour())


def _page(profile: Profile) -> Iterator[RenderableType]:
    yield Text(profile.name, style="bold").append(f"  {profile.title}", style="not bold")
    yield Text(f"\n{profile.description}")
    for scale in profile.scales:
        yield Text(f"· {scale}")
    words = profile.dialect
    yield Text(f"· It says {words.zone} for a zone of cells and {words.boundary} for one of faces. {words.note}")
    sources = Sources()
    if profile.limits:
        yield section("Limits", "a value that equals its limit passes, but for < and >")
        yield _limits(profile, sources)
        yield from _small(f"{n}  {source}{'' if verified else ' (unverified)'}" for n, source, verified in sources)
        notes = [f"{limit.id}: {limit.note}" for limit in profile.limits if limit.note]
        if notes:
            yield section("Notes")
            yield from _small(notes)
    if profile.default_metrics:
        yield section("Quality measure by type of cell")
        grid = Grid((Column(), Column()))
        for kind, ids in profile.default_metrics.items():
            grid.add(kind, ids[0] if len(ids) == 1 else f"the worst of {', '.join(ids)}")
        yield grid
    if profile.measures:
        yield section("Reported without a limit")
        grid = Grid((Column("quantity"), Column("metric"), Column("note", cut=True)))
        for measure in profile.measures:
            grid.add(measure.name, ", ".join(measure.metrics), measure.note)
        yield grid
    if profile.left_out:
        yield section("Left out")
        for left in profile.left_out:
            source = f" ({left.source})" if left.source else ""
            yield from _small([f"{left.what}: {left.reason}{source}"])


def _small(lines: Any) -> Iterator[RenderableType]:
    for line in lines:
        yield Padding(Text(line, style="dim"), (0, 0, 0, 2))


def _limits(profile: Profile, sources: Sources) -> Grid:
    columns = (Column("id", cut=True), Column("metric", cut=True), Column("on"), Column("no warning"))
    grid = Grid((*columns, Column("no failure"), Column("source")), gap=1)
    for limit in profile.limits:
        warn, fail = limit_text(limit, _best(limit))
        on = " ".join(limit.types) or limit.faces or "all"
        on += {1: ", 1st order", 2: ", 2nd order"}.get(limit.order, "")
        grid.add(limit.id, limit.subject, on, warn, fail, sources.cite(limit.source, limit.verified))
    return grid


def _best(limit: Limit) -> str:
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    if metric is not None:
        return metric.best
    return "high" if limit.stat == "min" else "low"


def export_profile(name: str, kind: str) -> tuple[str, list[str]]:
    """The text of a profile as another program's file, and what is lost in it."""
    return EXPORTS[kind](read_profile(name))


def limits_on(id_: str) -> list[str]:
    """A line for each limit on a metric or a check: who sets it, on what, from which value on, and where it stands."""
    lines = []
    for name in PROFILES:
        for limit in read_profile(name).limits:
            if id_ not in (limit.metric, limit.finding):
                continue
            warn, fail = limit_text(limit, _best(limit))
            levels = [f"{word} unless {text}" for word, text in (("warns", warn), ("fails", fail)) if text]
            on = f" on {' '.join(limit.types) or f'{limit.faces} faces'}" if limit.types or limit.faces else ""
            mark = "" if limit.verified else ", unverified"
            lines.append(f"{name}: {limit.name}{on} {', '.join(levels)} ({limit.source}{mark})")
    return lines
