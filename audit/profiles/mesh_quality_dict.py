"""OpenFOAM's meshQualityDict as limits, and limits as a meshQualityDict.

Grammar: `key number;` entries, the blocks `FoamFile { ... }` and `relaxed { ... }`, comments `// ...` and `/* ... */`.
Includes, macros and code are refused, for what they bring in is not in the file. What an entry means, and when it is
off, is read off OpenFOAM's motionSmootherAlgoCheck.C and polyMeshGeometry.C.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.model import Dialect, Limit, Profile, Unmeasurable
from meshwright.audit.profiles.quantities import QUANTITIES

__all__ = ["KEYS", "is_mesh_quality_dict", "read_mesh_quality_dict", "write_mesh_quality_dict"]

_SMALL = 1e-15
_GREAT = 1e15
_SOURCE = "OpenFOAM motionSmootherAlgoCheck.C"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_TOKEN = re.compile(r'"(?:[^"\\\n]|\\.)*"|[{};]|[^\s{};"]+')


@dataclass(frozen=True)
class _Key:
    """One entry.

    metrics: ids of what it limits; the first is what a file of limits is read as, the others say the same of cells.
    off: whether a value switches the check off; none: a value that does.  low, high: values OpenFOAM accepts.
    """

    metrics: tuple[str, ...]
    stat: Literal["max", "min"]
    off: Callable[[float], bool]
    none: str
    faces: Literal["", "interior", "boundary"] = ""
    low: float = -1e300
    high: float = 1e300
    inclusive: bool = False
    required: bool = True
    note: str = ""


KEYS: dict[str, _Key] = {
    "maxNonOrtho": _Key(("openfoam.non_orthogonality_deg",), "max", lambda v: v >= 180 - _SMALL, "180"),
    "maxBoundarySkewness": _Key(("openfoam.skewness",), "max", lambda v: v <= 0, "-1", "boundary"),
    "maxInternalSkewness": _Key(("openfoam.skewness",), "max", lambda v: v <= 0, "-1", "interior"),
    "maxConcave": _Key(
        ("openfoam.face_concavity_deg",), "max", lambda v: v >= 180 - _SMALL, "180",
        low=0, high=180, inclusive=True, note="Compared by sines, so that 100 means the same as 80.",
    ),
    "minVol": _Key(("openfoam.face_pyramid", "openfoam.min_pyramid"), "min", lambda v: v <= -_GREAT, "-1e30"),
    "minTetQuality": _Key(("openfoam.tet_quality",), "min", lambda v: v <= -_GREAT, "-1e30"),
    "minArea": _Key(("face.area",), "min", lambda v: v <= -_SMALL, "-1"),
    "minTwist": _Key(("openfoam.face_twist",), "min", lambda v: v <= -1, "-2", high=1),
    "minDeterminant": _Key(
        ("openfoam.smoother_determinant",), "min", lambda v: v <= -1, "-2",
        note="Of all faces of a cell; checkMesh's own determinant is another number.",
    ),
    "minFaceWeight": _Key(("openfoam.face_weight",), "min", lambda v: not 0 <= v < 1, "-1"),
    "minVolRatio": _Key(
        ("openfoam.volume_ratio",), "min", lambda v: v < 0, "-1",
        note="Of signed volumes, as in checkMesh; the motion smoother drops the sign, which differs on inverted cells.",
    ),
    "minTriangleTwist": _Key(("openfoam.triangle_twist",), "min", lambda v: v <= -1, "-2", high=1),
    "minFaceFlatness": _Key(
        ("openfoam.flatness",), "min", lambda v: v <= -_SMALL, "-1", high=1, required=False,
        note="OpenFOAM divides the other way round here and never counts a face; this is the flatness of checkMesh.",
    ),
    "minEdgeLength": _Key(("edge.min",), "min", lambda v: v < 0, "-1", required=False),
}  # fmt: skip
"""Entries that are limits, in the order in which they are written."""

_ALIASES = {"minFlatness": "minFaceFlatness"}
_ASIDE = {
    "nSmoothScale": "a control of snapping",
    "errorReduction": "a control of snapping",
    "minVolCollapseRatio": "about cells before and after snapping",
}
"""Entries that are no limits of a mesh."""


def is_mesh_quality_dict(text: str) -> bool:
    """Whether a text looks like one: it has a FoamFile header or one of the entries."""
    plain = _without_comments(text)
    words = "|".join((*KEYS, *_ALIASES))
    return bool(re.search(rf"^\s*(FoamFile\b|({words})\s+[^=\s]|#include)", plain, re.MULTILINE))


def _without_comments(text: str) -> str:
    """The text with comments blanked, strings kept and lines where they were."""
    pattern = r'"(?:[^"\\\n]|\\.)*"|//[^\n]*|/\*.*?(?:\*/|\Z)'

    def blank(match: re.Match[str]) -> str:
        found = match[0]
        return found if found.startswith('"') else re.sub(r"[^\n]", " ", found)

    return re.sub(pattern, blank, text, flags=re.DOTALL)


def _wrong(file: str, line: int, expected: str, found: str) -> UsageError:
    return UsageError(f"{printable(file, 200)}: line {line}: expected {expected}, found {printable(found)}")


def _tokens(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(_without_comments(text).split("\n"), 1):
        for match in _TOKEN.finditer(line):
            yield number, match[0]
        rest = _TOKEN.sub("", line).strip()
        if rest:
            yield number, rest


def _entries(text: str, file: str) -> Iterator[tuple[int, str, list[str] | None]]:
    """(line, key, words of the value), None for a block, whose content is skipped but must close."""
    words = list(_tokens(text))
    at = 0
    while at < len(words):
        line, key = words[at]
        if key.startswith("#"):
            raise _wrong(file, line, "entries written out: give the file that it includes, or copy its entries", key)
        if key in ("{", "}", ";"):
            raise _wrong(file, line, "a key", key)
        at += 1
        value: list[str] = []
        while at < len(words) and words[at][1] not in ("{", "}", ";"):
            value.append(words[at][1])
            at += 1
        if at == len(words) or words[at][1] == "}":
            raise _wrong(file, line, f"a semicolon after {key}", words[at][1] if at < len(words) else "the end")
        if words[at][1] == ";":
            yield line, key, value
            at += 1
            continue
        depth = 0
        while at < len(words):
            depth += {"{": 1, "}": -1}.get(words[at][1], 0)
            at += 1
            if not depth:
                break
        if depth:
            raise _wrong(file, line, f"a closing brace for {key}", "the end")
        if value:
            raise _wrong(file, line, f"a brace after {key}", value[0])
        yield line, key, None


def read_mesh_quality_dict(text: str, file: str) -> Profile:
    """The limits of a meshQualityDict; UsageError with the line for whatever it should not hold.

    Every entry that is on is a limit whose violation fails. Entries whose number is not of this build are kept as
    demands that cannot be checked.
    """
    limits: list[Limit] = []
    cannot: list[Unmeasurable] = []
    notes: list[str] = []
    seen: dict[str, int] = {}
    off = []
    for line, word, value in _entries(text, file):
        key = _ALIASES.get(word, word)
        if key in seen:
            raise _wrong(file, line, f"each key once ({key} stands in line {seen[key]} too)", word)
        seen[key] = line
        if value is None:
            if key == "relaxed":
                notes.append("the block relaxed is left aside: it is for a mesher that cannot do better")
            elif key != "FoamFile":
                raise _wrong(file, line, "an entry of a meshQualityDict", f"{word} {{")
            continue
        if key in _ASIDE:
            notes.append(f"{key} is left aside: it is {_ASIDE[key]}")
            continue
        if key not in KEYS:
            raise _wrong(file, line, f"one of {', '.join(KEYS)}", word)
        spec, number = KEYS[key], _number(file, line, key, value)
        if spec.off(number):
            off.append(key)
            continue
        if not spec.low <= number <= spec.high:
            raise _wrong(file, line, f"{key} from {spec.low:g} to {spec.high:g}", value[0])
        if key == "maxConcave" and number > 90:
            number = 180.0 - number
        metric = spec.metrics[0]
        if metric not in METRICS and metric not in QUANTITIES:
            cannot.append(Unmeasurable(_id(key), key, f"{metric} is not a metric of this build"))
            continue
        level = Limit(_id(key), key, spec.stat, f"line {line}", True, metric, faces=spec.faces, fail=number,
                      inclusive=spec.inclusive, note=spec.note)  # fmt: skip
        limits.append(level)
    if off:
        notes.append(f"off in this file: {', '.join(off)}")
    missing = [key for key, spec in KEYS.items() if spec.required and key not in seen]
    if missing:
        notes.append(f"OpenFOAM wants these entries too: {', '.join(missing)}")
    if not limits and not cannot:
        raise _wrong(file, 1, "at least one limit that is on", "none")
    return Profile(
        name="meshQualityDict",
        title="OpenFOAM meshQualityDict",
        description="Limits of a file, every one of which fails a mesh.",
        discipline="cfd",
        dialect=Dialect("cellZone", "cellZones and patches", "patch", "patches"),
        limits=tuple(limits),
        unmeasurable=tuple(cannot),
        file=file,
        notes=tuple(notes),
    )


def _number(file: str, line: int, key: str, value: list[str]) -> float:
    if len(value) != 1 or not _NUMBER.fullmatch(value[0]):
        raise _wrong(file, line, f"one number after {key}", " ".join(value) or "nothing")
    return float(value[0])


def _id(key: str) -> str:
    return re.sub(r"([A-Z])", r"-\1", key).lower()


def write_mesh_quality_dict(profile: Profile) -> tuple[str, list[str]]:
    """A meshQualityDict with the limits of a profile that it can hold, and a line for each that is lost in it.

    A limit is written by its level of failure, of warning where it has no other.
    """
    chosen: dict[str, Limit] = {}
    lost: list[str] = []
    for limit in profile.limits:
        keys = [key for key, spec in KEYS.items() if _holds(spec, limit)]
        if not keys:
            lost.append(f"{limit.name} ({limit.subject}) has no entry in a meshQualityDict")
        for key in keys:
            other = chosen.get(key)
            if other is None:
                chosen[key] = limit
                continue
            if other.fail is None and limit.fail is not None:
                chosen[key] = limit
            else:
                other = limit
            lost.append(f"{other.name}: {key} holds another limit of the profile, {chosen[key].name}")
    for key, limit in chosen.items():
        if limit.fail is not None and limit.warn is not None:
            lost.append(f"{limit.name}: the warning at {limit.warn!r} is left out, {key} fails at {limit.fail!r}")
        if limit.inclusive != KEYS[key].inclusive:
            lost.append(f"{limit.name}: a value that equals the limit counts as beyond it, which {key} does not say")
    lines = [
        "FoamFile", "{", "    version     2.0;", "    format      ascii;", "    class       dictionary;",
        "    object      meshQualityDict;", "}", "", f"// Limits of the profile {profile.name}. Left out:",
        *(f"//   {_comment(line)}" for line in lost or ["nothing"]), "",
    ]  # fmt: skip
    skewed = [key for key in chosen if key.endswith("Skewness")]
    for key, spec in KEYS.items():
        if key in chosen:
            limit = chosen[key]
            level = limit.warn if limit.fail is None else limit.fail
            aside = "a warning of the profile" if limit.fail is None else ""
            lines.append(_entry(key, repr(level), aside))
        elif spec.required:
            # one skewness that is on switches both on, and a negative limit would then fail every face
            none = "1e30" if skewed and key.endswith("Skewness") else spec.none
            lines.append(_entry(key, none, "off"))
    return "\n".join([*lines, ""]), lost


def _entry(key: str, value: str, aside: str) -> str:
    return f"{key:<20} {value};" + (f"  // {aside}" if aside else "")


def _comment(text: str) -> str:
    return printable(text, 300).replace("*/", "* /").replace("\\", "/")


def _holds(spec: _Key, limit: Limit) -> bool:
    if limit.metric not in spec.metrics or limit.stat != spec.stat or limit.order:
        return False
    return not limit.faces or not spec.faces or limit.faces == spec.faces
