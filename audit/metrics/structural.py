"""Checks of FEMAP and Pointwise on several cell types, and the checks of FEA systems that have no row."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.cells import LINEAR_TYPES
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, edges, faces, volume
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["LEFT_OUT", "ROWS"]

_WITH_QUADS = ("quad", "pyramid", "wedge", "hex")


@tile_kernel
def opposite_edges(tile: Tile, out: Lane) -> None:
    """Longer over shorter of two opposite edges of a quadrilateral face, the worst pair."""
    quads, x = tile.tables.quads, tile.x
    for i in range(LANES):
        out[i] = 0.0
    for r in range(2 * len(quads)):
        f, k = r // 2, r % 2
        a, b, c, d = quads[f, k], quads[f, k + 1], quads[f, k + 2], quads[f, (k + 3) % 4]
        for i in range(LANES):
            p2 = (x[b, 0, i] - x[a, 0, i]) ** 2 + (x[b, 1, i] - x[a, 1, i]) ** 2 + (x[b, 2, i] - x[a, 2, i]) ** 2
            q2 = (x[d, 0, i] - x[c, 0, i]) ** 2 + (x[d, 1, i] - x[c, 1, i]) ** 2 + (x[d, 2, i] - x[c, 2, i]) ** 2
            low, high = min(p2, q2), max(p2, q2)
            ratio = high / low if low > 0.0 else np.inf
            out[i] = max(out[i], ratio)
    for i in range(LANES):
        out[i] = math.sqrt(out[i])


@tile_kernel
def area_over_edge(tile: Tile, out: Lane) -> None:
    """A / longest edge."""
    a = tile.face[0]
    for i in range(LANES):
        longest = math.sqrt(tile.edge_range[1, i])
        area = math.sqrt(a[0, i] * a[0, i] + a[1, i] * a[1, i] + a[2, i] * a[2, i])
        out[i] = area / longest * tile.unit[i] if longest > 0.0 else 0.0


@tile_kernel
def volume_over_face(tile: Tile, out: Lane) -> None:
    """|V| / largest face."""
    for i in range(LANES):
        out[i] = 0.0
    for f in range(len(tile.face)):
        a = tile.face[f]
        for i in range(LANES):
            out[i] = max(out[i], a[0, i] * a[0, i] + a[1, i] * a[1, i] + a[2, i] * a[2, i])
    for i in range(LANES):
        out[i] = abs(tile.volume[i]) / math.sqrt(out[i]) * tile.unit[i] if out[i] > 0.0 else 0.0


@tile_kernel
def prism_aspect(tile: Tile, out: Lane) -> None:
    """Mean of the edges between the triangles over the mean edge of the triangles."""
    e = tile.edge2
    for i in range(LANES):
        base = (
            math.sqrt(e[0, i]) + math.sqrt(e[1, i]) + math.sqrt(e[2, i])
            + math.sqrt(e[3, i]) + math.sqrt(e[4, i]) + math.sqrt(e[5, i])
        )  # fmt: skip
        height = math.sqrt(e[6, i]) + math.sqrt(e[7, i]) + math.sqrt(e[8, i])
        out[i] = 2.0 * height / base if base > 0.0 else np.nan


@tile_kernel
def pyramid_aspect(tile: Tile, out: Lane) -> None:
    """Height of the apex above the base, signed, over the mean edge of the base."""
    x, e, n = tile.x, tile.edge2, tile.face[len(tile.tables.tris)]
    for i in range(LANES):
        hx = x[4, 0, i] - 0.25 * (x[1, 0, i] + x[2, 0, i] + x[3, 0, i])
        hy = x[4, 1, i] - 0.25 * (x[1, 1, i] + x[2, 1, i] + x[3, 1, i])
        hz = x[4, 2, i] - 0.25 * (x[1, 2, i] + x[2, 2, i] + x[3, 2, i])
        area = math.sqrt(n[0, i] * n[0, i] + n[1, i] * n[1, i] + n[2, i] * n[2, i])
        base = math.sqrt(e[0, i]) + math.sqrt(e[1, i]) + math.sqrt(e[2, i]) + math.sqrt(e[3, i])
        up = -(hx * n[0, i] + hy * n[1, i] + hz * n[2, i])  # the base's normal leaves the cell
        out[i] = 4.0 * up / (area * base) if area > 1e-14 * base * base else np.nan


ROWS = (
    Metric(
        id="femap.taper", title="Taper (FEMAP)", on=_WITH_QUADS, unit="1", low=1.0, high=math.inf, best="low", ideal=1.0,
        degenerate=math.inf, systems=("FEMAP: Taper",),
        formula="longer / shorter of two opposite edges of a quadrilateral, the worse pair; solids: worst face",
        source="FEMAP element quality check; unverified", kernel=opposite_edges,
    ),
    Metric(
        id="femap.explicit", title="Characteristic length (FEMAP)", on=LINEAR_TYPES, unit="L", low=0.0, high=math.inf, best="none",
        ideal=None, degenerate=0.0, systems=("FEMAP: Explicit",),
        formula="tri, quad: A / longest edge; solids: |V| / largest face",
        source="FEMAP element quality check; unverified. LS-DYNA Theory Manual, time step calculations, has V / A_max",
        caveat="The length a pressure wave crosses in one explicit time step, up to a factor that depends on the solver.",
        kernel={t: (area_over_edge if t in ("tri", "quad") else volume_over_face) for t in LINEAR_TYPES},
        stages={t: ((edges, faces) if t in ("tri", "quad") else (faces, volume)) for t in LINEAR_TYPES},
    ),
    Metric(
        id="pointwise.prism_aspect", title="Prism aspect ratio (Pointwise)", on=("wedge",), unit="1", low=0.0, high=math.inf,
        best="none", ideal=1.0, degenerate=math.nan, systems=("Pointwise: Aspect Ratio (prism)",),
        formula="mean edge between the triangles / mean edge of the triangles", source="Pointwise manual, Examine",
        caveat="Below 1 for flat prisms, such as those of a boundary layer.", stages=(edges,), kernel=prism_aspect,
    ),
    Metric(
        id="pointwise.pyramid_aspect", title="Pyramid aspect ratio (Pointwise)", on=("pyramid",), unit="1", low=-math.inf,
        high=math.inf, best="none", ideal=math.sqrt(0.5), degenerate=math.nan, systems=("Pointwise: Aspect Ratio (pyramid)",),
        formula="height above the base / mean edge of the base, negative when the apex is on the wrong side",
        source="Pointwise manual, Examine", caveat="0.7071 for the pyramid of equal edges.",
        stages=(edges, faces), kernel=pyramid_aspect,
    ),
)  # fmt: skip

LEFT_OUT: dict[str, str] = {
    "hm.jacobian_corner": "the same number as icem.determinant, whose row names HyperMesh",
    "hm.vol_aspect": "the same number as nastran.tetraar, whose row names HyperMesh",
    "hm.vol_skew": "the same number as gambit.equisize_skew, whose row names HyperMesh",
    "hm.taper_alt": "an angle up to 45 degrees; which one is not published",
    "femap.nastran_warping": "the same number as nastran.warp, whose row names FEMAP",
    "femap.warping": "an angle out of plane; which one is not published: icem.max_warp and salome.warp are two",
    "femap.jacobian": "neither its points nor its scale are published",
    "femap.combined": "the worst of all other checks over their limits, which are the user's",
    "patran.tri_skew": "the same number as hm.skew on triangles, whose row names Patran",
    "patran.skew": "the same number as hm.skew on quadrilaterals: the mid-lines are the axes",
    "patran.warp": "the same number as salome.warp, whose row names Patran",
    "patran.taper": "triangles about the centre of the axes; how they are weighed was not found in a published text",
    "patran.twist": "no published formula found",
    "pointwise.quad_aspect": "the same number as gambit.aspect_ratio on quadrilaterals, whose row names Pointwise",
    "optistruct.aspect_ratio": "ratios of triangles and quadrilaterals with no published formula found",
    "optistruct.tet_collapse": "hm.tet_collapse times 1.24/1.2408",
    "autodesk.warping_angle": "an angle up to 45 degrees; which one is not published",
}
"""Checks of FEA systems without a row of their own, and why."""
