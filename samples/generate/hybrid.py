"""A mesh of every linear 3-D cell type that fits without a gap: hexahedra, pyramids, tetrahedra, prism layers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from generate.cells import angle_skew
from generate.grid import Boundary, Cells, Floats, Grid, Ints, faces_of, joined
from generate.sample import Sample

__all__ = ["hybrid", "lattice", "samples", "with_hull"]

SIDE = np.arange(7.0)
HEX_LAYERS = 3
FIRST_LAYER, GROWTH, LAYERS = 0.05, 1.2, 5
_TETS = ((3, 7, 6, 2), (1, 2, 6, 5), (0, 1, 5, 4), (0, 4, 7, 3), (4, 5, 6, 7))


def lattice(across: Floats, deep: Floats, heights: Floats) -> tuple[Floats, Ints]:
    """Points of a block with these coordinates along x, y and z, and the eight corners of each of its cells."""
    x, y, z = np.meshgrid(across, deep, heights, indexing="ij")
    at = np.arange(x.size).reshape(x.shape)
    low = [at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]]
    corners = [a[:, :, :-1] for a in low] + [a[:, :, 1:] for a in low]
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), np.stack(corners, axis=-1).reshape(-1, 8)


def _transition(top: float) -> Grid:
    """Unit cubes on top of the hexahedra: a pyramid on each floor, ten tetrahedra around its apex."""
    points, corners = lattice(SIDE, SIDE, np.array([top, top + 1.0]))
    apex = len(points) + np.arange(len(corners))
    points = np.concatenate([points, points[corners].mean(axis=1)])
    pyramids = np.column_stack([corners[:, :4], apex])
    tets: list[Ints] = []
    for face in _TETS:
        # Every square is cut from its corner of least x, y, z to the opposite one, so neighbours agree.
        least = min(range(4), key=lambda i: _rank(face[i]))
        a, b, c, d = (face[(least + i) % 4] for i in range(4))
        tets += [np.column_stack([corners[:, triangle], apex]) for triangle in ((a, b, c), (a, c, d))]
    nodes = np.concatenate(tets)
    edge = points[nodes[:, 1:]] - points[nodes[:, :1]]
    left = np.linalg.det(edge) < 0
    nodes[left] = nodes[left][:, [1, 0, 2, 3]]
    return Grid(points, (Cells("pyramid", pyramids, "fluid"), Cells("tet", nodes, "fluid")))


def _rank(corner: int) -> int:
    """Sum of the coordinates of a corner of the unit cube: 0 for the least, 3 for the greatest."""
    return (0, 1, 2, 1, 1, 2, 3, 2)[corner]


def _layers(floor: float) -> Grid:
    """Prism layers between the tetrahedra and the wall above, thinnest at the wall, each 1.2 times the next."""
    thickness = FIRST_LAYER * GROWTH ** np.arange(LAYERS)[::-1]
    heights = floor + np.concatenate([[0.0], np.cumsum(thickness)])
    points, corners = lattice(SIDE, SIDE, heights)
    halves = [corners[:, [0, 1, 2, 4, 5, 6]], corners[:, [0, 2, 3, 4, 6, 7]]]
    return Grid(points, (Cells("wedge", np.concatenate(halves), "fluid"),))


def hybrid() -> Grid:
    """The whole mesh with its boundary: `solid-block` below, `sides` around, `wall` on top."""
    points, corners = lattice(SIDE, SIDE, np.arange(HEX_LAYERS + 1.0))
    grid = joined(
        Grid(points, (Cells("hex", corners, "fluid"),)), _transition(float(HEX_LAYERS)), _layers(HEX_LAYERS + 1.0)
    )
    return with_hull(grid)


def with_hull(grid: Grid) -> Grid:
    """The grid with its outer faces as zones `floor` (z least), `wall` (z greatest) and `sides`."""
    nodes, keys, _ = faces_of(grid)
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    outer = nodes[first[counts == 1]]
    z = grid.points[:, 2]
    low, high = z.min(), z.max()
    corner = np.where(outer >= 0, z[outer], np.nan)
    floor = np.nanmax(corner, axis=1) == low
    wall = np.nanmin(corner, axis=1) == high
    parts: list[Boundary] = []
    groups = (("floor", "inlet", floor), ("wall", "wall", wall), ("sides", "symmetry", ~floor & ~wall))
    for name, role, chosen in groups:
        for kind, four in (("tri", False), ("quad", True)):
            rows = outer[chosen & ((outer[:, 3] >= 0) == four)]
            if len(rows):
                parts.append(Boundary(kind, rows if four else rows[:, :3], name, role))
    return replace(grid, boundary=tuple(parts))


def samples() -> list[Sample]:
    """The hybrid mesh in four formats."""
    grid = hybrid()
    sixth = float(np.degrees(np.arctan(2.0**0.5)))
    diagonal = float(np.degrees(np.arccos(-1.0 / 3.0)))  # at the apex, over a diagonal of a unit square
    values = {
        "gambit.equiangle_skew": {
            "hex": {"max": 0.0},
            "pyramid": {"max": angle_skew(sixth, 60)},
            "tet": {"max": angle_skew(diagonal, 60)},
            "wedge": {"max": 0.25},
        },
        "volume": {"hex": {"min": 1.0}, "pyramid": {"min": 1 / 6}, "tet": {"min": 1 / 12}, "wedge": {"min": 0.025}},
    }
    shows = "hexahedra, a layer of pyramids, tetrahedra and five prism layers growing by 1.2, without a gap"
    walls = tuple(Boundary(b.type, b.nodes, b.zone, b.role.replace("symmetry", "wall")) for b in grid.boundary)
    sides = replace(grid, boundary=walls)
    return [
        Sample("hybrid/hybrid.msh.gz", f"{shows}; Gmsh 2.2", grid, values=values),
        Sample("hybrid/hybrid.v41.msh.gz", f"{shows}; Gmsh 4.1", grid, values=values),
        Sample("hybrid/hybrid.fluent.msh.gz", f"{shows}; Fluent", grid, values=values),
        Sample("hybrid/hybrid-openfoam", f"{shows}; OpenFOAM", sides, values=values),
    ]
