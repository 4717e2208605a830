"""Rows of Verdict's and Cubit's metrics; the kernels are in the files named verdict_*."""

from __future__ import annotations

import math

from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import angles, axes, diagonals, edges, faces, jacobians, quad_axes, volume
from meshwright.audit.metrics.verdict_axes import (
    hex_dimension,
    hex_distortion,
    hex_max_edge_ratio,
    hex_taper,
    quad_aspect_ratio,
    quad_max_edge_ratio,
    quad_radius_ratio,
    quad_taper,
    quad_warpage,
)
from meshwright.audit.metrics.verdict_cells import (
    hex_condition,
    hex_mean_frobenius,
    hex_oddy,
    hex_scaled_jacobian,
    hex_shape,
    pyramid_scaled_jacobian,
    pyramid_shape,
    quad_condition,
    quad_distortion,
    quad_frobenius,
    quad_mean_frobenius,
    quad_oddy,
    quad_scaled_jacobian,
    quad_shape,
    shear,
    wedge_condition,
    wedge_distortion,
    wedge_frobenius,
    wedge_mean_frobenius,
    wedge_scaled_jacobian,
    wedge_shape,
)
from meshwright.audit.metrics.verdict_corners import hex_corners, quad_corners, wedge_corners
from meshwright.audit.metrics.verdict_simplices import (
    tet_aspect_gamma,
    tet_aspect_ratio,
    tet_collapse,
    tet_condition,
    tet_frobenius,
    tet_inradius,
    tet_mean_ratio,
    tet_scaled_jacobian,
    tet_shape,
    tet_skew,
    tri_aspect_ratio,
    tri_condition,
    tri_inradius,
    tri_scaled_jacobian,
    tri_shape,
)

__all__ = ["LEFT_OUT", "ROWS"]

_MANUAL = "Stimpson et al., The Verdict Library Reference Manual, Sandia National Laboratories, 2007"
_CODE = "Verdict 1.4 (sandialabs/verdict); not in the manual of 2007"
_TRI, _TET = (edges, faces), (edges, jacobians)
_QUAD, _WEDGE, _HEX = (edges, faces, quad_corners), (edges, wedge_corners), (edges, axes, hex_corners)

ROWS = (
    Metric(
        id="verdict.scaled_jacobian", title="Scaled Jacobian", on=("tri", "quad", "tet", "pyramid", "wedge", "hex"), unit="1",
        low=-1.0, high=1.0, best="high", ideal=1.0, degenerate=0.0, systems=("Verdict: scaled Jacobian", "Cubit: Scaled Jacobian"),
        formula="min over the corners of J / product of the edges' lengths, times what makes the equilateral cell 1; hex: and at the "
        "centre; tet: over the largest product at a corner; pyramid: of the four tets at the base, 2 - v for v above 1",
        source=f"{_MANUAL}, scaled Jacobian; pyramid: {_CODE}",
        caveat="Cubit accepts 0.5 to 1 on quads and hexes, 0.2 to 1 on triangles, tets and wedges. A triangle has no sign.",
        kernel={
            "tri": tri_scaled_jacobian, "quad": quad_scaled_jacobian, "tet": tet_scaled_jacobian,
            "pyramid": pyramid_scaled_jacobian, "wedge": wedge_scaled_jacobian, "hex": hex_scaled_jacobian,
        },
        stages={"tri": _TRI, "quad": _QUAD, "tet": _TET, "pyramid": (jacobians,), "wedge": _WEDGE, "hex": _HEX},
    ),
    Metric(
        id="verdict.shape", title="Shape", on=("tri", "quad", "tet", "pyramid", "wedge", "hex"), unit="1", low=0.0, high=1.0,
        best="high", ideal=1.0, degenerate=0.0, systems=("Verdict: shape", "Cubit: Shape"),
        formula="tri 4 sqrt(3) A/sum e^2; tet 12 (3V)^(2/3)/sum e^2; quad min 2J/sum e^2, wedge min 3 (2J/sqrt(3))^(2/3)/sum e^2, "
        "hex min 3 J^(2/3)/sum e^2 over the corners; pyramid: base's shape x cosine of the slant x height/(Lmax/sqrt(2)) or its inverse",
        source=f"{_MANUAL}, shape; pyramid, wedge: {_CODE}",
        caveat="0 as soon as one corner is folded. Cubit accepts 0.3 to 1 on quads and hexes, 0.2 to 1 on tets and wedges. VTK's pyramid may miss the longest edge and takes the base's normal at its first corner.",
        kernel={
            "tri": tri_shape, "quad": quad_shape, "tet": tet_shape, "pyramid": pyramid_shape, "wedge": wedge_shape, "hex": hex_shape,
        },
        stages={"tri": _TRI, "quad": _QUAD, "tet": _TET, "pyramid": (edges, faces), "wedge": _WEDGE, "hex": _HEX},
    ),
    Metric(
        id="verdict.aspect_ratio", title="Aspect ratio (Verdict)", on=("tri", "quad", "tet"), unit="1", low=1.0, high=math.inf,
        best="low", ideal=1.0, degenerate=math.inf, systems=("Verdict: aspect ratio",),
        formula="tri Lmax P/(4 sqrt(3) A); quad Lmax P/4A; tet Lmax/(2 sqrt(6) r), r the inradius", source=f"{_MANUAL}, aspect ratio",
        caveat="Not GAMBIT's: a 2 x 1 rectangle has 1.5 here and 2 there. Cubit's Aspect Ratio of quads and hexes is "
        "verdict.max_edge_ratio, its Aspect Ratio Beta of tets gambit.aspect_ratio.",
        kernel={"tri": tri_aspect_ratio, "quad": quad_aspect_ratio, "tet": tet_aspect_ratio},
        stages={"tri": _TRI, "quad": (edges, faces), "tet": (edges, faces, jacobians)},
    ),
    Metric(
        id="verdict.max_edge_ratio", title="Ratio of the axes", on=("quad", "hex"), unit="1", low=1.0, high=math.inf, best="low",
        ideal=1.0, degenerate=math.inf, systems=("Verdict: maximum edge ratio", "Cubit: Aspect Ratio"),
        formula="longest / shortest principal axis (lines through opposite edge middles or face centres)",
        source=f"{_MANUAL}, maximum edge ratio", caveat="Not the ratio of edges: a rhombus and a sheared cube differ. Cubit accepts 1 to 4.",
        kernel={"quad": quad_max_edge_ratio, "hex": hex_max_edge_ratio}, stages={"quad": (quad_axes,), "hex": (axes,)},
    ),
    Metric(
        id="verdict.taper", title="Taper (Verdict)", on=("quad", "hex"), unit="1", low=0.0, high=math.inf, best="low", ideal=0.0,
        degenerate=math.inf, systems=("Verdict: taper", "Cubit: Taper"),
        formula="quad 2|T|/min(|X1|, |X2|), T the hour-glass vector; hex max |X_kl|/min(|B_k|, |B_l|)", source=f"{_MANUAL}, taper",
        caveat="Not GAMBIT's: counts the part of T across the axis, and warp. Cubit accepts up to 0.7 on quads, 0.4 on hexes. "
        "0 on a hex squeezed flat, whose modes vanish with the axis.",
        kernel={"quad": quad_taper, "hex": hex_taper}, stages={"quad": (quad_axes,), "hex": (axes,)},
    ),
    Metric(
        id="verdict.warpage", title="Warpage (Verdict)", on=("quad",), unit="1", low=-1.0, high=1.0, best="high", ideal=1.0,
        degenerate=math.nan, systems=("Verdict: warpage", "Cubit: Warpage"),
        formula="min(n0.n2, n1.n3)^3, n the unit normals at the corners", source=f"{_MANUAL}, warpage",
        caveat="A cosine, 1 for a plane quad; the manual prints 1 minus this. Undefined where a corner has no normal. Cubit accepts 0.9 to 1.",
        kernel=quad_warpage, stages=(edges,),
    ),
    Metric(
        id="verdict.condition", title="Condition number", on=("tri", "quad", "tet", "wedge", "hex"), unit="1", low=1.0, high=math.inf,
        best="low", ideal=1.0, degenerate=math.inf, systems=("Verdict: condition", "Cubit: Condition No."),
        formula="max over the corners of |A W^-1| |W A^-1| / n, A the edges there, W those of the ideal cell, Frobenius norms; "
        "wedge: Frobenius aspect instead",
        source=f"{_MANUAL}, condition; wedge: {_CODE}",
        caveat="inf where a corner is folded or flat. Cubit accepts 1 to 3 on tets and wedges, 1 to 8 on hexes; the manual 1 to 4 on quads.",
        kernel={"tri": tri_condition, "quad": quad_condition, "tet": tet_condition, "wedge": wedge_condition, "hex": hex_condition},
        stages={"tri": _TRI, "quad": _QUAD, "tet": (edges, faces, jacobians), "wedge": _TET, "hex": _HEX},
    ),
    Metric(
        id="verdict.oddy", title="Oddy", on=("quad", "hex"), unit="1", low=0.0, high=math.inf, best="low", ideal=0.0,
        degenerate=math.inf, systems=("Verdict: Oddy",),
        formula="max over the corners (hex: and the centre) of (|G|^2 - tr(G)^2/n) / det(G)^(2/n), G the metric tensor of the edges",
        source=f"{_MANUAL}, Oddy; Oddy et al., Trans. CSME 12 (1988)",
        caveat="inf where a corner is flat, or of a hex folded. Values up to 0.5 are taken as good.",
        kernel={"quad": quad_oddy, "hex": hex_oddy}, stages={"quad": _QUAD, "hex": _HEX},
    ),
    Metric(
        id="verdict.shear", title="Shear", on=("quad", "hex"), unit="1", low=0.0, high=1.0, best="high", ideal=1.0, degenerate=0.0,
        systems=("Verdict: shear", "Cubit: Shear"), formula="min over the corners of J / product of the edges' lengths, 0 where one is folded",
        source=f"{_MANUAL}, shear", caveat="Cubit's automatic check of quads and hexes. It accepts 0.3 to 1.",
        kernel=shear, stages={"quad": _QUAD, "hex": _HEX},
    ),
    Metric(
        id="verdict.distortion", title="Distortion", on=("quad", "wedge", "hex"), unit="1", low=-1.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0, systems=("Verdict: distortion", "Cubit: Distortion"),
        formula="min J of the map from the ideal cell x its size / the cell's: over the corners, and the 2x2x2 Gauss points of a hex",
        source=f"{_MANUAL}, distortion; wedge: {_CODE}",
        caveat="Divides by |V|: a mirrored cell has -1 (in Verdict 1). Verdict gives a warped quad a thickness; here J counts along the "
        "mean normal. Always 1 on linear triangles and tets. Cubit accepts 0.6 to 1.",
        kernel={"quad": quad_distortion, "wedge": wedge_distortion, "hex": hex_distortion},
        stages={"quad": _QUAD, "wedge": (edges, volume, jacobians), "hex": (edges, axes, volume, jacobians)},
    ),
    Metric(
        id="verdict.aspect_frobenius", title="Frobenius aspect", on=("tri", "tet"), unit="1", low=1.0, high=math.inf, best="low",
        ideal=1.0, degenerate=math.inf, systems=("Verdict: aspect Frobenius",),
        formula="tri sum e^2/(4 sqrt(3) A); tet sum e^2/(12 (3|V|)^(2/3))", source=f"{_MANUAL}, aspect Frobenius",
        caveat="1 / shape, but a mirrored tet keeps its value.",
        kernel={"tri": tri_condition, "tet": tet_frobenius}, stages={"tri": _TRI, "tet": _TET},
    ),
    Metric(
        id="verdict.max_aspect_frobenius", title="Largest Frobenius aspect", on=("quad", "wedge", "hex"), unit="1", low=1.0,
        high=math.inf, best="low", ideal=1.0, degenerate=math.inf, systems=("Verdict: maximum aspect Frobenius",),
        formula="max over the corners of: quad (e1^2 + e2^2)/(2|e1 x e2|); wedge the tet's number over that of the unit wedge; "
        "hex the condition number",
        source=f"{_MANUAL}, maximum aspect Frobenius; wedge: {_CODE}", caveat="inf where a corner is flat, or of a hex folded.",
        kernel={"quad": quad_frobenius, "wedge": wedge_frobenius, "hex": hex_condition},
        stages={"quad": _QUAD, "wedge": _TET, "hex": _HEX},
    ),
    Metric(
        id="verdict.med_aspect_frobenius", title="Mean Frobenius aspect", on=("quad", "wedge", "hex"), unit="1", low=1.0,
        high=math.inf, best="low", ideal=1.0, degenerate=math.inf, systems=("Verdict: mean aspect Frobenius",),
        formula="mean over the corners of the same", source=f"{_MANUAL}, mean aspect Frobenius; wedge: {_CODE}",
        caveat="inf where a corner is flat, or of a hex folded.",
        kernel={"quad": quad_mean_frobenius, "wedge": wedge_mean_frobenius, "hex": hex_mean_frobenius},
        stages={"quad": _QUAD, "wedge": _TET, "hex": _HEX},
    ),
    Metric(
        id="verdict.radius_ratio", title="Radius ratio", on=("quad",), unit="1", low=1.0, high=math.inf, best="low", ideal=1.0,
        degenerate=math.inf, systems=("Verdict: radius ratio",),
        formula="sqrt(sum e^2) x longest edge or diagonal / (2 sqrt(2) x smallest corner |e1 x e2|)", source=f"{_MANUAL}, radius ratio",
        caveat="Radii in name only. Of triangles and tets, where they are real, see gambit.aspect_ratio.",
        kernel=quad_radius_ratio, stages=(edges, diagonals, faces, quad_corners),
    ),
    Metric(
        id="verdict.aspect_gamma", title="Aspect gamma", on=("tet",), unit="1", low=1.0, high=math.inf, best="low", ideal=1.0,
        degenerate=math.inf, systems=("Verdict: aspect gamma", "Cubit: Aspect Ratio Gamma"), formula="Lrms^3 / (6 sqrt(2) |V|)",
        source=f"{_MANUAL}, aspect gamma", caveat="Cubit accepts 1 to 3.", kernel=tet_aspect_gamma, stages=_TET,
    ),
    Metric(
        id="verdict.mean_ratio", title="Mean ratio", on=("tet",), unit="1", low=-1.0, high=1.0, best="high", ideal=1.0, degenerate=0.0,
        systems=("Verdict: mean ratio", "Cubit: Mean Ratio"), formula="6 sqrt(2) V / Lrms^3", source=_CODE,
        caveat="1 / aspect gamma, negative for a mirrored tet. Cubit accepts 0.2 to 1.", kernel=tet_mean_ratio, stages=_TET,
    ),
    Metric(
        id="verdict.equiangle_skew", title="Equi-angle skew (Verdict)", on=("tet",), unit="1", low=0.0, high=1.0, best="low", ideal=0.0,
        degenerate=1.0, systems=("Verdict: equiangle skew",),
        formula="worse of the skews of the face angles (ideal 60) and of the angles between faces (ideal 70.53 degrees)", source=_CODE,
        caveat="Sees slivers, which gambit.equiangle_skew does not. On all other types the two are the same.",
        kernel=tet_skew, stages=(edges, faces, jacobians, angles),
    ),
    Metric(
        id="verdict.collapse_ratio", title="Collapse ratio", on=("tet",), unit="1", low=-math.sqrt(2.0 / 3.0), high=math.sqrt(2.0 / 3.0),
        best="high", ideal=math.sqrt(2.0 / 3.0), degenerate=0.0, systems=("Verdict: collapse ratio",),
        formula="min over the corners of height / longest edge of the opposite face, signed by the volume", source=f"{_MANUAL}, collapse ratio",
        caveat="VTK takes a wrong edge in two of the faces and, of a mirrored tet, the height that is best.",
        kernel=tet_collapse, stages=(edges, faces, jacobians),
    ),
    Metric(
        id="verdict.normalized_inradius", title="Normalised inradius", on=("tri", "tet"), unit="1", low=-1.0, high=1.0, best="high",
        ideal=1.0, degenerate=0.0, systems=("Verdict: normalized inradius", "Cubit: Normalized Inradius"),
        formula="smallest inradius of the cells between corners, edge middles and (tet) centre / circumradius, 1 for the equilateral cell",
        source=_CODE, caveat="Of a triangle 2r/R, without sign. Cubit accepts 0.15 to 1 on tets.",
        kernel={"tri": tri_inradius, "tet": tet_inradius}, stages={"tri": _TRI, "tet": (edges, faces, jacobians)},
    ),
    Metric(
        id="verdict.dimension", title="Dimension", on=("hex",), unit="L", low=0.0, high=math.inf, best="none", ideal=None, degenerate=0.0,
        systems=("Verdict: dimension", "Pronto: characteristic length"), formula="V / (sqrt(2) |grad V|), the gradient by the corners' coordinates",
        source=f"{_MANUAL}, dimension", caveat="Of explicit time steps: 0.577 for a unit cube.",
        kernel=hex_dimension, stages=(edges, axes, volume),
    ),
)  # fmt: skip

_MEAN_SIZE = "needs the mean size of the cells of the mesh or the zone, which a kernel of one cell does not see"
LEFT_OUT: dict[str, str] = {
    "relative_size_squared": _MEAN_SIZE,
    "shape_and_size": _MEAN_SIZE,
    "shear_and_size": _MEAN_SIZE,
    "distortion of triangles and tets": "always 1: the Jacobian of a linear simplex is constant",
    "timestep": "needs a material",
    "inradius": "3 V / surface; see verdict.normalized_inradius",
    "maximum stretch of wedges": "the best face's, where a quality number should be the worst face's",
    "jacobian": "jacobian.min_corner; Verdict adds the centre of a hex, and has it for quads",
    "area, volume": "area, volume",
    "edge_ratio": "gambit.edge_ratio",
    "radius_ratio of triangles and tets": "gambit.aspect_ratio",
    "equivolume_skew": "gambit.equisize_skew",
    "equiangle_skew of other types than tets": "gambit.equiangle_skew",
    "skew": "gambit.midangle_skew",
    "stretch": "1 - gambit.stretch",
    "diagonal": "1 / gambit.diagonal_ratio",
    "nodal_jacobian_ratio": "icem.determinant",
    "minimum_angle, maximum_angle": "angle.min, angle.max; of a tet Verdict means dihedral angles",
    "squish_index": "fluent.cell_squish",
}
"""Names of Verdict without a row, and where the number is, or why there is none."""
