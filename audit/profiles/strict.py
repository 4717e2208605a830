"""Reading TOML tables of limits and options: nothing that nobody asked for passes in silence."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from meshwright.audit.errors import UsageError, printable

__all__ = ["Table", "load_toml", "parse_toml", "read_text"]

T = TypeVar("T")

_LARGEST = 4 * 2**20
"""Bytes of a file of limits at the most; anything larger is something else."""


class Table:
    """One table of a TOML file. Every key is taken once; `done` refuses those that are left.

    file: as the user named it.  place: where the table stands, as "limit 3".
    """

    def __init__(self, data: Mapping[str, Any], file: str, place: str = "") -> None:
        self._left = dict(data)
        self.file = file
        self.place = place

    def wrong(self, key: str, expected: str, found: object) -> UsageError:
        """The error to raise about a key."""
        where = f"{self.place}, " if self.place else ""
        return UsageError(
            f"{printable(self.file, 200)}: {where}key {printable(key)!r}: "
            f"expected {expected}, found {printable(str(found))}"
        )

    def _take(self, key: str, default: T | None, kind: str, test: Callable[[Any], bool]) -> Any:
        if key not in self._left:
            if default is None:
                raise self.wrong(key, kind, "nothing")
            return default
        value = self._left.pop(key)
        if not test(value):
            raise self.wrong(key, kind, repr(value))
        return value

    def __contains__(self, key: str) -> bool:
        return key in self._left

    def word(self, key: str, default: str | None = None, among: tuple[str, ...] = ()) -> str:
        """A string, one of `among` where that is given; UsageError for a missing one without default."""
        expected = f"one of {', '.join(among)}" if among else "a string"
        value: str = self._take(key, default, expected, lambda v: isinstance(v, str) and (not among or v in among))
        return value

    def flag(self, key: str, default: bool | None = None) -> bool:
        """True or false."""
        value: bool = self._take(key, default, "true or false", lambda v: isinstance(v, bool))
        return value

    def number(self, key: str) -> float | None:
        """A finite number, None where the key is missing."""
        if key not in self._left:
            return None
        return float(self._take(key, 0.0, "a finite number", _finite))

    def numbers(self, key: str, n: int) -> tuple[float, ...]:
        """An array of n finite numbers."""

        def fits(value: object) -> bool:
            return isinstance(value, list) and len(value) == n and all(map(_finite, value))

        return tuple(float(v) for v in self._take(key, None, f"{n} finite numbers", fits))

    def words(self, key: str, among: tuple[str, ...] = ()) -> tuple[str, ...]:
        """An array of strings, () where the key is missing."""
        expected = f"strings out of {', '.join(among)}" if among else "an array of strings"

        def fits(value: object) -> bool:
            return isinstance(value, list) and all(isinstance(v, str) and (not among or v in among) for v in value)

        return tuple(self._take(key, (), expected, fits))

    def table(self, key: str) -> Table:
        """A table, empty where the key is missing."""
        value = self._take(key, {}, "a table", lambda v: isinstance(v, dict))
        return Table(value, self.file, f"{self.place}, {key}" if self.place else key)

    def tables(self, key: str) -> Iterator[Table]:
        """The tables of an array of tables."""

        def fits(value: object) -> bool:
            return isinstance(value, list) and all(isinstance(v, dict) for v in value)

        for i, entry in enumerate(self._take(key, (), "an array of tables", fits)):
            yield Table(entry, self.file, f"{key} {i + 1}")

    def keys(self) -> tuple[str, ...]:
        """Keys that nobody has taken yet."""
        return tuple(self._left)

    def done(self) -> None:
        """UsageError where a key is left."""
        for key, value in self._left.items():
            raise self.wrong(key, "no such key", repr(value))


def _finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def read_text(path: str | Path) -> str:
    """The text of a small file; UsageError where it cannot be read as UTF-8."""
    shown = printable(str(path), 200)
    try:
        with Path(path).open("rb") as stream:
            data = stream.read(_LARGEST + 1)
    except OSError as error:
        raise UsageError(f"cannot read {shown}: {error.strerror or 'input/output error'}") from None
    if len(data) > _LARGEST:
        raise UsageError(f"{shown}: expected a file of limits of at most {_LARGEST} bytes, found more")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UsageError(f"{shown}: byte {error.start}: expected UTF-8 text, found other bytes") from None


def parse_toml(text: str, file: str) -> dict[str, Any]:
    """A TOML text as plain tables; UsageError with the line where it is none."""
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise UsageError(
            f"{printable(file, 200)}: expected TOML, found an error: {printable(str(error), 200)}"
        ) from None


def load_toml(text: str, file: str) -> Table:
    """The root table of a TOML text; UsageError with the line where it is none."""
    return Table(parse_toml(text, file), file)
