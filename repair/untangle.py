"""Untangle, then smooth: move the inner points of cells of any type to the least foldover-free energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import minimize

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.csr import invert, uniform_offsets
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.audit.parallel import in_parallel
from meshwright.repair.carrying import with_points
from meshwright.repair.foldover import gather, ideal_corners, plane_energy, smallest_determinant, solid_energy
from meshwright.repair.held import held_points
from meshwright.repair.outcome import Options, Outcome

__all__ = ["untangle"]

_MOST_ROUNDS = 60
_INNER = 60
_PIECE = 4096
_TRIADS_2D = {"tri": ((0, 1, 2), (1, 2, 0), (2, 0, 1)), "quad": ((0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2))}
_MOVABLE = ("quad", "hex", "wedge", "pyramid")
_POWERS = ((1.0, 0.0), (1.0, 3.0))
"""Power of the shape term and weight of the angle term, one minimisation after the other."""


@dataclass
class _Block:
    """The cells of one type that have a point to move: nodes (m, k), corner table, gathering table."""

    nodes: Ints
    triads: Ints
    inverse: Floats
    energy: Floats
    slope: Floats
    begin: Ints
    places: Ints


class _Problem:
    """Energy and gradient as a function of the coordinates of the points that move."""

    def __init__(self, mesh: Mesh, moving: Ints) -> None:
        self.d = mesh.cell_dimension
        self.moving = moving
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        self.shift = 0.5 * (low + high)
        is_moving = np.zeros(len(mesh.points), bool)
        is_moving[moving] = True
        self.blocks: list[_Block] = []
        for block in mesh.blocks:
            corners = CELL_TYPES[block.type].corners
            nodes = block.nodes[is_moving[block.nodes].any(axis=1)].astype(np.int64)
            if not len(nodes):
                continue
            table = CELL_TYPES[corners].triad_table if self.d == 3 else np.array(_TRIADS_2D[corners])
            if corners == "tet":
                table = table[:1]
            begin, places = invert(uniform_offsets(len(nodes), nodes.shape[1]), nodes.ravel(), len(mesh.points))
            cell_places = _places(nodes, begin, places)
            self.blocks.append(_Block(
                nodes, table, np.asarray(np.linalg.inv(ideal_corners(corners)), np.float64), np.zeros(len(nodes)),
                np.zeros((*nodes.shape, 3)), begin, cell_places,
            ))  # fmt: skip
        # the energy knows no size: the mean edge becomes 1, so that e means the same for every mesh
        ends = [mesh.points[b.nodes[:, b.triads[0, 1]]] - mesh.points[b.nodes[:, b.triads[0, 0]]] for b in self.blocks]
        every = np.concatenate([np.linalg.norm(x, axis=1) for x in ends])
        size = float((high - low)[: self.d].prod())
        self.unit = (size / max(mesh.n_cells, 1)) ** (1.0 / self.d) if size > 0.0 else float(every.mean())
        self.points = (mesh.points - self.shift) / self.unit
        self.e, self.power, self.angles = 0.0, 1.0, 0.0

    def place(self, x: Floats) -> None:
        """Put the moving points there."""
        self.points[self.moving[:, None], np.arange(self.d)] = x.reshape(-1, self.d)

    def where(self) -> Floats:
        """Coordinates of the moving points, flat."""
        return self.points[self.moving, : self.d].ravel()

    def smallest(self) -> float:
        """Smallest determinant of a corner, in units of the mean cell."""
        return min(float(smallest_determinant(self.points, b.nodes, b.triads, b.inverse)) for b in self.blocks)

    def __call__(self, x: Floats) -> tuple[float, Floats]:
        self.place(x)
        run = solid_energy if self.d == 3 else plane_energy
        jobs: list[Callable[[], None]] = []
        for b in self.blocks:
            for start in range(0, len(b.nodes), _PIECE):
                stop = min(start + _PIECE, len(b.nodes))
                jobs.append(
                    partial(
                        run,
                        self.points,
                        b.nodes,
                        b.triads,
                        b.inverse,
                        self.e,
                        self.power,
                        self.angles,
                        start,
                        stop,
                        b.energy,
                        b.slope,
                    )
                )
        for _ in in_parallel(_call, jobs):
            pass
        total = sum(float(np.sum(b.energy)) for b in self.blocks)
        gradient = np.zeros((len(self.moving), self.d))
        if not np.isfinite(total):
            return np.inf, gradient.ravel()
        for b in self.blocks:
            gather(b.begin, b.places, b.slope, self.moving, self.d, gradient)
        return total, gradient.ravel()


def _call(job: Callable[[], None]) -> None:
    job()


def _places(nodes: Ints, begin: Ints, cells: Ints) -> Ints:
    """For each entry of the table point -> cells: cell * width + place of the point in the cell."""
    point = np.repeat(np.arange(len(begin) - 1), np.diff(begin))
    inside = (nodes[cells] == point[:, None]).argmax(axis=1)
    return cells.astype(np.int64) * nodes.shape[1] + inside


def untangle(mesh: Mesh, options: Options) -> Outcome:
    """Move inner points until no corner is inverted, then to the least energy.

    Points of quads, hexes, wedges and pyramids move; those of tets or triangles alone only where a cell is inverted.
    Leaves shells, second-order cells and polyhedra alone.
    """
    if mesh.faces is not None or any(block.items is not None for block in mesh.blocks):
        return Outcome(mesh, 0)
    if mesh.cell_dimension == 2 and mesh.dimension == 3 and np.ptp(mesh.points[:, 2]) > 0.0:
        return Outcome(mesh, 0)
    if any(CELL_TYPES[block.type].order > 1 for block in mesh.blocks):
        return Outcome(mesh, 0)
    held = held_points(mesh, options)
    used = np.zeros(len(mesh.points), bool)
    for block in mesh.blocks:
        used[block.nodes] = True
    moving = np.flatnonzero(used & ~held)
    if not len(moving):
        return Outcome(mesh, 0)
    problem = _Problem(mesh, moving)
    tangled = problem.smallest() <= 0.0
    if not tangled:
        # swaps serve triangles and tets better than moves alone: only what touches other cells is moved for its shape
        theirs = np.zeros(len(mesh.points), bool)
        for block in mesh.blocks:
            if block.type in _MOVABLE:
                theirs[block.nodes] = True
        moving = moving[theirs[moving]]
        if not len(moving):
            return Outcome(mesh, 0)
        problem = _Problem(mesh, moving)
    refused = []
    if tangled and not _untangle(problem, options):
        refused.append("the foldover-free energy found no place for the inner points without inverted corners")
    if not refused:
        _polish(problem, options)
    points = np.array(mesh.points)
    there = problem.points[moving] * problem.unit + problem.shift
    points[moving, : problem.d] = there[:, : problem.d]
    if problem.d == 2:
        points[:, 2] = mesh.points[:, 2]
    moved = int(np.count_nonzero((points != mesh.points).any(axis=1)))
    return Outcome(with_points(mesh, points), moved, "points moved", refused=tuple(refused))


def _untangle(problem: _Problem, options: Options) -> bool:
    """Lower e step by step, as in the article, until every corner is right; whether that came about."""
    problem.power = 1.0
    x = problem.where()
    for i in range(_MOST_ROUNDS):
        options.tell("untangle", i, _MOST_ROUNDS)
        low = problem.smallest()
        if low > 0.0 and i > 0:
            return True
        problem.e = float(np.sqrt(1e-12 + 0.04 * min(low, 0.0) ** 2))
        found = minimize(problem, x, jac=True, method="L-BFGS-B", options={"maxiter": _INNER, "maxcor": 20})
        x = found.x
        problem.place(x)
    return problem.smallest() > 0.0


def _polish(problem: _Problem, options: Options) -> None:
    """Bring the true energy, e = 0, to its minimum: it is infinite where a corner is flat, so none can turn over."""
    problem.e = 0.0
    for i, power in enumerate(_POWERS):
        options.tell("smooth", i, len(_POWERS))
        problem.power, problem.angles = power
        x = problem.where()
        found = minimize(
            problem,
            x,
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": 400, "maxcor": 20, "ftol": 1e-13, "gtol": 1e-7, "maxfun": 800},
        )
        best = found.x if np.isfinite(found.fun) else x
        problem.place(best)
