"""Morton's curve through space: what lies near each other gets places near each other in memory."""

from __future__ import annotations

import numpy as np

from meshwright.audit.mesh import Floats, Ints

__all__ = ["along_curve"]

_BITS = 16
"""Bits of the curve in each direction."""


def along_curve(points: Floats) -> Ints:
    """Rows of points (n, 3) in the order in which the curve passes them."""
    if not len(points):
        return np.empty(0, np.int64)
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.where(high > low, high - low, 1.0)
    cell = ((points - low) / size * (2**_BITS - 1)).astype(np.uint64)
    for shift, mask in (
        (16, 0x0000FF0000FF), (8, 0x00F00F00F00F), (4, 0x0C30C30C30C3), (2, 0x249249249249),
    ):  # fmt: skip
        # make room: each bit ends up with two free ones beside it
        cell = (cell | (cell << np.uint64(shift))) & np.uint64(mask)
    return np.argsort(cell[:, 0] | (cell[:, 1] << np.uint64(1)) | (cell[:, 2] << np.uint64(2)), kind="stable")
