"""`--sizes FILE.toml` and `--unit`: what a user tells of the wanted element sizes and of the unit of length."""

from __future__ import annotations

import math

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.findings.options import SizeRegion
from meshwright.audit.profiles.strict import Table, load_toml, read_text

__all__ = ["UNITS", "millimetres", "read_sizes"]

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
"""Millimetres of each unit of length."""

_PLACES = {
    "global": (),
    "zone": (),
    "box": (("low", 3), ("high", 3)),
    "cylinder": (("start", 3), ("end", 3), ("radius", 0)),
    "sphere": (("centre", 3), ("radius", 0)),
}
"""Keys of each shape in the order of `SizeRegion.place`, with the length of their arrays, 0 for a number."""


def millimetres(text: str | None) -> float | None:
    """Millimetres of one unit of length: of "mm", "cm", "m" or "in", or the number itself; None for None."""
    if text is None or text in UNITS:
        return None if text is None else UNITS[text]
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise UsageError(f"--unit {printable(text)}: expected {', '.join(UNITS)} or the millimetres of one unit")
    return value


def read_sizes(path: str | None) -> tuple[SizeRegion, ...]:
    """Regions of a TOML file, `[[region]]` tables with name, size and shape; () for None.

    shape: "global", "zone" (with `zone`, a pattern), "box" (`low`, `high`), "cylinder" (`start`, `end`, `radius`) or
    "sphere" (`centre`, `radius`). UsageError with file, region and key for anything else.
    """
    if path is None:
        return ()
    root = load_toml(read_text(path), path)
    regions = tuple(_region(table) for table in root.tables("region"))
    root.done()
    if not regions:
        raise root.wrong("region", "at least one [[region]]", "none")
    return regions


def _region(table: Table) -> SizeRegion:
    shape = table.word("shape", "global", tuple(_PLACES))
    region = SizeRegion(
        name=table.word("name"),
        size=_positive(table, "size"),
        shape=shape,  # type: ignore[arg-type]
        zone=table.word("zone") if shape == "zone" else "*",
        place=tuple(x for key, n in _PLACES[shape] for x in _values(table, key, n)),
    )
    table.done()
    low, high = region.place[:3], region.place[3:6]
    if shape == "box" and any(a >= b for a, b in zip(low, high, strict=True)):
        raise table.wrong("high", "more than low on every axis", list(high))
    if shape == "cylinder" and low == high:
        raise table.wrong("end", "another point than start", list(high))
    return region


def _values(table: Table, key: str, n: int) -> tuple[float, ...]:
    return table.numbers(key, n) if n else (_positive(table, key),)


def _positive(table: Table, key: str) -> float:
    value = table.number(key)
    if value is None or value <= 0:
        raise table.wrong(key, "a number above 0", value)
    return value
