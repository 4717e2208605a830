"""Metrics of cells that look at the cells beside them, from one pass over the faces."""

from __future__ import annotations

from typing import NamedTuple

from meshwright.audit.mesh import Floats, Mesh
from meshwright.audit.metrics.row import Metric

__all__ = ["ROWS", "Columns", "measure_neighbours"]


class Columns(NamedTuple):
    """One value per cell row."""

    orthogonal_quality: Floats


def measure_neighbours(mesh: Mesh) -> Columns:
    """All columns; the same bits for any number of threads."""
    raise NotImplementedError


ROWS: tuple[Metric, ...] = ()
