"""From a mesh to one number per cell, face or point and metric."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES, POLYTOPES
from meshwright.audit.connectivity import corner_points, faces
from meshwright.audit.mesh import NO_CELL, CellBlock, Mesh
from meshwright.audit.metrics import DEFAULT, METRICS, Metric
from meshwright.audit.metrics.facets import measure_faces
from meshwright.audit.metrics.neighbours import measure_neighbours
from meshwright.audit.metrics.points import measure_points
from meshwright.audit.metrics.polytopes import measure_polytopes
from meshwright.audit.metrics.tile import LANES, plan, prepare, run_kernels
from meshwright.audit.parallel import in_parallel, limited_to

__all__ = ["Measured", "clamp", "measure"]

_PIECES = 4
"""Pieces a large block is cut into: enough to share among a few threads, few enough to start cheaply."""

_LEAST_CHUNK = 256 * LANES
"""Cells of a piece at the least; always a whole number of tiles."""

_MOST_CHUNK = 2**20
"""Cells of a piece at the most, so that many processors have enough of them."""

_LEAST_POLYTOPES = 16 * LANES
"""The same for polygons and polyhedra, which take far longer."""

Floats = NDArray[np.float64]

Work = Callable[[int, int], None]
"""Measures entities begin to end of a list."""


@dataclass(frozen=True, eq=False)
class _Job:
    """Work on n entities, in pieces of at least `least`."""

    n: int
    work: Work
    least: int = _LEAST_CHUNK

    def pieces(self) -> list[tuple[Work, int, int]]:
        chunk = max(self.least, min(_MOST_CHUNK, -(-self.n // (_PIECES * LANES)) * LANES))
        return [(self.work, start, min(start + chunk, self.n)) for start in range(0, self.n, chunk)]


@dataclass(frozen=True, eq=False)
class Measured:
    """A mesh with its numbers.

    values: metric id -> key -> raw kernel values. Keys of cell metrics are cell types as in `mesh.blocks`, with (n,)
    values in block order; a type is absent where the metric is not defined on it. Face metrics have the one key
    "face", with a value per face of `connectivity.faces`; point metrics "point", with one per point; `domain` says
    which of those it is defined on. nan marks an entity on which a metric has no value.
    """

    mesh: Mesh
    metrics: tuple[Metric, ...]
    values: dict[str, dict[str, Floats]]

    def domain(self, id_: str, key: str) -> NDArray[np.intp] | None:
        """Rows of the values on which the metric is defined, None for all of them."""
        metric = METRICS[id_]
        if metric.entity == "point":
            return np.flatnonzero(corner_points(self.mesh))
        if metric.entity == "face" and len(metric.on) == 1:
            outside = faces(self.mesh).neighbour == NO_CELL
            return np.flatnonzero(outside if metric.on == ("boundary",) else ~outside)
        return None


def measure(
    mesh: Mesh,
    metrics: Iterable[str | Metric] = DEFAULT,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Measured:
    """Compute the metrics on everything they are defined on.

    Second-order cells are measured by their corners, except by metrics that name their type.  threads: None for all
    processors; the values are the same bits for any number.  progress: called with (entities done, entities in all).
    """
    rows = tuple(METRICS[m] if isinstance(m, str) else m for m in metrics)
    values: dict[str, dict[str, Floats]] = {row.id: {} for row in rows}
    with limited_to(threads):
        jobs = [job for block in mesh.blocks for job in _block_jobs(mesh, block, rows, values)]
        jobs += _face_jobs(mesh, rows, values)
        # one piece of each job in turn, so that a long one starts early and short ones fill the gaps
        pieces = [piece for turn in zip_longest(*(job.pieces() for job in jobs)) for piece in turn if piece]
        total, done = sum(stop - start for _, start, stop in pieces), 0
        for (_, start, stop), _ in zip(pieces, in_parallel(_run, pieces), strict=True):
            done += stop - start
            if progress is not None:
                progress(done, total)
        _column_passes(mesh, rows, values)
    return Measured(mesh, rows, values)


def _run(piece: tuple[Work, int, int]) -> None:
    work, start, stop = piece
    work(start, stop)


def _block_jobs(
    mesh: Mesh, block: CellBlock, rows: tuple[Metric, ...], values: dict[str, dict[str, Floats]]
) -> Iterable[_Job]:
    """What fills the values of one block; compiles what it needs."""
    kind = CELL_TYPES[block.type]
    cells = [row for row in rows if row.entity == "cell" and not row.column]
    if block.type in POLYTOPES:
        here = [row for row in cells if block.type in row.on]
        if here:
            shapes, work = measure_polytopes(mesh, block)
            for row in here:
                values[row.id][block.type] = getattr(shapes, row.polytope)
            yield _Job(len(block), work, _LEAST_POLYTOPES)
        return
    names = [kind.corners] if kind.order == 1 else [kind.corners, kind.name]
    for name in names:
        here = [row for row in cells if name in row.on]
        if not here:
            continue
        table = np.empty((len(here), len(block)))
        for row, column in zip(here, table, strict=True):
            values[row.id][block.type] = column
        if len(block):
            batches = plan([(row.kernel_for(name), row.stages_for(name)) for row in here])
            prepare(batches, block.nodes)

            def work(start: int, stop: int, name=name, batches=batches, table=table) -> None:  # type: ignore[no-untyped-def]
                run_kernels(name, mesh.points, block.nodes, start, stop, batches, table)

            yield _Job(len(block), work)


def _face_jobs(mesh: Mesh, rows: tuple[Metric, ...], values: dict[str, dict[str, Floats]]) -> Iterable[_Job]:
    """What fills the values of faces."""
    here = [row for row in rows if row.entity == "face"]
    if here:
        table, work = measure_faces(mesh, here)
        for row, column in zip(here, table, strict=True):
            values[row.id]["face"] = column
        yield _Job(table.shape[1], work)


def _column_passes(mesh: Mesh, rows: tuple[Metric, ...], values: dict[str, dict[str, Floats]]) -> None:
    """Values of the metrics that come from passes of their own over the mesh."""
    of_points = [row for row in rows if row.entity == "point"]
    if of_points:
        found = measure_points(mesh, [row.column for row in of_points])
        for row in of_points:
            if row.column in found:
                values[row.id]["point"] = found[row.column]
    of_cells = [row for row in rows if row.entity == "cell" and row.column]
    if of_cells:
        columns = measure_neighbours(mesh)
        for row in of_cells:
            for block in mesh.blocks:
                if CELL_TYPES[block.type].corners in row.on:
                    values[row.id][block.type] = getattr(columns, row.column)[block.rows]


def clamp(metric: Metric, values: Floats) -> Floats:
    """Values brought into the metric's documented range for reports; nan stays nan."""
    return np.clip(values, metric.low, metric.high)
