"""Compiled scanners for one number in text, with a strict grammar.

A number ends at white space (blank, tab, LF, VT, FF, CR), at '(' or ')' or at the end of the range.
Integers: [+-]digits. Floats: [+-]digits[.digits][(e|E|d|D)[+-]digits], where either side of the point may be
empty, and nan, inf, infinity in any case. Nothing else: no 1_000, 1,5, 0x10, no digits outside ASCII. Floats are
correctly rounded, bit for bit what Python's float() makes of them; one that overflows is refused, one that
underflows is 0 or subnormal.

None of these checks bounds: 0 <= pos and stop <= len(buf) are the caller's to know.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.readers.decimals import INFINITE_BITS, as_double, nearest_double, side_of_halfway

__all__ = [
    "Pointer",
    "float_at",
    "hex_at",
    "int_at",
    "is_space",
    "parse_float",
    "parse_hex",
    "parse_int",
    "pass_space",
    "pointer",
    "skip_space",
]

Bytes = NDArray[np.uint8]
Pointer = Any
"""To the first byte of such an array."""

_INT64_END = np.uint64(1 << 63)
_LONGEST_WORD = 8
_EXPONENT_CAP = 10**17


@intrinsic
def pointer(typing: Any, buf: Any) -> Any:
    """A pointer to the first byte of an array.

    Arrays are counted references: handing one on costs two atomic operations, more than scanning a short number does.
    """

    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return make_array(signature.args[0])(context, builder, values[0]).data

    return types.CPointer(types.uint8)(buf), build


@inner
def is_space(byte: int) -> bool:
    """Whether a byte is blank, tab, LF, VT, FF or CR."""
    return byte == 32 or 9 <= byte <= 13


@inner
def _ends(buf: Pointer, pos: int, stop: int) -> bool:
    """Whether a token may end before `pos`."""
    return pos >= stop or buf[pos] == 40 or buf[pos] == 41 or is_space(buf[pos])


@inner
def pass_space(buf: Pointer, pos: int, stop: int) -> int:
    """`skip_space` for kernels."""
    while pos < stop and is_space(buf[pos]):
        pos += 1
    return pos


@inner
def _signed(magnitude: np.uint64, negative: bool) -> tuple[np.int64, bool]:
    """(int64, fits) of a uint64 magnitude and a sign."""
    if negative:
        return -np.int64(magnitude), bool(magnitude <= _INT64_END)
    return np.int64(magnitude), bool(magnitude < _INT64_END)


@inner
def _digits(buf: Pointer, at: int, stop: int, value: np.uint64) -> tuple[np.uint64, int]:
    """(value, next offset): the decimal digits from `at` on behind those of a uint64 value, modulo 2**64."""
    while at < stop:
        digit = np.int64(buf[at]) - 48
        if digit < 0 or digit > 9:
            break
        value = value * np.uint64(10) + np.uint64(digit)
        at += 1
    return value, at


@inner
def parse_int(buf: Pointer, pos: int, stop: int) -> tuple[np.int64, int, bool]:
    """`int_at` for kernels."""
    at = pos
    negative = at < stop and buf[at] == 45
    if at < stop and (buf[at] == 43 or buf[at] == 45):
        at += 1
    first = at
    value, at = _digits(buf, at, stop, np.uint64(0))
    if at == first or not _ends(buf, at, stop):
        return np.int64(0), pos, False
    if at - first > 19:  # 19 digits fit in 64 bits; more are allowed when they are leading zeros
        while first < at and buf[first] == 48:
            first += 1
        if at - first > 19:
            return np.int64(0), pos, False
    number, fits = _signed(value, negative)
    return (number, at, True) if fits else (np.int64(0), pos, False)


@inner
def parse_hex(buf: Pointer, pos: int, stop: int) -> tuple[np.int64, int, bool]:
    """`hex_at` for kernels."""
    at = pos
    negative = at < stop and buf[at] == 45
    if at < stop and (buf[at] == 43 or buf[at] == 45):
        at += 1
    first = at
    value = np.uint64(0)
    while at < stop:
        digit = np.int64(buf[at]) - 48
        if digit < 0 or digit > 9:
            digit = (np.int64(buf[at]) | 32) - 87  # a to f, A to F
            if digit < 10 or digit > 15:
                break
        value = value * np.uint64(16) + np.uint64(digit)
        at += 1
    if at == first or not _ends(buf, at, stop):
        return np.int64(0), pos, False
    if at - first > 16:
        while first < at and buf[first] == 48:
            first += 1
        if at - first > 16:
            return np.int64(0), pos, False
    number, fits = _signed(value, negative)
    return (number, at, True) if fits else (np.int64(0), pos, False)


@inner
def _word_at(buf: Pointer, at: int, stop: int) -> tuple[float, int]:
    """(value, next offset) of nan, inf or infinity at `at`, any case; next is `at` when there is none."""
    size = 0
    letters = np.int64(0)
    while at + size < stop and size <= _LONGEST_WORD and not _ends(buf, at + size, stop):
        letters = letters << 5 | (np.int64(buf[at + size]) & 31)
        if np.int64(buf[at + size]) | 32 < 97 or np.int64(buf[at + size]) | 32 > 122:
            return 0.0, at
        size += 1
    if size == 3 and letters == _NAN:
        return np.nan, at + size
    if (size == 3 and letters == _INF) or (size == _LONGEST_WORD and letters == _INFINITY):
        return np.inf, at + size
    return 0.0, at


def _code(word: bytes) -> int:
    """Five bits a letter, as `_word_at` packs them."""
    code = 0
    for letter in word:
        code = code << 5 | (letter & 31)
    return code


_NAN, _INF, _INFINITY = _code(b"nan"), _code(b"inf"), _code(b"infinity")


@inner
def _long_double(buf: Pointer, first: int, stop: int, exponent: int) -> np.uint64:
    """Bits of the double nearest to a decimal of 20 digits or more, leading zeros counted.

    first, stop: where its digits, and perhaps a '.', stand. exponent: weight of the last digit.
    """
    while first < stop and (buf[first] == 48 or buf[first] == 46):
        first += 1
    value = np.uint64(0)
    n = 0
    rest = 0
    for at in range(first, stop):
        if buf[at] != 46:
            if n < 19:
                value = value * np.uint64(10) + np.uint64(np.int64(buf[at]) - 48)
                n += 1
            else:
                rest += 1
    low = nearest_double(value, exponent + rest)
    if rest == 0 or low == nearest_double(value + np.uint64(1), exponent + rest):
        return low
    side = side_of_halfway(buf, first, stop, exponent, low)
    if side > 0 or (side == 0 and low & np.uint64(1)):
        low += np.uint64(1)
    return low


@inner
def parse_float(buf: Pointer, pos: int, stop: int) -> tuple[float, int, bool]:
    """`float_at` for kernels."""
    at = pos
    negative = at < stop and buf[at] == 45
    if at < stop and (buf[at] == 43 or buf[at] == 45):
        at += 1
    first = at
    significand, at = _digits(buf, at, stop, np.uint64(0))
    n_digits = at - first
    exponent = np.int64(0)
    if at < stop and buf[at] == 46:
        at += 1
        point = at
        significand, at = _digits(buf, at, stop, significand)
        exponent = np.int64(point - at)
        n_digits += at - point
    if n_digits == 0:
        word, end = _word_at(buf, first, stop)
        if end == first:
            return 0.0, pos, False
        return (-word if negative else word), end, True
    last = at
    if at < stop and (buf[at] | 32 == 101 or buf[at] | 32 == 100):
        at += 1
        down = at < stop and buf[at] == 45
        if at < stop and (buf[at] == 43 or buf[at] == 45):
            at += 1
        begin = at
        power = np.int64(0)
        while at < stop:
            digit = np.int64(buf[at]) - 48
            if digit < 0 or digit > 9:
                break
            if power < _EXPONENT_CAP:  # beyond, no number of digits brings the value back into range
                power = power * 10 + digit
            at += 1
        if at == begin:
            return 0.0, pos, False
        exponent += -power if down else power
    if not _ends(buf, at, stop):
        return 0.0, pos, False
    bits = nearest_double(significand, exponent) if n_digits <= 19 else _long_double(buf, first, last, exponent)
    if bits == INFINITE_BITS:
        return 0.0, pos, False
    if negative:
        bits |= _INT64_END
    return as_double(bits), at, True  # type: ignore[call-arg]


@kernel
def int_at(buf: Bytes, pos: int, stop: int) -> tuple[np.int64, int, bool]:
    """(value int64, next offset, ok) of the decimal integer that begins at `pos`; not ok: next is `pos`."""
    return parse_int(pointer(buf), pos, stop)  # type: ignore[call-arg]


@kernel
def hex_at(buf: Bytes, pos: int, stop: int) -> tuple[np.int64, int, bool]:
    """(value int64, next offset, ok) of the hexadecimal integer, either case and no prefix, that begins at `pos`."""
    return parse_hex(pointer(buf), pos, stop)  # type: ignore[call-arg]


@kernel
def float_at(buf: Bytes, pos: int, stop: int) -> tuple[float, int, bool]:
    """(value float64, next offset, ok) of the number that begins at `pos`, nan and inf included.

    Not ok (not a number, or one that overflows): next is `pos`.
    """
    return parse_float(pointer(buf), pos, stop)  # type: ignore[call-arg]


@kernel
def skip_space(buf: Bytes, pos: int, stop: int) -> int:
    """First offset from `pos` that is not white space, or `stop`."""
    return pass_space(pointer(buf), pos, stop)  # type: ignore[call-arg]
