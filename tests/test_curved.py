"""Curved cells proven valid or invalid: against dense sampling, exact arithmetic, closed forms and Gmsh."""

import itertools
import math
import runpy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshwright.audit.bernstein import basis, corners, indices, product_terms, split_matrices
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.findings import run_checks
from meshwright.audit.findings.bezier.exact import exact_sign
from meshwright.audit.findings.bezier.proof import FLAT, SOLID, determinants, gather, new_scratch
from meshwright.audit.findings.bezier.tables import bends, formula
from meshwright.audit.findings.curved import INVALID, UNDECIDED, UNJUDGED, VALID, curved_cells
from meshwright.audit.jit import kernel
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.readers import read
from meshwright.audit.shape_functions import DOMAINS, tangents

helpers = runpy.run_path(str(Path(__file__).with_name("curved_cells.py")))
TYPES, SURFACES, SOLIDS = helpers["TYPES"], helpers["SURFACES"], helpers["SOLIDS"]
straight, shaken, mesh_of, with_mid_node = (helpers[n] for n in ("straight", "shaken", "mesh_of", "with_mid_node"))


def states(name, cells, dimension=None):
    return curved_cells(mesh_of(name, cells, dimension)).state


def sampled(name, cells, steps=8):
    """(cells, points) determinants on a lattice of the domain, corners and edges included, by plain interpolation."""
    domain = DOMAINS[name]
    lattices = [
        [
            tuple(Fraction(i, steps) for i in p)
            for p in itertools.product(range(steps + 1), repeat=d + 1)
            if sum(p) == steps
        ]
        for d in domain
    ]
    points = list(itertools.product(*lattices))
    slopes = []
    for field in tangents(name):
        weights = np.array([[float(b) for b in basis(domain, field.degree, p)] for p in points])
        slopes.append(np.einsum("pn,cnd->cpd", weights @ field.rows, cells))
    normal = np.cross(slopes[0], slopes[1])
    return np.einsum("cpd,cpd->cp", normal, slopes[2]) if name in SOLIDS else normal[..., 2]


# --- the algebra


@pytest.mark.parametrize("domain", [(1,), (2,), (3,), (2, 1), (1, 1, 1)])
def test_products_in_bernstein_form_are_products_of_polynomials(domain):
    first, second = (2,) * len(domain), tuple(range(1, len(domain) + 1))
    total = tuple(p + q for p, q in zip(first, second, strict=True))
    rng = np.random.default_rng(0)
    a = [Fraction(int(x)) for x in rng.integers(-9, 9, len(indices(domain, first)))]
    b = [Fraction(int(x)) for x in rng.integers(-9, 9, len(indices(domain, second)))]
    c = [Fraction(0)] * len(indices(domain, total))
    for row, i, j, weight in product_terms(domain, first, second):
        c[row] += weight * a[i] * b[j]
    for _ in range(5):
        weights = [rng.integers(0, 9, d + 1) + 1 for d in domain]
        point = tuple(tuple(Fraction(int(w), int(part.sum())) for w in part) for part in weights)
        value = [
            sum(x * w for x, w in zip(f, basis(domain, p, point), strict=True))
            for f, p in ((a, first), (b, second), (c, total))
        ]
        assert value[2] == value[0] * value[1]


@pytest.mark.parametrize(("dimension", "degree"), [(1, 5), (2, 2), (2, 4), (3, 3)])
def test_a_polynomial_on_a_part_of_a_simplex_is_the_same_polynomial(dimension, degree):
    rng = np.random.default_rng(1)
    whole = rng.integers(-9, 9, len(indices((dimension,), (degree,)))).astype(float)
    matrices, parts = split_matrices(dimension, degree)
    volume = 0.0
    for matrix, part in zip(matrices, parts, strict=True):
        assert np.all(matrix >= 0)
        np.testing.assert_array_equal(matrix.sum(axis=1), 1.0)
        volume += abs(np.linalg.det(np.array(part, float)))
        weights = rng.integers(1, 9, dimension + 1)
        inside = tuple(Fraction(int(w), int(weights.sum())) for w in weights)
        outside = tuple(
            sum((w * v[i] for w, v in zip(inside, part, strict=True)), Fraction(0)) for i in range(dimension + 1)
        )
        here = sum(c * float(b) for c, b in zip(matrix @ whole, basis((dimension,), (degree,), (inside,)), strict=True))
        there = sum(c * float(b) for c, b in zip(whole, basis((dimension,), (degree,), (outside,)), strict=True))
        assert here == pytest.approx(there, rel=1e-12)
    assert volume == pytest.approx(1.0)  # the parts fill the simplex


@pytest.mark.parametrize("name", TYPES)
def test_the_tables_hold_exact_numbers_and_weights_that_add_up_to_one(name):
    table = formula(name)
    for rows, weights in ((table.cross, table.cross_weight), (table.dot, table.dot_weight)):
        np.testing.assert_allclose(np.bincount(rows[:, 0], weights), 1.0, rtol=1e-15)
        assert weights.min() > 0
    assert np.all(table.derivative_weight * 32 == np.rint(table.derivative_weight * 32))
    assert len(table.corner) == len(corners(DOMAINS[name], (1,) * len(DOMAINS[name])))
    assert np.all(bends(name).reach[: CELL_TYPES[name].dimension] > 0)


@kernel
def one_cell(points, nodes, way, kind, out, rounding):
    """Coefficients of the first cell, and the bound of their rounding."""
    x, largest = np.zeros((nodes.shape[1], 3, 1)), np.empty((4, 3, 1))
    t, c, found = new_scratch(way, kind, 1)
    gather(points, nodes, 0, x, 0)
    determinants(x, way, kind, t, c, found, largest, rounding)
    out[:] = found[:, 0]


def exact_coefficients(name, points):
    """The same in rational arithmetic, of a solid."""
    x = [[Fraction(value) for value in row] for row in points.tolist()]
    fields, domain = tangents(name), DOMAINS[name]
    first, second, third = (
        [
            [sum((Fraction(w) * x[j][d] for j, w in enumerate(row) if w), Fraction(0)) for d in range(3)]
            for row in field.rows
        ]
        for field in fields
    )
    degree = tuple(p + q for p, q in zip(fields[0].degree, fields[1].degree, strict=True))
    normal = [[Fraction(0)] * 3 for _ in indices(domain, degree)]
    for row, i, j, weight in product_terms(domain, fields[0].degree, fields[1].degree):
        a, b = first[i], second[j]
        for d, (p, q) in enumerate(((1, 2), (2, 0), (0, 1))):
            normal[row][d] += weight * (a[p] * b[q] - a[q] * b[p])
    total = [Fraction(0)] * len(indices(domain, tuple(p + q for p, q in zip(degree, fields[2].degree, strict=True))))
    for row, i, j, weight in product_terms(domain, degree, fields[2].degree):
        total[row] += weight * sum(a * b for a, b in zip(normal[i], third[j], strict=True))
    return total


@pytest.mark.parametrize("name", ["tet10", "pyramid13", "wedge15", "hex20", "hex27"])
@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (1.0, 1e-3, 1e-7)])
@pytest.mark.parametrize("far", [0.0, 1e6])
def test_no_coefficient_is_off_by_more_than_its_stated_rounding(name, size, far):
    for points in shaken(name, 0.1, 3, seed=2) * size + far:
        found, rounding = np.empty(formula(name).size[1]), np.empty(1)
        one_cell(points, np.arange(len(points), dtype=np.int32)[None], formula(name), SOLID, found, rounding)
        exact = exact_coefficients(name, points)
        off = max(abs(Fraction(a) - b) for a, b in zip(found.tolist(), exact, strict=True))
        assert off <= Fraction(rounding[0])
        assert rounding[0] < 1e-11 * np.abs(found).max() if far == 0.0 else True  # and the bound is of use


# --- proofs


@pytest.mark.parametrize("name", TYPES)
@pytest.mark.parametrize("amplitude", [0.05, 0.1, 0.15, 0.2])
def test_no_cell_with_a_sampled_jacobian_of_0_or_less_is_called_valid(name, amplitude):
    cells = shaken(name, amplitude, 500, seed=int(100 * amplitude))
    state, lowest = states(name, cells), sampled(name, cells).min(axis=1)
    assert not np.any((state == VALID) & (lowest <= 0))
    assert np.all(state[(lowest <= 0) & (state != UNJUDGED)] == INVALID)
    assert np.count_nonzero(state == UNDECIDED) == 0
    if amplitude <= 0.05:
        assert np.all(state == VALID)


@pytest.mark.parametrize("name", TYPES)
def test_every_invalid_cell_comes_with_a_point_that_rational_arithmetic_confirms(name):
    from meshwright.audit.findings import curved

    cells = shaken(name, 0.15, 300, seed=3)
    mesh = mesh_of(name, cells)
    rows = np.flatnonzero(curved_cells(mesh).state == INVALID)[:20]
    assert len(rows) > 5
    found = curved._search(
        mesh, mesh.blocks[0], rows, np.ones(len(rows), np.int8), FLAT if name in SURFACES else SOLID, 4096
    )
    assert np.all(found.state == INVALID)
    for k, row in enumerate(rows):
        assert exact_sign(name, cells[row], found.point(name, k), FLAT if name in SURFACES else SOLID) <= 0


@pytest.mark.parametrize("name", TYPES)
def test_cells_that_are_positive_at_all_nodes_and_negative_between_them_are_found(name):
    cells = shaken(name, 0.2 if name in ("tri6", "quad8", "tet10") else 0.15, 3000, seed=9)
    mesh = mesh_of(name, cells)
    at_nodes = measure(mesh, ["jacobian_ratio_min_over_max_nodes"]).values["jacobian_ratio_min_over_max_nodes"][name]
    state, lowest = curved_cells(mesh).state, sampled(name, cells).min(axis=1)
    hidden = (at_nodes > 0) & (lowest < 0) & (state != UNJUDGED)
    assert np.count_nonzero(hidden) >= 3
    assert np.all(state[hidden] == INVALID)


@pytest.mark.parametrize("name", TYPES)
@pytest.mark.parametrize("turned", [False, True])
def test_the_verdict_turns_where_a_mid_node_crosses_the_quarter_of_its_edge(name, turned):
    """The Jacobian at the near end of the edge is 4 t - 1 times that of the straight cell."""
    turn = (
        Rotation.from_euler("z", 0.3).as_matrix()
        if name in SURFACES
        else Rotation.random(rng=np.random.default_rng(2)).as_matrix()
    )
    shift = np.array([3.3, 1.7, 0.0])
    for off, wanted in (
        (1e-3, VALID),
        (1e-6, VALID),
        (1e-9, VALID),
        (-1e-9, INVALID),
        (-1e-6, INVALID),
        (-1e-3, INVALID),
    ):
        points = with_mid_node(name, 0, 0.25 + off)
        points = points @ turn.T + shift if turned else points
        assert states(name, [points]).tolist() == [wanted], off


@pytest.mark.parametrize("name", TYPES)
def test_a_jacobian_of_exactly_0_at_a_node_makes_a_cell_invalid(name):
    """Coordinates without rounding: the quarter is the quarter."""
    assert states(name, [with_mid_node(name, 0, 0.25)]).tolist() == [INVALID]


@pytest.mark.parametrize("name", TYPES)
def test_less_than_rounding_above_0_is_never_called_invalid_and_never_valid_below_it(name):
    """Quarter-point cells turned at random: the stored numbers decide, whatever the sign of their last bit."""
    rng = np.random.default_rng(5)
    cells = []
    for angle in rng.uniform(0, 6, 40):
        turn = Rotation.from_euler("z", angle).as_matrix()
        cells.append(with_mid_node(name, 0, 0.25) @ turn.T + (3.3, 1.7, 0.0))
    found = states(name, cells)
    corner = tuple(tuple(Fraction(int(i == 0)) for i in range(d + 1)) for d in DOMAINS[name])
    kind = FLAT if name in SURFACES else SOLID
    signs = np.array([exact_sign(name, points, corner, kind) for points in cells])
    assert np.all(found[signs <= 0] == INVALID)
    assert np.all(found[signs > 0] == UNDECIDED)


def squeezed(low):
    """A hexahedron with y = s ((r - 1/3)^2 + low): its Jacobian is (r - 1/3)^2 + low."""
    points = straight("hex27")
    points[:, 1] *= (points[:, 0] - 1 / 3) ** 2 + low
    return points


def test_a_jacobian_that_all_but_touches_0_inside_is_left_undecided_and_proven_a_little_above():
    cells = [squeezed(low) for low in (1e-2, 1e-3, 1e-4, 0.0, -1e-4, -1e-3)]
    assert states("hex27", cells).tolist() == [VALID, VALID, VALID, UNDECIDED, INVALID, INVALID]


def test_a_pyramid_is_judged_at_its_apex_too():
    """Narrowed along x to the share m half-way up, its Jacobian is 1 - w + w (4 m - 1): 4 m - 1 at its top."""
    cells = []
    for m in (0.5, 0.3, 0.25 + 1e-9, 0.25, 0.25 - 1e-9, 0.2):
        points = straight("pyramid13")
        points[9:, 0] = 0.5 + m * np.array([-0.5, 0.5, 0.5, -0.5])
        cells.append(points)
    assert states("pyramid13", cells).tolist() == [VALID, VALID, VALID, INVALID, INVALID, INVALID]
    np.testing.assert_allclose(
        sampled("pyramid13", np.array(cells)).min(axis=1), [1, 0.2, 4e-9, 0, -4e-9, -0.2], atol=1e-15
    )


@pytest.mark.parametrize("name", TYPES)
def test_the_size_the_place_and_the_numbering_of_a_cell_do_not_matter(name):
    cells = shaken(name, 0.13, 200, seed=11)
    want = states(name, cells)
    for factor in (1e-3, 2.0**300, 2.0**-300):
        np.testing.assert_array_equal(states(name, cells * factor), want)
    np.testing.assert_array_equal(states(name, cells + (1000.0, -2000.0, 0.0)), want)


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("size", [(1.0, 1e-3, 1e-5), (1.0, 1e-6, 1e-6)])
def test_thin_cells_along_the_axes_are_judged_like_the_same_cells_unsqueezed(name, size):
    cells = shaken(name, 0.13, 300, seed=12)
    flat = states(name, cells * size)
    assert np.count_nonzero(flat != UNJUDGED) > 200
    np.testing.assert_array_equal(flat[flat != UNJUDGED], states(name, cells)[flat != UNJUDGED])


@pytest.mark.parametrize("name", TYPES)
def test_straight_cells_are_valid_by_their_corners_alone(name):
    cells = np.repeat(straight(name)[None], 100, axis=0)
    assert np.all(states(name, cells) == VALID)


def test_any_number_of_threads_gives_the_same_verdicts():
    from meshwright.audit.parallel import limited_to

    cells = shaken("hex20", 0.13, 700, seed=13)
    found = []
    for threads in (1, 2, 5):
        with limited_to(threads):
            found.append(states("hex20", cells).tobytes())
    assert len(set(found)) == 1


# --- surfaces in space


@pytest.mark.parametrize("name", ["quad8", "quad9"])
@pytest.mark.parametrize("degrees", [90, 170, 190, 250])
def test_a_surface_may_turn_away_from_its_corners_as_long_as_it_has_a_normal(name, degrees):
    """Part of a circular roof with one cell across: of more than half a circle, the normals at its sides look down."""
    points = straight(name)
    angle = math.radians(degrees) * (points[:, 0] - 0.5)
    points = np.stack([np.sin(angle), points[:, 1], np.cos(angle)], axis=1)
    assert states(name, [points], dimension=3).tolist() == [VALID]


@pytest.mark.parametrize("name", SURFACES)
def test_a_plane_surface_in_space_is_judged_like_the_same_one_in_the_plane(name):
    cells = shaken(name, 0.15, 300, seed=14)
    turn = Rotation.random(rng=np.random.default_rng(14)).as_matrix()
    flat = states(name, cells)
    judged = flat != UNJUDGED
    np.testing.assert_array_equal(states(name, cells @ turn.T, dimension=3)[judged], flat[judged])


# --- findings


def findings(mesh):
    return {finding.code: finding for finding in run_checks(mesh)}


def test_a_folded_cell_is_reported_with_the_point_that_proves_it():
    cells = (
        np.array([straight("hex20"), with_mid_node("hex20", 0, 0.2), straight("hex20")])
        + np.arange(3)[:, None, None] * 5
    )
    mesh = Mesh(
        cells.reshape(-1, 3),
        (CellBlock("hex20", np.arange(3), np.arange(60).reshape(3, 20)),),
        cell_ids=np.array([11, 22, 33]),
    )
    finding = findings(mesh)["curved-invalid-cells"]
    assert (finding.severity, finding.rows.tolist(), finding.ids(mesh).tolist()) == ("error", [1], [22])
    witness = finding.detail["witnesses"][0]
    assert witness["cell"] == 22
    assert witness["at"] == pytest.approx([5.0, 5.0, 5.0])  # the end of the edge near the mid node
    assert witness["share_of_largest"] < 0
    assert finding.detail["proven_valid"] == 2


def test_a_cell_left_undecided_is_a_warning():
    found = findings(mesh_of("hex27", [squeezed(0.0)]))
    assert found["curved-undecided-cells"].severity == "warning"
    assert "curved-invalid-cells" not in found


def test_cells_whose_corners_are_at_fault_are_left_to_the_checks_on_corners():
    inverted = straight("hex20") * (1, 1, -1)
    folded = straight("hex20", [*helpers["CORNERS"]["hex"][:6], (0.3, 0.3, 0.3), (0, 1, 1)])
    broken = straight("hex20")
    broken[12] = math.nan
    cells = [straight("hex20"), inverted, folded, np.full((20, 3), 7.0), broken]
    mesh = mesh_of("hex20", [cell + (4.0 * k, 0, 0) for k, cell in enumerate(cells)])
    assert curved_cells(mesh).state.tolist() == [VALID, UNJUDGED, UNJUDGED, UNJUDGED, UNJUDGED]
    found = findings(mesh)
    assert {"inverted-cells", "negative-jacobian-cells", "degenerate-cells", "nonfinite-points"} <= found.keys()
    assert not {"curved-invalid-cells", "curved-undecided-cells"} & found.keys()


@pytest.mark.parametrize("name", ["tri6", "quad9", "tet10", "hex20"])
def test_a_mesh_that_is_mirrored_throughout_is_judged_as_it_was_meant(name):
    cells = shaken(name, 0.04, 30, seed=15)
    cells[3] = with_mid_node(name, 0, 0.2)
    mirrored = cells * ((-1, 1, 1) if name in SURFACES else (1, 1, -1))
    found = curved_cells(mesh_of(name, mirrored)).state
    assert found[3] == INVALID
    assert np.count_nonzero(found == VALID) == 29


def test_a_mesh_of_first_order_has_nothing_to_judge():
    nodes = np.arange(8)[None]
    mesh = Mesh(np.array(helpers["CORNERS"]["hex"], float), (CellBlock("hex", np.array([0]), nodes),))
    assert curved_cells(mesh).state.tolist() == [UNJUDGED]
    assert not {"curved-invalid-cells", "curved-undecided-cells"} & findings(mesh).keys()


# --- other programs and real meshes


GMSH_TYPES = {"tri6": 9, "quad9": 10, "tet10": 11, "hex20": 17, "hex27": 12, "wedge15": 18}


@pytest.mark.parametrize("name", GMSH_TYPES)
def test_gmsh_finds_the_same_cells_invalid(name):
    """Gmsh's smallest Jacobian comes from the same kind of bounds (Johnen, Remacle, Geuzaine)."""
    gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed: pip install 'meshwright[oracles]'")
    cells = shaken(name, 0.12, 200, seed=16)
    state = states(name, cells)
    n, dimension = cells.shape[1], CELL_TYPES[name].dimension
    order = gmsh_order(name)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Verbosity", 0)
        gmsh.model.add("cells")
        tag = gmsh.model.addDiscreteEntity(dimension)
        gmsh.model.mesh.addNodes(dimension, tag, np.arange(1, len(cells) * n + 1), cells.ravel())
        nodes = np.arange(1, len(cells) * n + 1).reshape(-1, n)[:, order]
        gmsh.model.mesh.addElementsByType(tag, GMSH_TYPES[name], np.arange(1, len(cells) + 1), nodes.ravel())
        lowest = np.array(gmsh.model.mesh.getElementQualities(np.arange(1, len(cells) + 1), "minDetJac"))
    finally:
        gmsh.finalize()
    judged = state != UNJUDGED
    clear = judged & (np.abs(lowest) > 1e-3)  # Gmsh stops at a tolerance
    assert np.count_nonzero(clear) > 150
    np.testing.assert_array_equal(state[clear] == VALID, lowest[clear] > 0)


def gmsh_order(name):
    """Our node for each of Gmsh's: it lists edges in another order, and faces."""
    edges = {
        "tet10": "01 12 20 03 23 13",
        "wedge15": "01 02 03 12 14 25 34 35 45",
        "hex": "01 03 04 12 15 23 26 37 45 47 56 67",
    }
    cell = CELL_TYPES[name]
    listed = edges.get(name, edges.get(cell.corners))
    pairs = [tuple(map(int, w)) for w in listed.split()] if listed else list(cell.edges)
    ours = [set(edge) for edge in cell.edges]
    order = list(range(cell.n_corners)) + [cell.mid_edges[ours.index(set(pair))] for pair in pairs]
    return order + {"quad9": [8], "hex27": [24, 22, 20, 21, 23, 25, 26]}.get(name, [])


REAL = {
    "gmsh/petsc_gmsh-hex-20node.msh": 4,
    "gmsh/rectangle-mix-p2.msh": 256,
    "gmsh/horn.msh": 5239,
    "vtk/QuadraticTetra.vtu": 96,
    "vtk/TriQuadraticHexahedron.vtu": 7,
    "vtk/mfem_escher-p2.vtk": 42,
    "vtk/mfem_star-mixed-p2.vtk": 30,
    "xdmf/mesh.xdmf": 484,
}


@pytest.mark.parametrize("file", REAL)
def test_curved_meshes_that_solvers_were_given_are_proven_valid(shared, file):
    state = curved_cells(read(shared / "meshes" / file)).state
    assert np.count_nonzero(state == VALID) == REAL[file] == len(state)
