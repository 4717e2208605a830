"""The tables as pandas frames, for notebooks and scripts. Kept apart because importing pandas takes a while."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import Measured
from meshwright.audit.tables import BINNINGS, GAMBIT_CLASSES, OVER, Tables

__all__ = ["cell_frame", "class_frame", "distribution_frame", "quality_frame"]


def quality_frame(tables: Tables, group: int = 0) -> pd.DataFrame:
    """The article's first table of one group: a row per cell type that occurs in it.

    Columns: Type, No. of elements, Worst equi-angle skewness, % with skewness > 0.8 | ICEM < 0.2; the last two
    are nan where the skew is not defined.
    """
    kinds = [k for k in range(len(tables.types)) if tables.cells[group, k]]
    return pd.DataFrame(
        {
            "Type": [CELL_TYPES[tables.types[k]].title for k in kinds],
            "No. of elements": [int(tables.cells[group, k]) for k in kinds],
            "Worst equi-angle skewness": [float(tables.worst[group, k]) for k in kinds],
            f"% with skewness > {OVER} | ICEM < 0.2": [100 * tables.share_over(group, k) for k in kinds],
        }
    )


def distribution_frame(tables: Tables, which: str, group: int = 0) -> pd.DataFrame:
    """One of the article's distributions ("equiangle_skew" or "aspect_ratio") of one group.

    Ten rows; the labels of both scales side by side, then a column of counts per type for which the metric is
    defined, and their sum. KeyError for another name.
    """
    binning = {b.id: b for b in BINNINGS}[which]
    tally = tables.distributions[which]
    frame = pd.DataFrame({binning.columns[0]: binning.labels, binning.columns[1]: binning.mirrored_labels})
    for k in np.flatnonzero(tally.defined):
        frame[tables.types[k]] = tally.counts[group, k]
    frame["all"] = tally.counts[group].sum(axis=0)
    return frame


def class_frame(tables: Tables, group: int = 0) -> pd.DataFrame:
    """GAMBIT's seven classes of one group: class, range, and counts as in `distribution_frame`."""
    frame = pd.DataFrame({"Class": [c.name for c in GAMBIT_CLASSES], "Range": [c.range for c in GAMBIT_CLASSES]})
    for k in np.flatnonzero(tables.skew.defined):
        frame[tables.types[k]] = tables.classes[group, k]
    frame["all"] = tables.classes[group].sum(axis=0)
    return frame


def cell_frame(measured: Measured) -> pd.DataFrame:
    """One row a cell, in file order: cell (the file's number), type, zone (first that holds it), then every metric.

    Raw values; nan both where a metric is undefined and where it is not defined for the type.
    """
    mesh = measured.mesh
    type_codes = np.empty(mesh.n_cells, dtype=np.int16)
    for code, block in enumerate(mesh.blocks):
        type_codes[block.rows] = code
    zone_codes, zone_names = pd.factorize(np.array([zone.name for zone in mesh.cell_zones], dtype=object))
    index = mesh.cell_zone_index()
    columns: dict[str, object] = {
        "cell": mesh.ids_of_cells(np.arange(mesh.n_cells)),
        # the stubs of pandas know lists of codes only
        "type": pd.Categorical.from_codes(type_codes, [block.type for block in mesh.blocks]),  # type: ignore[call-overload]
        "zone": pd.Categorical.from_codes(np.append(zone_codes, -1)[index], list(zone_names)),  # type: ignore[call-overload]
    }
    for metric in (metric for metric in measured.metrics if metric.entity == "cell"):
        values = np.full(mesh.n_cells, math.nan)
        for name, raw in measured.values[metric.id].items():
            values[mesh.block(name).rows] = raw
        columns[metric.id] = values
    return pd.DataFrame(columns)
