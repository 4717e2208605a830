"""Meshes that need repair, made from fixed seeds; each has a known answer."""

import runpy
from pathlib import Path

import numpy as np

from meshwright.audit.connectivity import faces
from meshwright.audit.mesh import NO_CELL, CellBlock, Mesh, Zone

blocks = runpy.run_path(str(Path(__file__).parent.parent / "benchmarks" / "meshes.py"))

MIRROR = {"tet": [1, 0, 2, 3], "hex": [4, 5, 6, 7, 0, 1, 2, 3], "quad": [0, 3, 2, 1], "tri": [0, 2, 1],
          "wedge": [3, 4, 5, 0, 1, 2], "pyramid": [0, 3, 2, 1, 4]}  # fmt: skip


def solid(points, **cells):
    """A mesh of the cells given by type; 2 dimensions where z is 0 throughout."""
    blocks, at = [], 0
    for name, nodes in cells.items():
        blocks.append(CellBlock(name, np.arange(at, at + len(nodes)), np.asarray(nodes)))
        at += len(nodes)
    flat = next(iter(cells)) in ("tri", "quad") and not np.any(points[:, 2])
    return Mesh(points, tuple(blocks), dimension=2 if flat else 3)


def volume6(points, tets):
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)


def random_tets(n=250, seed=7):
    """Delaunay tets of random points in the unit cube: many slivers, all positive."""
    points, tets = blocks["random_tets"](n, seed)
    return solid(points, tet=tets)


def box(n=6, jitter=0.0, seed=11):
    """(points, hexes) of the unit cube in n^3 hexes, its inner points thrown about by `jitter` of an edge."""
    return blocks["thrown_block"](n, jitter, seed)


def square(n=8, jitter=0.0, seed=13):
    """(points, quads) of the unit square, its inner points thrown about by `jitter` of an edge."""
    r = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    points = np.c_[x.ravel(), y.ravel(), 0 * x.ravel()]
    inner = ((points[:, :2] > 1e-9) & (points[:, :2] < 1 - 1e-9)).all(axis=1)
    points[inner, :2] += r.uniform(-jitter / n, jitter / n, (int(inner.sum()), 2))
    at = np.array([[j * (n + 1) + i for i in range(n)] for j in range(n)]).ravel()
    return points, np.stack([at, at + 1, at + n + 2, at + n + 1], axis=1)


def random_triangles(n=10, seed=3):
    """The unit square in triangles: inner points thrown about, a third of the edges swapped at random."""
    points, quads = square(n, 0.35, seed)
    half = np.random.default_rng(seed).random(len(quads)) < 0.5
    one = np.where(half[:, None], quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
    two = np.where(half[:, None], quads[:, [0, 2, 3]], quads[:, [1, 2, 3]])
    return solid(points, tri=np.vstack([one, two]))


def hybrid_layers(seed=5):
    """Three layers of wedges under random tets, one face in common everywhere between them."""
    above = random_tets(200, seed)
    points, tets = above.points, above.block("tet").nodes
    sides = np.sort(tets[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3), axis=1)
    sides = np.unique(sides[(points[sides][:, :, 2] == 0.0).all(axis=1)], axis=0)
    a, b, c = (points[sides[:, k]] for k in range(3))
    down = np.cross(b - a, c - a)[:, 2] < 0.0
    sides[down] = sides[down][:, [0, 2, 1]]
    base = np.unique(sides)
    into = np.full(len(points), -1)
    layers, wedges, top = [points], [], sides
    for level in range(1, 4):
        into[base] = sum(map(len, layers)) + np.arange(len(base))
        layers.append(points[base] - [0.0, 0.0, 0.02 * level])
        wedges.append(np.hstack([into[sides], top]))
        top = into[sides]
    return solid(np.vstack(layers), tet=tets, wedge=np.vstack(wedges))


def with_reversed(nodes, kind, rows):
    """The cells with those rows turned inside out."""
    nodes = np.array(nodes)
    nodes[rows] = nodes[rows][:, MIRROR[kind]]
    return nodes


def in_two_zones(mesh):
    """The mesh with its cells in a zone left of x = 0.5 and one right of it."""
    centre = np.empty(mesh.n_cells)
    for block in mesh.blocks:
        centre[block.rows] = mesh.points[block.nodes, 0].mean(axis=1)
    left = np.flatnonzero(centre < 0.5)
    right = np.flatnonzero(centre >= 0.5)
    zones = (Zone("left", "zone", "fluid", "cell", left), Zone("right", "zone", "solid", "cell", right))
    return Mesh(mesh.points, mesh.blocks, zones=zones, dimension=mesh.dimension)


def sphere(levels=3):
    """(points, tris) of the unit sphere: an octahedron, its triangles cut in four `levels` times."""
    return blocks["sphere"](levels)


def soup(seed=4):
    """Loose triangles of a sphere with every fault of a bad STL file; see the counts in the test."""
    loose = blocks["loose_triangles"](3, seed)
    return Mesh(
        loose.reshape(-1, 3), (CellBlock("tri", np.arange(len(loose)), np.arange(3 * len(loose)).reshape(-1, 3)),)
    )


def bounded(mesh):
    """The mesh with its outside listed as elements, in two zones."""
    found = faces(mesh)
    rows = np.flatnonzero(found.neighbour == NO_CELL)
    width = int(np.diff(found.offsets)[rows[0]])
    nodes = found.nodes[found.offsets[rows].astype(np.int64)[:, None] + np.arange(width)]
    name = {2: "line", 3: "tri", 4: "quad"}[width]
    half = len(rows) // 2
    zones = (Zone("inlet", "g", "", "face", np.arange(half)), Zone("wall", "g", "", "face", np.arange(half, len(rows))))
    return Mesh(mesh.points, mesh.blocks, boundary=(CellBlock(name, np.arange(len(rows)), nodes),), zones=zones,
                dimension=mesh.dimension)  # fmt: skip
