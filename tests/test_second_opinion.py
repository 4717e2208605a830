"""VTK's Verdict filter on hundreds of cells of each type, wherever its number is one of ours.

What differs, and why, stands in test_second_opinion_known.py.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.metrics import METRICS

vtk = pytest.importorskip("vtk", reason="VTK is not installed: pip install 'meshwright[oracles]'")
_filter = runpy.run_path(str(Path(__file__).parent / "verdict_filter.py"))
families, verdict, ours, turned, NAMES = (_filter[k] for k in ("families", "verdict", "ours", "turned", "NAMES"))

FROBENIUS_OF_THE_UNIT_WEDGE = 4 / (3 * 1.5 ** (1 / 3))  # (1.5 * 3 - 1/2) / (3 (2 * 3/4)^(1/3))


def same(v):
    return v


def mirrored(v):
    return 1 - v


def inverse(v):
    return 1 / v


def rounded_frobenius(v):
    """VTK divides by 1.16477 and lets nothing below 1."""
    return np.maximum(v * (FROBENIUS_OF_THE_UNIT_WEDGE / 1.16477), 1)


def rounded_distortion(v):
    """VTK's unit wedge has the volume 0.433013 and the Jacobian 0.866025."""
    return v * (0.433013 / 0.866025) * 2


# (type, our metric, VTK's measure, VTK's value from ours)
SAME = [
    ("tri", "area", "Area", same),
    ("tri", "gambit.aspect_ratio", "RadiusRatio", same),
    ("tri", "gambit.edge_ratio", "EdgeRatio", same),
    ("tri", "gambit.equiangle_skew", "EquiangleSkew", same),
    ("tri", "angle.min", "MinAngle", same),
    ("tri", "angle.max", "MaxAngle", same),
    ("tri", "verdict.aspect_frobenius", "AspectFrobenius", same),
    ("tri", "verdict.aspect_ratio", "AspectRatio", same),
    ("tri", "verdict.condition", "Condition", same),
    ("tri", "verdict.normalized_inradius", "NormalizedInradius", same),
    ("tri", "verdict.scaled_jacobian", "ScaledJacobian", same),
    ("tri", "verdict.shape", "Shape", same),
    ("quad", "area", "Area", same),
    ("quad", "gambit.edge_ratio", "EdgeRatio", same),
    ("quad", "gambit.midangle_skew", "Skew", same),
    ("quad", "gambit.stretch", "Stretch", mirrored),
    ("quad", "gambit.equiangle_skew", "EquiangleSkew", same),
    ("quad", "icem.equiangle_skewness", "EquiangleSkew", mirrored),
    ("quad", "angle.min", "MinAngle", same),
    ("quad", "angle.max", "MaxAngle", same),
    ("quad", "verdict.aspect_ratio", "AspectRatio", same),
    ("quad", "verdict.condition", "Condition", same),
    ("quad", "verdict.max_aspect_frobenius", "MaxAspectFrobenius", same),
    ("quad", "verdict.max_edge_ratio", "MaxEdgeRatio", same),
    ("quad", "verdict.med_aspect_frobenius", "MedAspectFrobenius", same),
    ("quad", "verdict.oddy", "Oddy", same),
    ("quad", "verdict.radius_ratio", "RadiusRatio", same),
    ("quad", "verdict.scaled_jacobian", "ScaledJacobian", same),
    ("quad", "verdict.shape", "Shape", same),
    ("quad", "verdict.shear", "Shear", same),
    ("quad", "verdict.taper", "Taper", same),
    ("quad", "verdict.warpage", "Warpage", same),
    ("tet", "volume", "Volume", same),
    ("tet", "jacobian.min_corner", "Jacobian", same),
    ("tet", "gambit.aspect_ratio", "RadiusRatio", same),
    ("tet", "gambit.edge_ratio", "EdgeRatio", same),
    ("tet", "gambit.equisize_skew", "EquivolumeSkew", same),
    ("tet", "verdict.aspect_frobenius", "AspectFrobenius", same),
    ("tet", "verdict.aspect_gamma", "AspectGamma", same),
    ("tet", "verdict.aspect_ratio", "AspectRatio", same),
    ("tet", "verdict.condition", "Condition", same),
    ("tet", "verdict.equiangle_skew", "EquiangleSkew", same),
    ("tet", "verdict.mean_ratio", "MeanRatio", same),
    ("tet", "verdict.normalized_inradius", "NormalizedInradius", same),
    ("tet", "verdict.scaled_jacobian", "ScaledJacobian", same),
    ("tet", "verdict.shape", "Shape", same),
    ("tet", "fluent.cell_squish", "SquishIndex", same),
    ("tri", "icem.r_over_R_x2", "RadiusRatio", inverse),
    ("tet", "icem.r_over_R_x3", "RadiusRatio", inverse),
    ("pyramid", "volume", "Volume", same),
    ("pyramid", "jacobian.min_corner", "Jacobian", same),
    ("pyramid", "gambit.equiangle_skew", "EquiangleSkew", same),
    ("pyramid", "verdict.scaled_jacobian", "ScaledJacobian", same),
    ("wedge", "volume", "Volume", same),
    ("wedge", "jacobian.min_corner", "Jacobian", same),
    ("wedge", "gambit.edge_ratio", "EdgeRatio", same),
    ("wedge", "gambit.equiangle_skew", "EquiangleSkew", same),
    ("wedge", "verdict.condition", "Condition", rounded_frobenius),
    ("wedge", "verdict.distortion", "Distortion", rounded_distortion),
    ("wedge", "verdict.max_aspect_frobenius", "MaxAspectFrobenius", rounded_frobenius),
    ("wedge", "verdict.med_aspect_frobenius", "MeanAspectFrobenius", rounded_frobenius),
    ("wedge", "verdict.scaled_jacobian", "ScaledJacobian", same),
    ("wedge", "verdict.shape", "Shape", same),
    ("hex", "volume", "Volume", same),
    ("hex", "jacobian.min_corner", "Jacobian", same),
    ("hex", "gambit.diagonal_ratio", "Diagonal", inverse),
    ("hex", "gambit.equiangle_skew", "EquiangleSkew", same),
    ("hex", "gambit.midangle_skew", "Skew", same),
    ("hex", "gambit.stretch", "Stretch", mirrored),
    ("hex", "icem.determinant", "NodalJacobianRatio", same),
    ("hex", "verdict.condition", "Condition", same),
    ("hex", "verdict.dimension", "Dimension", same),
    ("hex", "verdict.distortion", "Distortion", same),
    ("hex", "verdict.max_aspect_frobenius", "MaxAspectFrobenius", same),
    ("hex", "verdict.max_edge_ratio", "MaxEdgeRatio", same),
    ("hex", "verdict.med_aspect_frobenius", "MedAspectFrobenius", same),
    ("hex", "verdict.oddy", "Oddy", same),
    ("hex", "verdict.scaled_jacobian", "ScaledJacobian", same),
    ("hex", "verdict.shape", "Shape", same),
    ("hex", "verdict.shear", "Shear", same),
    ("hex", "verdict.taper", "Taper", same),
]
FAMILIES = ("random", "sheared", "stretched", "warped")


def assert_same(theirs, mine):
    np.testing.assert_allclose(theirs, mine, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize(
    ("type_name", "metric", "name", "convert"), SAME, ids=lambda v: v if isinstance(v, str) else ""
)
def test_verdict_gives_the_same_number(type_name, metric, name, convert, family):
    cells = families(type_name)[family]
    assert len(cells) >= 400
    assert_same(verdict(type_name, cells, name), convert(ours(type_name, cells, metric)))


# Measures that agree on part of the cells; the others are among the known differences.


def test_the_distortion_of_plane_quadrilaterals_is_verdicts():
    for family in ("random", "sheared", "stretched"):
        cells = families("quad")[family]
        assert_same(verdict("quad", cells, "Distortion"), ours("quad", cells, "verdict.distortion"))


def test_the_edge_ratio_of_a_hex_is_verdicts_where_the_longest_edge_is_one_of_its_first_six():
    cells = np.concatenate([families("hex")[family] for family in FAMILIES])
    edges = np.array(_filter["CELL_TYPES"]["hex"].edges)
    lengths = np.linalg.norm(cells[:, edges[:, 1]] - cells[:, edges[:, 0]], axis=2)
    seen = cells[lengths.argmax(axis=1) < 6]
    assert len(seen) > 400
    assert_same(verdict("hex", seen, "EdgeRatio"), ours("hex", seen, "gambit.edge_ratio"))


def test_the_collapse_ratio_of_a_tet_is_verdicts_where_edges_12_and_13_are_as_long():
    rng = np.random.default_rng(3)
    cells = rng.uniform(0.2, 1, (900, 4, 3)) * (1, 1, 0)
    cells[:, 2, 2] = rng.uniform(0.1, 1, 900)
    cells[:, 3] = cells[:, 2] * (1, 1, -1)  # corner 3 mirrors corner 2 in the plane of 0 and 1
    cells = cells[np.linalg.det(cells[:, 1:] - cells[:, :1]) < -0.01][:, [0, 1, 3, 2]]
    cells = np.concatenate([cells, cells * (-1, -1, 1)])
    assert len(cells) >= 400
    assert_same(verdict("tet", cells, "CollapseRatio"), ours("tet", cells, "verdict.collapse_ratio"))


def test_the_shape_of_a_pyramid_is_verdicts_on_plane_bases_with_long_sides():
    rng = np.random.default_rng(4)
    base = np.array(_filter["IDEAL"]["pyramid"][:4])
    cells = np.empty((400, 5, 3))
    cells[:, :4] = base + rng.uniform(-0.2, 0.2, (400, 4, 3)) * (1, 1, 0)
    cells[:, 4] = (0.5, 0.5, 0) + rng.uniform(-1, 1, (400, 3)) * (0.5, 0.5, 0.5) + (0, 0, 2)
    cells = turned(cells, rng)
    assert_same(verdict("pyramid", cells, "Shape"), ours("pyramid", cells, "verdict.shape"))


SIZE = "needs the mean size of the mesh's cells"
WITHOUT_A_ROW = {
    ("tri", "Distortion"): "always 1",
    ("tri", "RelativeSizeSquared"): SIZE,
    ("tri", "ShapeAndSize"): SIZE,
    ("quad", "Jacobian"): "an area; the scaled Jacobian says the same without a unit",
    ("quad", "RelativeSizeSquared"): SIZE,
    ("quad", "ShapeAndSize"): SIZE,
    ("quad", "ShearAndSize"): SIZE,
    ("tet", "Distortion"): "always 1",
    ("tet", "Inradius"): "a length; the normalised inradius says the same without a unit",
    ("tet", "MinAngle"): "mixes dihedral angles and their supplements: see the known differences",
    ("tet", "RelativeSizeSquared"): SIZE,
    ("tet", "ShapeAndSize"): SIZE,
    ("wedge", "MaxStretch"): "the best face's: see the known differences",
    ("hex", "RelativeSizeSquared"): SIZE,
    ("hex", "ShapeAndSize"): SIZE,
    ("hex", "ShearAndSize"): SIZE,
}
ON_PART_OF_THE_CELLS = {("quad", "Distortion"), ("hex", "EdgeRatio"), ("tet", "CollapseRatio"), ("pyramid", "Shape")}


def test_every_measure_of_vtk_is_compared_or_has_a_reason_not_to_be():
    offered = {
        (type_name, word.split("To", 1)[1])
        for type_name, name in NAMES.items()
        for word in dir(vtk.vtkMeshQuality)
        if word.startswith(f"Set{name}QualityMeasureTo")
    }
    compared = {(type_name, name) for type_name, _, name, _ in SAME} | ON_PART_OF_THE_CELLS
    assert compared <= offered
    assert not compared & WITHOUT_A_ROW.keys()
    assert offered - compared - WITHOUT_A_ROW.keys() == set()


def test_every_metric_of_verdict_is_compared_on_every_type():
    compared = {(type_name, metric) for type_name, metric, _, _ in SAME}
    compared |= {("quad", "verdict.distortion"), ("tet", "verdict.collapse_ratio"), ("pyramid", "verdict.shape")}
    rows = {(t, row.id) for row in METRICS.values() if row.id.startswith("verdict.") for t in row.on}
    assert rows - compared == set()
