"""`--cells`: one row a cell, in file order: its number, type, zone and the raw value of every metric."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.files import replacing
from meshwright.audit.run import Audit
from meshwright.reports.vtu import write_vtu
from meshwright.reports.wording import csv_cell

__all__ = ["CELL_FILES", "cell_table", "check_cell_file", "write_cells"]

Mask = NDArray[np.bool_]


def cell_table(audit: Audit, chosen: Mask | None = None) -> pa.Table:
    """Columns cell, type, zone, then one per chosen metric id; null where the metric is not defined, else raw.

    zone: the first that holds the cell, null for none.  chosen: (n_cells,) cells to keep.
    """
    mesh, measured = audit.mesh, audit.measured
    type_codes = np.empty(mesh.n_cells, dtype=np.int32)
    for code, block in enumerate(mesh.blocks):
        type_codes[block.rows] = code
    zone_codes = mesh.cell_zone_index()
    types = pa.array([block.type for block in mesh.blocks], pa.string())
    zones = pa.array([zone.name.encode("utf-8", "replace").decode() for zone in mesh.cell_zones], pa.string())
    columns = {
        "cell": pa.array(mesh.ids_of_cells(np.arange(mesh.n_cells)).astype(np.int64)),
        "type": types.take(pa.array(type_codes)),
        "zone": zones.take(pa.array(zone_codes, mask=zone_codes < 0)),
    }
    for key in audit.cell_metrics:
        values = np.full(mesh.n_cells, math.nan)
        missing = np.ones(mesh.n_cells, dtype=bool)
        for name, raw in measured.values[key].items():
            rows = mesh.block(name).rows
            values[rows] = raw
            missing[rows] = False
        columns[key] = pa.array(values, mask=missing, from_pandas=False)
    table = pa.table(columns)
    return table if chosen is None else table.filter(pa.array(chosen))


def _write_parquet(audit: Audit, chosen: Mask | None, stream: BinaryIO) -> None:
    from pyarrow import parquet  # noqa: PLC0415 - slow to import, wanted by one format

    parquet.write_table(cell_table(audit, chosen), stream, compression="zstd")


def _write_csv(audit: Audit, chosen: Mask | None, stream: BinaryIO) -> None:
    from pyarrow import csv  # noqa: PLC0415 - slow to import, wanted by one format

    table = cell_table(audit, chosen)
    column = table.column_names.index("zone")
    names = table.column(column).combine_chunks().dictionary_encode()
    safe = pa.array([csv_cell(name) for name in names.dictionary.to_pylist()], pa.string())
    table = table.set_column(column, "zone", safe.take(names.indices))
    csv.write_csv(table, stream, csv.WriteOptions(quoting_style="needed"))


def _write_vtu(audit: Audit, chosen: Mask | None, stream: BinaryIO) -> None:
    write_vtu(audit, chosen, stream)


CELL_FILES: dict[str, Callable[[Audit, Mask | None, BinaryIO], None]] = {
    ".parquet": _write_parquet,
    ".csv": _write_csv,
    ".vtu": _write_vtu,
}
"""Writer by suffix."""


def check_cell_file(path: str) -> None:
    """UsageError unless the suffix names a format we write."""
    if Path(path).suffix.lower() not in CELL_FILES:
        raise UsageError(f"--cells {printable(path)}: expected a file ending in {', '.join(CELL_FILES)}")


def write_cells(audit: Audit, chosen: Mask | None, path: str) -> None:
    """Write the values of every cell to `path`, in the format its suffix names."""
    with replacing(path) as stream:
        CELL_FILES[Path(path).suffix.lower()](audit, chosen, stream)
