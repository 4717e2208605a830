"""Metrics and checks that profiles name and this build may not have yet: the list is to be empty."""

import math

from meshwright.audit.metrics import METRICS
from meshwright.audit.metrics.row import Metric

PENDING = [
    "ansys.aspect_ratio", "ansys.aspect_ratio_faces", "ansys.element_quality", "ansys.jacobian_ratio",
    "ansys.jacobian_ratio_nodes", "ansys.max_corner_angle", "ansys.parallel_deviation",
    "ansys.parallel_deviation_faces", "ansys.warping_factor", "cfx.aspect_ratio", "cfx.connectivity_number",
    "cfx.expansion_factor", "cfx.orthogonality_angle", "cfx.orthogonality_angle_min", "dihedral.min",
    "femap.alternate_taper", "femap.explicit", "femap.taper", "femap.tet_collapse", "fluent.aspect_ratio",
    "fluent.cell_squish", "fluent.orthogonal_quality", "growth_ratio", "hm.aspect", "hm.jacobian_gauss", "hm.skew",
    "hm.taper", "hm.tet_collapse", "hm.warpage", "hm.warpage_alt", "icem.angle", "icem.max_warp",
    "icem.mid_node_angle", "icem.opp_face_area_ratio", "icem.opp_face_parallelism", "icem.orthogonal_quality",
    "icem.quality", "icem.quality_premesh", "icem.skew", "icem.tetra_special", "max_neighbour_volume_ratio",
    "nastran.skew", "nastran.taper", "nastran.tetraar", "nastran.warp", "openfoam.aspect_ratio",
    "openfoam.concave", "openfoam.determinant", "openfoam.face_pyramid", "openfoam.face_twist",
    "openfoam.face_weight", "openfoam.flatness", "openfoam.min_pyramid", "openfoam.openness", "openfoam.skewness",
    "openfoam.volume_ratio", "patran.aspect_ratio", "points-below-axis", "pointwise.prism_aspect",
    "pointwise.pyramid_aspect", "simlab.collapse_ratio", "verdict.aspect_frobenius", "verdict.aspect_gamma",
    "verdict.aspect_ratio", "verdict.collapse_ratio", "verdict.condition", "verdict.distortion",
    "verdict.equiangle_skew", "verdict.max_aspect_frobenius", "verdict.max_edge_ratio", "verdict.mean_ratio",
    "verdict.med_aspect_frobenius", "verdict.normalized_inradius", "verdict.oddy", "verdict.radius_ratio",
    "verdict.scaled_jacobian", "verdict.shape", "verdict.shear", "verdict.taper", "verdict.warpage",
]  # fmt: skip

_EVERY = ("tri", "quad", "tet", "pyramid", "wedge", "hex", "polygon", "polyhedron")
_OF_FACES = ("skewness", "face_weight", "volume_ratio", "flatness", "face_pyramid", "face_twist")


def stand_ins():
    """Rows in place of metrics that are pending: nothing measures them, so that their rules stay undecided."""
    found = {}
    for id_ in PENDING:
        if id_ in METRICS:
            continue
        of_face = id_.startswith("openfoam.") and id_.split(".")[1] in _OF_FACES
        entity = "face" if of_face else "point" if id_.startswith("cfx.") else "cell"
        on = {"face": ("interior", "boundary"), "point": ("point",), "cell": _EVERY}[entity]
        found[id_] = Metric(id_, id_, on, "1", -math.inf, math.inf, "none", None, math.nan, (), "", "", entity=entity)
    return found
