"""Files of limits: what kind a file is, reading it as a profile, and writing a profile as each kind."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.gate.presets import PRESET, is_gate, preset
from meshwright.audit.profiles.hypermesh_criteria import is_hypermesh, read_hypermesh, write_hypermesh
from meshwright.audit.profiles.loading import check, profile_from_toml
from meshwright.audit.profiles.mesh_quality_dict import (
    is_mesh_quality_dict,
    read_mesh_quality_dict,
    write_mesh_quality_dict,
)
from meshwright.audit.profiles.model import Limit, Profile
from meshwright.audit.profiles.strict import parse_toml, read_text

__all__ = ["EXPORTS", "read_gate_file", "write_toml"]

_TOML = re.compile(
    r"^\s*(\[\[?\s*(limit|rule|waiver)\s*\]\]?|(schema_version|extends|rule|limit|baseline|title)\s*=)", re.MULTILINE
)


def read_gate_file(path: str | Path, within: tuple[Path, ...] = ()) -> Profile:
    """The limits of a file, known by its content; UsageError where it is no file of limits or holds a mistake.

    A gate file, an OpenFOAM meshQualityDict, HyperMesh criteria (alone or in a recorded command file), or TOML as the
    profiles of this program and `meshwright profiles export --as toml` write it; "preset:NAME" is a profile.
    within: files that extend this one, for those that go round in a circle.
    """
    if str(path).startswith(PRESET):
        return preset(str(path).removeprefix(PRESET))
    text, shown = read_text(path), str(path)
    if is_hypermesh(text):
        profile = read_hypermesh(text, shown)
    elif is_mesh_quality_dict(text):
        profile = read_mesh_quality_dict(text, shown)
    elif _TOML.search(text):
        if is_gate(parse_toml(text, shown)):
            from meshwright.audit.gate.loading import read_gate  # noqa: PLC0415 - loads pydantic

            return read_gate(text, shown, read_gate_file, within or (Path(path).resolve(),))
        profile = profile_from_toml(text, shown, "gate", shown)
    else:
        raise UsageError(
            f"{printable(shown, 200)}: expected a gate file (TOML with [[rule]] tables or extends), an OpenFOAM "
            "meshQualityDict, HyperMesh quality criteria or TOML with [[limit]] tables, found "
            f"{printable(text.lstrip()[:40]) or 'an empty file'}"
        )
    check(profile)
    return profile


def write_toml(profile: Profile) -> tuple[str, list[str]]:
    """The profile as TOML that `read_gate_file` reads; nothing is lost."""
    lines = [f"title = {_toml(profile.title)}", f"description = {_toml(profile.description)}"]
    if profile.version:
        lines.append(f"version = {_toml(profile.version)}")
    if profile.discipline:
        lines.append(f"discipline = {_toml(profile.discipline)}")
    if profile.scales:
        lines.append(f"scales = {_toml(profile.scales)}")
    words = {key: getattr(profile.dialect, key) for key in ("zone", "zones", "boundary", "boundaries", "note")}
    lines += ["", "[dialect]", *(f"{key} = {_toml(value)}" for key, value in words.items())]
    if profile.default_metrics:
        lines += ["", "[default_metrics]"]
        lines += [f"{kind} = {_toml(ids)}" for kind, ids in profile.default_metrics.items()]
    for limit in profile.limits:
        lines += ["", "[[limit]]", *_limit(limit)]
    for measure in profile.measures:
        lines += ["", "[[measure]]", f"name = {_toml(measure.name)}", f"metrics = {_toml(measure.metrics)}"]
        lines += [f"note = {_toml(measure.note)}"] if measure.note else []
    for left in profile.left_out:
        lines += ["", "[[left_out]]", f"what = {_toml(left.what)}", f"reason = {_toml(left.reason)}"]
        lines += [f"source = {_toml(left.source)}"] if left.source else []
    return "\n".join([*lines, ""]), []


_LIMIT_KEYS = (
    *("id", "name", "metric", "finding", "stat", "types", "order", "faces", "beyond", "warn", "fail", "inclusive"),
    *("sense", "ideal", "good", "worst", "weight", "source", "verified", "note"),
)
_ALWAYS = ("id", "name", "stat", "source", "verified")


def _limit(limit: Limit) -> list[str]:
    found = []
    for key in _LIMIT_KEYS:
        value = getattr(limit, key)
        if key in _ALWAYS or (value is not None and value not in ("", ()) and value is not False and key != "order"):
            found.append(f"{key} = {_toml(value)}")
        elif key == "order" and value:
            found.append(f"order = {value}")
    return found


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    # JSON's escapes are TOML's, but for DEL
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")


EXPORTS: dict[str, Callable[[Profile], tuple[str, list[str]]]] = {
    "meshQualityDict": write_mesh_quality_dict,
    "hypermesh": write_hypermesh,
    "toml": write_toml,
}
"""Writers by the name of the kind: (profile) -> text and what is lost in it."""
