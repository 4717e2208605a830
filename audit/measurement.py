"""From a mesh to one number per cell and metric."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES, POLYTOPES
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import DEFAULT, METRICS, Metric
from meshwright.audit.metrics.polytopes import measure_polytopes
from meshwright.audit.metrics.stages import STAGES
from meshwright.audit.metrics.tile import LANES, prepare, run_kernels
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

Work = Callable[[int, int], None]
"""Measures cells begin to end of a block."""


@dataclass(frozen=True, eq=False)
class Measured:
    """A mesh with its numbers.

    values: metric id -> cell type as in `mesh.blocks` -> (n,) raw kernel values in block order. A type is absent
    where the metric is not defined on it; nan marks a cell on which it has no value.
    """

    mesh: Mesh
    metrics: tuple[Metric, ...]
    values: dict[str, dict[str, NDArray[np.float64]]]


def measure(
    mesh: Mesh,
    metrics: Iterable[str | Metric] = DEFAULT,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Measured:
    """Compute the metrics on every cell they are defined on.

    Second-order cells are measured by their corners.  threads: None for all processors; the values are the same
    bits for any number.  progress: called with (cells done, cells in all).
    """
    rows = tuple(METRICS[m] if isinstance(m, str) else m for m in metrics)
    values: dict[str, dict[str, NDArray[np.float64]]] = {row.id: {} for row in rows}
    work: list[tuple[CellBlock, Work]] = []
    for block in mesh.blocks:
        here = tuple(row for row in rows if CELL_TYPES[block.type].corners in row.on)
        if not here:
            continue
        columns, measure_rows = (_polytopes if block.type in POLYTOPES else _fixed)(mesh, block, here)
        for row, column in zip(here, columns, strict=True):
            values[row.id][block.type] = column
        if len(block):
            work.append((block, measure_rows))
    pieces = []
    for block, measure_rows in work:
        least = _LEAST_POLYTOPES if block.type in POLYTOPES else _LEAST_CHUNK
        chunk = max(least, min(_MOST_CHUNK, -(-len(block) // (_PIECES * LANES)) * LANES))
        pieces += [(measure_rows, start, min(start + chunk, len(block))) for start in range(0, len(block), chunk)]
    total, done = sum(stop - start for _, start, stop in pieces), 0
    with limited_to(threads):
        for (_, start, stop), _ in zip(pieces, in_parallel(_run, pieces), strict=True):
            done += stop - start
            if progress is not None:
                progress(done, total)
    return Measured(mesh, rows, values)


def _run(piece: tuple[Work, int, int]) -> None:
    measure_rows, start, stop = piece
    measure_rows(start, stop)


def _fixed(mesh: Mesh, block: CellBlock, rows: tuple[Metric, ...]) -> tuple[NDArray[np.float64], Work]:
    """One row of values per metric for cells of a fixed type, and the work that fills them; compiles what it needs."""
    name = CELL_TYPES[block.type].corners
    kernels = [row.kernel_for(name) for row in rows]
    needed = {stage for row in rows for stage in row.stages_for(name)}
    stages = [stage for stage in STAGES if stage in needed]
    table = np.empty((len(rows), len(block)))
    if len(block):
        prepare((*stages, *kernels), block.nodes)
    return table, lambda start, stop: run_kernels(name, mesh.points, block.nodes, start, stop, stages, kernels, table)


def _polytopes(mesh: Mesh, block: CellBlock, rows: tuple[Metric, ...]) -> tuple[list[NDArray[np.float64]], Work]:
    """The same for polygons and polyhedra."""
    shapes, work = measure_polytopes(mesh, block)
    return [getattr(shapes, row.polytope) for row in rows], work


def clamp(metric: Metric, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values brought into the metric's documented range for reports; nan stays nan."""
    return np.clip(values, metric.low, metric.high)
