"""A gate file as a `Profile`: presets and files it extends first, then its own rules; the last of an id wins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from meshwright.audit.errors import UsageError
from meshwright.audit.gate.lines import Lines
from meshwright.audit.gate.model import GateFile
from meshwright.audit.gate.presets import PRESET, preset
from meshwright.audit.gate.problems import GateError, Problem, nearest, of_validation
from meshwright.audit.gate.rules import RuleError, UnknownError, limit_of_rule
from meshwright.audit.profiles.loading import PROFILES
from meshwright.audit.profiles.model import Dialect, Limit, Preset, Profile, Unmeasurable, Waiver
from meshwright.audit.profiles.strict import parse_toml

__all__ = ["gate_schema", "read_gate"]

_DEEPEST = 10


@dataclass
class _Inherited:
    """What the files and presets that a gate file extends come to."""

    limits: dict[str, Limit] = field(default_factory=dict)
    unmeasurable: dict[str, Unmeasurable] = field(default_factory=dict)
    waivers: list[Waiver] = field(default_factory=list)
    presets: list[Preset] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    baseline: str = ""
    profile: Profile | None = None

    def add(self, profile: Profile) -> None:
        """Take over the rules of a profile; the later of an id wins."""
        for limit in profile.limits:
            self.limits.pop(limit.id, None)
            self.unmeasurable.pop(limit.id, None)
            self.limits[limit.id] = limit
        for lost in profile.unmeasurable:
            self.unmeasurable[lost.id] = lost
        self.waivers += profile.waivers
        self.presets += [p for p in profile.presets if p not in self.presets]
        self.notes += profile.notes
        self.baseline = profile.baseline or self.baseline
        self.profile = profile


def read_gate(
    text: str, shown: str, read_other: Callable[[str, tuple[Path, ...]], Profile], within: tuple[Path, ...] = ()
) -> Profile:
    """The rules of a gate file; GateError with every mistake it holds.

    shown: its path as the user named it.  read_other: reads a file of limits that it extends.  within: files that are
    being read, this one last. Rules about metrics or checks that are not known are `unmeasurable`, never left out.
    """
    lines = Lines(text)
    data = parse_toml(text, shown)
    try:
        file = GateFile.model_validate(data)
    except ValidationError as error:
        raise GateError(of_validation(error, shown, lines)) from None
    problems: list[Problem] = []
    inherited = _extended(file, shown, lines, read_other, within, problems)
    unknown = _add_rules(file, shown, lines, inherited, problems)
    waivers = _waivers(file, shown, lines, inherited, problems)
    if not problems and not inherited.limits and not inherited.unmeasurable:
        problems.append(Problem(shown, (), None, "at least one rule, or something it extends", "none"))
    if problems:
        raise GateError(sorted(problems, key=lambda p: (p.line is None, p.line or 0)))
    base = inherited.profile
    return Profile(
        name="gate",
        title=file.title or Path(shown).name,
        description=file.description,
        discipline="" if base is None else base.discipline,
        dialect=Dialect() if base is None else base.dialect,
        scales=() if base is None else base.scales,
        limits=tuple(inherited.limits.values()),
        unmeasurable=tuple(inherited.unmeasurable.values()),
        file=shown,
        notes=(*inherited.notes, *unknown),
        waivers=(*inherited.waivers, *waivers),
        presets=tuple(inherited.presets),
        baseline=_beside(file.baseline, shown) if file.baseline else inherited.baseline,
    )


def _beside(baseline: str, shown: str) -> str:
    """A baseline file is named relative to the gate file."""
    kind, colon, path = baseline.partition(":")
    return f"file:{Path(shown).parent / path}" if colon and kind == "file" else baseline


def _extended(
    file: GateFile,
    shown: str,
    lines: Lines,
    read_other: Callable[[str, tuple[Path, ...]], Profile],
    within: tuple[Path, ...],
    problems: list[Problem],
) -> _Inherited:
    found = _Inherited()
    for name in file.extends or ():
        path, line = ("extends",), lines.line(("extends",))
        if name.startswith(PRESET):
            kind = name.removeprefix(PRESET)
            if kind in PROFILES:
                found.add(preset(kind))
            else:
                expected = f"one of {', '.join(PRESET + known for known in PROFILES)}"
                problems.append(Problem(shown, path, line, expected, f"{name!r}{nearest(kind, PROFILES)}"))
            continue
        if name in PROFILES:
            problems.append(Problem(shown, path, line, f"{PRESET}{name}, or the path of a file", repr(name)))
            continue
        other = Path(shown).parent / name
        if other.resolve() in within or len(within) > _DEEPEST:
            problems.append(Problem(shown, path, line, "files that do not extend each other in a circle", repr(name)))
            continue
        try:
            found.add(read_other(str(other), (*within, other.resolve())))
        except GateError as error:
            problems += error.problems
        except UsageError as error:
            problems.append(Problem(shown, path, line, "a file of limits", f"{name!r} ({error})"))
    return found


def _add_rules(file: GateFile, shown: str, lines: Lines, inherited: _Inherited, problems: list[Problem]) -> list[str]:
    """Add the file's own rules to those inherited; notes about those that nothing can be measured for."""
    seen: set[str] = set()
    notes = []
    for k, rule in enumerate(file.rule):
        here: tuple[str | int, ...] = ("rule", k)
        if rule.id in seen:
            problems.append(
                Problem(shown, (*here, "id"), lines.line((*here, "id")), "ids that differ", f"{rule.id!r} twice")
            )
            continue
        seen.add(rule.id)
        before = inherited.limits.get(rule.id)
        if rule.severity == "off":
            if (
                before is None
                and rule.id not in inherited.unmeasurable
                and rule.metric is None
                and rule.finding is None
            ):
                known = nearest(rule.id, inherited.limits)
                problems.append(
                    Problem(
                        shown,
                        (*here, "id"),
                        lines.line((*here, "id")),
                        "the id of an inherited rule",
                        f"{rule.id!r}{known}",
                    )
                )
            inherited.limits.pop(rule.id, None)
            inherited.unmeasurable.pop(rule.id, None)
            continue
        try:
            limit = limit_of_rule(rule, file, before, f"line {lines.line(here)}")
        except UnknownError as error:
            problem = Problem(shown, (*here, *error.key), lines.line((*here, *error.key)), error.expected, error.found)
            inherited.limits.pop(rule.id, None)
            inherited.unmeasurable[rule.id] = Unmeasurable(rule.id, rule.name or rule.id, str(problem))
            notes.append(str(problem))
            continue
        except RuleError as error:
            path: tuple[str | int, ...] = (*here, *error.key)
            problems.append(Problem(shown, path, lines.line(path), error.expected, error.found))
            continue
        inherited.limits.pop(rule.id, None)
        inherited.unmeasurable.pop(rule.id, None)
        inherited.limits[rule.id] = limit
    return notes


def _waivers(file: GateFile, shown: str, lines: Lines, rules: _Inherited, problems: list[Problem]) -> list[Waiver]:
    known = (*rules.limits, *rules.unmeasurable)
    found = []
    for k, waiver in enumerate(file.waiver):
        if not any(id_ == waiver.rule or fnmatchcase(id_, waiver.rule) for id_ in known):
            path = ("waiver", k, "rule")
            expected = "the id of a rule, or a pattern of ids"
            problems.append(
                Problem(shown, path, lines.line(path), expected, f"{waiver.rule!r}{nearest(waiver.rule, known)}")
            )
        found.append(Waiver(waiver.rule, waiver.zone or "", waiver.reason, waiver.until))
    return found


def gate_schema() -> dict[str, Any]:
    """The JSON Schema of gate files, for editors."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "urn:meshwright:gate:1",
        **GateFile.model_json_schema(),
    }
