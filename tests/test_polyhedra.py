"""How polyhedra stand to their faces: an independent sum, the reference values of hexes and kin, closed forms, laws."""

import json
import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Faces, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.metrics.polytopes import Shapes, measure_polytopes

hybrid_mesh = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))["hybrid_mesh"]

COLUMN = {
    "volume": "size",
    "fluent.cell_squish": "squish",
    "fluent.ortho_cell_face": "orthogonality",
    "fluent.aspect_ratio": "reach",
    "openfoam.openness": "openness",
    "openfoam.aspect_ratio": "balance",
    "openfoam.min_pyramid": "pyramid",
    "openfoam.min_flatness": "flatness",
    "openfoam.concave": "concavity",
}
SOLIDS = ("tet", "pyramid", "wedge", "hex")
CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
UNIT = {
    "tet": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0.5, 0.29, 0.82)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0.7)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0, 0, 1), (1, 0, 1), (0.5, 0.87, 1)],
    "hex": CUBE,
}


def as_polyhedra(type_name, cells):
    """Cells (n, k, 3) of a fixed type, each a polyhedron that shares nothing with the others."""
    cells = np.asarray(cells, float)
    n, k, _ = cells.shape
    sides = CELL_TYPES[type_name].faces
    nodes = np.concatenate([np.array(side) + k * c for c in range(n) for side in sides])
    offsets = np.cumsum([0, *[len(side) for side in sides] * n])
    owner = np.repeat(np.arange(n), len(sides))
    table = Faces(offsets, nodes, owner, np.full(len(owner), -1))
    block = CellBlock(
        "polyhedron", np.arange(n), offsets=np.arange(0, len(owner) + 1, len(sides)), items=np.arange(len(owner))
    )
    return Mesh(cells.reshape(-1, 3), (block,), faces=table)


def columns(mesh):
    shapes, work = measure_polytopes(mesh, mesh.blocks[0])
    work(0, len(mesh.blocks[0]))
    return shapes


def named(mesh):
    shapes = columns(mesh)
    return {id_: getattr(shapes, column) for id_, column in COLUMN.items()}


def by_the_book(sides):
    """The figures of one cell from its outward faces (arrays of corners), straight from the definitions."""
    area, centre, flat = [], [], []
    for p in sides:
        q, mean = np.roll(p, -1, axis=0), p.mean(axis=0)
        fan = np.cross(p - mean, q - mean) / 2
        weight = np.linalg.norm(fan, axis=1)
        area.append(fan.sum(axis=0))
        centre.append((weight[:, None] * (p + q + mean) / 3).sum(axis=0) / weight.sum())
        about = np.linalg.norm(np.cross(p - centre[-1], q - centre[-1]) / 2, axis=1).sum()
        flat.append(np.linalg.norm(area[-1]) / about)
    area, centre = np.array(area), np.array(centre)
    guess = centre.mean(axis=0)
    pieces = ((centre - guess) * area).sum(axis=1)
    middle = guess + 0.75 * (pieces[:, None] * (centre - guess)).sum(axis=0) / pieces.sum()
    size, way = np.linalg.norm(area, axis=1), np.linalg.norm(centre - middle, axis=1)
    flux = (area * (centre - middle)).sum(axis=1)
    distances = np.concatenate([abs(flux) / size, *(np.linalg.norm(p - middle, axis=1) for p in sides)])
    seen = abs(area).sum(axis=0)
    between = centre[None] - centre[:, None]
    length = np.linalg.norm(between, axis=2)
    with np.errstate(invalid="ignore"):
        ahead = (area[:, None] * between).sum(axis=2) / size[:, None] / length
    volume = pieces.sum() / 3
    bulk = abs(volume) ** (2 / 3)
    return {
        "volume": volume,
        "fluent.cell_squish": 1 - (flux / size / way).min(),
        "fluent.ortho_cell_face": (flux / size / way).min(),
        "fluent.aspect_ratio": distances.max() / distances.min(),
        "openfoam.openness": (abs(area.sum(axis=0)) / seen).max(),
        "openfoam.aspect_ratio": max(seen.max() / seen.min(), seen.sum() / 6 / bulk) if volume > 0 else math.inf,
        "openfoam.min_pyramid": flux.min() / 3,
        "openfoam.min_flatness": min(flat),
        "openfoam.concave": ahead[~np.eye(len(sides), dtype=bool)].max(),
    }  # fmt: skip


def sides_of(mesh, row):
    block, table = mesh.blocks[0], mesh.faces
    for f in block.items[block.offsets[row] : block.offsets[row + 1]]:
        corners = mesh.points[table.nodes[table.offsets[f] : table.offsets[f + 1]]]
        yield corners if table.owner[f] == block.rows[row] else corners[::-1]


@pytest.mark.parametrize("type_name", SOLIDS)
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), wild=st.booleans())
def test_a_polyhedron_has_the_figures_of_the_definitions(type_name, seed, wild):
    # Wild: corners anywhere, so that faces are warped, concave, folded into figures of eight.
    noise = np.random.default_rng(seed).uniform(-1, 1, (20, len(UNIT[type_name]), 3))
    mesh = as_polyhedra(type_name, noise if wild else np.array(UNIT[type_name]) + 0.2 * noise)
    found = named(mesh)
    for row in range(mesh.n_cells):
        for id_, value in by_the_book(list(sides_of(mesh, row))).items():
            assert found[id_][row] == pytest.approx(value, rel=1e-7, abs=1e-9), (row, id_)


def test_hexes_and_their_kin_told_by_faces_score_the_reference_values(shared):
    golden = json.loads((shared / "reference/golden.json").read_text())["elements"]
    seen = 0
    for element in golden:
        if element["type"] not in SOLIDS:
            continue
        found = named(as_polyhedra(element["type"], [element["points"]]))
        for id_, column in found.items():
            if id_ in element["values"]:
                value = float(element["values"][id_])
                assert column[0] == pytest.approx(value, rel=1e-9, abs=1e-9, nan_ok=True), (element["name"], id_)
                seen += 1
    assert seen > 400


def test_every_column_is_named_by_a_metric_of_polytopes_or_is_told_here_which_one_it_is_for():
    named_by_rows = {row.polytope for row in METRICS.values() if row.polytope}
    waiting = {column for id_, column in COLUMN.items() if id_ not in METRICS or not METRICS[id_].polytope}
    assert set(Shapes._fields) == named_by_rows | waiting
    for id_, column in COLUMN.items():
        assert id_ not in METRICS or METRICS[id_].polytope in ("", column), id_


CLOSED_FORMS = [
    ("a cube", CUBE, {
        "fluent.aspect_ratio": 3**0.5, "fluent.cell_squish": 0.0, "openfoam.aspect_ratio": 1.0,
        "openfoam.min_pyramid": 1 / 6, "openfoam.concave": -(0.5**0.5), "openfoam.min_flatness": 1.0,
    }),
    # Farthest: a corner at sqrt(0.25 + 1 + 4); nearest: the wall at 0.5.
    ("a box of 1 by 2 by 4", np.multiply(CUBE, (1, 2, 4)), {
        "fluent.aspect_ratio": 21**0.5, "openfoam.aspect_ratio": 8 / 2, "openfoam.min_pyramid": 8 / 6,
    }),
    # Leaning by 45 degrees: the way to two faces is along the lean, cosine sqrt(1/2).
    ("a leaning cube", [(x + z, y, z) for x, y, z in CUBE], {
        "fluent.ortho_cell_face": 0.5**0.5, "fluent.cell_squish": 1 - 0.5**0.5, "volume": 1.0,
    }),
    ("a mirrored cube", [(-x, y, z) for x, y, z in CUBE], {
        "fluent.cell_squish": 2.0, "fluent.ortho_cell_face": -1.0, "openfoam.min_pyramid": -1 / 6,
        "openfoam.aspect_ratio": math.inf, "openfoam.openness": 0.0, "volume": -1.0,
    }),
    ("a cube without height", [(x, y, 0) for x, y, z in CUBE], {
        "fluent.cell_squish": 1.0, "fluent.ortho_cell_face": 0.0, "fluent.aspect_ratio": math.inf,
        "openfoam.aspect_ratio": math.inf, "openfoam.min_pyramid": 0.0,
    }),
    ("a point", [(3, 4, 5)] * 8, {
        "volume": 0.0, "fluent.cell_squish": 1.0, "fluent.ortho_cell_face": 0.0, "fluent.aspect_ratio": math.inf,
        "openfoam.openness": 0.0, "openfoam.aspect_ratio": math.inf, "openfoam.min_pyramid": 0.0,
        "openfoam.min_flatness": 1.0, "openfoam.concave": 0.0,
    }),
]  # fmt: skip


@pytest.mark.parametrize(("what", "points", "wanted"), CLOSED_FORMS)
def test_closed_forms(what, points, wanted):
    found = named(as_polyhedra("hex", [points]))
    for id_, value in wanted.items():
        assert found[id_][0] == pytest.approx(value, rel=1e-14, abs=1e-15), (what, id_)


def test_a_saddle_is_as_flat_as_its_triangles_say():
    # Corners of a unit square, up and down by h in turn: net area 1, four triangles of sqrt(1/16 + h^2/4) each.
    h = 0.25
    points = [(x, y, z + (h if z and (x == y) else -h if z else 0)) for x, y, z in CUBE]
    found = named(as_polyhedra("hex", [points]))
    assert found["openfoam.min_flatness"][0] == pytest.approx(1 / (4 * math.sqrt(1 / 16 + h * h / 4)), rel=1e-14)


def test_a_cell_without_its_lid_is_open_by_the_share_of_the_lid():
    # Areas along z: floor 1, lid missing, so all of the area that looks along z is unbalanced; nothing else is.
    mesh = as_polyhedra("hex", [CUBE])
    block = mesh.blocks[0]
    lidless = CellBlock("polyhedron", [0], offsets=[0, 5], items=[f for f in block.items if f != 1])
    found = columns(Mesh(mesh.points, (lidless,), faces=mesh.faces))
    assert found.openness[0] == 1.0
    # A lid of half the size leaves (1 - 1/2) out of 1 + 1/2.
    points = np.concatenate([mesh.points, [(0, 0, 1), (1, 0, 1), (1, 0.5, 1), (0, 0.5, 1)]])
    table = Faces(mesh.faces.offsets, np.where(np.arange(24) // 4 == 1, np.arange(24) % 4 + 8, mesh.faces.nodes),
                  mesh.faces.owner, mesh.faces.neighbour)  # fmt: skip
    assert columns(Mesh(points, mesh.blocks, faces=table)).openness[0] == pytest.approx(1 / 3, rel=1e-15)


def test_a_notched_prism_is_concave_and_so_are_two_faces_in_one_plane():
    ring = [(0, 0), (2, 0), (2, 2), (1, 1), (0, 2)]
    points = np.array([(x, y, z) for z in (0, 1) for x, y in ring], float)
    walls = [(i, (i + 1) % 5, (i + 1) % 5 + 5, i + 5) for i in range(5)]
    assert concave(points, [(4, 3, 2, 1, 0), (5, 6, 7, 8, 9), *walls]) > 0.1
    points = np.array([*CUBE, (0.5, 0, 0), (0.5, 1, 0)], float)  # a cube, its floor in two pieces
    halves = [(0, 3, 9, 8), (8, 9, 2, 1)]
    rest = [(4, 5, 6, 7), (0, 8, 1, 5, 4), (1, 2, 6, 5), (2, 9, 3, 7, 6), (3, 0, 4, 7)]
    assert concave(points, [*halves, *rest]) == 0.0
    assert concave(np.array(CUBE, float), [list(side) for side in CELL_TYPES["hex"].faces]) < -0.7


def concave(points, sides):
    table = Faces(np.cumsum([0, *map(len, sides)]), np.concatenate(sides), [0] * len(sides), [-1] * len(sides))
    block = CellBlock("polyhedron", [0], offsets=[0, len(sides)], items=np.arange(len(sides)))
    return columns(Mesh(points, (block,), faces=table)).concavity[0]


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rotation_changes_nothing_but_what_looks_along_the_axes(seed):
    rng = np.random.default_rng(seed)
    cells = np.array(CUBE) + rng.uniform(-0.25, 0.25, (30, 8, 3))
    here, there = (
        named(as_polyhedra("hex", cells)),
        named(as_polyhedra("hex", cells @ Rotation.random(rng=rng).as_matrix().T)),
    )
    for id_, column in here.items():
        if id_ != "openfoam.aspect_ratio":
            np.testing.assert_allclose(there[id_], column, rtol=1e-9, atol=1e-9, err_msg=id_)


@pytest.mark.parametrize("exponent", [-300, -100, 100, 300])
def test_cells_of_any_size_score_the_same_bits(exponent):
    cells = np.array(CUBE) + np.random.default_rng(1).uniform(-0.25, 0.25, (30, 8, 3))
    here, there = named(as_polyhedra("hex", cells)), named(as_polyhedra("hex", cells * 2.0**exponent))
    for id_, column in here.items():
        power = 3 * exponent if id_ in ("volume", "openfoam.min_pyramid") else 0
        if abs(power) < 900:
            np.testing.assert_array_equal(there[id_], column * 2.0**power, err_msg=id_)


def test_what_needs_the_metrics_of_fixed_types_agrees_with_them():
    mesh = hybrid_mesh(1, n=4, jitter=0.2)
    ids = [id_ for id_ in COLUMN if id_ in METRICS]
    assert "volume" in ids
    values = measure(mesh, ids, threads=1).values
    for block in mesh.blocks:
        found = named(as_polyhedra(block.type, mesh.points[block.nodes]))
        for id_ in ids:
            np.testing.assert_allclose(found[id_], values[id_][block.type], rtol=1e-11, atol=1e-12, err_msg=id_)
