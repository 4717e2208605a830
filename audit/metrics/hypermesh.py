"""HyperMesh checks of all cell types: aspect ratio and skew."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES, LINEAR_TYPES
from meshwright.audit.jit import inner
from meshwright.audit.metrics.edges import edge_ratio
from meshwright.audit.metrics.face_shapes import SKEW, SKEWLESS, face_shapes, flattened
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, degrees_from_cotangent, edges
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]

_WITH_QUADS = ("quad", "pyramid", "wedge", "hex")


def _face_edges(type_name: str) -> NDArray[np.int64]:
    """(faces, 4) rows of the type's edge table around each face; a triangle repeats its first."""
    cell = CELL_TYPES[type_name]
    rows = {frozenset(edge): row for row, edge in enumerate(cell.edges)}
    around = [[rows[frozenset((f[k], f[(k + 1) % len(f)]))] for k in range(len(f))] for f in cell.faces]
    return np.array([(row + row[:1])[:4] for row in around])


_TET, _PYRAMID, _WEDGE, _HEX = (_face_edges(name) for name in ("tet", "pyramid", "wedge", "hex"))


@inner
def _worst_face(tile, faces, out):  # type: ignore[no-untyped-def]
    """Largest ratio of the longest and the shortest edge of one face."""
    e = tile.edge2
    for i in range(LANES):
        out[i] = 0.0
    for f in range(len(faces)):
        a, b, c, d = faces[f, 0], faces[f, 1], faces[f, 2], faces[f, 3]
        for i in range(LANES):
            low, high = min(e[a, i], e[b, i], e[c, i], e[d, i]), max(e[a, i], e[b, i], e[c, i], e[d, i])
            ratio = high / low if low > 0.0 else np.inf
            out[i] = max(out[i], ratio)
    for i in range(LANES):
        out[i] = math.sqrt(out[i])


@tile_kernel
def tet_edge_aspect(tile: Tile, out: Lane) -> None:
    """Worst face of a tet."""
    _worst_face(tile, _TET, out)


@tile_kernel
def pyramid_edge_aspect(tile: Tile, out: Lane) -> None:
    """Worst face of a pyramid."""
    _worst_face(tile, _PYRAMID, out)


@tile_kernel
def wedge_edge_aspect(tile: Tile, out: Lane) -> None:
    """Worst face of a wedge."""
    _worst_face(tile, _WEDGE, out)


@tile_kernel
def hex_edge_aspect(tile: Tile, out: Lane) -> None:
    """Worst face of a hex."""
    _worst_face(tile, _HEX, out)


@tile_kernel
def skew(tile: Tile, out: Lane) -> None:
    """Worst skew angle of a face; undefined faces are left out, nan where there is no other."""
    n = len(tile.tables.tris) + len(tile.tables.quads)
    for i in range(LANES):
        angle = degrees_from_cotangent(1.0 / math.sqrt(tile.face_shape[SKEW, i]))
        out[i] = angle if tile.face_shape[SKEWLESS, i] < n and not flattened(tile, i) else np.nan


ROWS = (
    Metric(
        id="hm.aspect", title="Aspect ratio (HyperMesh)", on=LINEAR_TYPES, unit="1", low=1.0, high=math.inf, best="low", ideal=1.0,
        degenerate=math.inf, systems=("HyperMesh: aspect", "MSC Nastran: aspect ratio (quad)", "FEMAP: Aspect Ratio"),
        formula="longest / shortest edge of a face, the worst face",
        source="Altair HyperMesh help, element quality calculations; for FEMAP unverified",
        caveat="Blind to height: a flat triangle with a corner in the middle of its longest edge scores 2. HyperMesh can be told to use the smallest height instead.",
        kernel={"tri": edge_ratio, "quad": edge_ratio, "tet": tet_edge_aspect, "pyramid": pyramid_edge_aspect,
                "wedge": wedge_edge_aspect, "hex": hex_edge_aspect},
        stages=(edges,),
    ),
    Metric(
        id="hm.skew", title="Skew angle (HyperMesh)", on=LINEAR_TYPES, unit="deg", low=0.0, high=90.0, best="low", ideal=0.0,
        degenerate=math.nan,
        systems=("HyperMesh: skew", "OptiStruct: skew angle", "Patran: Skew, Face Skew", "Salome: skew"),
        formula="quad: 90 less the angle between the mid-lines; tri: 90 less the smallest angle between a median and the line "
        "between the other two middles; solids: worst face",
        source="Altair HyperMesh help, element quality calculations",
        caveat="90 for a flat triangle; undefined where two corners of a triangle coincide or a mid-line has no length. Solids leave "
        "such faces out.",
        stages=(face_shapes,), kernel=skew,
    ),
)  # fmt: skip
