"""The kernel that finds pairs of points of a hull that lie close together without being neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.hulls.boxes import boxes_around
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["close_pairs"]

Floats = NDArray[np.float64]


@inner
def _neighbours(offsets: Ints, nodes: Ints, starts: Ints, around: Ints, p: int, q: int) -> bool:
    """Whether p and q are corners of one facet, or of two facets that have a corner in common."""
    found = False
    for i in range(starts[p], starts[p + 1]):
        for k in range(offsets[around[i]], offsets[around[i] + 1]):
            r = nodes[k]
            for j in range(starts[q], starts[q + 1]):
                for m in range(offsets[around[j]], offsets[around[j] + 1]):
                    found |= nodes[m] == r
    return found


@inner
def _behind(x: Floats, normal: Floats, starts: Ints, around: Ints, p: int, q: int) -> bool:
    """Whether q lies on the inner side of the surface around p: what is between them is meshed."""
    out = 0.0
    for i in range(starts[p], starts[p + 1]):
        for d in range(3):
            out += (x[q, d] - x[p, d]) * normal[around[i], d]
    return out < 0.0


@kernel
def close_pairs(
    x: Floats,
    reach: Floats,
    normal: Floats,
    offsets: Ints,
    nodes: Ints,
    starts: Ints,
    around: Ints,
    order: Ints,
    boxes: Floats,
    heap: Floats,
    most: float,
    first: Ints,
    second: Ints,
    distances: Floats,
) -> int:
    """(p, q, distance), p < q: different places no further apart than `most` times the shortest edges at both: how
    many, for `collected`.

    Left out are points on two sides of what is meshed, by the normals (m, 3) of the facets, outward or 0; corners of
    one facet; and corners one facet further on, which are close where a surface folds sharply.
    """
    n = 0
    near = np.empty(256, np.int32)
    for i in range(order.size):
        p = order[i]
        if not reach[p] < np.inf:
            continue
        margin = most * reach[p]
        near, count = boxes_around(boxes, heap, x[p], margin, near)
        for k in range(count):
            q = order[near[k]]
            if q == p:
                continue
            square = (x[p, 0] - x[q, 0]) ** 2 + (x[p, 1] - x[q, 1]) ** 2 + (x[p, 2] - x[q, 2]) ** 2
            # each pair once: from the end with the shorter edges, which cannot miss the other
            if reach[q] < reach[p] or (reach[q] == reach[p] and q < p):
                continue
            if not 0.0 < square <= margin * margin:
                continue
            if _behind(x, normal, starts, around, p, q) or _behind(x, normal, starts, around, q, p):
                continue
            if _neighbours(offsets, nodes, starts, around, p, q):
                continue
            if n < first.size:
                first[n], second[n], distances[n] = min(p, q), max(p, q), np.sqrt(square)
            n += 1
    return n
