"""HyperMesh's quality index criteria for shells as limits, and limits as such criteria.

Grammar, that of the strings of `*setqualitycriteria`: a criterion a line,

    number name on weight ideal good warn fail worst [three whole numbers]
    number name on element-size limit [three whole numbers]

with `on` 0 or 1, the second form for time_step, area_skew, cell_squish and equi_skew. The lines stand alone, or as
the quoted strings of a `*createstringarray` of a recorded command file that a `*setqualitycriteria` follows. Lines
"0 penalty value", "QI color legend" and "Global_solver" set no limits. Lines that begin with # are comments.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from typing import Literal

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.model import CELLS, Dialect, Limit, Profile, Unmeasurable

__all__ = ["CRITERIA", "is_hypermesh", "read_hypermesh", "write_hypermesh"]

_SHELLS = ("tri", "quad")


@dataclass(frozen=True)
class _Criterion:
    """metric, stat, types: what it limits here, metric "" for nothing.  ideal: value of a perfect element, None where
    it is the wanted size.  short: of the second form.  colour: of its display.
    """

    metric: str
    stat: Literal["max", "min", "share"]
    types: tuple[str, ...]
    ideal: float | None
    colour: int
    short: bool = False
    why: str = ""


CRITERIA: dict[str, _Criterion] = {
    "min length": _Criterion("edge.min", "min", _SHELLS, None, 59),
    "max length": _Criterion("edge.max", "max", _SHELLS, None, 39),
    "aspect ratio": _Criterion("hm.aspect", "max", _SHELLS, 1.0, 41),
    "warpage": _Criterion("icem.max_warp", "max", ("quad",), 0.0, 56),
    "max angle quad": _Criterion("angle.max", "max", ("quad",), 90.0, 28),
    "min angle quad": _Criterion("angle.min", "min", ("quad",), 90.0, 61),
    "max angle tria": _Criterion("angle.max", "max", ("tri",), 60.0, 19),
    "min angle tria": _Criterion("angle.min", "min", ("tri",), 60.0, 22),
    "skew": _Criterion("hm.skew", "max", _SHELLS, 0.0, 46),
    "jacobian": _Criterion(
        "hm.jacobian_gauss", "min", ("quad",), 1.0, 57, why="the Jacobian at the Gauss points of a quadrilateral"
    ),
    "chordal dev": _Criterion("", "max", _SHELLS, 0.0, 29, why="it needs the geometry"),
    "taper": _Criterion("hm.taper", "max", ("quad",), 0.0, 53),
    "% of trias": _Criterion(CELLS, "share", ("tri",), 0.0, 0),
    "time_step": _Criterion("", "min", _SHELLS, None, 59, short=True, why="it needs a material"),
    "area_skew": _Criterion("gambit.equisize_skew", "max", ("tri",), None, 39, short=True),
    "cell_squish": _Criterion("", "max", _SHELLS, None, 53, short=True, why="the squish of shells is not measured"),
    "equi_skew": _Criterion("gambit.equiangle_skew", "max", _SHELLS, None, 34, short=True),
}
"""Criteria by name, in their order."""

_OTHERS = ("penalty value", "QI color legend", "Global_solver")
_LINE = re.compile(r"\s*(?:(\d+)\s+)?([A-Za-z%][A-Za-z_% ]*?)((?:\s+[-+.\deE]+)*)\s*")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_STRING = re.compile(r'"((?:[^"\\]|\\.)*)"')


def is_hypermesh(text: str) -> bool:
    """Whether a text looks like criteria: it has the command, or a line of one of them."""
    if re.search(r"^\s*\*setqualitycriteria", text, re.MULTILINE):
        return True
    names = "|".join(re.escape(name) for name in CRITERIA)
    return bool(re.search(rf'^\s*"?\s*\d+\s+({names})\s+[01]\s', text, re.MULTILINE))


def _wrong(file: str, line: int, expected: str, found: str) -> UsageError:
    return UsageError(f"{printable(file, 200)}: line {line}: expected {expected}, found {printable(found)}")


def _strings(text: str, file: str) -> tuple[list[tuple[int, str]], int]:
    """(line, criterion) and how many sets of criteria there are, of which the last is meant."""
    lines = text.split("\n")
    if not any(line.lstrip().startswith("*setqualitycriteria") for line in lines):
        plain = [(n, line.strip()) for n, line in enumerate(lines, 1)]
        return [(n, _unquoted(line)) for n, line in plain if line and not line.startswith("#")], 1
    sets: list[list[tuple[int, str]]] = []
    array: list[tuple[int, str]] = []
    inside = False
    for n, line in enumerate(lines, 1):
        words = line.strip()
        if words.startswith("*createstringarray"):
            array, inside = [], True
        elif words.startswith("*setqualitycriteria"):
            if not array:
                raise _wrong(file, n, "a *createstringarray before it", words)
            sets.append(array)
            array = []
        if inside:
            array += [(n, string) for string in _STRING.findall(line)]
            inside = words.endswith("\\")
    return sets[-1], len(sets)


def _unquoted(line: str) -> str:
    body = line.removesuffix("\\").strip()
    return body[1:-1] if len(body) > 1 and body[0] == body[-1] == '"' else body


def read_hypermesh(text: str, file: str) -> Profile:
    """The limits of HyperMesh criteria; UsageError with the line for what the grammar does not hold.

    A criterion that is on gives a warning beyond `warn` and a failure beyond `fail`; one that nothing here measures is
    kept as a demand that cannot be checked.
    """
    strings, n_sets = _strings(text, file)
    notes = [f"of {n_sets} sets of criteria the last is taken"] if n_sets > 1 else []
    limits: list[Limit] = []
    cannot: list[Unmeasurable] = []
    off: list[str] = []
    seen: set[str] = set()
    for line, string in strings:
        name, numbers = _parse(file, line, string)
        if name in _OTHERS:
            continue
        if name in seen:
            raise _wrong(file, line, f"each criterion once, found {name!r} again", string.strip())
        seen.add(name)
        criterion = CRITERIA[name]
        if numbers[0] not in (0.0, 1.0):
            raise _wrong(file, line, f"0 or 1 after {name!r}", f"{numbers[0]:g}")
        if not numbers[0]:
            off.append(name)
            continue
        id_ = re.sub(r"[^a-z]+", "-", name.lower().replace("%", "share")).strip("-")
        reason = _cannot(criterion)
        if reason:
            cannot.append(Unmeasurable(id_, name, reason))
            continue
        limits.append(_limit(line, id_, name, criterion, numbers))
    if off:
        notes.append(f"off in this file: {', '.join(off)}")
    if not seen:
        raise _wrong(file, 1, "a criterion", "none")
    if not limits and not cannot:
        raise _wrong(file, 1, "at least one criterion that is on", "none")
    return Profile(
        name="hypermesh-criteria",
        title="HyperMesh criteria",
        description="Criteria of a file: beyond warn is a warning, beyond fail a failure.",
        discipline="fea",
        dialect=Dialect("component", "components", "set", "sets"),
        limits=tuple(limits),
        unmeasurable=tuple(cannot),
        file=file,
        notes=tuple(notes),
    )


def _parse(file: str, line: int, string: str) -> tuple[str, list[float]]:
    match = _LINE.fullmatch(string)
    if match is None:
        raise _wrong(file, line, "number, name and figures of a criterion", string.strip())
    name, words = match[2].strip(), match[3].split()
    if not all(_NUMBER.fullmatch(word) for word in words):
        raise _wrong(file, line, f"figures after {name!r}", match[3].strip())
    numbers = [float(word) for word in words]
    if name in _OTHERS:
        return name, numbers
    if name not in CRITERIA:
        raise _wrong(file, line, f"one of {', '.join(CRITERIA)}", name)
    least = 3 if CRITERIA[name].short else 7
    if len(numbers) not in (least, least + 3):
        raise _wrong(file, line, f"{least} figures after {name!r}, and three whole numbers or none", f"{len(numbers)}")
    if not CRITERIA[name].short:
        _check_levels(file, line, name, numbers[2:7])
    return name, numbers


def _check_levels(file: str, line: int, name: str, levels: list[float]) -> None:
    falling = CRITERIA[name].stat == "min"
    if sorted(levels, reverse=falling) != levels:
        way = "fall" if falling else "rise"
        shown = " ".join(f"{level:g}" for level in levels)
        raise _wrong(file, line, f"levels of {name!r} that {way} from ideal to worst", shown)


def _cannot(criterion: _Criterion) -> str:
    """Why a criterion cannot be checked, "" where it can."""
    if criterion.metric == CELLS:
        return ""
    if not criterion.metric:
        return criterion.why
    metric = METRICS.get(criterion.metric)
    if metric is None:
        return f"{criterion.metric} is not a metric of this build"
    missing = [kind for kind in criterion.types if kind not in metric.on]
    if missing:
        return f"{criterion.why or criterion.metric} is not measured on {' and '.join(missing)} cells"
    return ""


def _limit(line: int, id_: str, name: str, criterion: _Criterion, numbers: list[float]) -> Limit:
    source = f"line {line}"
    if criterion.short:
        return Limit(id_, name, criterion.stat, source, False, criterion.metric, types=criterion.types, fail=numbers[2],
                     note="That the third figure is the limit of failure is inferred.")  # fmt: skip
    weight, levels = numbers[1], numbers[2:7]
    if criterion.stat == "share":
        levels = [_scaled(level, -2) for level in levels]
    ideal, good, warn, fail, worst = levels
    return Limit(id_, name, criterion.stat, source, True, criterion.metric, types=criterion.types, warn=warn, fail=fail,
                 ideal=ideal, good=good, worst=worst, weight=weight)  # fmt: skip


def _scaled(value: float, power: int) -> float:
    """value * 10**power without the rounding of a product."""
    return float(Decimal(repr(value)).scaleb(power))


def write_hypermesh(profile: Profile) -> tuple[str, list[str]]:
    """A command file that sets the criteria of a profile, and a line for each limit that is lost in it.

    Criteria have five levels. Where a limit does not name them, good is written as warn, worst as fail, and the one
    of warn and fail that it lacks as the other.
    """
    chosen: dict[str, Limit] = {}
    lost: list[str] = []
    for limit in profile.limits:
        names = [name for name, c in CRITERIA.items() if _holds(c, limit) and name not in chosen]
        if not names:
            lost.append(f"{limit.name} ({limit.subject}, {' '.join(limit.types) or 'all'}) has no criterion for shells")
        for name in names:
            chosen[name] = limit
            if limit.inclusive:
                lost.append(
                    f"{limit.name}: a value that equals the limit counts as beyond it, which criteria cannot say"
                )
    strings = [f"{0:>3} {'penalty value':<18}      0.00     0.00     0.80     1.00    10.00"]
    for k, (name, criterion) in enumerate(CRITERIA.items(), 1):
        number, place = (k, k - 1) if k < 13 else (k, -1) if k == 13 else (k + 1, k - 2)
        strings.append(_string(number, place, name, criterion, chosen.get(name), lost))
        if name == "% of trias":
            strings.append(f"{14:>3} {'QI color legend':<18}      32       32        7        6        3     3   -1")
    strings.append("    Global_solver -1")
    head = [
        f"# Criteria of the profile {profile.name}. Left out:",
        *(f"#   {_comment(x)}" for x in lost or ["nothing"]),
    ]
    first = f'*createstringarray {len(strings)} "{strings[0]}" \\'
    body = [f'  "{string}" \\' for string in strings[1:-1]]
    return "\n".join([*head, first, *body, f'  "{strings[-1]}"', f"*setqualitycriteria 1 {len(strings)} 0", ""]), lost


def _string(number: int, place: int, name: str, criterion: _Criterion, limit: Limit | None, lost: list[str]) -> str:
    start, colour = f"{number:>3} {name:<18}", f"{0:>4} {criterion.colour:>4} {place:>4}"
    if criterion.short:
        level = None if limit is None else limit.warn if limit.fail is None else limit.fail
        return f"{start} {int(limit is not None)} {10.0!r:>8} {0.5 if level is None else level!r:>8} {colour}"
    if limit is None:
        zeros = " ".join(f"{criterion.ideal or 0.0!r:>8}" for _ in range(5))
        return f"{start} 0 {1.0!r:>5} {zeros} {colour}"
    warn = limit.fail if limit.warn is None else limit.warn
    fail = limit.warn if limit.fail is None else limit.fail
    ideal = criterion.ideal if limit.ideal is None else limit.ideal
    good = warn if limit.good is None else limit.good
    levels = [warn if ideal is None else ideal, good, warn, fail, fail if limit.worst is None else limit.worst]
    if limit.good is None or limit.worst is None:
        lost.append(f"{limit.name}: its levels good and worst are not known and written as warn and fail")
    if criterion.stat == "share":
        levels = [None if level is None else _scaled(level, 2) for level in levels]
    figures = " ".join(f"{level!r:>8}" for level in levels)
    return f"{start} 1 {1.0 if limit.weight is None else limit.weight!r:>5} {figures} {colour}"


def _comment(text: str) -> str:
    return printable(text, 300).rstrip("\\")


def _holds(criterion: _Criterion, limit: Limit) -> bool:
    if limit.metric != criterion.metric or not limit.metric or limit.stat != criterion.stat or limit.order:
        return False
    return not limit.types or set(criterion.types) <= set(limit.types)
