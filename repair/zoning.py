"""Which zones an entity is in, as one number."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from meshwright.audit.mesh import Ints, Zone

__all__ = ["zone_numbers"]


def zone_numbers(zones: Iterable[Zone], n: int) -> Ints:
    """(n,) a number from 0 for the zones that each of n entities is in, the same where they are the same."""
    out: Ints = np.zeros(n, np.int32)
    for zone in zones:
        inside = np.zeros(n, np.int32)
        inside[zone.members] = 1
        out = np.unique(2 * out + inside, return_inverse=True)[1].astype(np.int32)
    return out
