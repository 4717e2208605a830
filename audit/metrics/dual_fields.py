"""What a point gathers from the cells around it, and the metrics made of that."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats
from meshwright.audit.metrics.stages import degrees

__all__ = [
    "ANGLE_MIN",
    "AREA",
    "AREA_ANGLE",
    "AREA_COSINE",
    "AREA_MAX",
    "AREA_MIN",
    "CELL_MAX",
    "CELL_MIN",
    "CORNER_LARGE",
    "CORNER_REFLEX",
    "CORNER_SMALL",
    "COUNT",
    "EDGES",
    "FIELDS",
    "SECTOR_MAX",
    "SECTOR_MIN",
    "finish",
    "new_fields",
]

FIELDS = 15
(
    COUNT, SECTOR_MIN, SECTOR_MAX, AREA, AREA_ANGLE, AREA_COSINE, ANGLE_MIN, AREA_MIN, AREA_MAX, CELL_MIN,
    CELL_MAX, CORNER_SMALL, CORNER_LARGE, CORNER_REFLEX, EDGES,
) = range(FIELDS)  # fmt: skip
"""Columns of a point's row: cells around it; extremes of its sectors; sums over dual faces of area, area times angle and
area times cosine; smallest angle and extreme areas of dual faces; extremes of the cells' volumes; extremes of the corner
angles as signed squares of cotangents; largest squared ratio of two edges at a corner."""


def new_fields(n_points: int) -> Floats:
    """(n_points, FIELDS) rows of points that no cell has touched yet."""
    fields = np.zeros((n_points, FIELDS))
    fields[:, [SECTOR_MIN, ANGLE_MIN, AREA_MIN, CELL_MIN, CORNER_LARGE]] = np.inf
    fields[:, [SECTOR_MAX, CELL_MAX, CORNER_SMALL, CORNER_REFLEX]] = -np.inf
    return fields


@kernel
def finish(fields, column, out):  # type: ignore[no-untyped-def]
    """out (n,): the metric of that number (as `points` counts them) from the rows; nan at a point without cells."""
    for p in range(out.size):
        row = fields[p]
        if not row[COUNT] > 0.0:
            out[p] = np.nan
        elif column == 0:
            out[p] = row[SECTOR_MAX] / row[SECTOR_MIN] if row[SECTOR_MIN] > 0.0 else np.inf
        elif column == 1:
            out[p] = row[AREA_ANGLE] / row[AREA]
        elif column == 2:
            out[p] = row[ANGLE_MIN] if row[ANGLE_MIN] < np.inf and row[AREA_ANGLE] == row[AREA_ANGLE] else np.nan
        elif column == 3:
            out[p] = row[AREA_COSINE] / row[AREA]
        elif column == 4:
            out[p] = row[AREA_MAX] / row[AREA_MIN] if row[AREA_MIN] > 0.0 else np.inf
        elif column == 5:
            out[p] = row[COUNT]
        elif column == 6:
            out[p] = math.sqrt(row[EDGES])
        elif column == 7:
            out[p] = row[CELL_MAX] / row[CELL_MIN] if row[CELL_MIN] > 0.0 else np.inf
        elif column == 8:
            out[p] = _smallest_angle(row)
        else:
            out[p] = _largest_angle(row)


@inner
def _smallest_angle(row):  # type: ignore[no-untyped-def]
    """Smallest corner angle of a point's row; nan where an edge there has no length."""
    if not row[EDGES] < np.inf:
        return np.nan
    if row[CORNER_SMALL] == -np.inf and row[CORNER_LARGE] == np.inf:  # no corner but reflex ones
        return 360.0 - degrees(row[CORNER_REFLEX])
    return degrees(row[CORNER_SMALL])


@inner
def _largest_angle(row):  # type: ignore[no-untyped-def]
    """Largest corner angle of a point's row; nan where an edge there has no length."""
    if not row[EDGES] < np.inf:
        return np.nan
    if row[CORNER_REFLEX] > -np.inf:
        return 360.0 - degrees(row[CORNER_REFLEX])
    return degrees(row[CORNER_LARGE])
