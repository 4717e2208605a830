"""`repeated`: which rows repeat an earlier one, found by sorting one hash a row."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.mesh import Ints

__all__ = ["repeated", "repeats"]


def repeated(keys: NDArray[np.uint64], same: Callable[[Ints, Ints], NDArray[np.bool_]]) -> Ints:
    """Rows that are the same as the first row with their key, ascending.

    keys (n,): equal for equal rows.  same(rows, firsts): whether each of `rows` really equals its first. Rows that
    share a key with different ones by accident are compared with the first of them only: at 64 bits that happens
    once in a million meshes of three million faces.
    """
    twice = repeats(keys)
    if not len(twice):
        return np.empty(0, dtype=np.int64)
    place = np.minimum(np.searchsorted(twice, keys), len(twice) - 1)
    rows = np.flatnonzero(twice[place] == keys)
    place = place[rows]
    first = np.full(len(twice), len(keys), dtype=np.int64)
    np.minimum.at(first, place, rows)
    firsts = first[place]
    later = rows != firsts
    rows, firsts = rows[later], firsts[later]
    return rows[same(rows, firsts)]


def repeats(keys: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The keys that occur more than once.

    Sorting bare keys is an order of magnitude faster than sorting rows by them, and a sound mesh ends here.
    """
    ordered = np.sort(keys)
    return np.unique(ordered[1:][ordered[1:] == ordered[:-1]])
