"""Conforming random meshes of tets, pyramids, wedges and hexes for the tests, with their faces by brute force.

Loaded with `runpy.run_path` by the tests that need it.
"""

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.mesh import CellBlock, Faces, Mesh

ORDER = ("tet", "pyramid", "wedge", "hex")


def hybrid_mesh(seed, n=3, jitter=0.1):
    """n x n x n boxes: columns split into wedges, boxes into six pyramids, outer pyramids into two tets each."""
    rng = np.random.default_rng(seed)
    line = np.arange(n + 1.0)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    points = list(grid + rng.uniform(-jitter, jitter, grid.shape))
    row = lambda i, j, k: (i * (n + 1) + j) * (n + 1) + k  # noqa: E731
    cells = []
    for i in range(n):
        for j in range(n):
            column_of_wedges = rng.random() < 0.3
            for k in range(n):
                box = [row(i + a, j + b, k + c) for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                if column_of_wedges:
                    cells += [("wedge", [box[v] for v in half]) for half in ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7))]
                elif rng.random() < 0.5:
                    cells.append(("hex", box))
                else:
                    points.append(np.mean([points[v] for v in box], axis=0))
                    apex = len(points) - 1
                    outside = (k == 0, k == n - 1, j == 0, i == n - 1, j == n - 1, i == 0)
                    for side, outer in zip(CELL_TYPES["hex"].faces, outside, strict=True):
                        a, b, c, d = (box[v] for v in side)
                        if outer and rng.random() < 0.5:
                            cells += [("tet", [a, c, b, apex]), ("tet", [a, d, c, apex])]
                        else:
                            cells.append(("pyramid", [a, d, c, b, apex]))
    order = rng.permutation(len(cells))
    cells = [cells[c] for c in order]
    blocks = []
    for name in ORDER:
        rows = [r for r, cell in enumerate(cells) if cell[0] == name]
        if rows:
            blocks.append(CellBlock(name, np.array(rows), np.array([cells[r][1] for r in rows])))
    return Mesh(np.array(points), tuple(blocks))


def sides_of_cells(mesh):
    """Outward faces (tuples of nodes) of every cell, by row, from the reference tables alone."""
    sides = [None] * mesh.n_cells
    for block in mesh.blocks:
        kind = CELL_TYPES[block.type]
        tables = kind.edges if kind.dimension == 2 else kind.faces
        for row, nodes in zip(block.rows.tolist(), block.nodes.tolist(), strict=True):
            sides[row] = [tuple(nodes[v] for v in side) for side in tables]
    return sides


def turned(face):
    """The face started at its smallest node: equal for equal cycles, different for the reverse."""
    at = face.index(min(face))
    return (*face[at:], *face[:at])


def faces_by_brute_force(mesh):
    """[(nodes as the owner sees them, owner, neighbour)] with a dictionary, by owner row and local face."""
    found = {}
    for row, sides in enumerate(sides_of_cells(mesh)):
        for side in sides:
            key = frozenset(side)
            if key in found:
                found[key][2] = row
            else:
                found[key] = [side, row, -1]
    return [tuple(face) for face in found.values()]


def with_shuffled_faces(mesh, rng):
    """(the mesh with its faces in another order, some told from the other side; the rows of the old order)."""
    table = faces(mesh)
    order = rng.permutation(len(table))
    loops, owner, neighbour = [], [], []
    for f in order.tolist():
        loop = np.roll(table.nodes[table.offsets[f] : table.offsets[f + 1]], rng.integers(9))
        a, b = int(table.owner[f]), int(table.neighbour[f])
        if b >= 0 and rng.random() < 0.5:
            a, b, loop = b, a, loop[::-1]
        loops.append(loop)
        owner.append(a)
        neighbour.append(b)
    shuffled = Faces(np.cumsum([0, *map(len, loops)]), np.concatenate(loops), owner, neighbour)
    return Mesh(mesh.points, mesh.blocks, faces=shuffled), order
