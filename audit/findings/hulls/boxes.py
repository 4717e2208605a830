"""A tree of boxes around things on a surface: which of them come near a point or another box.

The boxes are put in the order of a space-filling curve (Morton) and eight of them make a leaf; the leaves are those of
a complete binary tree stored as a heap. Whatever the grading or stretching of a mesh, a query visits a few dozen
nodes, and nothing needs tuning.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["LEAF", "Tree", "box_tree", "boxes_around", "boxes_near"]

LEAF = 8

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Tree:
    """order (m,): the things along the curve.  boxes (m, 6): low and high corner of each, in that order.

    nodes (2 p, 6): box of each node of the heap; node 1 is the root, node p + k the leaf of things 8 k to 8 k + 7.
    """

    order: Ints
    boxes: Floats
    nodes: Floats


def box_tree(low: Floats, high: Floats) -> Tree:
    """The tree of m boxes with these corners, (m, 3) each, all finite and well inside the range of floats."""
    m = len(low)
    order = np.argsort(_codes(low, high), kind="stable").astype(np.int32)
    leaves = 1
    while leaves * LEAF < m:
        leaves *= 2
    boxes = np.empty((m, 6))
    nodes = np.empty((2 * leaves, 6))
    _fill(low, high, order, boxes, nodes)
    return Tree(order, boxes, nodes)


@kernel
def _codes(low: Floats, high: Floats) -> NDArray[np.uint64]:
    """(m,) place of the centre of each box on Morton's curve, 21 bits an axis."""
    m = low.shape[0]
    out = np.zeros(m, np.uint64)
    for d in range(3):
        least, most = np.inf, -np.inf
        for i in range(m):
            centre = 0.5 * low[i, d] + 0.5 * high[i, d]
            least, most = min(least, centre), max(most, centre)
        step = 2097151.0 / (most - least) if most > least else 0.0
        for i in range(m):
            x = np.uint64((0.5 * low[i, d] + 0.5 * high[i, d] - least) * step)
            x = (x | (x << np.uint64(32))) & np.uint64(0x1F00000000FFFF)
            x = (x | (x << np.uint64(16))) & np.uint64(0x1F0000FF0000FF)
            x = (x | (x << np.uint64(8))) & np.uint64(0x100F00F00F00F00F)
            x = (x | (x << np.uint64(4))) & np.uint64(0x10C30C30C30C30C3)
            x = (x | (x << np.uint64(2))) & np.uint64(0x1249249249249249)
            out[i] |= x << np.uint64(d)
    return out


@kernel
def _fill(low: Floats, high: Floats, order: Ints, boxes: Floats, nodes: Floats) -> None:
    nodes[:, :3] = np.inf
    nodes[:, 3:] = -np.inf
    p = nodes.shape[0] // 2
    for i in range(order.size):
        k = p + i // LEAF
        for d in range(3):
            boxes[i, d] = low[order[i], d]
            boxes[i, 3 + d] = high[order[i], d]
            nodes[k, d] = min(nodes[k, d], boxes[i, d])
            nodes[k, 3 + d] = max(nodes[k, 3 + d], boxes[i, 3 + d])
    for k in range(p - 1, 0, -1):
        for d in range(3):
            nodes[k, d] = min(nodes[2 * k, d], nodes[2 * k + 1, d])
            nodes[k, 3 + d] = max(nodes[2 * k, 3 + d], nodes[2 * k + 1, 3 + d])


@inner
def _apart(boxes: Floats, i: int, box: Floats) -> bool:
    return (
        boxes[i, 0] > box[3]
        or boxes[i, 3] < box[0]
        or boxes[i, 1] > box[4]
        or boxes[i, 4] < box[1]
        or boxes[i, 2] > box[5]
        or boxes[i, 5] < box[2]
    )


@inner
def boxes_near(boxes: Floats, nodes: Floats, box: Floats, out: Ints) -> int:
    """How many boxes touch `box` (6,); as many of their places along the curve as `out` can hold are written to it."""
    found = 0
    p = nodes.shape[0] // 2
    # A depth-first walk of a heap needs no stack: down to the left child, and up past right children.
    k = 1
    while True:
        if not _apart(nodes, k, box):
            if k < p:
                k *= 2
                continue
            first = (k - p) * LEAF
            for i in range(first, min(first + LEAF, boxes.shape[0])):
                if not _apart(boxes, i, box):
                    if found < out.size:
                        out[found] = i
                    found += 1
        while k & 1:
            k >>= 1
        if k == 0:
            return found
        k += 1


@inner
def boxes_around(boxes: Floats, heap: Floats, point: Floats, margin: float, near: Ints) -> tuple[Ints, int]:
    """(places in the order of the tree, how many) of the boxes within `margin` of a point along every axis.

    near: room to use; more is made where it does not hold them.
    """
    box = np.empty(6)
    for d in range(3):
        box[d], box[3 + d] = point[d] - margin, point[d] + margin
    count = boxes_near(boxes, heap, box, near)
    if count > near.size:
        near = np.empty(2 * count, np.int32)
        count = boxes_near(boxes, heap, box, near)
    return near, count
