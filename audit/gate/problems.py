"""What is wrong in a gate file: each thing with its line, its key, what may stand there and what does."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.gate.lines import Lines
from meshwright.audit.gate.model import (
    DistanceTable,
    GateFile,
    NoWorseTable,
    RuleTable,
    WaiverTable,
    WallLayerTable,
    WhereTable,
)

__all__ = ["GateError", "Problem", "nearest", "of_validation"]

_MODELS: dict[str, type[BaseModel]] = {
    "rule": RuleTable,
    "waiver": WaiverTable,
    "where": WhereTable,
    "wall_layer": WallLayerTable,
    "distance": DistanceTable,
    "no_worse": NoWorseTable,
}
_EXPECTED = {
    "string_type": "a string",
    "bool_type": "true or false",
    "float_type": "a number",
    "int_type": "a whole number",
    "list_type": "an array",
    "model_type": "a table",
    "dict_type": "a table",
    "finite_number": "a finite number",
    "missing": "a value",
    "too_short": "at least one",
    "string_too_short": "some text",
    "date_type": "a date such as 2027-03-01",
    "date_parsing": "a date such as 2027-03-01",
}


class Problem:
    """One mistake.  path: of the key, as ("rule", 2, "le").  line: in the file, None where that is not known."""

    def __init__(self, file: str, path: Sequence[str | int], line: int | None, expected: str, found: str) -> None:
        self.file, self.path, self.line = file, tuple(path), line
        self.expected, self.found = expected, found

    def __str__(self) -> str:
        line = "" if self.line is None else f" line {self.line}:"
        key = f" {_spelled(self.path)}:" if self.path else ""
        return f"{printable(self.file, 200)}:{line}{key} expected {self.expected}, found {printable(self.found, 120)}"


class GateError(UsageError):
    """A gate file with mistakes; `problems` has them all, the message the first."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = list(problems)
        more = len(self.problems) - 1
        rest = f" (and {more} more: `meshwright gate check` lists them)" if more else ""
        super().__init__(f"{self.problems[0]}{rest}")


def nearest(word: str, among: Iterable[str]) -> str:
    """'; did you mean ...?', "" where nothing is near."""
    found = difflib.get_close_matches(word, list(among), 3, 0.6)
    return f"; did you mean {' or '.join(map(repr, found))}?" if found else ""


def of_validation(error: ValidationError, file: str, lines: Lines) -> list[Problem]:
    """The mistakes that pydantic found, in the order of the file."""
    found: dict[tuple[str | int, ...], Problem] = {}
    for entry in error.errors(include_url=False):
        path = _real(entry["loc"])
        if entry["type"] == "extra_forbidden":
            problem = _unknown_key(file, path, lines)
        else:
            value = entry["input"]
            shown = "nothing" if entry["type"] == "missing" else repr(value)
            problem = Problem(file, path, lines.line(path), _expected(entry, path), shown)
        found.setdefault(path, problem)
    return sorted(found.values(), key=lambda p: (p.line is None, p.line or 0))


def _real(location: tuple[int | str, ...]) -> tuple[int | str, ...]:
    """The location without the names of the branches of a union."""
    return tuple(part for part in location if isinstance(part, int) or _is_key(part))


def _is_key(part: str) -> bool:
    branch = part.startswith(("function", "literal", "constrained", "list", "bool"))
    return part.replace("_", "").isalnum() and part[:1].islower() and not branch


def _unknown_key(file: str, path: tuple[int | str, ...], lines: Lines) -> Problem:
    tables = [part for part in path[:-1] if isinstance(part, str)]
    model = _MODELS[tables[-1]] if tables else GateFile
    keys = list(model.model_fields)
    name = str(path[-1])
    return Problem(file, path, lines.line(path), f"one of {', '.join(keys)}", f"{name!r}{nearest(name, keys)}")


def _expected(entry: Any, path: tuple[int | str, ...]) -> str:
    kind, context = entry["type"], entry.get("ctx", {})
    if kind == "literal_error":
        return f"one of {context['expected']}"
    if kind == "value_error":
        return str(context.get("error", entry["msg"]))
    if kind == "string_pattern_mismatch":
        if path[-1] == "stat":
            return "one of max, min, mean, count, share, undefined, or a percentile such as p99.9"
        return "letters, digits and single . _ - between them"
    bounds = {
        "greater_than_equal": ("ge", "at least"),
        "less_than_equal": ("le", "at most"),
        "string_too_long": ("max_length", "at most"),
    }
    if kind in bounds:
        key, words = bounds[kind]
        return f"{words} {context[key]:g}{' characters' if key == 'max_length' else ''}"
    return _EXPECTED.get(kind, entry["msg"])


def _spelled(path: Sequence[str | int]) -> str:
    """'rule 3, where.distance.at_most'; tables of an array count from 1."""
    words = ""
    for part in path:
        if isinstance(part, int):
            words += f" {part + 1}"
        elif words[-1:].isdigit():
            words += f", {part}"
        else:
            words += f"{'.' if words else ''}{part}"
    return printable(words, 120)
