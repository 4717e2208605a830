"""Delaunay violations: triangles, shells and tetrahedra against closed forms, exact rationals and scipy."""

import json
import math
import runpy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.connectivity import faces
from meshwright.audit.findings import Options, run_checks
from meshwright.audit.findings.delaunay import violating_faces
from meshwright.audit.findings.facts import Facts
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.predicates import in_circle, in_sphere

spatial = pytest.importorskip("scipy.spatial")
blocks = runpy.run_path(str(Path(__file__).parent.parent / "benchmarks" / "meshes.py"))

KITE = [(0, 0, 0), (4, 0, 0), (2, 1, 0), (2, -1, 0)]
LONG, SHORT = [(0, 1, 2), (1, 0, 3)], [(0, 3, 2), (1, 2, 3)]


def cells(kind, points, nodes, dimension=3, **more):
    nodes = np.array(nodes)
    return Mesh(np.array(points, float), (CellBlock(kind, np.arange(len(nodes)), nodes),), dimension=dimension, **more)


def found(mesh, **options):
    here = [f for f in run_checks(mesh, options=Options(**options)) if f.code == "delaunay-violations"]
    return here[0] if here else None


@pytest.mark.parametrize("dimension", [2, 3])
def test_two_triangles_on_the_long_diagonal_of_a_kite_violate_and_on_the_short_one_do_not(dimension):
    # alpha = beta = 180 - 2 atan(1/2)
    finding = found(cells("tri", KITE, LONG, dimension))
    assert (finding.severity, finding.rows.tolist(), finding.detail["faces"]) == ("info", [0, 1], 1)
    assert finding.detail["max_angle_sum_excess"] == pytest.approx(180 - 4 * math.degrees(math.atan(0.5)), rel=1e-12)
    assert found(cells("tri", KITE, SHORT, dimension)) is None


def test_the_reference_value_of_the_kite_is_met(shared):
    golden = json.loads((shared / "reference" / "golden.json").read_text())["meshes"]
    case = next(entry for entry in golden if entry["name"] == "delaunay_two_tris")
    a, b, c, d = case["points"]
    assert float(in_circle(a, b, c, d)) == pytest.approx(case["expected"]["incircle_d_in_abc"], rel=1e-9)
    finding = found(cells("tri", [(*p, 0) for p in case["points"]], case["tris"], 2))
    total = 180 + finding.detail["max_angle_sum_excess"]
    assert total == pytest.approx(case["expected"]["opposite_angle_sum_deg"], rel=1e-9)
    assert found(cells("tri", [(*p, 0) for p in case["points"]], case["expected"]["after_swap_tris"], 2)) is None


def test_five_points_split_into_two_tetrahedra_or_three():
    # a unit triangle in the plane and an apex at +-h: the sphere through the upper tetrahedron holds the lower apex
    # when h is less than the radius of the triangle's own circle, 1; then three tetrahedra around the axis are Delaunay
    ring = [(math.cos(t), math.sin(t), 0.0) for t in (0.0, 2 * math.pi / 3, 4 * math.pi / 3)]
    for h in (0.6, 1.5):
        two = cells("tet", [*ring, (0, 0, h), (0, 0, -h)], [(0, 1, 2, 3), (0, 2, 1, 4)])
        three = cells("tet", [*ring, (0, 0, h), (0, 0, -h)], [(0, 1, 4, 3), (1, 2, 4, 3), (2, 0, 4, 3)])
        assert (found(two) is not None) == (h < 1)
        assert (found(three) is not None) == (h > 1)
    # h = 0.6: centre at z = (h^2 - 1) / 2h, radius (1 + h^2) / 2h, the other apex h - radius ... from the centre
    centre, radius = (0.36 - 1) / 1.2, 1.36 / 1.2
    deep = 1 - abs(-0.6 - centre) / radius
    assert found(cells("tet", [*ring, (0, 0, 0.6), (0, 0, -0.6)], [(0, 1, 2, 3), (0, 2, 1, 4)])).detail[
        "max_relative_depth"
    ] == pytest.approx(deep, rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["tri", "shell", "tet"])
def test_the_delaunay_mesh_of_a_random_cloud_has_none_however_it_is_stretched_along_with_its_sites(seed, kind):
    rng = np.random.default_rng(seed)
    points = rng.random((2000, 3))
    if kind != "tet":
        points[:, 2] = 0.0
    nodes = spatial.Delaunay(points[:, : 3 if kind == "tet" else 2]).simplices
    for scale, offset in ((1.0, 0.0), (1e-30, 0.0), (1e100, 0.0), (1e-170, 0.0)):
        mesh = cells("tet" if kind == "tet" else "tri", points * scale + offset, nodes, 2 if kind == "tri" else 3)
        assert found(mesh) is None


@pytest.mark.parametrize("n", [(3, 3, 3), (7, 5, 6)])
@pytest.mark.parametrize("place", [0.0, 1e3])
def test_a_lattice_has_none_whose_points_are_cospherical_up_to_rounding(n, place):
    points, hexes = blocks["hex_block"](n, jitter=0.0)
    tets = blocks["split_to_tets"](hexes)
    mesh = cells("tet", points * 0.7 + place, tets)
    assert found(mesh) is None
    assert violating_faces(Facts(mesh)).cocircular > 0


def side(ring, p):
    """Exact sign of the side of a face on which a point lies."""
    rows = [[Fraction(x) - Fraction(y) for x, y in zip(q, ring[0], strict=True)] for q in (*ring[1:], p)]
    if len(ring) == 2:
        return np.sign(rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0])
    a, b, c = rows
    cross = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return np.sign(sum(x * y for x, y in zip(cross, c, strict=True)))


def by_rationals(mesh):
    """Faces with a cell on either side whose exact determinant is positive."""
    table, out = faces(mesh), []
    nodes, test = mesh.blocks[0].nodes, in_sphere if mesh.cell_dimension == 3 else in_circle
    for f in np.flatnonzero(table.neighbour >= 0):
        ring = table.nodes[table.offsets[f] : table.offsets[f + 1]].tolist()
        near, far = (next(p for p in nodes[c] if p not in ring) for c in (table.owner[f], table.neighbour[f]))
        corners = [mesh.points[p].tolist() for p in (*ring, near, far)]
        if side(corners[:-2], corners[-2]) * side(corners[:-2], corners[-1]) < 0 and test(*corners) > 0:
            out.append(int(f))
    return out


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), dimension=st.sampled_from([2, 3]))
def test_what_is_reported_is_what_rational_arithmetic_finds(seed, dimension):
    rng = np.random.default_rng(seed)
    points = np.zeros((60, 3))
    points[:, :dimension] = rng.random((60, dimension))
    nodes = spatial.Delaunay(points[:, :dimension]).simplices
    points[:, :dimension] += rng.normal(0, 0.02, (60, dimension))  # moved after it was built, some cells inside out
    mesh = cells("tet" if dimension == 3 else "tri", points, nodes, dimension)
    assert violating_faces(Facts(mesh)).faces.tolist() == by_rationals(mesh) != []


@pytest.mark.parametrize("inside", [True, False])
def test_a_corner_a_few_roundings_inside_the_circle_is_told_from_one_that_is_clearly_inside(inside):
    step = 1e-12 if inside else 2e-16
    mesh = cells("tri", [(0, 0, 0), (1, 0, 0), (1 - step, 1 - step, 0), (0, 1, 0)], [(0, 1, 3), (1, 2, 3)], 2)
    assert in_circle(*(mesh.points[p].tolist() for p in (0, 1, 3, 2))) > 0
    assert (found(mesh) is not None) == inside
    assert violating_faces(Facts(mesh)).cocircular == (not inside)


def test_the_predicates_do_not_depend_on_the_order_of_the_points_and_know_zero():
    a, b, c = (0.1, 0.2, 0.3), (1.7, 0.1, 0.2), (0.3, 1.9, 0.1)
    d, e = (0.2, 0.3, 1.3), (0.4, 0.5, 0.6)
    assert in_sphere(a, b, c, d, e) == in_sphere(b, a, c, d, e) == in_sphere(d, c, b, a, e) > 0
    assert in_circle(a, b, c, e) == in_circle(c, b, a, e) > 0
    assert in_circle((0, 0), (1, 0), (0, 1), (1, 1)) == 0
    step = math.ulp(1.0)
    assert in_circle((0, 0), (1, 0), (0, 1), (1, 1 + step)) < 0 < in_circle((0, 0), (1, 0), (0, 1), (1, 1 - step / 2))
    assert isinstance(in_sphere(a, b, c, d, e), Fraction)


def test_an_edge_between_zones_a_listed_edge_and_a_fold_are_constraints_and_no_violations():
    zones = (Zone("water", "zone", "fluid", "cell", [0]), Zone("steel", "zone", "solid", "cell", [1]))
    assert found(cells("tri", KITE, LONG, 2, zones=zones)) is None
    line = (CellBlock("line", [0], [[0, 1]]),)
    assert found(cells("tri", KITE, LONG, 2, boundary=line)) is None
    other = (CellBlock("line", [0], [[0, 2]]),)
    assert found(cells("tri", KITE, LONG, 2, boundary=other)) is not None
    # a fold of 2 atan(z) about the long diagonal
    lift = math.tan(math.radians(6))
    folded = cells("tri", [(0, 0, 0), (4, 0, 0), (2, 1, lift), (2, -1, lift)], LONG)
    assert found(folded, feature_angle=10.0) is None
    assert found(folded, feature_angle=15.0) is not None
    turned = cells("tri", folded.points, [LONG[0], LONG[1][::-1]])
    assert found(turned, feature_angle=10.0) is None
    assert found(turned, feature_angle=15.0) is not None


def test_flat_doubled_reversed_and_undefined_cells_are_left_to_other_checks():
    points = np.array([*KITE, (0, 0, 0), (8, 0, 0)], float)
    assert found(cells("tri", points, [*LONG, LONG[0], (0, 1, 5)], 2)).rows.tolist() == [0, 1]
    points[3] = np.nan
    assert found(cells("tri", np.where(np.isnan(points), 0, points), LONG, 2)) is None
    gone = points.copy()
    gone[3, :2] = np.nan
    gone[3, 2] = 0.0
    assert found(cells("tri", gone, LONG, 2)) is None
    flat = np.zeros((5, 3))
    flat[:, :2] = np.random.default_rng(1).random((5, 2))
    assert found(cells("tet", flat, [(0, 1, 2, 3), (0, 2, 1, 4)])) is None
