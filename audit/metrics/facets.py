"""The engine of face metrics: faces by the tile, as `tile` does it for cells.

A tile holds 192 faces of any number of nodes with what lies on both sides of them. A metric is a function
`(face: FaceTile, out)` that loops over the lanes. Faces of 2-D cells are edges: their area vector has the length of
the edge and lies in the plane of the owner. In a shell the cells beside an edge are unfolded about it into one plane,
that of the owner, so that a fold does not pass for a bad mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numba import typeof, types
from numba.np.numpy_support import from_dtype
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces
from meshwright.audit.geometry import cell_geometry, cell_normals, in_safe_units
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Mesh
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.tile import LANES, Kernel, compile_driver

__all__ = ["FaceTile", "Sides", "face_kernel", "fill", "measure_faces", "new_tile", "sides_of"]

_SLOTS = 16
_ALL, _INTERIOR, _BOUNDARY = range(3)


class FaceTile(NamedTuple):
    """Geometry of 192 faces; the last axis is the lane. Centres and areas by OpenFOAM's rules (`geometry`).

    x (k, 3, L): nodes relative to the face's first one; only the first count[0] rows are in use, and a face of fewer
    nodes repeats its last one, which adds nothing to a sum over its fan and moves no extreme.
    centre (3, L): of the face, relative to the same node.  area (3, L): area vector, away from the owner.
    fan (L,): sum of the areas of the triangles of the fan about the mean of the nodes; length of an edge.
    own, other (3, L): from the centre of the owner and of the neighbour to the centre of the face; other is 0 on the
    boundary.  between (3, L): from owner to neighbour, 0 on the boundary.  volume (2, L): of owner and neighbour, signed.
    boundary (L,): 1 where there is no neighbour, else 0.  unit (L,): length of one unit of all this.
    work (8, L): scratch.  count (1,): rows of x in use.
    """

    x: NDArray[np.float64]
    centre: NDArray[np.float64]
    area: NDArray[np.float64]
    fan: NDArray[np.float64]
    own: NDArray[np.float64]
    other: NDArray[np.float64]
    between: NDArray[np.float64]
    volume: NDArray[np.float64]
    boundary: NDArray[np.float64]
    unit: NDArray[np.float64]
    work: NDArray[np.float64]
    count: NDArray[np.int64]  # type: ignore[assignment]


class Sides(NamedTuple):
    """The faces of a mesh and the cells beside them, in safe units.

    first (c,), arm (c, 3): a point of each cell and the way from there to its centre.  volume (c,): of the cells.
    normal (c, 3): of 2-D cells, empty otherwise.  shell: 1 where these may differ in direction, else 0.
    """

    points: Floats
    offsets: NDArray[np.integer]
    nodes: NDArray[np.integer]
    owner: NDArray[np.integer]
    neighbour: NDArray[np.integer]
    first: NDArray[np.integer]
    arm: Floats
    volume: Floats
    normal: Floats
    shell: int


def new_tile(most_nodes: int, unit: float) -> FaceTile:
    """Room for faces of up to so many nodes."""
    shape = {
        "x": (most_nodes, 3), "centre": (3,), "area": (3,), "fan": (), "own": (3,), "other": (3,), "between": (3,),
        "volume": (2,), "boundary": (), "unit": (), "work": (8,),
    }  # fmt: skip
    tile = FaceTile(**{name: np.zeros((*dims, LANES)) for name, dims in shape.items()}, count=np.zeros(1, np.int64))
    tile.unit[:] = unit
    return tile


_TILE = typeof(new_tile(1, 1.0))
_SIGNATURE = types.void(_TILE, types.Array(types.float64, 1, "C"))
_KERNEL = types.FunctionType(_SIGNATURE)


def face_kernel(function: Kernel) -> Kernel:
    """Mark a function `(face: FaceTile, out: (L,) float64)` as a face metric; compiled when first asked for."""
    return kernel(no_cpython_wrapper=True, no_cfunc_wrapper=False)(function)


@face_kernel
def _nothing(face: FaceTile, out: NDArray[np.float64]) -> None:
    """Fill the unused slots of the driver."""


@inner
def _gather(tile, sides, first, stop, finite):  # type: ignore[no-untyped-def]
    """Fill the tile with the faces from row `first` on; lanes past the last one, `stop` - 1, repeat it."""
    points, most = sides.points, 0
    last = np.uintp(stop - 1)  # unsigned indices throughout: numba then skips its test for negative ones
    for i in range(LANES):
        f = min(np.uintp(first + i), last)
        most = max(most, sides.offsets[f + np.uintp(1)] - sides.offsets[f])
    tile.count[0] = most
    for i in range(LANES):
        f = min(np.uintp(first + i), last)
        start = np.uintp(sides.offsets[f])
        size = sides.offsets[f + np.uintp(1)] - sides.offsets[f]
        p = np.uintp(sides.nodes[start])
        ox, oy, oz = points[p, 0], points[p, 1], points[p, 2]
        mx, my, mz = 0.0, 0.0, 0.0
        for k in range(most):
            q = np.uintp(sides.nodes[start + np.uintp(min(k, size - 1))])
            dx, dy, dz = points[q, 0] - ox, points[q, 1] - oy, points[q, 2] - oz
            tile.x[k, 0, i], tile.x[k, 1, i], tile.x[k, 2, i] = dx, dy, dz
            if k < size:
                mx, my, mz = mx + dx, my + dy, mz + dz
        tile.work[0, i], tile.work[1, i], tile.work[2, i] = mx / size, my / size, mz / size
        inside = sides.neighbour[f] >= 0
        c = np.uintp(sides.owner[f])
        n = np.uintp(sides.neighbour[f]) if inside else c
        tile.boundary[i] = 0.0 if inside else 1.0
        # relative to the first node, like everything else; completed below
        p, q = np.uintp(sides.first[c]), np.uintp(sides.first[n])
        o = (ox, oy, oz)
        for d in range(3):
            tile.own[d, i] = o[d] - points[p, d] - sides.arm[c, d]
            tile.other[d, i] = o[d] - points[q, d] - sides.arm[n, d]
        tile.volume[0, i], tile.volume[1, i] = sides.volume[c], sides.volume[n]
        if len(sides.normal) > 0:  # the edge of a 2-D cell: the normal, for `_turn`
            for d in range(3):
                tile.work[3 + d, i] = sides.normal[c, d]
        check = mx + my + mz + tile.own[0, i] + tile.own[1, i] + tile.own[2, i]
        check += tile.other[0, i] + tile.other[1, i] + tile.other[2, i]
        finite[i] = 1.0 if abs(check) < np.inf else 0.0


@inner
def _fan(tile):  # type: ignore[no-untyped-def]
    """Area vector and centre of each face, fanned about the mean of its nodes in work[0:3]."""
    x, area, centre, fan, mean, n = tile.x, tile.area, tile.centre, tile.fan, tile.work, tile.count[0]
    for i in range(LANES):
        fan[i] = area[0, i] = area[1, i] = area[2, i] = centre[0, i] = centre[1, i] = centre[2, i] = 0.0
    for k in range(n):
        p, q = x[k], x[k + 1 if k + 1 < n else 0]
        for i in range(LANES):
            ux, uy, uz = p[0, i] - mean[0, i], p[1, i] - mean[1, i], p[2, i] - mean[2, i]
            vx, vy, vz = q[0, i] - mean[0, i], q[1, i] - mean[1, i], q[2, i] - mean[2, i]
            nx, ny, nz = 0.5 * (uy * vz - uz * vy), 0.5 * (uz * vx - ux * vz), 0.5 * (ux * vy - uy * vx)
            w = np.sqrt(nx * nx + ny * ny + nz * nz)
            fan[i] += w
            area[0, i] += nx
            area[1, i] += ny
            area[2, i] += nz
            centre[0, i] += w * (ux + vx)
            centre[1, i] += w * (uy + vy)
            centre[2, i] += w * (uz + vz)
    for d in range(3):
        for i in range(LANES):
            centre[d, i] = mean[d, i] + (centre[d, i] / (3.0 * fan[i]) if fan[i] > 0.0 else 0.0)


@inner
def _turn(tile):  # type: ignore[no-untyped-def]
    """The same of edges, whose area vector is the edge turned outward in the plane of the owner, normal in work[3:6]."""
    for i in range(LANES):
        nx, ny, nz = tile.work[3, i], tile.work[4, i], tile.work[5, i]
        size = np.sqrt(nx * nx + ny * ny + nz * nz)
        size = size if size > 0.0 else np.inf  # a cell without a plane: no direction
        tx, ty, tz = tile.x[1, 0, i], tile.x[1, 1, i], tile.x[1, 2, i]
        tile.area[0, i] = (ty * nz - tz * ny) / size
        tile.area[1, i] = (tz * nx - tx * nz) / size
        tile.area[2, i] = (tx * ny - ty * nx) / size
        tile.fan[i] = np.sqrt(tx * tx + ty * ty + tz * tz)
        for d in range(3):
            tile.centre[d, i] = tile.work[d, i]


@inner
def _unfold(tile):  # type: ignore[no-untyped-def]
    """Turn both cells beside an edge about it into the plane of the owner: lengths along and across it are kept."""
    for i in range(LANES):
        tx, ty, tz = tile.x[1, 0, i], tile.x[1, 1, i], tile.x[1, 2, i]
        nx, ny, nz = tile.area[0, i], tile.area[1, i], tile.area[2, i]
        length, size = np.sqrt(tx * tx + ty * ty + tz * tz), np.sqrt(nx * nx + ny * ny + nz * nz)
        if length > 0.0 and size > 0.0:
            tx, ty, tz, nx, ny, nz = tx / length, ty / length, tz / length, nx / size, ny / size, nz / size
            for side in range(2):
                c = tile.own if side == 0 else tile.other
                along = c[0, i] * tx + c[1, i] * ty + c[2, i] * tz
                dx, dy, dz = c[0, i] - along * tx, c[1, i] - along * ty, c[2, i] - along * tz
                across = np.sqrt(dx * dx + dy * dy + dz * dz)
                # the owner's own normal tells on which side its centre lies; the neighbour's lies on the other one
                across = -across if side == 1 or dx * nx + dy * ny + dz * nz < 0.0 else across
                c[0, i], c[1, i], c[2, i] = along * tx + across * nx, along * ty + across * ny, along * tz + across * nz


@inner
def fill(tile, sides, first, stop, finite):  # type: ignore[no-untyped-def]
    """Make a tile of the faces from row `first` on, before row `stop`; finite: 0 beside a point that is not finite."""
    _gather(tile, sides, first, stop, finite)
    if len(sides.normal) > 0:
        _turn(tile)
    else:
        _fan(tile)
    for d in range(3):
        for i in range(LANES):
            tile.own[d, i] += tile.centre[d, i]
            tile.other[d, i] = tile.other[d, i] + tile.centre[d, i] if tile.boundary[i] == 0.0 else 0.0
    if sides.shell == 1:
        _unfold(tile)
    for d in range(3):
        for i in range(LANES):
            tile.between[d, i] = tile.own[d, i] - tile.other[d, i] if tile.boundary[i] == 0.0 else 0.0


@kernel
def _run_faces(tile, sides, start, stop, kernels, columns, domains, out):  # type: ignore[no-untyped-def]
    """Rows start to stop: make each tile, run every kernel on it, keep nan outside the domain of each."""
    lane, finite = np.empty(LANES), np.empty(LANES)
    for first in range(start, stop, LANES):
        fill(tile, sides, first, stop, finite)
        used = min(LANES, stop - first)
        for k in range(len(columns)):
            kernels[k](tile, lane)
            row = out[columns[k]]
            for i in range(used):
                outside = domains[k] != _ALL and (tile.boundary[i] == 1.0) != (domains[k] == _BOUNDARY)
                row[first + i] = np.nan if outside or finite[i] == 0.0 else lane[i]


_DOMAIN = {("interior", "boundary"): _ALL, ("interior",): _INTERIOR, ("boundary",): _BOUNDARY}


def sides_of(mesh: Mesh) -> tuple[Sides, int, float]:
    """The faces of a mesh, the most nodes that one has, and the length of the unit of it all."""
    scaled, unit = in_safe_units(mesh)
    table, geometry = faces(scaled), cell_geometry(scaled)
    flat = mesh.cell_dimension == 2
    normal = cell_normals(scaled) if flat else np.empty((0, 3))
    parts = (table.offsets, table.nodes, table.owner, table.neighbour, geometry.first, geometry.arm, geometry.volume)
    sides = Sides(scaled.points, *parts, normal, int(flat and mesh.dimension == 3))
    return sides, int(np.diff(table.offsets).max(initial=2)), unit


def measure_faces(mesh: Mesh, rows: Sequence[Metric]) -> tuple[Floats, Callable[[int, int], None]]:
    """A row of values per metric over `connectivity.faces(mesh)`, and the work that fills faces begin to end of it.

    nan outside the domain of a metric and around a point that is not finite. The work releases the GIL; disjoint
    ranges may run in parallel and give the same bits in any order.
    """
    sides, most, unit = sides_of(mesh)
    out = np.empty((len(rows), len(sides.owner)))
    plans = []
    for batch in (range(i, min(i + _SLOTS, len(rows))) for i in range(0, len(rows), _SLOTS)):
        kernels = [rows[i].kernel_for("face") for i in batch]
        functions = (*kernels, *(_nothing,) * (_SLOTS - len(kernels)))
        domains = [_DOMAIN[rows[i].on] for i in batch]
        plans.append((functions, np.array(batch, np.int64), np.array(domains, np.int64)))
    run = _prepared({id(f): f for functions, *_ in plans for f in functions}.values(), sides)

    def work(begin: int, end: int) -> None:
        tile = new_tile(most, unit)
        for functions, columns, domains in plans:
            run(tile, sides, begin, end, functions, columns, domains, out)

    return out, work


def _prepared(functions: Iterable[Kernel], sides: Sides) -> Callable[..., None]:
    """The compiled driver for these sides, and these kernels compiled."""

    def frozen(array: NDArray) -> types.Type:
        return types.Array(from_dtype(array.dtype), array.ndim, "C", readonly=not array.flags.writeable)

    labels = types.Array(types.int64, 1, "C")
    signature = types.void(
        _TILE,
        types.NamedTuple([*(frozen(array) for array in sides[:-1]), types.int64], Sides),
        *(types.int64, types.int64),
        types.UniTuple(_KERNEL, _SLOTS),
        labels,
        labels,
        types.Array(types.float64, 2, "C"),
    )
    return compile_driver(_run_faces, signature, functions, _SIGNATURE)
