"""In which line of a TOML text a key stands. tomllib says it of broken syntax alone, not of a wrong value."""

from __future__ import annotations

import re
from collections.abc import Sequence

__all__ = ["Lines"]

_HEADER = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"""\s*((?:"[^"]*"|'[^']*'|[A-Za-z0-9_-]+)(?:\s*\.\s*(?:"[^"]*"|'[^']*'|[A-Za-z0-9_-]+))*)\s*=""")
_PART = re.compile(r""""([^"]*)"|'([^']*)'|([A-Za-z0-9_-]+)""")

Path = tuple[str | int, ...]


class Lines:
    """Lines of tables and keys, by paths such as ("rule", 2, "le")."""

    def __init__(self, text: str) -> None:
        self._lines: dict[Path, int] = {}
        counts: dict[str, int] = {}
        table: Path = ()
        fence = ""
        depth = 0
        for number, line in enumerate(text.splitlines(), 1):
            if fence:
                if fence in line:
                    fence = ""
                continue
            if depth == 0:
                header, key = _HEADER.match(line), _KEY.match(line)
                if header:
                    parts = _parts(header[2])
                    if header[1] == "[[":
                        name = ".".join(parts)
                        counts[name] = counts.get(name, -1) + 1
                        table = (*parts, counts[name])
                    else:
                        inner = counts.get(parts[0])
                        table = parts if inner is None else (parts[0], inner, *parts[1:])
                    self._lines.setdefault(table, number)
                elif key:
                    path: Path = table
                    for part in _parts(key[1]):
                        path = (*path, part)
                        self._lines.setdefault(path, number)
            fence = _opened(line)
            bare = _without_strings(line)
            depth = max(0, depth + bare.count("[") + bare.count("{") - bare.count("]") - bare.count("}"))

    def line(self, path: Sequence[str | int]) -> int | None:
        """The line of a path, or of the nearest table around it; None where the text says nothing of it."""
        for end in range(len(path), 0, -1):
            found = self._lines.get(tuple(path[:end]))
            if found is not None:
                return found
        return None


def _parts(name: str) -> tuple[str, ...]:
    return tuple(next(group for group in match.groups() if group is not None) for match in _PART.finditer(name))


def _opened(line: str) -> str:
    """The quotes of a string of several lines that begins here and does not end."""
    for quotes in ('"""', "'''"):
        if line.count(quotes) % 2:
            return quotes
    return ""


def _without_strings(line: str) -> str:
    return re.sub(r"\"(?:\\.|[^\"\\])*\"|'[^']*'|#.*", "", line)
