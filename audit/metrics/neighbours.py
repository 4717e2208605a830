"""Metrics of cells that look at the cells beside them, from one pass over the faces."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Mesh
from meshwright.audit.metrics import angles, aspect
from meshwright.audit.metrics.facets import fill, new_tile, sides_of
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.tile import LANES, plan, prepare, run_kernels
from meshwright.audit.parallel import in_parallel

__all__ = ["ROWS", "Columns", "measure_neighbours"]

_CHUNK = 256 * LANES


class Columns(NamedTuple):
    """One value per cell row; nan in and beside a cell with a non-finite corner.

    orthogonality: smallest cosine between a face's normal and the way to its centre or to the next cell.
    orthogonal_quality: the same, or 1 - skew where that is less (tet, pyramid, wedge).  volume_ratio: of the worst
    neighbour, 1 for a cell that has none.  determinant: of the areas of inner faces.
    """

    orthogonality: Floats
    orthogonal_quality: Floats
    volume_ratio: Floats
    determinant: Floats


def measure_neighbours(mesh: Mesh) -> Columns:
    """All columns; the same bits for any number of threads, since one of them does it, face after face."""
    sides, most, unit = sides_of(mesh)
    n = mesh.n_cells
    found = Columns(np.full(n, np.inf), np.empty(n), np.ones(n), np.empty(n))
    sums = np.zeros((n, 8))
    _walk(new_tile(most, unit), sides, found.orthogonality, found.volume_ratio, sums)
    _finish(sums, found.orthogonality, found.volume_ratio, found.determinant)
    np.copyto(found.orthogonal_quality, found.orthogonality)
    for block in mesh.blocks:
        metric = _SKEW.get(CELL_TYPES[block.type].corners)
        if metric is not None and len(block):
            skew = _of_block(mesh, metric, CELL_TYPES[block.type].corners, block.nodes)
            quality = found.orthogonal_quality
            quality[block.rows] = np.minimum(quality[block.rows], 1.0 - skew)  # keeps nan
    return found


def _of_block(mesh: Mesh, metric: Metric, name: str, nodes: NDArray[np.integer]) -> Floats:
    """Values of a cell metric on the cells (n, k) of a linear type."""
    batches = plan([(metric.kernel_for(name), metric.stages_for(name))])
    prepare(batches, nodes)
    out = np.empty((1, len(nodes)))

    def piece(start: int) -> None:
        run_kernels(name, mesh.points, nodes, start, min(start + _CHUNK, len(nodes)), batches, out)

    for _ in in_parallel(piece, range(0, len(nodes), _CHUNK)):
        pass
    return out[0]


@inner
def _cosine(a, b, i):  # type: ignore[no-untyped-def]
    """Cosine of the angle between a and b in lane i, 0 where one of them has no length."""
    dot = a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i]
    size = math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2) * math.sqrt(b[0, i] ** 2 + b[1, i] ** 2 + b[2, i] ** 2)
    return dot / size if size > 0.0 else 0.0


@kernel
def _walk(tile, sides, orthogonality, volume_ratio, sums):  # type: ignore[no-untyped-def]
    """Give every face to the cells beside it.

    sums (n, 8): over the inner faces of a cell A A^T (xx, yy, zz, xy, xz, yz), |A| and their number.
    """
    n = len(sides.owner)
    finite, own, other, size, ratio = (
        np.empty(LANES),
        np.empty(LANES),
        np.empty(LANES),
        np.empty(LANES),
        np.empty(LANES),
    )
    for first in range(0, n, LANES):
        fill(tile, sides, first, n, finite)
        a = tile.area
        for i in range(LANES):
            ahead = _cosine(a, tile.between, i)
            here, there = _cosine(a, tile.own, i), -_cosine(a, tile.other, i)
            shell = sides.shell == 1 or tile.boundary[i] == 1.0  # a shell's edge knows its own cell only
            own[i] = here if shell or here < ahead else ahead
            other[i] = there if shell or there < ahead else ahead
            size[i] = math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)
            low, high = abs(tile.volume[0, i]), abs(tile.volume[1, i])
            low, high = min(low, high), max(low, high)
            ratio[i] = high / low if low > 0.0 else np.inf
            if finite[i] == 0.0:
                own[i] = other[i] = size[i] = ratio[i] = np.nan
        for i in range(min(LANES, n - first)):
            c, b = sides.owner[first + i], sides.neighbour[first + i]
            orthogonality[c] = _lower(orthogonality[c], own[i])
            if b >= 0:
                orthogonality[b] = _lower(orthogonality[b], other[i])
                ax, ay, az = a[0, i], a[1, i], a[2, i]
                for side in range(2):
                    cell = c if side == 0 else b
                    volume_ratio[cell] = -_lower(-volume_ratio[cell], -ratio[i])
                    total = sums[cell]
                    total[0] += ax * ax
                    total[1] += ay * ay
                    total[2] += az * az
                    total[3] += ax * ay
                    total[4] += ax * az
                    total[5] += ay * az
                    total[6] += size[i]
                    total[7] += 1.0


@inner
def _lower(old, new):  # type: ignore[no-untyped-def]
    """The smaller one; nan if one is nan, and so for good."""
    return new if new < old or new != new else old


@kernel
def _finish(sums, orthogonality, volume_ratio, determinant):  # type: ignore[no-untyped-def]
    """Determinants from the sums; nan throughout where a corner is not finite, and for a cell without faces."""
    for c in range(len(sums)):
        xx, yy, zz, xy, xz, yz, size, n = sums[c]
        square = (size / n) * (size / n)
        if not orthogonality[c] < np.inf:
            orthogonality[c] = volume_ratio[c] = determinant[c] = np.nan
        elif n >= 3.0 and square > 0.0:
            xx, yy, zz, xy, xz, yz = xx / square, yy / square, zz / square, xy / square, xz / square, yz / square
            det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
            determinant[c] = abs(det) / 8.0
        else:  # fewer than three directions: no rounding shall make a determinant of them
            determinant[c] = 0.0


_SKEW = {
    "tet": next(row for row in aspect.ROWS if row.id == "gambit.equisize_skew"),
    **dict.fromkeys(("pyramid", "wedge"), next(row for row in angles.ROWS if row.id == "gambit.equiangle_skew")),
}
"""The skew that orthogonal quality looks at: by volume for tets, by angles for pyramids and wedges."""

_SOLIDS = ("tet", "pyramid", "wedge", "hex", "polyhedron")
_EVERY = ("tri", "quad", "polygon", *_SOLIDS)

ROWS = (
    Metric(
        id="fluent.orthogonal_quality", title="Orthogonal quality", on=_EVERY, unit="1", low=-1.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0, systems=("Fluent: Orthogonal Quality", "Pointwise, Icepak: face alignment (the c term)"),
        formula="min over the faces of A.f / |A||f| and, where a cell lies beyond, A.c / |A||c|; f to the centre of the face, c to the centre of that cell",
        source="Fluent user's guide, Mesh Quality (equations 5-1, 5-2); Ansys help 24.2 for shells: f alone",
        caveat="Later releases also take in 1 - skewness for tets, pyramids and wedges: icem.orthogonal_quality. Below 0 in an inverted cell.",
        column="orthogonality",
    ),
    Metric(
        id="icem.orthogonal_quality", title="Orthogonal quality with skewness", on=_EVERY, unit="1", low=-1.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0,
        systems=("ICEM CFD: Orthogonal Quality", "Ansys Meshing: Orthogonal Quality", "Ansys Discovery: Orthogonal Quality", "Fluent Meshing: 1 - Inverse Orthogonal Quality"),
        formula="min(fluent.orthogonal_quality, 1 - skewness) for tets (equi-size skew), pyramids and wedges (equi-angle skew); fluent.orthogonal_quality for all others",
        source="Ansys help 24.2, ICEM CFD and Meshing: Orthogonal Quality; Skewness for which of the two skews belongs to a type",
        caveat="The help does not name the skewness it means; these are the defaults of each type there.",
        column="orthogonal_quality",
    ),
    Metric(
        id="max_neighbour_volume_ratio", title="Largest volume ratio to a neighbour", on=_EVERY, unit="1", low=1.0, high=math.inf, best="low", ideal=1.0,
        degenerate=math.inf, systems=("Fluent Meshing: Size Change", "ICEM CFD: Volume Change"),
        formula="max over the neighbours of larger over smaller volume (area in 2-D), magnitudes; 1 for a cell that has none",
        source="Fluent user's guide, Report Cell Limits: size change", column="volume_ratio",
    ),
    Metric(
        id="openfoam.determinant", title="Cell determinant", on=_SOLIDS, unit="1", low=0.0, high=math.inf, best="high", ideal=1.0,
        degenerate=0.0, systems=("OpenFOAM: cell determinant (wellposedness)",),
        formula="|det(sum of a a^T)|/8 over the inner faces of the cell, a = A over the mean |A| of them; 1 for a cube among cubes",
        source="OpenFOAM 1912 primitiveMeshTools::cellDeterminant",
        caveat="As OpenFOAM 1912 prints it; releases of the OpenFOAM Foundation do not divide by 8. 0 where inner faces look in fewer than three "
        "directions, as in every mesh one cell thick, where OpenFOAM leaves out the direction of empty patches.",
        column="determinant",
    ),
)  # fmt: skip
