"""From decimal digits to the nearest double, in compiled code: Eisel-Lemire, with exact integers for the rest.

Sources: D. Lemire, "Number parsing at a gigabyte per second" (2021); N. Mushtak and D. Lemire, "Fast number
parsing without fallback" (2023), which proves that a significand of at most 64 bits is always decided.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from meshwright.audit.jit import inner

__all__ = ["INFINITE_BITS", "as_double", "nearest_double", "side_of_halfway"]

_LOWEST, _HIGHEST = -342, 308
INFINITE_BITS = np.uint64(0x7FF << 52)


def _powers_of_five() -> NDArray[np.uint64]:
    """(651, 2) the leading 128 bits, high word first, of 5**q for q from -342 to 308.

    Cut off, except that -27 <= q < 0 is rounded up, as the proof asks.
    """
    table = np.empty((_HIGHEST - _LOWEST + 1, 2), np.uint64)
    for row in range(len(table)):
        q = row + _LOWEST
        power = 5 ** abs(q)
        size = power.bit_length()
        if q < 0:
            bits = (1 << (size + 127)) // power + (q >= -27)
        else:
            bits = power << (128 - size) if size < 128 else power >> (size - 128)
        table[row] = bits >> 64, bits & (2**64 - 1)
    return table


_POWERS = _powers_of_five()


@intrinsic
def _high_product(typing: Any, a: Any, b: Any) -> Any:
    """The upper 64 bits of the 128-bit product of two uint64."""

    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        wide = ir.IntType(128)
        product = builder.mul(builder.zext(values[0], wide), builder.zext(values[1], wide))
        return builder.trunc(builder.lshr(product, ir.Constant(wide, 64)), ir.IntType(64))

    return types.uint64(types.uint64, types.uint64), build


@intrinsic
def _leading_zeros(typing: Any, a: Any) -> Any:
    """Zero bits above the highest set bit of a uint64 that is not 0."""

    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.ctlz(values[0], ir.Constant(ir.IntType(1), 1))

    return types.uint64(types.uint64), build


@intrinsic
def as_double(typing: Any, bits: Any) -> Any:
    """The float64 that a uint64 spells."""

    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.bitcast(values[0], ir.DoubleType())

    return types.float64(types.uint64), build


@inner
def nearest_double(w: np.uint64, q: int) -> np.uint64:
    """Bits of the double nearest to w * 10**q, ties to even; `INFINITE_BITS` on overflow. w: uint64, q: int64."""
    one = np.uint64(1)
    if w == 0 or q < _LOWEST:
        return np.uint64(0)
    if q > _HIGHEST:
        return INFINITE_BITS
    zeros = _leading_zeros(w)  # type: ignore[call-arg,var-annotated]
    w = w << zeros
    row = q - _LOWEST
    high = _high_product(w, _POWERS[row, 0])
    low = w * _POWERS[row, 0]
    if high & np.uint64(0x1FF) == np.uint64(0x1FF):  # all bits below the rounding ones set: look further
        more = _high_product(w, _POWERS[row, 1])
        low += more
        if more > low:
            high += one
    upper = high >> np.uint64(63)
    shift = upper + np.uint64(9)
    mantissa = high >> shift  # 54 bits: one more than fits
    # floor(q * log2(10)) + 63, exact for the q of the table
    exponent = ((217706 * q) >> 16) + 63 + np.int64(upper) - np.int64(zeros) + 1023
    if exponent <= 0:  # below the normal range
        if exponent < -62:
            return np.uint64(0)
        mantissa >>= np.uint64(1 - exponent)
        return (mantissa + (mantissa & one)) >> one  # a carry into bit 52 is the smallest normal number
    if low <= one and -4 <= q <= 23 and mantissa & np.uint64(3) == one and mantissa << shift == high:
        mantissa -= one  # exactly halfway and even below
    mantissa = (mantissa + (mantissa & one)) >> one
    if mantissa >> np.uint64(53):
        mantissa >>= one
        exponent += 1
    if exponent >= 0x7FF:
        return INFINITE_BITS
    return (np.uint64(exponent) << np.uint64(52)) | (mantissa & np.uint64((1 << 52) - 1))


# More digits than any halfway point between doubles has (767), so later ones only say "and a bit more".
_DIGITS = 800
_LIMBS = 128
"""32-bit limbs, least first: 4096 bits, where 10**-342 with 801 digits needs 2800."""


@inner
def _multiply_add(limbs: NDArray[np.uint32], size: int, factor: int, addend: int) -> int:
    """limbs = limbs * factor + addend (both below 2**32); the new size."""
    carry = np.uint64(addend)
    for i in range(size):
        carry += np.uint64(limbs[i]) * np.uint64(factor)
        limbs[i] = np.uint32(carry & np.uint64(0xFFFFFFFF))
        carry >>= np.uint64(32)
    if carry:
        limbs[size] = np.uint32(carry)
        size += 1
    return size


@inner
def _multiply_power(limbs: NDArray[np.uint32], size: int, base: int, step: int, times: int) -> int:
    """limbs = limbs * base**times, `step` factors at once (base**step < 2**32), none if times < 0; the new size."""
    power = base**step
    nothing = np.int64(0)
    while times >= step:
        size = _multiply_add(limbs, size, power, nothing)
        times -= step
    for _ in range(times):
        size = _multiply_add(limbs, size, base, nothing)
    return size


@inner
def side_of_halfway(buf: Any, pos: int, stop: int, exponent: int, low: np.uint64) -> int:
    """Sign of (the decimal) - (the point halfway from the double with bits `low` to the next one): -1, 0, 1.

    The decimal: its digits, the first of them not 0, and perhaps one '.', stand in `buf` (a pointer) from `pos` to
    `stop`; its last digit has the weight 10**exponent.
    """
    digits = np.empty(_LIMBS, np.uint32)
    half = np.empty(_LIMBS, np.uint32)
    n_digits = 0
    kept = 0
    beyond = False
    # Typed, since numba compiles a function anew for every literal it is called with.
    n, one, ten = np.int64(0), np.int64(1), np.int64(10)
    for at in range(pos, stop):
        if buf[at] != 46:
            n_digits += 1
            if kept < _DIGITS:
                kept += 1
                n = _multiply_add(digits, n, ten, np.int64(buf[at]) - 48)
            elif buf[at] != 48:
                beyond = True
    exponent += n_digits - kept
    if beyond:
        n = _multiply_add(digits, n, ten, one)
        exponent -= 1
    biased = np.int64(low >> np.uint64(52))
    mantissa = low & np.uint64((1 << 52) - 1)
    if biased:
        mantissa |= np.uint64(1 << 52)
    else:
        biased = np.int64(1)
    mantissa = (mantissa << np.uint64(1)) | np.uint64(1)
    binary = biased - 1076
    half[0] = np.uint32(mantissa & np.uint64(0xFFFFFFFF))
    half[1] = np.uint32(mantissa >> np.uint64(32))
    m = 2 if half[1] else 1
    # digits * 10**exponent against half * 2**binary: fives to the side where they multiply, then twos
    for base, step, times in ((5, 13, exponent), (2, 31, exponent - binary)):
        n = _multiply_power(digits, n, base, step, times)
        m = _multiply_power(half, m, base, step, -times)
    if n != m:
        return 1 if n > m else -1
    for i in range(n - 1, -1, -1):
        if digits[i] != half[i]:
            return 1 if digits[i] > half[i] else -1
    return 0
