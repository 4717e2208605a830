"""Polygons and polyhedra: the numbers of the fixed types where they are one, closed forms, laws, an independent sum."""

import itertools
import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Voronoi
from scipy.spatial.transform import Rotation

from meshwright.audit.cells import LINEAR_TYPES, POLYTOPES
from meshwright.audit.connectivity import faces, faces_of_cells
from meshwright.audit.geometry import cell_geometry
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Faces, Mesh
from meshwright.audit.metrics import APPLICABILITY, METRICS
from meshwright.audit.metrics.polytopes import Shapes
from meshwright.audit.readers import read
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.registry_text import explain

hybrid_mesh = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))["hybrid_mesh"]

IDS = tuple(id_ for id_, row in METRICS.items() if row.polytope)
POWER = {"L": 1, "L2": 2, "L3": 3}
SOLIDS = ("tet", "pyramid", "wedge", "hex")
FROM_THE_CENTRE = {
    "fluent.cell_squish", "fluent.ortho_cell_face", "fluent.aspect_ratio", "openfoam.min_pyramid", "openfoam.concave",
    "openfoam.aspect_ratio",
}  # fmt: skip
"""Metrics that tell inside from outside. A cell of wild shape has a centre far off, and there fewer digits."""
SKEW, DEVIATION = "gambit.equiangle_skew", "seed.internal_angle_deviation"


def values(mesh, type_name, threads=1):
    return {id_: by[type_name] for id_, by in measure(mesh, IDS, threads=threads).values.items() if type_name in by}


def fixed(type_name, cells):
    """A mesh of cells (n, k, 3) that share no point."""
    n, k, _ = cells.shape
    return Mesh(cells.reshape(-1, 3), (CellBlock(type_name, np.arange(n), np.arange(n * k).reshape(n, k)),))


def told_by_faces(mesh):
    """The same mesh, every cell a polyhedron (polygon)."""
    if mesh.cell_dimension == 2:
        (block,) = mesh.blocks
        n, k = block.nodes.shape
        loops = CellBlock("polygon", block.rows, offsets=np.arange(0, n * k + 1, k), items=block.nodes.reshape(-1))
        return Mesh(mesh.points, (loops,))
    offsets, items = faces_of_cells(mesh)
    return Mesh(
        mesh.points,
        (CellBlock("polyhedron", np.arange(mesh.n_cells), offsets=offsets, items=items),),
        faces=faces(mesh),
    )


def polyhedron(points, sides):
    """One cell with these outward faces."""
    n = len(sides)
    table = Faces(np.cumsum([0, *map(len, sides)]), np.concatenate(sides), np.zeros(n, int), np.full(n, -1))
    return Mesh(
        np.array(points, float), (CellBlock("polyhedron", [0], offsets=[0, n], items=np.arange(n)),), faces=table
    )


def polygon(*points):
    points = np.array(points, float)
    points = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])
    n = len(points)
    return Mesh(points, (CellBlock("polygon", [0], offsets=[0, n], items=np.arange(n)),))


def convex(points, normals):
    """The polyhedron with these vertices whose faces look along `normals`."""
    points, sides = np.array(points, float), []
    for normal in np.array(normals, float):
        height = points @ normal
        on = np.flatnonzero(height > height.max() - 1e-9)
        u = points[on[0]] - points[on].mean(axis=0)
        v = np.cross(normal, u) / np.linalg.norm(normal)
        arms = points[on] - points[on].mean(axis=0)
        sides.append(on[np.argsort(np.arctan2(arms @ v, arms @ u))])
    return polyhedron(points, sides)


PHI = (1 + 5**0.5) / 2


def dodecahedron():
    """Edge 2/phi about the origin."""
    turns = lambda a, b, c: [(a, b, c), (c, a, b), (b, c, a)]  # noqa: E731
    signs = list(itertools.product((-1, 1), repeat=2))
    points = [*itertools.product((-1, 1), repeat=3), *(v for s, t in signs for v in turns(0, s / PHI, t * PHI))]
    return convex(points, [v for s, t in signs for v in turns(0, s * PHI, t)])


def truncated_octahedron():
    """Edge sqrt 2 about the origin."""
    octants = list(itertools.product((-1, 1), repeat=3))
    points = {tuple(np.multiply(o, p).tolist()) for p in itertools.permutations((0, 1, 2)) for o in octants}
    return convex(sorted(points), [*np.eye(3), *-np.eye(3), *(np.array(octants) / 3**0.5)])


def voronoi_cells(seed, n=120):
    """The bounded cells of a random Voronoi diagram: convex polyhedra with faces of 3 to a dozen corners."""
    diagram = Voronoi(np.random.default_rng(seed).uniform(0, 1, (n, 3)))
    bounded = [c for c in range(n) if -1 not in diagram.regions[diagram.point_region[c]]]
    row = {c: r for r, c in enumerate(bounded)}
    sides, owner, neighbour, of_cell = [], [], [], [[] for _ in bounded]
    for pair, ridge in zip(diagram.ridge_points.tolist(), diagram.ridge_vertices, strict=True):
        if not row.keys() & set(pair):
            continue
        a, b = pair if pair[0] in row else pair[::-1]
        corners = diagram.vertices[ridge]
        area = sum(np.cross(p - corners[0], q - corners[0]) for p, q in itertools.pairwise(corners))
        for c in row.keys() & set(pair):
            of_cell[row[c]].append(len(sides))
        sides.append(ridge if area @ (diagram.points[b] - diagram.points[a]) > 0 else ridge[::-1])
        owner.append(row[a])
        neighbour.append(row.get(b, -1))
    block = CellBlock(
        "polyhedron", np.arange(len(bounded)), offsets=np.cumsum([0, *map(len, of_cell)]), items=np.concatenate(of_cell)
    )
    table = Faces(np.cumsum([0, *map(len, sides)]), np.concatenate(sides), owner, neighbour)
    used, nodes = np.unique(table.nodes, return_inverse=True)
    return Mesh(diagram.vertices[used], (block,), faces=Faces(table.offsets, nodes, owner, neighbour))


def sides_of(mesh, row):
    block, table = mesh.blocks[0], mesh.faces
    rows = block.items[block.offsets[row] : block.offsets[row + 1]]
    return [mesh.points[table.nodes[table.offsets[f] : table.offsets[f + 1]]] for f in rows]


def by_the_book(sides):
    """Figures of a cell with convex faces, corner by corner with `math.acos`."""
    lengths, angles, skew, off = [], [], 0.0, 0.0
    for corners in sides:
        n = len(corners)
        ideal = 180 * (n - 2) / n
        here = []
        for k in range(n):
            u, v = corners[(k + 1) % n] - corners[k], corners[k - 1] - corners[k]
            lengths.append(math.dist(corners[k], corners[k - 1]))
            here.append(math.degrees(math.acos(max(-1, min(1, u @ v / math.hypot(*u) / math.hypot(*v))))))
        angles += here
        skew = max(skew, (max(here) - ideal) / (180 - ideal), (ideal - min(here)) / ideal)
        off = max(off, *(abs(a - ideal) for a in here))
    return {
        "edge.min": min(lengths), "edge.max": max(lengths), "gambit.edge_ratio": max(lengths) / min(lengths),
        "angle.min": min(angles), "angle.max": max(angles), DEVIATION: off,
        SKEW: skew, "icem.equiangle_skewness": 1 - skew,
    }  # fmt: skip


def snapped(array):
    """On a grid of 2**-20, where differences of coordinates are exact and so the same from any corner."""
    return np.round(array * 2**20) / 2**20


def assert_equal_metrics(got, want, rtol=1e-12, size=0.0):
    """size: what the volume and area may be off by, beside rtol."""
    assert want.keys()
    assert got.keys() == want.keys()
    for id_, column in want.items():
        far = 1e3 if id_ in FROM_THE_CENTRE else 1.0
        atol = {"1": 1e-12, "deg": 1e-10, "L2": size, "L3": size}.get(METRICS[id_].unit, 0.0)
        if (
            id_ == "fluent.aspect_ratio"
        ):  # over a distance that may be next to nothing: its reciprocal is well conditioned
            np.testing.assert_allclose(1 / got[id_], 1 / column, rtol=far * rtol, atol=far * 1e-12, err_msg=id_)
            continue
        np.testing.assert_allclose(got[id_], column, rtol=far * rtol, atol=far * atol, err_msg=id_)


def test_every_metric_of_a_polytope_names_a_column():
    for row in METRICS.values():
        if row.entity == "cell" and not row.column:
            assert bool(row.polytope) == bool(set(row.on) & set(POLYTOPES)), row.id
    assert {METRICS[id_].polytope for id_ in IDS} <= set(Shapes._fields)
    assert set(IDS) >= {
        "area", "volume", "edge.min", "edge.max", "angle.min", "angle.max", "gambit.edge_ratio", SKEW,
        "icem.equiangle_skewness", DEVIATION,
    }  # fmt: skip


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), wild=st.booleans())
def test_a_cell_told_by_its_faces_has_the_numbers_of_its_type(type_name, seed, wild):
    # Wild: corners anywhere, so that faces are warped, concave, folded into figures of eight.
    rng = np.random.default_rng(seed)
    shape = np.array(UNIT[type_name])
    noise = rng.uniform(-1, 1, (40, *shape.shape))
    mesh = fixed(type_name, snapped(noise if wild else shape + 0.25 * noise))
    told = told_by_faces(mesh)
    assert_equal_metrics(values(told, told.blocks[0].type), values(mesh, type_name), size=1e-13)


UNIT = {
    "tri": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0)],
    "quad": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    "tet": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0.5, 0.29, 0.82)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0.7)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0, 0, 1), (1, 0, 1), (0.5, 0.87, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}


@pytest.mark.parametrize("seed", range(3))
def test_neighbours_that_share_faces_have_the_numbers_of_their_types(seed):
    mesh = hybrid_mesh(seed, n=4, jitter=0.2)
    mesh = Mesh(snapped(mesh.points), mesh.blocks)
    told = values(told_by_faces(mesh), "polyhedron")
    assert {block.type for block in mesh.blocks} == set(SOLIDS)
    for block in mesh.blocks:
        assert_equal_metrics({k: v[block.rows] for k, v in told.items()}, values(mesh, block.type), size=1e-13)


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_collapsed_cells_are_undefined_where_their_type_is(type_name, seed):
    # Corners on a coarse grid of eight places: most of the cells have an edge of zero length, many have several.
    rng = np.random.default_rng(seed)
    mesh = fixed(type_name, rng.integers(0, 2, (200, len(UNIT[type_name]), 3)).astype(float))
    told = told_by_faces(mesh)
    got, want = values(told, told.blocks[0].type), values(mesh, type_name)
    assert np.isnan(want["angle.min"]).mean() > 0.2
    assert (want[SKEW][np.isnan(want["angle.min"])] == 1.0).all()
    # Where two faces of a collapsed cell coincide, rounding decides which one lies behind the other.
    for id_ in FROM_THE_CENTRE & want.keys():
        del got[id_], want[id_]
    assert_equal_metrics(got, want, size=1e-14)


def test_a_cell_without_any_extent_has_the_degenerate_values_of_the_registry():
    for mesh in (polygon(*[(3, 4, 5)] * 5), mesh_with(dodecahedron(), np.full((20, 3), 7.0))):
        for id_, (value,) in values(mesh, mesh.blocks[0].type).items():
            assert value == pytest.approx(METRICS[id_].degenerate, nan_ok=True), id_


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_cell_with_a_non_finite_corner_has_no_number_and_spoils_no_other(bad):
    mesh = voronoi_cells(5)
    points = mesh.points.copy()
    spoilt = int(mesh.faces.nodes[0])
    points[spoilt, 1] = bad
    marked = mesh_with(mesh, points, spoilt)
    users = np.array([np.isnan(np.concatenate(sides_of(marked, row))).any() for row in range(mesh.n_cells)])
    assert users.any()
    assert not users.all()
    for (id_, got), want in zip(
        values(mesh_with(mesh, points), "polyhedron").items(), values(mesh, "polyhedron").values(), strict=True
    ):
        np.testing.assert_array_equal(got, np.where(users, np.nan, want), err_msg=id_)


def mesh_with(mesh, points, marked=None):
    """The mesh at other points, one of them marked by nan."""
    points = points.copy()
    if marked is not None:
        points[marked] = np.nan
    return Mesh(points, mesh.blocks, faces=mesh.faces)


def test_a_regular_dodecahedron_is_perfect():
    found = {k: v[0] for k, v in values(dodecahedron(), "polyhedron").items()}
    assert found["volume"] == pytest.approx((15 + 7 * 5**0.5) / 4 * (2 / PHI) ** 3, rel=1e-13)
    assert found["edge.min"] == pytest.approx(2 / PHI, rel=1e-14)
    assert found["gambit.edge_ratio"] == pytest.approx(1, abs=1e-14)
    assert (found["angle.min"], found["angle.max"]) == (pytest.approx(108, abs=1e-11), pytest.approx(108, abs=1e-11))
    assert found[SKEW] == pytest.approx(0, abs=1e-13)
    assert found["icem.equiangle_skewness"] == pytest.approx(1, abs=1e-13)
    assert found[DEVIATION] == pytest.approx(0, abs=1e-11)


def test_a_truncated_octahedron_is_perfect_though_its_faces_differ():
    found = {k: v[0] for k, v in values(truncated_octahedron(), "polyhedron").items()}
    assert found["volume"] == pytest.approx(8 * 2**0.5 * 2**1.5, rel=1e-13)
    assert (found["angle.min"], found["angle.max"]) == (pytest.approx(90, abs=1e-11), pytest.approx(120, abs=1e-11))
    assert found[SKEW] == pytest.approx(0, abs=1e-13)
    assert found[DEVIATION] == pytest.approx(0, abs=1e-11)


HOUSE = [(0, 0), (1, 0), (1, 1), (0.5, 1 + 3**0.5 / 2), (0, 1)]
CUT = [(0, 0), (2, 0), (2, 1), (1, 2), (0, 2)]
NOTCH = [(0, 0), (2, 0), (2, 2), (1, 1), (0, 2)]
HANGING = [(0, 0), (1, 0), (2, 0), (2, 2), (0, 2)]
L_SHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
CLOSED_FORMS = [
    ("a square under an equilateral roof", HOUSE, "angle.min", 60.0),
    ("a square under an equilateral roof", HOUSE, "angle.max", 150.0),
    ("a square under an equilateral roof", HOUSE, SKEW, 42 / 72),
    ("a square under an equilateral roof", HOUSE, DEVIATION, 48.0),
    ("a square under an equilateral roof", HOUSE, "area", 1 + 3**0.5 / 4),
    ("a square under an equilateral roof", HOUSE, "gambit.edge_ratio", 1.0),
    ("a square with a corner cut off", CUT, SKEW, 27 / 72),
    ("a square with a corner cut off", CUT, DEVIATION, 27.0),
    ("a square with a corner cut off", CUT, "icem.equiangle_skewness", 45 / 72),
    ("a square with a corner cut off", CUT, "area", 3.5),
    ("a square with a corner cut off", CUT, "edge.max", 2.0),
    ("a square with a notch", NOTCH, "angle.max", 270.0),
    ("a square with a notch", NOTCH, "angle.min", 45.0),
    ("a square with a notch", NOTCH, SKEW, 1.0),
    ("a square with a notch", NOTCH, DEVIATION, 162.0),
    ("a square with a notch", NOTCH, "area", 3.0),
    ("a square with a node on one side", HANGING, "angle.max", 180.0),
    ("a square with a node on one side", HANGING, SKEW, 1.0),
    ("a square with a node on one side", HANGING, "gambit.edge_ratio", 2.0),
    ("an L", L_SHAPE, "angle.max", 270.0),
    ("an L", L_SHAPE, DEVIATION, 150.0),
    ("an L", L_SHAPE, "area", 3.0),
]  # fmt: skip


@pytest.mark.parametrize(("what", "loop", "metric", "value"), CLOSED_FORMS)
def test_closed_forms(what, loop, metric, value):
    for turn in range(len(loop)):
        for order in (1, -1):
            found = values(polygon(*(loop[turn:] + loop[:turn])[::order]), "polygon")[metric][0]
            assert found == pytest.approx(value, rel=1e-12), what


@pytest.mark.parametrize("n", [3, 4, 5, 6, 7, 12, 100])
def test_a_regular_polygon_is_perfect_and_a_hair_of_it_is_not(n):
    turn = 2 * np.pi * np.arange(n) / n
    found = {k: v[0] for k, v in values(polygon(*np.column_stack([np.cos(turn), np.sin(turn)])), "polygon").items()}
    assert found["angle.max"] == pytest.approx(180 * (n - 2) / n, rel=1e-12)
    assert found["area"] == pytest.approx(n / 2 * math.sin(2 * math.pi / n), rel=1e-12)
    assert found[SKEW] == pytest.approx(0, abs=1e-11)
    flat = values(polygon(*np.column_stack([np.cos(turn), 1e-3 * np.sin(turn)])), "polygon")
    assert flat[SKEW][0] > 0.9


@pytest.mark.parametrize("seed", range(3))
def test_voronoi_cells_have_the_figures_of_a_corner_by_corner_sum(seed):
    mesh = voronoi_cells(seed)
    found = values(mesh, "polyhedron")
    assert mesh.n_cells > 20
    assert max(len(side) for row in range(mesh.n_cells) for side in sides_of(mesh, row)) > 7
    for row in range(mesh.n_cells):
        for id_, value in by_the_book(sides_of(mesh, row)).items():
            assert found[id_][row] == pytest.approx(value, rel=1e-6, abs=1e-5), (row, id_)
    np.testing.assert_allclose(found["volume"], cell_geometry(mesh).volume, rtol=1e-12)
    assert (found["volume"] > 0).all()


def test_polygons_have_the_areas_of_the_geometry():
    rng = np.random.default_rng(2)
    sizes = rng.integers(3, 12, 300)
    points = rng.uniform(-1, 1, (sizes.sum(), 3))
    block = CellBlock("polygon", np.arange(300), offsets=np.cumsum([0, *sizes]), items=np.arange(sizes.sum()))
    mesh = Mesh(points, (block,))
    np.testing.assert_allclose(values(mesh, "polygon")["area"], cell_geometry(mesh).volume, rtol=1e-12)


@pytest.mark.parametrize("exponent", [-300, -100, 100, 300])
def test_cells_of_any_size_score_the_same_bits(exponent):
    for mesh in (voronoi_cells(1), told_by_faces(fixed("quad", np.random.default_rng(1).uniform(-1, 1, (50, 4, 3))))):
        name = mesh.blocks[0].type
        here, there = values(mesh, name), values(mesh_with(mesh, mesh.points * 2.0**exponent), name)
        for id_, column in here.items():
            power = exponent * POWER.get(METRICS[id_].unit, 0)
            if abs(power) < 900:
                np.testing.assert_array_equal(there[id_], column * 2.0**power, err_msg=id_)
        assert (there[SKEW] > 0).all()


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rotation_changes_nothing(seed):
    mesh = voronoi_cells(seed % 4)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    got, want = values(mesh_with(mesh, mesh.points @ turn.T), "polyhedron"), values(mesh, "polyhedron")
    # A Voronoi diagram has edges of 1e-5, whose corners turn by the rounding of 1e-16.
    for id_, column in want.items():
        if id_ != "openfoam.aspect_ratio":  # looks along the axes
            np.testing.assert_allclose(got[id_], column, rtol=1e-8, atol=1e-8, err_msg=id_)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 3), where=st.tuples(*[st.integers(-10000, 10000)] * 3))
def test_translation_by_ten_thousand_changes_no_bit(seed, where):
    mesh = voronoi_cells(seed)
    points = np.round(np.clip(mesh.points, -9, 9) * 2**30) / 2**30
    here = values(mesh_with(mesh, points), "polyhedron")
    there = values(mesh_with(mesh, points + np.array(where, float)), "polyhedron")
    for id_, column in here.items():
        assert column.tobytes() == there[id_].tobytes(), id_


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_order_of_faces_first_corners_and_owners_change_nothing(seed):
    rng = np.random.default_rng(seed)
    mesh = voronoi_cells(seed % 4)
    mesh = mesh_with(mesh, snapped(mesh.points))
    table, block = mesh.faces, mesh.blocks[0]
    order = rng.permutation(len(table))
    sides, owner, neighbour = [], [], []
    for f in order.tolist():
        side = np.roll(table.nodes[table.offsets[f] : table.offsets[f + 1]], rng.integers(9))
        a, b = int(table.owner[f]), int(table.neighbour[f])
        if b >= 0 and rng.random() < 0.5:
            a, b, side = b, a, side[::-1]
        sides.append(side)
        owner.append(a)
        neighbour.append(b)
    shuffled = Faces(np.cumsum([0, *map(len, sides)]), np.concatenate(sides), owner, neighbour)
    new_row = np.argsort(order)
    items = [rng.permutation(new_row[block.items[a:b]]) for a, b in itertools.pairwise(block.offsets)]
    other = Mesh(
        mesh.points,
        (CellBlock("polyhedron", block.rows, offsets=block.offsets, items=np.concatenate(items)),),
        faces=shuffled,
    )
    assert_equal_metrics(values(other, "polyhedron"), values(mesh, "polyhedron"), rtol=1e-9, size=1e-14)


def test_a_mirror_turns_the_sign_of_volume_and_what_tells_inside_from_outside():
    mesh = voronoi_cells(2)
    here, there = values(mesh, "polyhedron"), values(mesh_with(mesh, mesh.points * [1, 1, -1]), "polyhedron")
    for id_ in here.keys() - FROM_THE_CENTRE:
        column = -here[id_] if id_ == "volume" else here[id_]
        np.testing.assert_array_equal(there[id_], column, err_msg=id_)


def test_any_number_of_threads_gives_the_same_bits():
    mesh = told_by_faces(fixed("hex", np.random.default_rng(3).uniform(-1, 1, (10_007, 8, 3))))
    one, two, five = (values(mesh, "polyhedron", threads=n) for n in (1, 2, 5))
    for id_, column in one.items():
        assert column.tobytes() == two[id_].tobytes() == five[id_].tobytes()


def test_progress_counts_every_cell_of_a_mesh_of_hexes_and_polyhedra():
    mesh = voronoi_cells(3)
    corners = len(mesh.points) + np.arange(8)
    points = np.concatenate([mesh.points, np.array(UNIT["hex"], float)])
    block = CellBlock("hex", [mesh.n_cells], [corners])
    told = []
    both = Mesh(points, (*mesh.blocks, block), faces=mesh.faces)
    found = measure(both, IDS, progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (both.n_cells, both.n_cells)
    assert found.values[SKEW]["hex"].tolist() == [0.0]
    assert found.values[SKEW]["polyhedron"].tobytes() == values(mesh, "polyhedron")[SKEW].tobytes()


def test_a_cell_with_a_face_of_very_many_corners_is_measured_in_time():
    # A prism over a polygon of 60,000 corners two of which coincide: no step may cost the square of that.
    n = 60_000
    turn = 2 * np.pi * np.arange(n) / n
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    ring[1] = ring[0]
    low, high = np.arange(n), np.arange(n) + n
    walls = np.column_stack([low, np.roll(low, -1), np.roll(high, -1), high])
    mesh = polyhedron(np.concatenate([ring, ring + (0, 0, 1)]), [low[::-1], high, *walls])
    found = {k: v[0] for k, v in values(mesh, "polyhedron").items()}
    assert (found["edge.min"], found[SKEW]) == (0.0, 1.0)
    assert math.isnan(found["angle.min"])
    assert found["volume"] == pytest.approx(math.pi, rel=1e-6)
    assert found[DEVIATION] == pytest.approx(180 / n, rel=1e-3)  # at the neighbours of the two


def test_a_face_of_two_nodes_has_no_angle():
    mesh = polyhedron(UNIT["tet"], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 1)])
    found = {k: v[0] for k, v in values(mesh, "polyhedron").items()}
    assert (found[SKEW], found["icem.equiangle_skewness"]) == (1.0, 0.0)
    assert math.isnan(found["angle.min"])
    assert found["volume"] > 0


def document(mesh, metrics="default"):
    return summarise(audit(mesh, metrics, threads=1))


def test_a_mesh_of_polyhedra_is_judged_and_tabled():
    mesh = voronoi_cells(1)
    made = document(mesh)
    skew = values(mesh, "polyhedron")[SKEW]
    assert (made["gate"]["verdict"], made["gate"]["reasons"]) == ("pass", [])
    assert {finding["severity"] for finding in made["findings"]} <= {"info"}
    (row,) = made["quality"]
    assert (row["type"], row["count"], row["over_0_8"]) == ("polyhedron", mesh.n_cells, np.count_nonzero(skew > 0.8))
    assert row["worst_equiangle_skew"] == skew.max()
    counts = made["distributions"]["equiangle_skew"]["counts"]["polyhedron"]
    assert counts == np.histogram(skew, np.arange(11) / 10)[0].tolist()
    assert made["distributions"]["aspect_ratio"]["counts"] == {}
    assert sum(made["gambit_classes"]["counts"]["polyhedron"]) == mesh.n_cells
    assert list(made["metrics"]["gambit.warpage"]) == []


def test_polyhedra_that_no_chosen_metric_is_defined_on_are_still_an_incomplete_audit():
    gate = document(voronoi_cells(1), "gambit.warpage")["gate"]
    assert gate["verdict"] == "incomplete"
    assert "polyhedron" in gate["reasons"][0]


def test_explain_lists_polygons_and_polyhedra_and_the_table_of_the_article_does_not():
    text = " ".join(explain(SKEW).split())
    assert "polygon, polyhedron" in text.split("not defined on")[0]
    assert "180 (n - 2)/n" in text
    assert "polygon, polyhedron" in " ".join(explain("gambit.warpage").split()).split("not defined on")[1]
    assert all(tuple(on) == LINEAR_TYPES for _, _, on in APPLICABILITY)


def test_the_polyhedra_of_a_real_mesh_agree_with_the_geometry_and_across_its_two_files(shared):
    folder = shared / "meshes"
    names = ["legacy_binary.cas.gz", "legacy_text.cas.gz"]
    meshes = [read(folder / "fluent_legacy" / f"Static_Mixer_Parameters_{name}") for name in names]
    columns = []
    for mesh in meshes:
        assert mesh.counts == {"polyhedron": 22771}
        found = values(mesh, "polyhedron", threads=2)
        np.testing.assert_allclose(found["volume"], cell_geometry(mesh).volume, rtol=1e-12)
        assert not any(np.isnan(column).any() for column in found.values())
        columns.append(found)
        rows = np.random.default_rng(0).choice(mesh.n_cells, 200, replace=False)
        rows = rows[found["angle.max"][rows] < 180]
        for row in rows.tolist():
            for id_, value in by_the_book(sides_of(mesh, row)).items():
                assert found[id_][row] == pytest.approx(value, rel=1e-6, abs=1e-6)
    assert columns[0][SKEW].mean() == pytest.approx(columns[1][SKEW].mean(), rel=1e-4)
