"""VTU with the metrics as fields of cells and points."""

from __future__ import annotations

import math
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.run import Audit
from meshwright.repair.writers.vtu import write_grid

__all__ = ["write_vtu"]


def write_vtu(audit: Audit, chosen: NDArray[np.bool_] | None, stream: BinaryIO) -> None:
    """Write the mesh and its chosen metrics to `stream`.

    Cells stand in file order; fields: cell (the file's number), zone (index of its cell zone, -1 for none; names are
    in the field data), and the raw metrics, those of points as point fields; metrics of faces have no place in it.
    VTK has no empty value, so a metric that is not defined for a type is nan.
    """
    mesh = audit.mesh
    rows = np.arange(mesh.n_cells) if chosen is None else np.flatnonzero(chosen)
    fields: dict[str, NDArray] = {
        "cell": mesh.ids_of_cells(rows).astype("<i8"),
        "zone": mesh.cell_zone_index()[rows].astype("<i4"),
    }
    for key in audit.cell_metrics:
        values = np.full(mesh.n_cells, math.nan, dtype="<f8")
        for name, raw in audit.measured.values[key].items():
            values[mesh.block(name).rows] = raw
        fields[key] = values[rows]
    points = {key: audit.measured.values[key]["point"].astype("<f8") for key in audit.point_metrics}
    write_grid(mesh, rows, fields, points, stream)
