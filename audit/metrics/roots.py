"""Cube roots of a row of lanes, as vector code: the library's function takes one number at a time."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.tile import LANES

__all__ = ["cube_roots"]

_TWO, _FOUR, _EIGHT, _SIXTEEN = np.uint64(2), np.uint64(4), np.uint64(8), np.uint64(16)
_START = np.uint64(int((1023.0 - 341.0 - 0.03306235651) * 2.0**52))
"""Two thirds of the exponent's bias, and a shift that halves the error of the first guess (Kahan's)."""


@inner
def cube_roots(values, out):  # type: ignore[no-untyped-def]
    """Cube roots of values (L,) into out (L,), another row; 0 for values below 2**-1022, inf for inf.

    A third of the bits of a number, read as an integer, is within 6 % of the bits of its root. Three steps of Halley's
    method then leave an error of a few ulp.
    """
    bits, guess = values.view(np.uint64), out.view(np.uint64)
    for i in range(LANES):
        third = (bits[i] >> _TWO) + (bits[i] >> _FOUR)  # 5/16, then 1/3 (1 - 2**-8), 1/3 (1 - 2**-16), ...
        third += third >> _FOUR
        third += third >> _EIGHT
        third += third >> _SIXTEEN
        guess[i] = third + _START
    for i in range(LANES):
        value, root = values[i], out[i]
        cube = root * root * root
        root = root * ((cube + 2.0 * value) / (2.0 * cube + value))
        cube = root * root * root
        root = root * ((cube + 2.0 * value) / (2.0 * cube + value))
        cube = root * root * root
        root = root * ((cube + 2.0 * value) / (2.0 * cube + value))
        root = root if value >= 2.2250738585072014e-308 else 0.0
        out[i] = root if value < math.inf else value
