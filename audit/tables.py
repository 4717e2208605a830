"""The tables of a measured mesh: the article's three, GAMBIT's classes, for the whole mesh and per zone.

Everything is counted once, on the clamped value of the 0-is-best (Fluent, GAMBIT) scale. The ICEM column is the
same counts under mirrored labels: 1 - 0.9 is 0.0999..., so binning mirrored values again would move cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import Measured, clamp
from meshwright.audit.metrics import METRICS

__all__ = [
    "ASPECT",
    "BINNINGS",
    "GAMBIT_CLASSES",
    "MEAN_HINTS",
    "OVER",
    "SKEW",
    "Binning",
    "GambitClass",
    "Group",
    "Tables",
    "Tally",
    "tabulate",
]

SKEW = "gambit.equiangle_skew"
ASPECT = "gambit.aspect_ratio"
OVER = 0.8
"""The article's limit: the share of cells with a skewness strictly above it (ICEM: below 0.2)."""

MEAN_HINTS = {2: 0.1, 3: 0.4}
"""Mean equi-angle skew of a high-quality mesh, by cell dimension (GAMBIT)."""

_TYPE_ORDER = ("hex", "tet", "wedge", "pyramid", "polyhedron", "quad", "tri", "polygon")
ROUNDING = 1e-9
_UPPER = (ROUNDING, 0.25, 0.5, 0.75, 0.9)

Counts = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Binning:
    """Ten bins over one metric, with the labels of both scales.

    id: key in the JSON.  metric: whose values are binned.  edges: 11, ascending, on the stored scale; bins are
    [low, high), the last one closed.  mirrored: the same edges on the ICEM scale.
    """

    id: str
    title: str
    metric: str
    edges: tuple[float, ...]
    mirrored: tuple[float, ...]
    columns: tuple[str, str]
    labels: tuple[str, ...]
    mirrored_labels: tuple[str, ...]

    @property
    def n(self) -> int:
        """Number of bins."""
        return len(self.labels)

    def index(self, values: Floats) -> NDArray[np.int8]:
        """(n,) bin of each clamped value, `self.n` for nan."""
        found = np.searchsorted(np.array(self.edges[1:-1]), values, side="right").astype(np.int8)
        found[np.isnan(values)] = self.n
        return found


_TENTHS = tuple(k / 10 for k in range(11))
_TENTHS_DOWN = tuple((10 - k) / 10 for k in range(11))
_ICEM_LABELS = tuple(f"{_TENTHS_DOWN[k]:.1f}-{_TENTHS_DOWN[k + 1]:.1f}" for k in range(10))

BINNINGS = (
    Binning(
        "equiangle_skew",
        "Equi-angle skewness distribution",
        SKEW,
        _TENTHS,
        _TENTHS_DOWN,
        ("Fluent (0 best)", "ICEM (1 best)"),
        tuple(f"{_TENTHS[k]:.1f}-{_TENTHS[k + 1]:.1f}" for k in range(10)),
        _ICEM_LABELS,
    ),
    Binning(
        "aspect_ratio",
        "Aspect ratio distribution",
        ASPECT,
        # 10/(10 - k), not 1/(1 - k/10): that lies one unit above 5 and 10 and would put a 5:1 box below 5.
        (*(10 / (10 - k) for k in range(10)), math.inf),
        _TENTHS_DOWN,
        ("AR (>=1)", "1/AR"),
        (
            *("1.00-1.11", "1.11-1.25", "1.25-1.43", "1.43-1.67", "1.67-2.00"),
            *("2.00-2.50", "2.50-3.33", "3.33-5.00", "5.00-10.0", "10.0-inf"),
        ),
        _ICEM_LABELS,
    ),
)
"""The article's two distributions."""


@dataclass(frozen=True)
class GambitClass:
    """One of GAMBIT's seven classes of equi-angle skew; the upper bound belongs to the class."""

    name: str
    range: str


GAMBIT_CLASSES = (
    GambitClass("perfect", "0"),
    GambitClass("excellent", "0 < Q <= 0.25"),
    GambitClass("good", "0.25 < Q <= 0.5"),
    GambitClass("fair", "0.5 < Q <= 0.75"),
    GambitClass("poor", "0.75 < Q <= 0.9"),
    GambitClass("very poor (sliver)", "0.9 < Q < 1"),
    GambitClass("degenerate", "1"),
)
"""GAMBIT's words for equi-angle skew. The printed table leaves 0.25, 0.5, ... in no class; here they end one.

A skew up to `ROUNDING` counts as 0: a perfect cell away from the origin scores the rounding of its coordinates.
"""


def _gambit_index(values: Floats) -> NDArray[np.int8]:
    """(n,) class of each clamped value, 7 for nan."""
    found = np.searchsorted(np.array(_UPPER), values, side="left").astype(np.int8)
    found[values >= 1.0] = 6
    found[np.isnan(values)] = len(GAMBIT_CLASSES)
    return found


@dataclass(frozen=True)
class Group:
    """What one set of tables is about: the whole mesh (the first group), a cell zone, or the cells of no zone.

    zone: index into `Mesh.cell_zones`, None for the whole mesh, -1 for the cells that are in no zone.
    """

    zone: int | None


@dataclass(frozen=True, eq=False)
class Tally:
    """Counts of one binning: counts (groups, types, bins), undefined (groups, types), defined (types,)."""

    counts: Counts
    undefined: Counts
    defined: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Tables:
    """All tables of a mesh. Every array has the axes (group, type); group 0 is the whole mesh.

    groups, types: what the axes stand for.  cells: number of cells.  distributions: by `Binning.id`.
    classes: (groups, types, 7) GAMBIT classes.  worst: largest equi-angle skew, nan where there is none.
    over: cells above `OVER`.  total: sum of the defined skews.  The skew is "not defined" for the types where
    `distributions["equiangle_skew"].defined` is false.
    """

    groups: tuple[Group, ...]
    types: tuple[str, ...]
    cells: Counts
    distributions: dict[str, Tally]
    classes: Counts
    worst: Floats
    over: Counts
    total: Floats

    @property
    def skew(self) -> Tally:
        """Counts of the equi-angle skew."""
        return self.distributions["equiangle_skew"]

    @cached_property
    def measured(self) -> Counts:
        """(groups, types) cells with a defined skew: what shares and means are taken over."""
        return self.skew.counts.sum(axis=2)

    def share_over(self, group: int, kind: int) -> float:
        """Share of the measured cells above `OVER`, 0 to 1; nan where none is measured."""
        n = int(self.measured[group, kind])
        return int(self.over[group, kind]) / n if n else math.nan

    def mean(self, group: int) -> float:
        """Mean equi-angle skew over the types of a group; nan where none is measured."""
        n = int(self.measured[group].sum())
        return float(self.total[group].sum()) / n if n else math.nan


def _type_rank(name: str) -> tuple[int, int]:
    """The article's order: hexahedra, tetrahedra, prisms, pyramids, then the rest; second order after first."""
    corners = CELL_TYPES[name].corners
    return _TYPE_ORDER.index(corners), CELL_TYPES[name].n_nodes


def _members(measured: Measured, chosen: NDArray[np.bool_] | None) -> tuple[tuple[Group, ...], Counts, NDArray]:
    """All groups, and for each cell of each group its group number and its row."""
    mesh = measured.mesh
    keep = np.ones(mesh.n_cells, dtype=bool) if chosen is None else chosen
    groups = [Group(None)]
    rows = [np.flatnonzero(keep)]
    homeless = keep.copy()
    for index, zone in enumerate(mesh.cell_zones):
        members = zone.members[keep[zone.members]]
        if len(members) or chosen is None:
            groups.append(Group(index))
            rows.append(members)
            homeless[members] = False
    if mesh.cell_zones and homeless.any():
        groups.append(Group(-1))
        rows.append(np.flatnonzero(homeless))
    codes = np.repeat(np.arange(len(groups), dtype=np.int64), [len(r) for r in rows])
    return tuple(groups), codes, np.concatenate(rows)


def _by_row(measured: Measured, metric: str, types: tuple[str, ...]) -> tuple[Floats, NDArray[np.bool_]]:
    """(n_cells,) clamped values in row order, nan where undefined; (types,) where the metric is defined."""
    values = np.full(measured.mesh.n_cells, np.nan)
    of_type = measured.values.get(metric, {})
    for name, raw in of_type.items():
        values[measured.mesh.block(name).rows] = clamp(METRICS[metric], raw)
    return values, np.array([name in of_type for name in types], dtype=bool)


def tabulate(measured: Measured, chosen: NDArray[np.bool_] | None = None) -> Tables:
    """Count a measured mesh into its tables.

    chosen: (n_cells,) cells to look at, all when None.  A cell that is in two zones counts in both; a zone whose
    cells are all left out is not listed. Needs the metrics `SKEW` and `ASPECT`; without them nothing is defined.
    """
    mesh = measured.mesh
    types = tuple(sorted(mesh.counts, key=_type_rank))
    groups, group_of, rows = _members(measured, chosen)
    type_of_cell = np.empty(mesh.n_cells, dtype=np.int64)
    for code, name in enumerate(types):
        type_of_cell[mesh.block(name).rows] = code
    pair = group_of * len(types) + type_of_cell[rows]
    shape = (len(groups), len(types))
    n_pairs = shape[0] * shape[1]

    def count(slots: NDArray[np.int8], n: int, defined: NDArray[np.bool_]) -> tuple[Counts, Counts]:
        """Cells by (group, type, slot) and those in the slot of nan; slots are given by cell row."""
        flat = np.bincount(pair * (n + 1) + slots[rows], minlength=n_pairs * (n + 1))
        counts = np.where(defined[:, None], flat.reshape(*shape, n + 1), 0)
        return counts[..., :n], counts[..., n]

    distributions = {}
    for binning in BINNINGS:
        values, defined = _by_row(measured, binning.metric, types)
        distributions[binning.id] = Tally(*count(binning.index(values), binning.n, defined), defined)

    skew, defined = _by_row(measured, SKEW, types)
    classes, _ = count(_gambit_index(skew), len(GAMBIT_CLASSES), defined)
    value, known = skew[rows], ~np.isnan(skew[rows])
    worst = np.full(n_pairs, -np.inf)
    np.maximum.at(worst, pair[known], value[known])
    worst[np.isneginf(worst)] = np.nan
    return Tables(
        groups=groups,
        types=types,
        cells=np.bincount(pair, minlength=n_pairs).reshape(shape),
        distributions=distributions,
        classes=classes,
        worst=worst.reshape(shape),
        over=np.bincount(pair[known & (value > OVER)], minlength=n_pairs).reshape(shape),
        total=np.bincount(pair[known], weights=value[known], minlength=n_pairs).reshape(shape).astype(np.float64),
    )
