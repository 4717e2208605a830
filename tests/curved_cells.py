"""Cells of second order for tests: straight ones, and the same with their nodes shaken."""

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.mesh import CellBlock, Mesh

SURFACES = ("tri6", "quad8", "quad9")
SOLIDS = ("tet10", "pyramid13", "wedge15", "hex20", "hex27")
TYPES = SURFACES + SOLIDS

CORNERS = {
    "tri": [(0, 0, 0), (1, 0, 0), (0, 1, 0)],
    "quad": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    "tet": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}
HEX_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))


def between(name):
    """For each node the corners in whose middle it stands in the straight cell, in VTK's node order."""
    cell = CELL_TYPES[name]
    sets = [(c,) for c in range(cell.n_corners)] + list(cell.edges)
    sets += {"quad9": [(0, 1, 2, 3)], "hex27": [*HEX_FACES, tuple(range(8))]}.get(name, [])
    return sets


def straight(name, corners=None):
    """(n, 3) nodes of the cell with straight edges."""
    corners = np.array(CORNERS[CELL_TYPES[name].corners] if corners is None else corners, float)
    return np.array([corners[list(group)].mean(axis=0) for group in between(name)])


def shaken(name, amplitude, n, seed=0):
    """(n, k, 3) straight cells whose nodes have moved; those of surface cells within their plane."""
    cell = straight(name)
    noise = np.random.default_rng(seed).uniform(-amplitude, amplitude, (n, *cell.shape))
    return cell + noise * ((1, 1, 0) if name in SURFACES else 1)


def with_mid_node(name, edge, along, aside=(0.0, 0.0, 0.0)):
    """The straight cell with the mid node of one edge at `along` between its ends, and moved aside."""
    points, cell = straight(name), CELL_TYPES[name]
    a, b = cell.edges[edge]
    points[cell.mid_edges[edge]] = points[a] + along * (points[b] - points[a]) + np.array(aside)
    return points


def mesh_of(name, cells, dimension=None):
    """A mesh of cells (n, k, 3) that share no nodes; surface cells in the x-y plane make it flat."""
    cells = np.asarray(cells, float)
    if dimension is None:
        dimension = 2 if name in SURFACES and not cells[..., 2].any() else 3
    nodes = np.arange(cells.shape[0] * cells.shape[1]).reshape(cells.shape[:2])
    return Mesh(cells.reshape(-1, 3), (CellBlock(name, np.arange(len(cells)), nodes),), dimension=dimension)
