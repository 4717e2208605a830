"""`warm_up`: load compiled kernels while something else waits for a file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from meshwright.audit.connectivity import boundary_faces, faces
from meshwright.audit.findings import run_checks
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.metrics import Metric

__all__ = ["warm_up"]

_SIDE = 3
_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def warm_up(metrics: Sequence[Metric]) -> None:
    """Measure and check a small block of hexahedra, told as face-based formats tell it.

    Most kernels serve all cell types, and loading them from the cache takes as long as auditing 100,000 cells. Run in
    a thread beside a reader it costs no time of its own.
    """
    n = _SIDE + 1
    points = np.stack(np.meshgrid(*[np.arange(float(n))] * 3, indexing="ij"), -1).reshape(-1, 3)
    place = np.arange(len(points), dtype=np.int32).reshape(n, n, n)
    nodes = np.stack([place[i : n - 1 + i, j : n - 1 + j, k : n - 1 + k].ravel() for i, j, k in _CORNERS], axis=1)
    plain = Mesh(points, (CellBlock("hex", np.arange(len(nodes)), nodes),))
    sides = faces(plain)
    wall = Zone("wall", "patch", "wall", "face", boundary_faces(plain))
    mesh = Mesh(points, plain.blocks, faces=sides, zones=(wall,))
    run_checks(mesh)
    measure(mesh, metrics)
