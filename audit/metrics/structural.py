"""Shape checks of FEMAP, Nastran, Patran, I-deas, SimLab, Salome and Pointwise."""

from __future__ import annotations

from meshwright.audit.metrics.row import Metric

__all__ = ["ROWS"]

ROWS: tuple[Metric, ...] = ()
