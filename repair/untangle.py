"""Untangle, then smooth: move the inner points of cells of any type to the least foldover-free energy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.csr import invert, uniform_offsets
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.audit.parallel import in_parallel
from meshwright.repair.carrying import padded, with_points
from meshwright.repair.foldover import gather, ideal_corners, plane_energy, smallest_determinants, solid_energy
from meshwright.repair.held import held_points
from meshwright.repair.outcome import Options, Outcome

__all__ = ["relax", "untangle"]

_MOST_ROUNDS = 60
_INNER = 60
"""Values of e, and steps for each, that untangling takes at most."""
_PIECE = 4096
"""Cells that a thread takes at a time."""
_RINGS = (3, 3, 6, 12)
"""Rings of cells by which the region around inverted cells grows from attempt to attempt, before all points move."""
_MANY = 0.2
"""Part of the cells that are inverted from which on the whole mesh is untangled at once."""
_TRIADS_2D = {"tri": ((0, 1, 2), (1, 2, 0), (2, 0, 1)), "quad": ((0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2))}
_MOVABLE = ("quad", "hex", "pyramid")
"""Types that `relax` shapes; wedges stay, and tets and triangles are better served by swaps."""
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
            table = _corner_table(corners, self.d)
            begin, places = invert(uniform_offsets(len(nodes), nodes.shape[1]), nodes.ravel(), len(mesh.points))
            cell_places = _places(nodes, begin, places)
            self.blocks.append(_Block(
                nodes, table, np.asarray(np.linalg.inv(ideal_corners(corners)), np.float64), np.zeros(len(nodes)),
                np.zeros((*nodes.shape, 3)), begin, cell_places,
            ))  # fmt: skip
        # the energy knows no size: the mean edge becomes 1, so that e means the same for every mesh
        ends = [mesh.points[b.nodes[:, b.triads[0, 1]]] - mesh.points[b.nodes[:, b.triads[0, 0]]] for b in self.blocks]
        self.unit = float(np.concatenate([np.linalg.norm(x, axis=1) for x in ends]).mean()) or 1.0
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
        return min(float(smallest_determinants(self.points, b.nodes, b.triads, b.inverse).min()) for b in self.blocks)

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
    """Move inner points until no corner is inverted: those near the inverted ones first, more where that is not enough.

    Far from them nothing moves, so that the spacing of boundary layers stays as it was made. Leaves shells, cells of
    second order and polyhedra alone.
    """
    free = _free_points(mesh, options)
    bad = _tangled(mesh) if len(free) else np.zeros(0, bool)
    if not bad.any():
        return Outcome(mesh, 0)
    for moving in _widening(mesh, bad, free):
        problem = _Problem(mesh, moving)
        if problem.smallest() <= 0.0 and _untangle(problem, options):
            _polish(problem, options)
            return _outcome(mesh, problem)
    return Outcome(mesh, 0, refused=("no place for the inner points was found that leaves no corner inverted",))


def _widening(mesh: Mesh, bad: NDArray[np.bool_], free: Ints) -> Iterator[Ints]:
    """The free points around the bad cells, in wider and wider regions, all of them at last."""
    if np.count_nonzero(bad) <= _MANY * mesh.n_cells:
        nodes = padded(mesh)
        near = np.zeros(len(mesh.points) + 1, bool)
        near[nodes[bad]] = True
        for rings in _RINGS:
            for _ in range(rings):
                near[-1] = False  # what cells are filled up with joins nothing
                near[nodes[near[nodes].any(axis=1)]] = True
            moving = free[near[free]]
            if len(moving) == len(free):
                break
            if len(moving):
                yield moving
    yield free


def relax(mesh: Mesh, options: Options) -> Outcome:
    """Move the inner points of quads, hexes and pyramids to the best shapes; their spacing evens out."""
    free = _free_points(mesh, options)
    theirs = np.zeros(len(mesh.points), bool)
    for block in mesh.blocks:
        if block.type in _MOVABLE:
            theirs[block.nodes] = True
    moving = free[theirs[free]] if len(free) else free
    if not len(moving):
        return Outcome(mesh, 0)
    problem = _Problem(mesh, moving)
    if problem.smallest() <= 0.0:
        return Outcome(mesh, 0, refused=("cells are inverted: untangle them first",))
    _polish(problem, options)
    return _outcome(mesh, problem)


def _free_points(mesh: Mesh, options: Options) -> Ints:
    """Rows of the points that may move; none in a mesh that these passes do not work on."""
    none = np.empty(0, np.int64)
    if mesh.faces is not None or any(block.items is not None for block in mesh.blocks):
        return none
    if mesh.cell_dimension == 2 and mesh.dimension == 3 and np.ptp(mesh.points[:, 2]) > 0.0:
        return none
    if any(CELL_TYPES[block.type].order > 1 for block in mesh.blocks):
        return none
    used = np.zeros(len(mesh.points), bool)
    for block in mesh.blocks:
        used[block.nodes] = True
    return np.flatnonzero(used & ~held_points(mesh, options))


def _tangled(mesh: Mesh) -> NDArray[np.bool_]:
    """(n_cells,) cells with a corner of no or negative volume."""
    out = np.zeros(mesh.n_cells, bool)
    for block in mesh.blocks:
        corners = CELL_TYPES[block.type].corners
        table = _corner_table(corners, mesh.cell_dimension)
        inverse = np.asarray(np.linalg.inv(ideal_corners(corners)), np.float64)
        out[block.rows] = smallest_determinants(mesh.points, block.nodes.astype(np.int64), table, inverse) <= 0.0
    return out


def _corner_table(corners: str, d: int) -> Ints:
    table = CELL_TYPES[corners].triad_table if d == 3 else np.array(_TRIADS_2D[corners])
    return table[:1] if corners == "tet" else table


def _outcome(mesh: Mesh, problem: _Problem) -> Outcome:
    points = np.array(mesh.points)
    there = problem.points[problem.moving] * problem.unit + problem.shift
    points[problem.moving, : problem.d] = there[:, : problem.d]
    moved = int(np.count_nonzero((points != mesh.points).any(axis=1)))
    return Outcome(with_points(mesh, points), moved, "points moved")


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
