"""Meshes for tests of reports: each small, each of another kind."""

import math

import numpy as np

from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)


def block_of_hexes(n=4, jitter=0.25, seed=3, zones=True, offset=0.0, scale=1.0):
    """n ** 3 jittered hexahedra in a cube, its lower half in zone "lower", with a wall below and one inverted cell."""
    k, j, i = np.meshgrid(*[np.arange(n + 1)] * 3, indexing="ij")
    points = np.column_stack([i.ravel(), j.ravel(), k.ravel()]).astype(float)
    inside = ((points > 0) & (points < n)).all(axis=1)
    points[inside] += np.random.default_rng(seed).uniform(-jitter, jitter, (int(inside.sum()), 3))
    first = np.array([x + (n + 1) * (y + (n + 1) * z) for z in range(n) for y in range(n) for x in range(n)])
    up, back = (n + 1) ** 2, n + 1
    hexes = first[:, None] + np.array([0, 1, back + 1, back, up, up + 1, up + back + 1, up + back])
    hexes[-1] = hexes[-1][[4, 5, 6, 7, 0, 1, 2, 3]]
    floor = np.array([x + back * y for y in range(n) for x in range(n)])
    quads = floor[:, None] + np.array([0, back, back + 1, 1])
    half = n**3 // 2
    named = (
        Zone("lower", "part", "fluid", "cell", np.arange(half)),
        Zone("upper", "part", "fluid", "cell", np.arange(half, n**3)),
        Zone("floor", "part", "wall", "face", np.arange(n * n)),
    )
    return Mesh(
        points * scale + offset,
        (CellBlock("hex", np.arange(n**3), hexes),),
        boundary=(CellBlock("quad", np.arange(n * n), quads),),
        zones=named if zones else (),
        cell_ids=np.arange(n**3) + 1001,
        path="block.msh",
        format="made",
    )


def plate():
    """A planar mesh of triangles and quadrilaterals."""
    points = np.array([(0, 0, 0), (1, 0, 0), (2, 0.3, 0), (0, 1, 0), (1, 1.2, 0), (2, 1, 0), (1, 2, 0)], float)
    blocks = (CellBlock("quad", [0, 1], [[0, 1, 4, 3], [1, 2, 5, 4]]), CellBlock("tri", [2, 3], [[3, 4, 6], [4, 5, 6]]))
    return Mesh(points, blocks, dimension=2, path="plate.msh", format="made")


def shell():
    """A surface in space: the outside of a cube in quadrilaterals, but for its lid."""
    quads = [[0, 3, 2, 1], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    return Mesh(CUBE, (CellBlock("quad", np.arange(5), quads),), path="shell.msh", format="made")


def one_tet():
    """The smallest mesh there is."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    return Mesh(points, (CellBlock("tet", [0], [[0, 1, 2, 3]]),), path="tet.msh", format="made")


def not_finite():
    """A block with a point that is no place."""
    mesh = block_of_hexes(3)
    points = mesh.points.copy()
    points[20, 1] = math.nan
    return Mesh(points, mesh.blocks, boundary=mesh.boundary, zones=mesh.zones, path="nan.msh", format="made")


def polyhedron():
    """Two cubes as polyhedra that share a face."""
    points = np.concatenate([CUBE, CUBE[[1, 2, 5, 6]] + (1, 0, 0)])
    loops = [[1, 2, 6, 5], [0, 4, 7, 3], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]
    loops += [[8, 9, 11, 10], [1, 8, 10, 5], [2, 6, 11, 9], [1, 2, 9, 8], [5, 10, 11, 6]]
    offsets = np.arange(0, 4 * len(loops) + 1, 4)
    owner = [0] * 6 + [1] * 5
    neighbour = [1] + [-1] * 10
    faces = Faces(offsets, np.concatenate(loops), owner, neighbour)
    cells = CellBlock("polyhedron", [0, 1], offsets=[0, 6, 12], items=[*range(6), 0, *range(6, 11)])
    return Mesh(points, (cells,), faces=faces, path="poly", format="made")


MESHES = {
    "block": block_of_hexes,
    "plate": plate,
    "shell": shell,
    "tet": one_tet,
    "not finite": not_finite,
    "polyhedron": polyhedron,
}
