"""Columns of numbers out of a text source: so many, in that range, or an error that names the line and the token.

The grammar of a number is that of `tokens`, whose scanners are offered here as well, for readers with records
of their own.
"""

from __future__ import annotations

import re
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.errors import ReadError
from meshwright.audit.jit import kernel
from meshwright.audit.readers.source import Source
from meshwright.audit.readers.tokens import (
    float_at,
    hex_at,
    int_at,
    is_space,
    parse_float,
    parse_hex,
    parse_int,
    pass_space,
    pointer,
    skip_space,
)

__all__ = ["float_at", "hex_at", "int_at", "read_all_ints", "read_floats", "read_ints", "skip_space"]

Bytes = NDArray[np.uint8]

_LONGEST_TOKEN = 400


@kernel
def _fill_ints(buf: Bytes, pos: int, stop: int, out: NDArray[np.int64]) -> tuple[int, int, bool]:
    """Read decimal integers into `out`; (how many, the offset after them or of what stopped them, ok)."""
    text = pointer(buf)  # type: ignore[call-arg,var-annotated]
    for i in range(len(out)):
        pos = pass_space(text, pos, stop)
        if pos >= stop:
            return i, pos, True
        value, after, ok = parse_int(text, pos, stop)
        if not ok:
            return i, pos, False
        out[i] = value
        pos = after
    return len(out), pos, True


@kernel
def _fill_hexes(buf: Bytes, pos: int, stop: int, out: NDArray[np.int64]) -> tuple[int, int, bool]:
    """The same for hexadecimal ones."""
    text = pointer(buf)  # type: ignore[call-arg,var-annotated]
    for i in range(len(out)):
        pos = pass_space(text, pos, stop)
        if pos >= stop:
            return i, pos, True
        value, after, ok = parse_hex(text, pos, stop)
        if not ok:
            return i, pos, False
        out[i] = value
        pos = after
    return len(out), pos, True


@kernel
def _fill_floats(buf: Bytes, pos: int, stop: int, finite: bool, out: NDArray[np.float64]) -> tuple[int, int, bool]:
    """The same for floats."""
    text = pointer(buf)  # type: ignore[call-arg,var-annotated]
    for i in range(len(out)):
        pos = pass_space(text, pos, stop)
        if pos >= stop:
            return i, pos, True
        value, after, ok = parse_float(text, pos, stop)
        if not ok or (finite and not np.isfinite(value)):
            return i, pos, False
        out[i] = value
        pos = after
    return len(out), pos, True


@kernel
def _count_tokens(buf: Bytes, start: int, stop: int) -> int:
    """How many runs of bytes other than white space there are."""
    n = 0
    before = True
    for at in range(start, stop):
        space = is_space(buf[at])
        n += before and not space
        before = space
    return n


def read_ints(
    source: Source, start: int, stop: int, count: int, what: str, *, base: Literal[10, 16] = 10
) -> tuple[NDArray[np.int64], int]:
    """Exactly `count` integers from `start`, none beyond `stop`: ((count,) int64, offset after the last).

    what: one of them in a word or two ("node id"). base: 10 or 16. Raises ReadError.
    """
    out = np.empty(_room(source, start, stop, count, what), np.int64)
    fill = _fill_hexes if base == 16 else _fill_ints
    n, pos, ok = fill(source.data, start, stop, out)
    if not ok:
        raise _bad_int(source, pos, stop, what, base)
    if n < count:
        raise _too_few(source, stop, n, f"{count} integers ({what})")
    return out, pos


def read_floats(
    source: Source, start: int, stop: int, count: int, what: str, *, finite: bool = True
) -> tuple[NDArray[np.float64], int]:
    """Exactly `count` floats from `start`, none beyond `stop`: ((count,) float64, offset after the last).

    what: one of them in a word or two ("coordinate"). finite: refuse nan and inf. Raises ReadError.
    """
    out = np.empty(_room(source, start, stop, count, what), np.float64)
    n, pos, ok = _fill_floats(source.data, start, stop, finite, out)
    if not ok:
        raise _bad_float(source, pos, stop, what)
    if n < count:
        raise _too_few(source, stop, n, f"{count} numbers ({what})")
    return out, pos


def read_all_ints(source: Source, start: int, stop: int, what: str, *, base: Literal[10, 16] = 10) -> NDArray[np.int64]:
    """Every integer from `start` to `stop`, where nothing else but white space may stand. Raises ReadError."""
    _check_range(source, start, stop)
    out, pos = read_ints(source, start, stop, int(_count_tokens(source.data, start, stop)), what, base=base)
    pos = int(skip_space(source.data, pos, stop))
    if pos < stop:
        raise _bad_int(source, pos, stop, what, base)
    return out


def _check_range(source: Source, start: int, stop: int) -> None:
    # The kernels do not check bounds, so a reader's slip would read foreign memory.
    if not 0 <= start <= stop <= len(source):
        raise ValueError(f"range {start} to {stop} of a source of {len(source)} bytes")


def _room(source: Source, start: int, stop: int, count: int, what: str) -> int:
    """How many numbers to make room for: `count`, but no more than the bytes can spell."""
    _check_range(source, start, stop)
    if count < 0:
        raise source.error(start, f"a count of numbers ({what})", str(count))
    return min(count, (stop - start + 1) // 2)


def _too_few(source: Source, stop: int, found: int, expected: str) -> ReadError:
    return source.error(stop, expected, f"{found} before {source.quote(stop)}")


def _token(source: Source, pos: int, stop: int) -> str:
    """The token at `pos`, as far as a message needs it; a single '(' or ')' is one."""
    text = source.data[pos : min(stop, pos + _LONGEST_TOKEN)].tobytes()
    return (re.split(rb"[ \t-\r()]", text, maxsplit=1)[0] or text[:1]).decode("utf-8", "backslashreplace")


def _bad_int(source: Source, pos: int, stop: int, what: str, base: int) -> ReadError:
    token = _token(source, pos, stop)
    kind = "a hexadecimal integer" if base == 16 else "an integer"
    digits = "[0-9a-fA-F]" if base == 16 else "[0-9]"
    size = " of at most 64 bits" if re.fullmatch(f"[+-]?{digits}+", token) else ""
    return source.error(pos, f"{kind}{size} ({what})", f"'{token}'")


def _bad_float(source: Source, pos: int, stop: int, what: str) -> ReadError:
    token = _token(source, pos, stop)
    kind = "a number"
    if re.fullmatch(r"[+-]?(nan|inf|infinity)", token, re.IGNORECASE):
        kind = "a finite number"
    elif re.fullmatch(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eEdD][+-]?[0-9]+)?", token):
        kind = "a number below 1.8e308"
    return source.error(pos, f"{kind} ({what})", f"'{token}'")
