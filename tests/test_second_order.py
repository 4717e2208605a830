"""Shape functions of second-order cells, and the metrics that look at their mid nodes."""

import itertools
import json
import math
import runpy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.metrics import METRICS
from meshwright.audit.shape_functions import (
    DOMAINS,
    gradient_table,
    nodal_points,
    position,
    tangents,
    values_at,
)

helpers = runpy.run_path(str(Path(__file__).with_name("curved_cells.py")))
TYPES, SURFACES, SOLIDS = helpers["TYPES"], helpers["SURFACES"], helpers["SOLIDS"]
straight, shaken, mesh_of, with_mid_node, between = (
    helpers[name] for name in ("straight", "shaken", "mesh_of", "with_mid_node", "between")
)

IDS = tuple(row.id for row in METRICS.values() if set(row.on) & set(TYPES))
RATIOS = ("jacobian_ratio_min_over_max_nodes", "jacobian_ratio_with_centres")


def values(name, cells, dimension=None):
    mesh = mesh_of(name, cells, dimension)
    return {id_: by_type[name] for id_, by_type in measure(mesh, IDS, threads=1).values.items() if name in by_type}


def value(name, points, id_):
    return float(values(name, [points])[id_][0])


def somewhere(name, seed, n=20):
    """Random points of the domain, rational."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        weights = [rng.integers(1, 64, d + 1).tolist() for d in DOMAINS[name]]
        yield tuple(tuple(Fraction(w, sum(part)) for w in part) for part in weights)


def local(name, point):
    """The local coordinates of a point of the domain."""
    if name == "pyramid13":  # collapsed towards the apex, which stands over the middle of the base
        u, v, w = (part[1] for part in point)
        half = Fraction(1, 2)
        return (half + (u - half) * (1 - w), half + (v - half) * (1 - w), w)
    flat = tuple(x for part in point for x in part[1:])
    return flat + (Fraction(0),) * (3 - len(flat))


# --- shape functions


@pytest.mark.parametrize("name", TYPES)
def test_a_shape_function_is_one_at_its_own_node_and_zero_at_all_others(name):
    found = [values_at(name, point) for point in nodal_points(name)]
    if name == "pyramid13":
        assert all(found[k] == found[4] for k in (5, 6, 7))  # the apex, from each of its edges
        found = found[:5] + found[8:]
    assert found == np.eye(CELL_TYPES[name].n_nodes, dtype=int).tolist()


@pytest.mark.parametrize("name", TYPES)
def test_shape_functions_add_up_to_one_everywhere(name):
    assert all(sum(values_at(name, point)) == 1 for point in somewhere(name, 1))


@pytest.mark.parametrize("name", TYPES)
def test_every_quadratic_polynomial_is_met_exactly(name):
    nodes = [local(name, point) for point in nodal_points(name)]
    if name == "pyramid13":
        nodes = nodes[:5] + nodes[8:]
    powers = [p for p in itertools.product(range(3), repeat=3) if sum(p) <= 2]
    for point in somewhere(name, 2):
        weights = values_at(name, point)
        for p in powers:
            at_nodes = [math.prod(x**e for x, e in zip(node, p, strict=True)) for node in nodes]
            wanted = math.prod(x**e for x, e in zip(local(name, point), p, strict=True))
            assert sum(w * x for w, x in zip(weights, at_nodes, strict=True)) == wanted


@pytest.mark.parametrize("name", TYPES)
def test_gradients_add_up_to_zero_and_turn_local_coordinates_into_unit_vectors(name):
    nodes = np.array([[float(x) for x in local(name, point)] for point in nodal_points(name)])
    if name == "pyramid13":
        nodes = np.delete(nodes, (5, 6, 7), axis=0)
    table = gradient_table(name)
    np.testing.assert_allclose(table.sum(axis=1), 0.0, atol=1e-14)
    unit = np.eye(3) * (1.0, 1.0, 0.0 if name in SURFACES else 1.0)
    np.testing.assert_allclose(
        np.einsum("pnk,nd->pdk", table, nodes), np.broadcast_to(unit, (len(table), 3, 3)), atol=1e-14
    )


@pytest.mark.parametrize("name", TYPES)
def test_tangents_are_the_slopes_of_the_position(name):
    """Central differences of a polynomial of degree 2 along a line are exact."""
    step, domain = Fraction(1, 128), DOMAINS[name]
    axes = [(f, v) for f, d in enumerate(domain) for v in range(1, d + 1)]
    for point in somewhere(name, 3, n=5):
        for (f, v), field in zip(axes, tangents(name), strict=True):
            ends = []
            for side in (step, -step):
                part = [x + side * ((i == v) - (i == 0)) for i, x in enumerate(point[f])]
                ends.append(position(name).at((*point[:f], tuple(part), *point[f + 1 :])))
            slope = [(a - b) / (2 * step) for a, b in zip(*ends, strict=True)]
            shrunk = 1 - point[2][1] if name == "pyramid13" and f < 2 else 1  # across a pyramid, by the height
            assert [shrunk * x for x in field.at(point)] == slope


def test_a_linear_type_has_no_gradient_table():
    assert all(gradient_table(name).shape == (0, 0, 3) for name in ("tri", "quad", "tet", "pyramid", "wedge", "hex"))


def test_the_points_of_the_table_are_nodes_and_centres():
    counts = {name: len(gradient_table(name)) for name in TYPES}
    assert counts == {
        "tri6": 7, "quad8": 9, "quad9": 9, "tet10": 15, "pyramid13": 22, "wedge15": 21, "hex20": 27, "hex27": 27
    }  # fmt: skip


VTK_CELLS = {
    "tri6": "QuadraticTriangle", "quad8": "QuadraticQuad", "quad9": "BiQuadraticQuad", "tet10": "QuadraticTetra",
    "wedge15": "QuadraticWedge", "hex20": "QuadraticHexahedron", "hex27": "TriQuadraticHexahedron",
}  # fmt: skip


@pytest.mark.parametrize("name", VTK_CELLS)
def test_vtk_has_the_same_shape_functions_and_node_order(name):
    vtk = pytest.importorskip("vtk", reason="VTK is not installed: pip install 'meshwright[oracles]'")
    cell, n, d = getattr(vtk, f"vtk{VTK_CELLS[name]}")(), CELL_TYPES[name].n_nodes, CELL_TYPES[name].dimension
    for point in somewhere(name, 4):
        weights, slopes = [0.0] * n, [0.0] * (n * d)
        place = [float(x) for x in local(name, point)]
        cell.InterpolateFunctions(place, weights)
        cell.InterpolateDerivs(place, slopes)
        np.testing.assert_allclose(weights, [float(x) for x in values_at(name, point)], atol=1e-14)
        ours = [[float(x) for x in field.at(point)] for field in tangents(name)]
        np.testing.assert_allclose(np.reshape(slopes, (d, n)), ours, atol=1e-14)


def test_vtk_has_another_pyramid_inside_and_the_same_one_at_its_surface():
    """vtkQuadraticPyramid is a hexahedron of 20 nodes with its roof closed; only its faces are Bedrosian's."""
    vtk = pytest.importorskip("vtk", reason="VTK is not installed: pip install 'meshwright[oracles]'")
    cell, half, third = vtk.vtkQuadraticPyramid(), Fraction(1, 2), Fraction(1, 3)
    for u, v, w, same in (
        (half, third, 0, True),
        (0, third, half, True),
        (third, 1, third, True),
        (half, half, third, False),
    ):
        weights = [0.0] * 13
        cell.InterpolateFunctions([float(u), float(v), float(w)], weights)
        ours = [float(x) for x in values_at("pyramid13", ((1 - u, u), (1 - v, v), (1 - w, w)))]
        assert np.allclose(weights, ours, atol=1e-14) is same


def test_gmsh_has_the_same_pyramid_throughout():
    gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed: pip install 'meshwright[oracles]'")
    edges = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 4), (2, 3), (2, 4), (3, 4)]  # Gmsh's order
    ours = [0, 1, 2, 3, 4] + [5 + CELL_TYPES["pyramid13"].edges.index(e if e != (0, 3) else (3, 0)) for e in edges]
    gmsh.initialize(interruptible=False)
    try:
        for point in somewhere("pyramid13", 5):
            r, s, t = (float(x) for x in local("pyramid13", point))
            place = [2 * r - 1, 2 * s - 1, t]  # from -1 to 1 across the base
            found = gmsh.model.mesh.getBasisFunctions(19, place, "Lagrange")[1]
            np.testing.assert_allclose(found, [float(values_at("pyramid13", point)[k]) for k in ours], atol=1e-14)
    finally:
        gmsh.finalize()


# --- metrics


def test_every_golden_value_is_met_to_nine_digits(shared):
    golden = json.loads((shared / "reference" / "golden.json").read_text())["second_order"]
    wrong, checked = [], 0
    for cell in golden:
        got = values(cell["type"], [cell["points"]])
        for id_, text in cell["values"].items():
            checked += 1
            if not math.isclose(got[id_][0], float(text), rel_tol=1e-9, abs_tol=1e-12):
                wrong.append((cell["name"], id_, got[id_][0], text))
    assert checked == 5 * len(golden) > 50
    assert wrong == []


@pytest.mark.parametrize("name", TYPES)
def test_a_straight_cell_is_perfect(name):
    got = values(name, [straight(name)])
    assert got["icem.mid_node_angle"] == got["femgv.midnode_offset"] == got["chordal_ratio_max"] == 0.0
    for id_ in ("ansys.jacobian_ratio_nodes", *RATIOS):
        assert got[id_] == pytest.approx(1.0, rel=1e-14)
    size = "jacobian.min_nodes" if name in SOLIDS else "jacobian.min_nodes_surface"
    assert got[size] == pytest.approx(1.0, rel=1e-14)  # 6 V of the corner of a cube, V of the cube, and so on
    assert ("jacobian.min_nodes" in got) is (name in SOLIDS)


@pytest.mark.parametrize("name", TYPES)
def test_a_mid_node_a_tenth_aside_bends_its_edge_by_the_arctangent_of_a_fifth(name):
    points = with_mid_node(name, 0, 0.5, aside=(0.0, -0.1, 0.0))
    assert value(name, points, "icem.mid_node_angle") == pytest.approx(math.degrees(math.atan(0.2)), rel=1e-14)
    assert value(name, points, "chordal_ratio_max") == pytest.approx(0.1, rel=1e-14)
    assert value(name, points, "femgv.midnode_offset") == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("name", TYPES)
@pytest.mark.parametrize("edge", [0, 1, 2])
def test_a_mid_node_at_a_quarter_makes_the_jacobian_vanish_at_the_near_end(name, edge):
    points = with_mid_node(name, edge, 0.25)
    got = values(name, [points])
    assert got["femgv.midnode_offset"] == pytest.approx(0.25, rel=1e-14)
    assert got["icem.mid_node_angle"] == pytest.approx(0.0, abs=1e-12)
    assert got["ansys.jacobian_ratio_nodes"] == math.inf
    assert got["jacobian_ratio_min_over_max_nodes"] == pytest.approx(0.0, abs=1e-15)
    beyond = values(name, [with_mid_node(name, edge, 0.2)])
    assert beyond["ansys.jacobian_ratio_nodes"] == math.inf
    assert beyond["jacobian_ratio_min_over_max_nodes"] < -0.01


def test_the_jacobian_of_an_edge_with_its_mid_node_at_t_runs_from_4t_minus_1_to_3_minus_4t():
    """x(r) = r (1 + (4 t - 2) (1 - r)), so that dx/dr is 4 t - 1 at 0 and 3 - 4 t at 1; nothing else depends on r."""
    for t in (0.3, 0.4, 0.45):
        hexahedron = straight("hex20")
        for edge in (0, 2, 4, 6):  # the four edges along x
            a, b = CELL_TYPES["hex20"].edges[edge]
            sense = t if hexahedron[a, 0] == 0 else 1 - t
            hexahedron[8 + edge] = hexahedron[a] + sense * (hexahedron[b] - hexahedron[a])
        got = values("hex20", [hexahedron])
        assert got["jacobian.min_nodes"] == pytest.approx(4 * t - 1, rel=1e-13)
        assert got["ansys.jacobian_ratio_nodes"] == pytest.approx((3 - 4 * t) / (4 * t - 1), rel=1e-13)
        assert got["jacobian_ratio_min_over_max_nodes"] == pytest.approx((4 * t - 1) / (3 - 4 * t), rel=1e-13)


def test_centres_find_a_jacobian_that_the_nodes_miss():
    """A hexahedron of 27 nodes has nodes at all centres; of the one with 20, the middle of a face can be the worst."""
    cells = shaken("hex20", 0.12, 2000, seed=4)
    got = values("hex20", cells)
    nodes, both = got["jacobian_ratio_min_over_max_nodes"], got["jacobian_ratio_with_centres"]
    assert np.all(both[nodes > 0] <= nodes[nodes > 0])  # of a folded cell the centres may raise the largest only
    assert np.count_nonzero(both < nodes) > 20
    other = values("hex27", shaken("hex27", 0.1, 50, seed=4))
    np.testing.assert_array_equal(other["jacobian_ratio_min_over_max_nodes"], other["jacobian_ratio_with_centres"])


@pytest.mark.parametrize("name", SOLIDS)
def test_a_mirrored_solid_scores_minus_one_and_has_no_ratio_of_largest_to_smallest(name):
    got = values(name, [straight(name) * (1, 1, -1)])
    assert got["jacobian_ratio_min_over_max_nodes"] == pytest.approx(-1.0, rel=1e-14)
    assert got["jacobian_ratio_with_centres"] == pytest.approx(-1.0, rel=1e-14)
    assert got["ansys.jacobian_ratio_nodes"] == math.inf
    assert got["jacobian.min_nodes"] == pytest.approx(-1.0, rel=1e-14)


@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_has_no_side_of_its_own(name):
    cells = shaken(name, 0.04, 20)
    here, there = values(name, cells), values(name, cells * (1, -1, 1))
    for id_ in RATIOS:
        np.testing.assert_allclose(there[id_], here[id_], rtol=1e-12)


@pytest.mark.parametrize("name", ["quad8", "quad9"])
def test_the_jacobian_of_a_roof_is_that_of_its_own_surface_and_not_of_its_shadow(name):
    """A quarter of a cylinder of radius 1 about the y axis: slopes of a parabola through its ends and its middle."""
    c, s = math.cos(math.pi / 4), math.sin(math.pi / 4)
    points = straight(name)
    points[:, 2] = np.where(points[:, 0] == 0.5, 1.0, c)
    points[:, 0] = np.array([-s, 0.0, s])[np.rint(2 * points[:, 0]).astype(int)]
    # x = s (2 r - 1), z = c + 4 (1 - c) r (1 - r): at the ends dz/dr = 4 (1 - c), in the middle 0
    ends, middle = math.hypot(2 * s, 4 * (1 - c)), 2 * s
    got = values(name, [points])
    assert got["jacobian_ratio_min_over_max_nodes"] == pytest.approx(middle / ends, rel=1e-13)
    assert got["jacobian.min_nodes_surface"] == pytest.approx(middle, rel=1e-13)


@pytest.mark.parametrize("name", TYPES)
def test_a_cell_without_extent_has_the_degenerate_values_of_the_registry(name):
    got = values(name, [np.full_like(straight(name), 2.5)])
    for id_, found in got.items():
        assert found[0] == pytest.approx(METRICS[id_].degenerate, nan_ok=True), id_


@pytest.mark.parametrize("name", TYPES)
def test_an_edge_closed_to_a_point_does_not_count_and_leaves_the_others_their_values(name):
    points = with_mid_node(name, 1, 0.5, aside=(0.05, 0.05, 0.0))
    a, b = CELL_TYPES[name].edges[0]
    points[CELL_TYPES[name].mid_edges[0]] = points[b] = points[a]
    got = values(name, [points])
    assert np.isfinite(got["icem.mid_node_angle"])
    assert np.isfinite(got["femgv.midnode_offset"])
    assert np.isfinite(got["chordal_ratio_max"])
    points[CELL_TYPES[name].mid_edges[0]] += (0.0, -0.1, 0.0)  # a loop out of nowhere
    assert value(name, points, "chordal_ratio_max") == math.inf


@pytest.mark.parametrize("name", TYPES)
def test_a_mid_node_that_is_not_finite_takes_every_number_away(name):
    points = straight(name)
    points[-1, 0] = math.nan
    mesh = mesh_of(name, [points], dimension=3)
    for id_ in IDS:
        by_type = measure(mesh, [id_], threads=1).values[id_]
        assert all(np.isnan(found).all() for found in by_type.values())


@pytest.mark.parametrize("name", TYPES)
def test_rotation_translation_and_scale_change_nothing_but_sizes(name):
    cells = shaken(name, 0.1, 50, seed=6)
    want = values(name, cells)
    turn = Rotation.random(rng=np.random.default_rng(6)).as_matrix()
    for factor in (1.0, 1e-3, 2.0**200, 2.0**-200):
        got = values(name, factor * (cells @ turn.T), dimension=3)
        for id_, wanted in want.items():
            size = factor ** {"L3": 3, "L2": 2}.get(METRICS[id_].unit, 0)
            np.testing.assert_allclose(got[id_] / size, wanted, rtol=1e-9, atol=1e-9, err_msg=id_)
    grid = np.round(cells * 2**30) / 2**30
    here, there = values(name, grid), values(name, grid + (1000.0, -77.0, 0.0))
    for id_, wanted in here.items():
        assert there[id_].tobytes() == wanted.tobytes(), id_


def rotations(name):
    """Renumberings of all nodes that turn the cell as a whole."""
    cell, sets = CELL_TYPES[name], [frozenset(group) for group in between(name)]
    n = cell.n_corners
    if name in SURFACES:
        orders = [tuple((k + s) % n for k in range(n)) for s in range(n)]
    else:
        faces = {canonical(face) for face in cell.faces}
        orders = [
            p for p in itertools.permutations(range(n)) if {canonical([p[i] for i in f]) for f in cell.faces} == faces
        ]
    return [[sets.index(frozenset(order[c] for c in group)) for group in sets] for order in orders]


def canonical(face):
    start = list(face).index(min(face))
    return tuple(face[start:]) + tuple(face[:start])


@pytest.mark.parametrize("name", TYPES)
def test_the_way_a_cell_is_numbered_does_not_matter(name):
    cells = shaken(name, 0.1, 20, seed=7)
    want = values(name, cells)
    orders = rotations(name)
    assert (
        len(orders) == {"tri": 3, "quad": 4, "tet": 12, "pyramid": 4, "wedge": 6, "hex": 24}[CELL_TYPES[name].corners]
    )
    for order in orders:
        got = values(name, cells[:, order])
        for id_, wanted in want.items():
            np.testing.assert_allclose(got[id_], wanted, rtol=1e-9, atol=1e-9, err_msg=id_)


@pytest.mark.parametrize("name", TYPES)
def test_random_nodes_never_give_nan(name):
    cells = np.random.default_rng(8).uniform(-1, 1, (5000, *straight(name).shape))
    for id_, found in values(name, cells, dimension=3).items():
        assert not np.isnan(found).any(), id_


def test_metrics_of_linear_cells_look_at_corners_only():
    bent, plain = with_mid_node("hex20", 0, 0.4, aside=(0.0, 0.2, 0.1)), straight("hex20")
    for points in (bent, plain):
        values_ = measure(mesh_of("hex20", [points]), ["gambit.equiangle_skew", "volume", "icem.determinant"]).values
        assert [float(by_type["hex20"][0]) for by_type in values_.values()] == [0.0, 1.0, 1.0]
