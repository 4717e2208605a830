"""Polygons and polyhedra: one compiled pass, a cell at a time, that fills the columns the metrics take.

Cells of any number of faces fit no tile. Angles, volumes and units are those of the fixed types and of `geometry`, so a
polyhedron that happens to be a hex gets the number of the hex.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces
from meshwright.audit.csr import ragged, sort_keys, uniform_offsets
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import CellBlock, Floats, Ints, Mesh, index_array
from meshwright.audit.metrics.angles import deviation_of_face, skew_of_face
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.polyhedra import area_vector, balance, concavity, flatness, reach, slant
from meshwright.audit.metrics.stages import corner, degrees, widen
from meshwright.audit.metrics.tile import SAFE_HIGH, SAFE_LOW, rescale
from meshwright.audit.solids import one_cell, one_face

__all__ = ["Shapes", "measure_polytopes"]


class Shapes(NamedTuple):
    """Columns (n,) of a block; `Metric.polytope` names one. nan throughout in a cell with a non-finite corner.

    size: area of a polygon (L2), signed volume of a polyhedron (L3).  shortest, longest: edge (L).  edge_ratio: inf
    where an edge has no length.  smallest_angle, largest_angle: degrees; nan where an edge has no length.
    skew, skewness: equi-angle, 0 and 1 best.  deviation: largest one from the ideal angle, degrees.
    flatness: |A| over the area of the fan, of the worst face.  The rest of polyhedra only, nan for polygons;
    orthogonality, squish: smallest cosine between a face's normal and the way to it, and 1 less that.  reach: longest
    over shortest distance of faces and corners from the centre (Fluent's aspect ratio).  openness, balance: of the
    areas (OpenFOAM's aspect ratio).  pyramid: smallest one on a face, signed (L3).  concavity: largest cosine between
    a face's normal and the way to another face.
    """

    size: Floats
    shortest: Floats
    longest: Floats
    edge_ratio: Floats
    smallest_angle: Floats
    largest_angle: Floats
    skew: Floats
    skewness: Floats
    deviation: Floats
    flatness: Floats
    orthogonality: Floats
    squish: Floats
    reach: Floats
    openness: Floats
    balance: Floats
    pyramid: Floats
    concavity: Floats


class _Cells(NamedTuple):
    """Cells told by faces; a polygon is a cell of one.

    rows (n,): of the cells.  starts (n + 1,), faces: rows of the faces of each cell.  offsets (f + 1,), nodes: point
    rows around each face.  owner (f,): row of the cell that the face's normal leaves.
    """

    points: Floats
    rows: Ints
    starts: Ints
    faces: Ints
    offsets: Ints
    nodes: Ints
    owner: Ints


class _Cell(NamedTuple):
    """Room for one cell: its faces' corners, face after face, at ends[i]:ends[i + 1] of x and node.

    x (k, 3): relative to the first corner, in the cell's unit.  node (k,): point rows.  place (k,): 0, 1, 2, ...
    area, centre (m, 3), deviation (m,): of the faces, areas outward.
    """

    x: Floats
    node: NDArray[np.int64]
    place: NDArray[np.int64]
    ends: NDArray[np.int64]
    area: Floats
    centre: Floats
    deviation: Floats


def measure_polytopes(mesh: Mesh, block: CellBlock) -> tuple[Shapes, Callable[[int, int], None]]:
    """Columns for a block of polygons or polyhedra, and the work that fills cells begin to end of them.

    The work releases the GIL; disjoint ranges may run in parallel and give the same bits in any order.
    """
    n, solid = len(block), block.type == "polyhedron"
    starts, items = ragged(block)
    if solid:
        table = faces(mesh)
        cells = _Cells(mesh.points, block.rows, starts, items, table.offsets, table.nodes, table.owner)
    else:
        cells = _Cells(
            mesh.points, block.rows, uniform_offsets(n, 1), index_array(np.arange(n)), starts, items, block.rows
        )
    shapes = Shapes(*(np.empty(n) for _ in Shapes._fields))
    return shapes, lambda begin, end: _measure(cells, begin, end, solid, shapes)


@kernel
def _measure(cells, begin, end, solid, shapes):  # type: ignore[no-untyped-def]
    """Rows begin to end of all columns."""
    cell = _room(cells, begin, end)
    for c in range(begin, end):
        m = cells.starts[c + 1] - cells.starts[c]
        unit = _gather(cells, c, cell)
        if unit != unit:
            for column in shapes:
                column[c] = np.nan
            continue
        short, long, flat = np.inf, 0.0, np.inf
        low, high, skew, deviation, shapeless = np.nan, np.nan, 0.0, np.nan, 0
        for i in range(m):
            face = cells.faces[cells.starts[c] + i]
            first, n = cell.ends[i], cell.ends[i + 1] - cell.ends[i]
            area, centre = one_face(cell.x, cell.place, first, n, (0.0, 0.0, 0.0))
            outward = 1.0 if cells.owner[face] == cells.rows[c] else -1.0
            for d in range(3):  # a whole row at once would compile for a second longer
                cell.area[i, d], cell.centre[i, d] = outward * area[d], centre[d]
            shortest, longest = _edge_range(cell.x, first, n)
            flat = min(flat, flatness(cell.x, first, n, area, centre, longest))
            short, long = min(short, shortest), max(long, longest)
            smallest, largest, undefined = _angle_range(cell.x, first, n)
            shapeless += undefined
            low = smallest if smallest < low or low != low else low
            high = largest if largest > high or high != high else high
            ideal = 180.0 * (n - 2) / n
            of_face = skew_of_face(smallest, largest, ideal)
            skew = of_face if of_face > skew else skew
            off = deviation_of_face(smallest, largest, ideal)
            cell.deviation[i] = off
            deviation = off if off > deviation or deviation != deviation else deviation
        if shapeless > 0:
            low, high, skew = np.nan, np.nan, 1.0
            deviation = _deviation_of_sound_faces(cell, m, len(cells.points))
        if solid:
            volume, middle = one_cell(cell.area, cell.centre, m)
            shapes.size[c] = volume * unit * unit * unit
            ratio, pyramid = reach(cell.area, cell.centre, m, cell.x, cell.ends[m], middle)
            cosine, squish = slant(cell.area, cell.centre, m, middle)
            shapes.openness[c], aspect = balance(cell.area, m, volume)
            least = FLAT * long * math.sqrt(long)
            if not (abs(volume) >= least and long > 0.0):  # flat: no centre to look from
                cosine, squish, ratio = 0.0, 1.0, np.inf
            shapes.orthogonality[c], shapes.squish[c], shapes.reach[c] = cosine, squish, ratio
            shapes.pyramid[c] = pyramid * unit * unit * unit
            shapes.balance[c] = aspect if volume > least else np.inf
            shapes.concavity[c] = concavity(cell.area, cell.centre, m, long)
        else:
            shapes.orthogonality[c] = shapes.squish[c] = shapes.reach[c] = np.nan
            shapes.pyramid[c] = shapes.openness[c] = shapes.balance[c] = shapes.concavity[c] = np.nan
            shapes.size[c] = math.sqrt(cell.area[0, 0] ** 2 + cell.area[0, 1] ** 2 + cell.area[0, 2] ** 2) * unit * unit
        shapes.shortest[c] = math.sqrt(short) * unit
        shapes.longest[c] = math.sqrt(long) * unit
        shapes.edge_ratio[c] = math.sqrt(long / short) if short > 0.0 else np.inf
        shapes.smallest_angle[c] = low
        shapes.largest_angle[c] = high
        shapes.skew[c] = min(skew, 1.0)
        shapes.skewness[c] = 1.0 - min(skew, 1.0)
        shapes.deviation[c] = deviation
        shapes.flatness[c] = flat


@inner
def _room(cells, begin, end):  # type: ignore[no-untyped-def]
    """Room for the largest of these cells."""
    most_faces, most_corners = 0, 0
    for c in range(begin, end):
        corners = 0
        for i in range(cells.starts[c], cells.starts[c + 1]):
            face = cells.faces[i]
            corners += cells.offsets[face + 1] - cells.offsets[face]
        most_faces = max(most_faces, cells.starts[c + 1] - cells.starts[c])
        most_corners = max(most_corners, corners)
    return _Cell(
        np.empty((most_corners, 3)),
        np.empty(most_corners, np.int64),
        np.arange(most_corners),
        np.zeros(most_faces + 1, np.int64),
        np.empty((most_faces, 3)),
        np.empty((most_faces, 3)),
        np.empty(most_faces),
    )


@inner
def _gather(cells, c, cell):  # type: ignore[no-untyped-def]
    """Copy the corners of one cell; returns the length of its unit, nan for a cell with a non-finite corner."""
    points, x = cells.points, cell.x
    origin = cells.nodes[cells.offsets[cells.faces[cells.starts[c]]]]
    ox, oy, oz = points[origin, 0], points[origin, 1], points[origin, 2]
    k = 0
    extent = 0.0
    for i in range(cells.starts[c + 1] - cells.starts[c]):
        face = cells.faces[cells.starts[c] + i]
        for at in range(cells.offsets[face], cells.offsets[face + 1]):
            p = cells.nodes[at]
            cell.node[k] = p
            x[k, 0], x[k, 1], x[k, 2] = points[p, 0] - ox, points[p, 1] - oy, points[p, 2] - oz
            extent += abs(x[k, 0]) + abs(x[k, 1]) + abs(x[k, 2])  # a sum, not a maximum: it keeps NaN
            k += 1
        cell.ends[i + 1] = k
    return 1.0 if SAFE_LOW < extent < SAFE_HIGH else rescale(x[:k], points, cell.node)


@inner
def _edge_range(x, first, n):  # type: ignore[no-untyped-def]
    """Smallest and largest squared edge of one face."""
    low, high = np.inf, 0.0
    p = first + n - 1
    for q in range(first, first + n):
        d2 = (x[q, 0] - x[p, 0]) ** 2 + (x[q, 1] - x[p, 1]) ** 2 + (x[q, 2] - x[p, 2]) ** 2
        low, high = min(low, d2), max(high, d2)
        p = q
    return low, high


@inner
def _angle_range(x, first, n):  # type: ignore[no-untyped-def]
    """Smallest and largest corner angle of one face in degrees, nan where it has none, and its corners without one.

    At a reflex corner (its normal against the face's) the angle is 360 degrees minus the plain one. A face of fewer
    than three corners has no angle.
    """
    if n < 3:
        return np.nan, np.nan, n
    nx, ny, nz = area_vector(x, first, n)
    small, large, reflex, undefined = -np.inf, np.inf, -np.inf, 0
    b = first + n - 1
    for o in range(first, first + n):
        a = o + 1 if o + 1 < first + n else first
        square, cx, cy, cz = corner(
            x[a, 0] - x[o, 0], x[a, 1] - x[o, 1], x[a, 2] - x[o, 2],
            x[b, 0] - x[o, 0], x[b, 1] - x[o, 1], x[b, 2] - x[o, 2],
        )  # fmt: skip
        undefined += square != square
        turned = n > 3 and cx * nx + cy * ny + cz * nz < 0.0
        small, large, reflex = widen(small, large, reflex, square, turned)
        b = o
    low, high = np.nan, np.nan
    if large < np.inf or small > -np.inf:
        low, high = degrees(small), degrees(large)
    if reflex > -np.inf:
        high = 360.0 - degrees(reflex)
    return low, high, undefined


@inner
def _deviation_of_sound_faces(cell, m, n_points):  # type: ignore[no-untyped-def]
    """Largest deviation in a cell with edges of zero length, nan for none.

    As in the fixed types, which look at triangles and at quadrilaterals apart, the faces of n corners count if one of
    their nodes is on no such edge of theirs.
    """
    x, k = cell.x, cell.ends[m]
    keys = np.empty(k, np.int64)
    for i in range(m):
        first, last = cell.ends[i], cell.ends[i + 1]
        b = last - 1
        for o in range(first, last):
            a = o + 1 if o + 1 < last else first
            broken = False
            for other in (a, b):
                broken |= x[o, 0] == x[other, 0] and x[o, 1] == x[other, 1] and x[o, 2] == x[other, 2]
            keys[o] = 2 * ((last - first) * n_points + cell.node[o]) + broken
            b = o
    sort_keys(keys, k)
    sound = np.zeros(k + 1, np.bool_)
    for j in range(k):
        # the last key of a node on the faces of one size is odd where one of its corners is broken
        if keys[j] % 2 == 0 and (j + 1 == k or keys[j + 1] // 2 != keys[j] // 2):
            sound[keys[j] // 2 // n_points] = True
    deviation = np.nan
    for i in range(m):
        off = cell.deviation[i]
        if sound[cell.ends[i + 1] - cell.ends[i]] and (off > deviation or deviation != deviation):
            deviation = off
    return deviation
