"""Order statistics without sorting: the values at given ranks of many floats."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel

__all__ = ["at_ranks"]

Floats = NDArray[np.float64]

_FEW = 1 << 14
"""Values below which numpy's partition is as fast."""

_BITS = 16


def at_ranks(values: Floats, ranks: Iterable[int]) -> dict[int, float]:
    """The value at each of these ranks (0 for the smallest) of (n,) values without nan.

    Values are counted by the upper bits of their ordered bit patterns; only those that share them with a wanted one are
    sorted out further. -0.0 comes before 0.0.
    """
    wanted = sorted(set(ranks))
    if len(values) < _FEW:
        ordered = np.partition(values, wanted)
        return {rank: float(ordered[rank]) for rank in wanted}
    bits = np.ascontiguousarray(values).view(np.int64)
    ends = np.cumsum(_count(bits))
    found: dict[int, float] = {}
    slots = np.searchsorted(ends, wanted, side="right")
    for slot in np.unique(slots).tolist():
        first = int(ends[slot - 1]) if slot else 0
        here = [rank for rank, of in zip(wanted, slots.tolist(), strict=True) if of == slot]
        members = _members(bits, slot, int(ends[slot]) - first).view(np.float64)
        places = [rank - first for rank in here]
        ordered = np.partition(members, places)
        found |= {rank: float(ordered[place]) for rank, place in zip(here, places, strict=True)}
    return found


@inner
def _slot(bits: int) -> int:
    """Upper bits of a float's pattern, turned so that they order as the floats do."""
    turned = bits ^ ((bits >> 63) & 0x7FFFFFFFFFFFFFFF)
    return (turned >> (64 - _BITS)) + (1 << (_BITS - 1))


@kernel
def _count(bits: NDArray[np.int64]) -> NDArray[np.int64]:
    counts = np.zeros(1 << _BITS, np.int64)
    for i in range(bits.size):
        counts[_slot(bits[i])] += 1
    return counts


@kernel
def _members(bits: NDArray[np.int64], slot: int, n: int) -> NDArray[np.int64]:
    """The n values in one slot, in their order."""
    found = np.empty(n, np.int64)
    k = 0
    for i in range(bits.size):
        if _slot(bits[i]) == slot:
            found[k] = bits[i]
            k += 1
    return found
