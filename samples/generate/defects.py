"""Meshes with one known defect each: topology, zones, numbering, and values that lie on the edges of bins."""

from __future__ import annotations

import dataclasses

import numpy as np
from generate.cells import CUBE, REGULAR_TET, SQUARE, UP, flat
from generate.grid import Boundary, Cells, Floats, Grid, Ints, Polymesh, extruded, honeycomb, joined, polymesh
from generate.hybrid import hybrid
from generate.sample import Sample, row_of_cells

__all__ = ["block", "samples"]


def block(nx: int, ny: int, width: float = 1.0, height: float = 1.0, x0: float = 0.0, zone: str = "fluid") -> Grid:
    """A rectangle of nx by ny quadrilaterals with its four sides as line zones."""
    x, y = np.meshgrid(x0 + np.linspace(0, width, nx + 1), np.linspace(0, height, ny + 1))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    at = np.arange(x.size).reshape(ny + 1, nx + 1)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    sides = (
        Boundary("line", np.stack([at[0, :-1], at[0, 1:]], axis=-1), "bottom"),
        Boundary("line", np.stack([at[:-1, -1], at[1:, -1]], axis=-1), "right", "outlet"),
        Boundary("line", np.stack([at[-1, 1:], at[-1, :-1]], axis=-1), "top"),
        Boundary("line", np.stack([at[1:, 0], at[:-1, 0]], axis=-1), "left", "inlet"),
    )
    return Grid(points, (Cells("quad", quads, zone),), sides, 2)


def _rhombus(skew: float) -> Floats:
    """Unit rhombus whose equi-angle skew is (90 - acute angle) / 90."""
    angle = np.radians(90.0 * (1.0 - skew))
    return flat((0, 0), (1, 0), (1 + np.cos(angle), np.sin(angle)), (np.cos(angle), np.sin(angle)))


def _skew_edges() -> Sample:
    tenths = np.arange(1, 10) / 10
    skews = np.concatenate([tenths, tenths - 1e-6, tenths + 1e-6])
    return Sample(
        "defects/skew-bin-edges.msh",
        "27 rhombi: equi-angle skew 0.1, 0.2 ... 0.9 to the last digits, and a millionth below and above each",
        row_of_cells("quad", [("rhombi", _rhombus(float(s))) for s in skews], dimension=2),
        values={"gambit.equiangle_skew": {"quad": skews.tolist()}},
    )


def _ratio_edges() -> Sample:
    sides = np.arange(1, 11)
    cells = [("rectangles", SQUARE * (10.0, float(side), 1.0)) for side in sides]
    return Sample(
        "defects/aspect-bin-edges.msh",
        "ten rectangles of 10 by 1 to 10 by 10: aspect ratios 10, 5, 10/3 ... 10/9, 1, each on the edge of a bin",
        row_of_cells("quad", cells, gap=12.0, dimension=2),
        values={
            "gambit.aspect_ratio": {"quad": (10.0 / sides).tolist()},
            "gambit.equiangle_skew": {"quad": [0.0] * 10},
        },
    )


def _left_handed() -> Sample:
    mesh = polymesh(_box())
    faces = list(mesh.faces)
    inner = next(f for f in range(len(faces)) if mesh.owner[f] == 0 and mesh.neighbour[f] == 1)
    faces[inner] = faces[inner][::-1]
    return Sample(
        "defects/left-handed.fluent.msh",
        "a 3 x 2 x 2 block of cubes in Fluent's format; the nodes of the face between cells 1 and 2 run the wrong way",
        mesh=dataclasses.replace(mesh, faces=faces),
        findings={"left-handed-faces": 1},
        values={"gambit.equiangle_skew": {"hex": [0.0] * 12}},
    )


def _box() -> Grid:
    """3 x 2 x 2 unit cubes with six named sides."""
    return extruded(block(3, 2, 3.0, 2.0), [0.0, 1.0, 2.0])


def _cracked() -> Sample:
    left, right = block(2, 2, 2.0, 2.0), block(2, 2, 2.0, 2.0, x0=2.0)
    points = np.concatenate([left.points, right.points, [[9.0, 9.0, 0.0]]])
    shifted = right.cells[0].nodes + len(left.points)
    return Sample(
        "defects/duplicate-points.v41.msh",
        "two blocks of 2 x 2 that share a line of three points but were never merged, and one point no cell uses",
        Grid(points, (left.cells[0], Cells("quad", shifted, "fluid")), dimension=2),
        findings={"duplicate-points": 3, "unused-points": 1},
        values={"gambit.equiangle_skew": {"quad": [0.0] * 8}},
    )


def _hanging() -> Sample:
    coarse, fine = block(1, 1), block(2, 2, x0=1.0)
    return Sample(
        "defects/hanging-node.msh",
        "one square beside four of half its size: the middle of their common side is a corner for two of the five",
        dataclasses.replace(joined(coarse, fine), boundary=()),
        findings={"hanging-nodes": 1},
        values={"gambit.equiangle_skew": {"quad": [0.0] * 5}},
    )


def _nonconformal() -> Sample:
    a, b = block(4, 4, zone="left-block"), block(6, 6, x0=1.0, zone="right-block")
    points = np.concatenate([a.points, b.points])
    moved = Cells("quad", b.cells[0].nodes + len(a.points), "right-block")
    flat_grid = Grid(points, (a.cells[0], moved), dimension=2)
    thick = extruded(flat_grid, np.array([0.0, 0.25]))
    return Sample(
        "defects/nonconformal.msh",
        "a block of 4 x 4 against one of 6 x 6, one layer thick: no face in common, 6 points in one place",
        dataclasses.replace(thick, boundary=()),
        findings={"duplicate-points": 6, "nonconformal-interface": 10},
        values={"gambit.equiangle_skew": {"hex": {"max": 0.0}}},
    )


def _open_box() -> Sample:
    faces = [(0, 3, 2, 1), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    fin = np.array([(2.0, 0.0, 0.0), (2.0, 0.0, 1.0)])
    plate = [(1, 8, 9, 5)]
    return Sample(
        "defects/open-tee.v41.msh",
        "a box of five unit squares without its lid, and a fin on one edge: 4 + 3 open edges, 1 with three faces",
        Grid(np.concatenate([CUBE, fin]), (Cells("quad", np.array(faces + plate), "skin"),)),
        findings={"nonmanifold-edges": 1},
        values={"gambit.equiangle_skew": {"quad": [0.0] * 6}},
    )


def _swapped_wedges() -> Sample:
    grid = hybrid()
    turned = [
        dataclasses.replace(c, nodes=c.nodes[:, [3, 4, 5, 0, 1, 2]]) if c.type == "wedge" else c for c in grid.cells
    ]
    return Sample(
        "defects/wedge-convention.v41.msh.gz",
        "the hybrid mesh with the nodes of all 360 wedges in another program's order: all negative, nothing else wrong",
        dataclasses.replace(grid, cells=tuple(turned)),
        findings={"node-order-convention": 360},
        values={"gambit.equiangle_skew": {"wedge": {"max": 0.25}}},
    )


def _delaunay() -> Sample:
    kite = flat((0, 0), (2, 1), (4, 0), (2, -1))
    return Sample(
        "defects/delaunay.msh",
        "two triangles on the long diagonal of a kite: each holds the other's far corner in its circle",
        Grid(kite, (Cells("tri", np.array([[0, 2, 1], [0, 3, 2]]), "kite"),), dimension=2),
    )


def _doubled() -> Sample:
    nodes = np.array([[0, 1, 2, 3], [1, 2, 0, 3]])
    return Sample(
        "defects/duplicate-cells.msh",
        "one tetrahedron written twice, with its corners in another order",
        Grid(REGULAR_TET, (Cells("tet", nodes, "fluid"),)),
        findings={"duplicate-cells": 1},
        values={"gambit.equiangle_skew": {"tet": [0.0, 0.0]}},
    )


def _below_axis() -> Sample:
    grid = block(4, 2, 4.0, 2.0)
    points = grid.points.copy()
    points[2, 1] = -1e-3
    return Sample(
        "defects/below-axis.fluent.msh",
        "a 2-D Fluent block on the x axis; one of its points lies a thousandth below the axis",
        Grid(points, grid.cells, grid.boundary, 2),
    )


def _ring_lists(cells: list[list[int]]) -> tuple[list[tuple[int, int]], Ints, Ints]:
    """Edges of polygons with the cell on the left (owner) and on the right (neighbour or -1), interior first."""
    seen: dict[tuple[int, int], int] = {}
    edges: list[tuple[int, int]] = []
    owner: list[int] = []
    other: list[int] = []
    for number, ring in enumerate(cells):
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            if (b, a) in seen:
                other[seen[b, a]] = number
            else:
                seen[a, b] = len(edges)
                edges.append((a, b))
                owner.append(number)
                other.append(-1)
    order = sorted(range(len(edges)), key=lambda e: (other[e] < 0, owner[e], other[e]))
    return [edges[e] for e in order], np.array(owner)[order], np.array(other)[order]


def _honeycomb() -> Sample:
    points, cells = honeycomb(4, 3)
    edges, owner, neighbour = _ring_lists(cells)
    inside = int((neighbour >= 0).sum())
    mesh = Polymesh(
        points, edges, owner, neighbour, len(cells),
        (("rim", "wall", np.arange(inside, len(edges))),),
        (("comb", "fluid", np.arange(len(cells))),), ("polygon",) * len(cells), 2,
    )  # fmt: skip
    return Sample(
        "cells/polygon.fluent.msh",
        "a honeycomb of 12 regular hexagons as a 2-D Fluent mesh: polygons known by their edges alone",
        mesh=mesh,
    )


def _prisms() -> tuple[Polymesh, Ints]:
    """The honeycomb one unit thick: every cell a hexagonal prism of eight faces."""
    flat_points, cells = honeycomb(4, 3)
    edges, owner, neighbour = _ring_lists(cells)
    n = len(flat_points)
    points = np.concatenate([flat_points, flat_points + UP])
    sides = [(a, b, b + n, a + n) for a, b in edges]
    floor = [tuple(ring[::-1]) for ring in cells]
    roof = [tuple(node + n for node in ring) for ring in cells]
    every = np.arange(len(cells))
    inside = int((neighbour >= 0).sum())
    none = np.full(len(cells), -1)
    starts = np.cumsum([inside, len(edges) - inside, len(cells), len(cells)])
    names = (("rim", "wall"), ("floor", "wall"), ("roof", "wall"))
    patches = tuple((name, role, np.arange(starts[i], starts[i + 1])) for i, (name, role) in enumerate(names))
    mesh = Polymesh(
        points, [*sides, *floor, *roof], np.concatenate([owner, every, every]),
        np.concatenate([neighbour, none, none]), len(cells), patches,
        (("comb", "fluid", every),), ("polyhedron",) * len(cells),
    )  # fmt: skip
    return mesh, neighbour


def _polyhedra() -> list[Sample]:
    mesh, neighbour = _prisms()
    faces = list(mesh.faces)
    flip = int(np.flatnonzero(neighbour < 0)[0])
    faces[flip] = faces[flip][::-1]
    return [
        Sample(
            "cells/polyhedron-openfoam", "the honeycomb one unit thick: 12 hexagonal prisms of eight faces", mesh=mesh
        ),
        Sample(
            "cells/polyhedron.fluent.msh",
            "the same prisms in Fluent's format; the nodes of one outer face run the wrong way",
            mesh=dataclasses.replace(mesh, faces=faces),
            findings={"left-handed-faces": 1},
        ),
    ]


def samples() -> list[Sample]:
    """The meshes of defects/, and the polygons and polyhedra of cells/."""
    return [
        _honeycomb(), *_polyhedra(), _left_handed(), _cracked(), _hanging(), _nonconformal(), _open_box(),
        _swapped_wedges(), _delaunay(), _doubled(), _below_axis(), _skew_edges(), _ratio_edges(),
    ]  # fmt: skip
