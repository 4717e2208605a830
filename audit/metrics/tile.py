"""The kernel engine: cells by the tile, geometry as structure of arrays, one driver for all cell types.

A tile holds 192 cells as `x[node, xyz, lane]`. Stages fill the tile with shared geometry (edges, corner angles,
Jacobians, ...), metrics turn it into one number per lane. Both are functions `(tile, out)` whose outer loop runs
over the rows of the cell type's tables and whose inner loop runs over the lanes, which LLVM turns into vector code.
The driver receives them as compiled function values, so each is compiled and cached on its own, and only when
something asks for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numba import typeof, types
from numba.np.numpy_support import from_dtype
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.jit import inner, kernel
from meshwright.audit.shape_functions import gradient_table

__all__ = [
    "LANES",
    "SAFE_HIGH",
    "SAFE_LOW",
    "STAGES",
    "Batch",
    "Kernel",
    "Tables",
    "Tile",
    "compile_driver",
    "plan",
    "prepare",
    "rescale",
    "run_kernels",
    "stage",
    "tile_kernel",
]

LANES = 192
"""Cells of a tile: enough to hide the function calls, few enough for the second-level cache, and not a power of two,
which would send all rows of a tile to the same few sets of it. Measured: 64 lanes 180, 128 lanes 137, 192 lanes 130 ns."""

_SLOTS = 32
"""Kernels that one pass of the driver can take; a longer list takes several passes."""

SAFE_LOW, SAFE_HIGH = 1e-20, 1e20
"""Cell extents between which no product of twelve lengths can under- or overflow, with room for thin cells below."""

_COMPILING = Lock()
"""Held while a driver is open for new signatures: metrics and checks may prepare at the same time."""

Kernel = Any
"""A compiled function; numba publishes no type for one."""


class Tables(NamedTuple):
    """Rows of the cell type's tables that kernels loop over; see `cells.CellType`.

    mids (m,): of a second-order type, the node on each row of `edges`; empty otherwise.  gradients (p, n, 3):
    derivatives of its shape functions at p points, the nodes first; see `shape_functions`. Empty otherwise.
    """

    edges: NDArray[np.int64]
    tris: NDArray[np.int64]
    quads: NDArray[np.int64]
    triads: NDArray[np.int64]
    diagonals: NDArray[np.int64]
    mids: NDArray[np.int64]
    gradients: NDArray[np.float64]


class Tile(NamedTuple):
    """Geometry of 192 cells; the last axis is the lane.

    x (n, 3, L): corners, and for metrics of second-order cells all nodes, relative to the first, in units of `unit`.
    unit (L,): length of one unit of x, a power of two; 1 except in huge or tiny cells.
    edge2 (m, L): squared edge lengths.  edge_range, diagonal_range (2, L): smallest and largest squared length.
    angle (4, L): smallest and largest corner angle in degrees of the triangular faces (rows 0, 1) and of the quadrilateral
    faces (rows 2, 3), of the corners where an angle is defined; nan where the cell has no such face or corner.
    shapeless (2, L): corners of triangular and of quadrilateral faces at an edge of zero length, where none is defined.
    face_shape (6, L): extremes over the faces for the checks of FEA systems; see `face_shapes`.  gauss (3, L): of a hex, the
    smallest, the largest absolute and the mean determinant at 2x2x2 Gauss points, in the unit of volume.
    jacobian (k, L): determinants of the corner triads.  jacobian_range (2, L): the smallest, and the largest absolute one.
    axis (3, 3, L), mode (4, 3, L): of a hex, the vectors B_k and X_01, X_02, X_12, hour-glass; of a quad, axis holds the two
    bisectors and mode[3] the hour-glass vector.
    face (f, 3, L): area vectors, triangular faces first.  area2 (f, L): their squared lengths, 0 for a face so flat that it
    has no direction.  face_centre (f, 3, L), face_fan (f, L): centre of each face and
    the sum of its fan triangles' areas.  centre (3, L): of the cell.  volume (L,): signed volume in unit**3.
    dihedral (2, L): smallest and largest angle between faces in degrees.  warp (L,): largest angle in degrees between the
    two triangles of a quadrilateral face, cut along either diagonal.  slant (L,): of the face that stands least at right
    angles to the line from the cell's centre to its own, signed square of the cotangent between its normal and that line.
    corner (7, L): of a quad, wedge or hex, extremes over its corners for Verdict's metrics; see `verdict_corners`.
    nodal (4, L): of a second-order cell, smallest Jacobian and largest absolute one at its nodes, then at nodes and centres.
    bow (3, L): of its edges, extremes of what the mid nodes do; see `second_order`.
    work (16, L): scratch.  tables: of the cell type.
    """

    x: NDArray[np.float64]
    unit: NDArray[np.float64]
    edge2: NDArray[np.float64]
    edge_range: NDArray[np.float64]
    diagonal_range: NDArray[np.float64]
    angle: NDArray[np.float64]
    shapeless: NDArray[np.float64]
    face_shape: NDArray[np.float64]
    gauss: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    jacobian_range: NDArray[np.float64]
    corner: NDArray[np.float64]
    axis: NDArray[np.float64]
    mode: NDArray[np.float64]
    face: NDArray[np.float64]
    area2: NDArray[np.float64]
    face_centre: NDArray[np.float64]
    face_fan: NDArray[np.float64]
    centre: NDArray[np.float64]
    dihedral: NDArray[np.float64]
    warp: NDArray[np.float64]
    slant: NDArray[np.float64]
    volume: NDArray[np.float64]
    nodal: NDArray[np.float64]
    bow: NDArray[np.float64]
    work: NDArray[np.float64]
    tables: Tables


def _new_tables(type_name: str) -> Tables:
    cell = CELL_TYPES[type_name]
    mids = np.array(cell.mid_edges, dtype=np.int64)
    return Tables(
        *(cell.edge_table, cell.tri_faces, cell.quad_faces, cell.triad_table, cell.diagonal_table, mids),
        gradients=gradient_table(type_name),
    )


def _new_tile(type_name: str) -> Tile:
    t = _new_tables(type_name)
    n_faces = len(t.tris) + len(t.quads)
    shape = {
        "x": (CELL_TYPES[type_name].n_nodes, 3), "unit": (), "edge2": (len(t.edges),), "edge_range": (2,),
        "diagonal_range": (2,), "jacobian_range": (2,),
        "face_shape": (6,), "gauss": (3,), "corner": (7,),
        "angle": (4,), "shapeless": (2,), "jacobian": (len(t.triads),), "axis": (3, 3), "mode": (4, 3),
        "face": (n_faces, 3), "area2": (n_faces,), "face_centre": (n_faces, 3), "face_fan": (n_faces,), "centre": (3,),
        "dihedral": (2,), "warp": (), "slant": (), "volume": (), "nodal": (4,), "bow": (3,), "work": (16,),
    }  # fmt: skip
    return Tile(**{name: np.zeros((*dims, LANES)) for name, dims in shape.items()}, tables=t)


_TILE = typeof(_new_tile("hex"))
_SIGNATURE = types.void(_TILE, types.Array(types.float64, 1, "C"))
_KERNEL = types.FunctionType(_SIGNATURE)


def tile_kernel(function: Kernel) -> Kernel:
    """Mark a function `(tile: Tile, out: (L,) float64)` as a stage or metric; compiled when first asked for.

    Only the driver and other kernels can call it, which spares compiling the entry point from Python.
    """
    return kernel(no_cpython_wrapper=True, no_cfunc_wrapper=False)(function)


STAGES: list[Kernel] = []
"""Every stage in the order of definition, in which a tile runs them: a stage may read what those before it wrote."""


def stage(function: Kernel) -> Kernel:
    """A tile kernel that writes geometry for others into the tile instead of `out`."""
    made = tile_kernel(function)
    STAGES.append(made)
    return made


@tile_kernel
def _nothing(tile: Tile, out: NDArray[np.float64]) -> None:
    """Fill the unused slots of the driver."""


@inner
def _gather(tile: Tile, points: NDArray[np.float64], nodes: NDArray[np.integer], first: int, finite: NDArray) -> None:
    """Copy the corners of 192 cells from row `first` on; lanes past the last cell repeat it."""
    last = nodes.shape[0] - 1
    for i in range(LANES):
        row = np.uintp(min(first + i, last))  # unsigned: numba then skips its test for negative indices
        origin = np.uintp(nodes[row, 0])
        ox, oy, oz = points[origin, 0], points[origin, 1], points[origin, 2]
        for j in range(tile.x.shape[0]):
            p = np.uintp(nodes[row, j])
            tile.x[j, 0, i] = points[p, 0] - ox
            tile.x[j, 1, i] = points[p, 1] - oy
            tile.x[j, 2, i] = points[p, 2] - oz
    extent = tile.work[0]
    for i in range(LANES):
        extent[i] = 0.0
        finite[i] = 1.0
        tile.unit[i] = 1.0
    for j in range(1, tile.x.shape[0]):
        for i in range(LANES):
            # a sum, not a maximum: it keeps NaN
            extent[i] += abs(tile.x[j, 0, i]) + abs(tile.x[j, 1, i]) + abs(tile.x[j, 2, i])
    for i in range(LANES):
        if not (SAFE_LOW < extent[i] < SAFE_HIGH):
            tile.unit[i] = rescale(tile.x[:, :, i], points, nodes[min(first + i, last)])
            if tile.unit[i] != tile.unit[i]:
                finite[i], tile.unit[i] = 0.0, 1.0


@inner
def rescale(x, points, nodes):  # type: ignore[no-untyped-def]
    """Gather the corners x (n, 3) of a huge, tiny or broken cell again, in units of a power of two near its size.

    nodes: of the cell, at least n.  Returns the unit, nan for a cell with a non-finite corner, whose x becomes 0.
    """
    size, finite = 0.0, True
    for j in range(x.shape[0]):
        for d in range(3):
            value = points[nodes[j], d]
            finite = finite and math.isfinite(value)
            size = max(size, abs(0.25 * value - 0.25 * points[nodes[0], d]))
    if not finite or size == 0.0:
        x[:] = 0.0
        return 1.0 if finite else np.nan
    exponent = math.frexp(size)[1]
    half = exponent // 2  # two steps, since 2**-exponent itself may overflow
    for j in range(x.shape[0]):
        for d in range(3):
            value = 0.25 * points[nodes[j], d] - 0.25 * points[nodes[0], d]
            x[j, d] = math.ldexp(math.ldexp(value, -half), half - exponent)
    return math.ldexp(4.0, exponent)


@cache
def _driver_signature(index: np.dtype) -> Any:
    nodes = types.Array(from_dtype(index), 2, "C", readonly=True)
    points = types.Array(types.float64, 2, "C", readonly=True)
    columns = types.Array(types.int64, 1, "C")
    return types.void(
        _TILE,
        points,
        nodes,
        types.int64,
        types.int64,
        types.UniTuple(_KERNEL, _SLOTS),
        columns,
        types.Array(types.float64, 2, "C"),
    )


@kernel
def _run_tiles(tile, points, nodes, start, stop, kernels, columns, out):  # type: ignore[no-untyped-def]
    """Rows start to stop of one block: gather each tile, run every kernel on it, keep the columns asked for."""
    lane = np.empty(LANES)
    finite = np.empty(LANES)
    for first in range(start, stop, LANES):
        _gather(tile, points, nodes, first, finite)
        used = min(LANES, stop - first)
        for k in range(len(columns)):
            kernels[k](tile, lane)
            if columns[k] >= 0:
                row = out[columns[k]]
                for i in range(used):
                    row[first + i] = lane[i] if finite[i] == 1.0 else np.nan


class Batch(NamedTuple):
    """What one pass of the driver runs: `_SLOTS` functions, and for each of them a row of the output or -1."""

    functions: tuple[Kernel, ...]
    columns: NDArray[np.int64]


def plan(work: Sequence[tuple[Kernel, Sequence[Kernel]]]) -> list[Batch]:
    """The passes that run these (kernel, stages it reads), whose output rows count from 0.

    Kernels that read the same stages go together, since every pass runs its stages again.
    """
    rank = {id(function): place for place, function in enumerate(STAGES)}
    order = sorted(range(len(work)), key=lambda row: sorted(rank[id(one)] for one in work[row][1]))
    batches: list[Batch] = []
    stages: dict[int, Kernel] = {}
    rows: list[int] = []

    def close() -> None:
        if rows:
            before = [function for _, function in sorted(stages.items())]
            functions = (*before, *(work[row][0] for row in rows))
            columns = np.array([-1] * len(before) + rows, dtype=np.int64)
            batches.append(Batch((*functions, *(_nothing,) * (_SLOTS - len(functions))), columns))

    for row in order:
        needed = {rank[id(function)]: function for function in work[row][1]}
        if len(stages | needed) + len(rows) + 1 > _SLOTS:
            close()
            stages, rows = {}, []
        stages |= needed
        rows.append(row)
    close()
    return batches


def prepare(batches: Iterable[Batch], nodes: NDArray[np.integer]) -> None:
    """Compile the kernels of these batches, and the driver for this type of connectivity, unless that is done already."""
    functions = {id(function): function for batch in batches for function in batch.functions}.values()
    compile_driver(_run_tiles, _driver_signature(nodes.dtype), functions, _SIGNATURE)


def compile_driver(
    driver: Kernel, signature: Any, functions: Iterable[Kernel], of_functions: Any
) -> Callable[..., None]:
    """The entry point of a driver, which takes compiled functions as values, with those functions compiled too.

    The entry point itself: working out the types of all those functions at every call costs more than 10,000 cells do.
    """
    with _COMPILING:
        for function in functions:
            function.compile(of_functions)
        if signature.args not in driver.overloads:
            driver.disable_compile(False)
            driver.compile(signature)
            driver.disable_compile()  # or else a call would specialise on the very kernels it is given
        entry: Callable[..., None] = driver.overloads[signature.args].entry_point
        return entry


def run_kernels(
    type_name: str,
    points: NDArray[np.float64],
    nodes: NDArray[np.integer],
    start: int,
    stop: int,
    batches: Sequence[Batch],
    out: NDArray[np.float64],
) -> None:
    """Measure rows start to stop of a block, after `prepare`.

    type_name: linear, or second-order to give kernels all nodes.  points (n, 3), nodes (cells, k): may be wider than
    the type.  batches: of `plan`.  out (rows, cells).  A cell with a non-finite corner gets nan throughout.
    Releases the GIL; disjoint ranges may run in parallel.
    """
    tile = _new_tile(type_name)
    run = _run_tiles.overloads[_driver_signature(nodes.dtype).args].entry_point
    for functions, columns in batches:
        run(tile, points, nodes, start, stop, functions, columns, out)
