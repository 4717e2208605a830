"""How numbers and foreign names are spelled in every output."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from meshwright.audit.errors import printable

__all__ = ["csv_cell", "figure", "markdown", "name", "not_defined", "number", "percent", "plural", "size"]

_EXACT = 1e-9
_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")
_MARKDOWN = "\\`*_{}[]<>()#|!~&"


def number(value: Any) -> float:
    """A number of the document, where inf and nan are strings and null means "not defined"."""
    return math.nan if value is None else float(value)


def figure(value: Any, unit: str = "1") -> str:
    """A value to about four digits; it is never rounded onto 0 or 1, the perfect and the degenerate ends.

    "-" for not defined (None), "nan" for undefined, "inf".  unit: lengths, areas and volumes ("L", "L2", "L3") have
    no perfect end and are printed plainly.
    """
    if value is None:
        return "-"
    x = float(value)
    if not math.isfinite(x):
        return "nan" if math.isnan(x) else "inf" if x > 0 else "-inf"
    size = abs(x)
    if unit.startswith("L") or size >= 1e5:
        return f"{x:.4g}"
    decimals = 3 if size < 10 else 2 if size < 100 else 1
    text = f"{x:.{decimals}f}"
    end = round(x)
    if end in (-1, 0, 1) and float(text) == end:
        if abs(x - end) <= _EXACT:
            return f"{end:.{decimals}f}"
        step = 10.0**-decimals
        return f"<{end + step:.{decimals}f}" if x > end else f">{end - step:.{decimals}f}"
    return text


def percent(part: int, whole: int) -> str:
    """A share in percent, "-" of nothing; only nothing is "0 %" and only everything is "100 %"."""
    if whole <= 0:
        return "-"
    if part <= 0:
        return "0 %"
    if part >= whole:
        return "100 %"
    share = 100 * part / whole
    return "<0.1 %" if share < 0.1 else ">99.9 %" if share > 99.9 else f"{share:.1f} %"


def size(n: int) -> str:
    """A count with thousands set apart."""
    return f"{n:,}"


def plural(n: int, noun: str) -> str:
    """ "1 cell", "2 cells", "2 entries"."""
    if n == 1:
        return f"1 {noun}"
    ending = noun[:-1] + "ies" if noun.endswith("y") else noun + "s"
    return f"{size(n)} {ending}"


def not_defined(tables: dict[str, Any], kinds: Iterable[str]) -> str:
    """Which cells of a set of tables a table of these types says nothing about, "" for none."""
    counted = set(kinds)
    left = [plural(q["count"], f"{q['type']} cell") for q in tables["quality"] if q["type"] not in counted]
    return f"not defined for {', '.join(left)}" if left else ""


def name(text: str | None, longest: int = 40, none: str = "(no zone)") -> str:
    """A name from a file, safe for a terminal: one line, control characters escaped, cut with an ellipsis."""
    if text is None:
        return none
    return printable(text, longest) if text.strip() else "(unnamed)"


def markdown(text: str | None, longest: int = 120, none: str = "(no zone)") -> str:
    """A name from a file as Markdown text, safe inside a table: nothing in it is markup."""
    return "".join(f"\\{c}" if c in _MARKDOWN else c for c in name(text, longest, none))


def csv_cell(text: str | None) -> str:
    """A name from a file as a CSV field that no spreadsheet takes for a formula."""
    if text is None:
        return ""
    shown = f"'{text}" if text.startswith(_FORMULA_STARTS) else text
    return printable(shown, 10_000)
