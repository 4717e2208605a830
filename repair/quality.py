"""The measures by which the driver judges a pass: per cell, the same for every pass."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from meshwright.audit.geometry import cell_geometry
from meshwright.audit.jit import kernel
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.audit.parallel import workers

__all__ = [
    "SHAPE",
    "SMALL",
    "WORTH",
    "Rating",
    "Standing",
    "standing",
    "worst_around_points",
    "worst_at_points",
    "worst_first",
]

WORTH = 1e-2
"""Part of a level by which it must rise to be worth a change."""
SMALL = 1e-3
"""Level to take the part of where a level is smaller."""
_SOUND = 1e-3
"""Least quality of a polyhedron or polygon that is not inverted."""
_CUTS = (0.05, 0.1, 0.2, 0.3, 0.45, 0.7, 1.0)
SHAPE = ("verdict.scaled_jacobian", "gambit.equiangle_skew")
"""Metrics that tell how good a cell's shape is, whatever its type."""


@dataclass(frozen=True, eq=False)
class Rating:
    """What is told of the cells of a mesh as a whole.

    levels (8,): the worst quality and the means of the quality cut off at rising levels: what a pass must raise to
    count. Cutting off is Klingner's and Shewchuk's way ("Aggressive tetrahedral mesh improvement", 2007) to see that
    bad cells gain while good ones stay; the levels are ours, closer together where cells are bad.
    bad: number of cells that are inverted or degenerate.
    """

    levels: Floats
    bad: int

    @property
    def worst(self) -> float:
        """Quality of the worst cell."""
        return float(self.levels[0])


@dataclass(frozen=True, eq=False)
class Standing(Rating):
    """quality: (n_cells,) minimum of the scaled Jacobian and 1 - equiangle skew; below 0 where a cell is inverted.
    Of polyhedra and polygons 1 - skew, `_SOUND` at least where their volume is positive: one reflex corner of a face
    makes the skew 1, and the cell can be sound.
    """

    quality: Floats

    @classmethod
    def of(cls, quality: Floats) -> Standing:
        """Of cells of this quality."""
        levels = [float(quality.min()), *(_mean_below(quality, cut) for cut in _CUTS)]
        return cls(np.array(levels), int(np.count_nonzero(quality <= 0.0)), quality)

    @property
    def rating(self) -> Rating:
        """The same without the quality of each cell."""
        return Rating(self.levels, self.bad)


def standing(mesh: Mesh) -> Standing:
    """How good the cells of the mesh are."""
    quality = np.full(mesh.n_cells, np.inf)
    measured = measure(mesh, SHAPE, threads=workers())
    for name, values in measured.values[SHAPE[0]].items():
        _lower(quality, mesh.block(name).rows, values, 0.0, 1.0, -np.inf)
    for name, values in measured.values[SHAPE[1]].items():
        block = mesh.block(name)
        _lower(quality, block.rows, values, 1.0, -1.0, -np.inf if block.items is None else _SOUND)
    if mesh.cell_dimension == 3 and any(block.type == "polyhedron" for block in mesh.blocks):
        rows = mesh.block("polyhedron").rows
        quality[rows[~(cell_geometry(mesh).volume[rows] > 0.0)]] = -1.0
    quality[~np.isfinite(quality)] = -1.0
    return Standing.of(quality)


def _mean_below(quality: Floats, cut: float) -> float:
    return float(np.minimum(quality, cut).mean())


@kernel
def _lower(quality: Floats, rows: Ints, values: Floats, base: float, sign: float, least: float) -> None:
    """Lower the quality of these cells to base + sign * value, or to `least` where that is more; -1 for nan."""
    for i in range(rows.size):
        v = -1.0 if math.isnan(values[i]) else max(base + sign * values[i], least)
        quality[rows[i]] = min(quality[rows[i]], v)


def worst_at_points(mesh: Mesh, quality: Floats) -> Floats:
    """(n_points,) quality of the worst cell at each point, inf where there is none; quality (n_cells,)."""
    out = np.full(len(mesh.points), np.inf)
    for block in mesh.blocks:
        if block.items is None:
            np.minimum.at(out, block.nodes, quality[block.rows][:, None])
    return out


def worst_around_points(nodes: Ints, at_points: Floats) -> Floats:
    """(n,) quality of the worst cell around each point: among its cells and those that share a point with them.

    nodes (m, k): point rows of the cells, -1 where one has fewer. at_points (n,): quality of the worst cell at each.
    """
    around = np.full(len(at_points), np.inf)
    _spread(nodes, at_points, around)
    return around


@kernel
def _spread(nodes: Ints, low: Floats, around: Floats) -> None:
    for c in range(nodes.shape[0]):
        worst = np.inf
        for k in range(nodes.shape[1]):
            if nodes[c, k] >= 0:
                worst = min(worst, low[nodes[c, k]])
        for k in range(nodes.shape[1]):
            if nodes[c, k] >= 0:
                around[nodes[c, k]] = min(around[nodes[c, k]], worst)


def worst_first(before: Rating, after: Rating, least: float = WORTH) -> bool:
    """Whether `after` is an improvement worth keeping: fewer bad cells, or a level raised and none let down."""
    if after.bad != before.bad:
        return after.bad < before.bad
    gain = after.levels - before.levels
    scale = np.maximum(np.abs(before.levels), SMALL)
    return bool((gain >= -1e-9).all() and (gain > least * scale).any())
