"""`collected`: what a kernel finds, when nobody knows beforehand how much that is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["collected"]

_FIRST_GUESS = 4096


def collected(run: Callable[..., int], *dtypes: type[np.generic]) -> tuple[NDArray[Any], ...]:
    """The columns that `run` fills, cut to length.

    run(*columns): writes as many rows as the columns hold and returns how many there are in all. It is called once, and
    again where the columns were too short. Kernels that grow arrays themselves take seconds longer to compile.
    """
    size = _FIRST_GUESS
    while True:
        columns = tuple(np.empty(size, dtype) for dtype in dtypes)
        n = run(*columns)
        if n <= size:
            return tuple(column[:n] for column in columns)
        size = n
