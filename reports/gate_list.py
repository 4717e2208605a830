"""What a gate file comes to, on a page; its schema; and one to begin with."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import click
from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.gate.files import read_gate_file
from meshwright.audit.gate.loading import gate_schema
from meshwright.audit.gate.problems import GateError
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.loading import load
from meshwright.audit.profiles.model import Limit, Profile
from meshwright.audit.profiles.quantities import QUANTITIES
from meshwright.reports.layout import Column, Grid, page_text
from meshwright.reports.limits import Sources, limit_text, no_worse_text
from meshwright.reports.text_tables import section
from meshwright.reports.verdicts import EXIT_USAGE
from meshwright.reports.wording import name, plural
from meshwright.reports.writing import deliver, page_width, wants_colour

__all__ = ["check_gate", "schema_text", "write_starter"]


def check_gate(file: str) -> int:
    """Print the rules of a gate file, or every mistake in it on stderr; 0 or 2."""
    try:
        profile = read_gate_file(file)
    except GateError as error:
        for problem in error.problems:
            click.echo(f"meshwright: {problem}", err=True)
        return EXIT_USAGE
    deliver(page_text(_page(profile), page_width(), colour=wants_colour()), None)
    for lost in profile.unmeasurable:
        click.echo(f"meshwright: {lost.reason}", err=True)
    return EXIT_USAGE if profile.unmeasurable else 0


def schema_text() -> str:
    """The JSON Schema of gate files."""
    return json.dumps(gate_schema(), indent=2, ensure_ascii=False) + "\n"


def _page(profile: Profile) -> Iterator[RenderableType]:
    yield Text(name(profile.file or profile.name, 80), style="bold").append(f"  {name(profile.title, 80)}", "not bold")
    for preset in profile.presets:
        yield Text(f"· extends {preset.name}, version {preset.version}, sha256 {preset.sha256[:12]}")
    if profile.baseline:
        yield Text(f"· baseline {name(profile.baseline, 80)}")
    yield section("Rules", "a value that equals its limit passes, but for < and >")
    sources = Sources()
    columns = (Column("id", cut=True), Column("what", cut=True), Column("on", cut=True), Column("no warning"))
    grid = Grid((*columns, Column("no failure"), Column("source")), gap=1)
    for limit in profile.limits:
        metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
        best = "low" if metric is None else str(metric.best)
        if limit.scale:
            best = "low" if limit.scale == "fluent" else "high"
        warn, fail = limit_text(limit, best)
        scale = f" ({limit.scale})" if limit.scale else ""
        source = sources.cite(name(limit.source, 200), limit.verified)
        grid.add(name(limit.id), f"{limit.subject}{scale}", _on(limit), warn, _fail(limit, fail), source)
    yield grid
    for n, source, verified in sources:
        yield _small(f"{n}  {source}{'' if verified else ' (unverified)'}")
    if profile.waivers:
        yield section("Waivers")
        for waiver in profile.waivers:
            zone = f" in {name(waiver.zone)}" if waiver.zone else ""
            yield _small(f"{name(waiver.rule)}{zone} until {waiver.until.isoformat()}: {name(waiver.reason, 200)}")
    yield Text(f"\n{plural(len(profile.limits), 'rule')}", style="dim")


def _small(text: str) -> RenderableType:
    return Padding(Text(text, style="dim"), (0, 0, 0, 2))


def _on(limit: Limit) -> str:
    parts = [" ".join(limit.types) or limit.faces, limit.where.words, "each zone" if limit.each else ""]
    return name(", ".join(part for part in parts if part) or "all", 80)


def _fail(limit: Limit, text: str) -> str:
    if limit.no_worse is not None:
        worse = no_worse_text({"abs": limit.no_worse.abs, "rel": limit.no_worse.rel})
        text = f"{text}, {worse}" if text else worse
    return text if limit.severity == "error" else f"{text} ({limit.severity})"


_STARTER = """\
# Rules that a mesh has to keep. `meshwright gate check {file}` lists them,
# `meshwright audit MESH --gate {file}` judges a mesh by them: 0 pass, 1 fail, 3 could not be checked.
# `meshwright explain` lists metrics, `meshwright explain --checks` the findings.
schema_version = 1
extends = ["preset:{preset}"]          # {title}; `meshwright profiles` lists the others

# An earlier audit, for rules with no_worse: `meshwright baseline save main MESH` keeps one.
# baseline = "main"

[[rule]]
id = "inverted"
finding = "inverted-cells"
le = 0

[[rule]]
id = "skew-share"
metric = "gambit.equiangle_skew"
scale = "fluent"                      # numbers of this rule: 0 is best; "icem" for 1 is best
stat = "share"                        # max min mean p99 p99.9 count share undefined
beyond = 0.8
warn_le = 0.005
le = 0.01

# [[rule]]
# id = "aspect-outside-the-layers"
# metric = "gambit.aspect_ratio"
# stat = "p99.9"
# le = 20
# where = {{ type = ["tet", "hex"], zone = "fluid*", distance = {{ to = "wall*", at_least = 0.05 }} }}
# no_worse = {{ rel = 0.01 }}

# [[waiver]]
# rule = "skew-share"
# zone = "gap"
# reason = "contact gap, reviewed"
# until = "2027-03-01"
"""


def write_starter(path: str, preset: str) -> None:
    """Write a gate file to begin with; UsageError for an unknown preset, or where the file is there already."""
    title = load(preset).title
    text = _STARTER.format(file=Path(path).name, preset=preset, title=title)
    try:
        with Path(path).open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise UsageError(f"{printable(path, 200)}: expected a new file, found one that is there already") from None
    except OSError as error:
        raise UsageError(f"cannot write {printable(path, 200)}: {error.strerror}") from None
    click.echo(
        f"meshwright: wrote {printable(path, 200)}; now `meshwright gate check {printable(path, 200)}`", err=True
    )
