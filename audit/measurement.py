"""From a mesh to one number per cell and metric."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import DEFAULT, METRICS, Metric
from meshwright.audit.metrics.stages import STAGES
from meshwright.audit.metrics.tile import LANES, prepare, run_kernels

__all__ = ["Measured", "clamp", "measure"]

_LEAST_CHUNK = 512 * LANES
"""Cells a thread takes at a time at the least; always a whole number of tiles."""


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
    work: list[tuple[CellBlock, tuple[Metric, ...], NDArray[np.float64]]] = []
    for block in mesh.blocks:
        here = tuple(row for row in rows if CELL_TYPES[block.type].corners in row.on)
        table = np.empty((len(here), len(block)))
        for row, column in zip(here, table, strict=True):
            values[row.id][block.type] = column
        if here and len(block):
            work.append((block, here, table))
    total = sum(len(block) for block, _, _ in work)
    done = 0
    workers = threads or os.cpu_count() or 1
    with ThreadPoolExecutor(max_workers=workers) as pool:
        jobs = []
        for block, here, table in work:
            name = CELL_TYPES[block.type].corners
            kernels = [row.kernel_for(name) for row in here]
            needed = {stage for row in here for stage in row.stages_for(name)}
            stages = [stage for stage in STAGES if stage in needed]
            prepare((*stages, *kernels), block.nodes)
            chunk = max(_LEAST_CHUNK, -(-len(block) // (4 * workers * LANES)) * LANES)
            for start in range(0, len(block), chunk):
                stop = min(start + chunk, len(block))
                jobs.append(
                    (
                        pool.submit(run_kernels, name, mesh.points, block.nodes, start, stop, stages, kernels, table),
                        stop - start,
                    )
                )
        for job, cells in jobs:
            job.result()
            done += cells
            if progress is not None:
                progress(done, total)
    return Measured(mesh, rows, values)


def clamp(metric: Metric, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values brought into the metric's documented range for reports; nan stays nan."""
    return np.clip(values, metric.low, metric.high)
