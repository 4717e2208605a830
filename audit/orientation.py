"""Which way the cells of a surface run around their edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, nodes_of_cells
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints, Mesh

__all__ = ["traversed_alike"]

Mask = NDArray[np.bool_]


def traversed_alike(mesh: Mesh) -> Mask:
    """(edges,) the edges of a surface mesh that both their cells traverse in one direction: their normals disagree."""
    found = faces(mesh)
    offsets, nodes = nodes_of_cells(mesh)
    corners = np.diff(offsets)
    for block in mesh.blocks:
        if block.items is None:
            corners[block.rows] = CELL_TYPES[block.type].n_corners
    return _runs_along(found.nodes, found.neighbour, offsets, nodes, corners)


@kernel
def _runs_along(edge_nodes: Ints, neighbour: Ints, offsets: Ints, nodes: Ints, corners: Ints) -> Mask:
    """Whether the neighbour, too, runs along each edge from its first node to its second, as the owner does."""
    out = np.zeros(neighbour.size, np.bool_)
    for e in range(neighbour.size):
        c = neighbour[e]
        if c >= 0:
            p = nodes[offsets[c] + corners[c] - 1]
            for i in range(corners[c]):
                q = nodes[offsets[c] + i]
                out[e] |= p == edge_nodes[2 * e] and q == edge_nodes[2 * e + 1]
                p = q
    return out
