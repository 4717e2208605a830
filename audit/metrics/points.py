"""Metrics of points, from one pass over the cells around them."""

from __future__ import annotations

from typing import NamedTuple

from meshwright.audit.mesh import Floats, Mesh
from meshwright.audit.metrics.row import Metric

__all__ = ["ROWS", "Columns", "measure_points"]


class Columns(NamedTuple):
    """One value per point; nan for points that no cell uses."""

    valence: Floats


def measure_points(mesh: Mesh) -> Columns:
    """All columns; the same bits for any number of threads."""
    raise NotImplementedError


ROWS: tuple[Metric, ...] = ()
