"""OpenFOAM's cell metrics."""

from __future__ import annotations

from meshwright.audit.metrics.row import Metric

__all__ = ["ROWS"]

ROWS: tuple[Metric, ...] = ()
