"""Gmsh's element qualities on hundreds of cells of each type, wherever its number is one of ours.

The meshes are made through Gmsh's programming interface; no file is opened.
"""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

_filter = runpy.run_path(str(Path(__file__).parent / "verdict_filter.py"))
families, ours = _filter["families"], _filter["ours"]

NUMBERS = {"tri": 2, "quad": 3, "tet": 4, "hex": 5, "wedge": 6, "pyramid": 7}
"""Gmsh's element types. Linear cells have VTK's node order."""

# The Frobenius condition number and the Jacobian's normalisations are Verdict's.
SAME = [
    ("tri", "gambit.aspect_ratio", "gamma", lambda v: 1 / v),
    ("tri", "verdict.normalized_inradius", "gamma", lambda v: v),
    ("tri", "verdict.shape", "minSICN", lambda v: v),
    ("tri", "verdict.condition", "minSICN", lambda v: 1 / v),
    ("tri", "area", "volume", lambda v: v),
    ("quad", "icem.equiangle_skewness", "gamma", lambda v: v),
    ("quad", "verdict.max_aspect_frobenius", "minSICN", lambda v: 1 / v),
    ("quad", "verdict.scaled_jacobian", "minSIGE", lambda v: v),
    ("quad", "verdict.distortion", "minSJ", lambda v: v),
    ("quad", "verdict.condition", "minIsotropy", lambda v: 1 / v),
    ("quad", "area", "volume", lambda v: v),
    ("tet", "gambit.aspect_ratio", "gamma", lambda v: 1 / v),
    ("tet", "verdict.condition", "minSICN", lambda v: 1 / v),
    ("tet", "verdict.shape", "minIsotropy", lambda v: v),
    ("tet", "verdict.aspect_frobenius", "minIsotropy", lambda v: 1 / v),
    ("tet", "jacobian.min_corner", "minDetJac", lambda v: v),
    ("tet", "volume", "volume", lambda v: v),
    ("pyramid", "jacobian.min_corner", "minDetJac", lambda v: v / 4),
    ("pyramid", "volume", "volume", lambda v: v),
    ("wedge", "verdict.scaled_jacobian", "gamma", lambda v: v),
    ("wedge", "volume", "volume", lambda v: v),
    ("hex", "verdict.condition", "minSICN", lambda v: 1 / v),
    ("hex", "verdict.shear", "minSIGE", lambda v: v),
    ("hex", "volume", "volume", lambda v: v),
]
SAME += [(t, f"edge.{end}", f"{end}Edge", lambda v: v) for t in NUMBERS for end in ("min", "max")]


@pytest.fixture(scope="module")
def quality():
    """Function (type, cells, name of a quality) -> (n,) Gmsh's numbers."""
    try:
        import gmsh
    except (ImportError, OSError) as problem:  # OSError: a system library that Gmsh needs is missing
        pytest.skip(f"Gmsh cannot be imported: {problem}")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)

    def of(type_name, cells, name):
        cells = np.asarray(cells, dtype=float).reshape(-1, len(_filter["IDEAL"][type_name]), 3)
        gmsh.clear()
        dimension = 2 if type_name in ("tri", "quad") else 3
        entity = gmsh.model.addDiscreteEntity(dimension)
        nodes = np.arange(1, cells.shape[0] * cells.shape[1] + 1)
        tags = np.arange(1, len(cells) + 1)
        gmsh.model.mesh.addNodes(dimension, entity, nodes, cells.ravel())
        gmsh.model.mesh.addElements(dimension, entity, [NUMBERS[type_name]], [tags], [nodes])
        return np.array(gmsh.model.mesh.getElementQualities(tags, name))

    yield of
    gmsh.finalize()


@pytest.mark.parametrize(
    ("type_name", "metric", "name", "convert"), SAME, ids=lambda v: v if isinstance(v, str) else ""
)
def test_gmsh_gives_the_same_number(quality, type_name, metric, name, convert):
    for cells in families(type_name).values():
        assert len(cells) >= 400
        mine = convert(ours(type_name, cells, metric))
        np.testing.assert_allclose(quality(type_name, cells, name), mine, rtol=1e-9, atol=1e-12)


def test_gmsh_counts_a_quadrilateral_by_its_corners_own_normals_where_shape_takes_the_mean_normal(quality):
    """Saddle of height 1/4: normals (1/2, 1/2, 1) are sqrt(1.5) long, 1 along the mean normal; edges sqrt(1.25)."""
    saddle = [(0, 0, 0.25), (1, 0, -0.25), (1, 1, 0.25), (0, 1, -0.25)]
    assert quality("quad", saddle, "minSICN")[0] == pytest.approx(2 * math.sqrt(1.5) / 2.5, rel=1e-12)
    assert ours("quad", saddle, "verdict.shape")[0] == pytest.approx(2 / 2.5, rel=1e-12)


def test_gmsh_gives_a_mirrored_tet_a_negative_condition_where_ours_is_infinite(quality):
    """Corner of a cube: squared edges sum to 9, squared areas to 3/2, 18 V = -3."""
    mirrored = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1)]
    assert quality("tet", mirrored, "minSICN")[0] == pytest.approx(-3 / math.sqrt(9 * 1.5), rel=1e-12)
    assert ours("tet", mirrored, "verdict.condition")[0] == math.inf
