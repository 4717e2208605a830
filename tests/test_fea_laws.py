"""The checks of FEA systems: laws, and a second opinion by plain definitions."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from meshwright.audit.cells import CELL_TYPES, LINEAR_TYPES
from meshwright.audit.metrics import METRICS, structural

FORMS = runpy.run_path(str(Path(__file__).with_name("test_fea_metrics.py")))
measured, box, IDS, SHAPES = FORMS["measured"], FORMS["box"], FORMS["IDS"], FORMS["SHAPES"]
SQUARE, REGULAR_TET = FORMS["SQUARE"], FORMS["REGULAR_TET"]
POWER = {"L": 1, "L2": 2, "L3": 3}
ROOT3 = math.sqrt(3)


def random_cells(type_name, seed, n=50):
    shape = np.array(SHAPES[type_name], float)
    return shape + np.random.default_rng(seed).uniform(-0.25, 0.25, (n, *shape.shape))


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(1e-9, 1e9))
def test_rotation_and_scale_change_nothing_but_sizes(type_name, seed, scale):
    cells = random_cells(type_name, seed)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    here, there = measured(type_name, cells), measured(type_name, scale * cells @ turn.T)
    for id_, values in here.items():
        factor = scale ** POWER.get(METRICS[id_].unit, 0)
        np.testing.assert_allclose(there[id_] / factor, values, rtol=1e-9, atol=1e-9, err_msg=id_)


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
def test_translation_by_exact_offsets_gives_the_same_bits(type_name):
    cells = np.round(random_cells(type_name, 3) * 2**30) / 2**30
    here, there = measured(type_name, cells), measured(type_name, cells + [4096.0, -777.0, 12.0])
    for id_, values in here.items():
        assert values.tobytes() == there[id_].tobytes(), id_


ROTATIONS = {
    "tri": [(1, 2, 0)], "quad": [(1, 2, 3, 0)], "tet": [(1, 2, 0, 3), (3, 0, 2, 1)], "pyramid": [(1, 2, 3, 0, 4)],
    "wedge": [(1, 2, 0, 4, 5, 3), (3, 5, 4, 0, 2, 1)], "hex": [(1, 2, 3, 0, 5, 6, 7, 4), (0, 4, 5, 1, 3, 7, 6, 2)],
}  # fmt: skip


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
def test_the_cell_may_be_numbered_from_any_corner(type_name):
    cells = random_cells(type_name, 8)
    want = measured(type_name, cells)
    for order in ROTATIONS[type_name]:
        got = measured(type_name, cells[:, list(order)])
        for id_, values in want.items():
            np.testing.assert_allclose(got[id_], values, rtol=1e-9, atol=1e-9, err_msg=id_)


def test_random_cells_never_give_nan():
    for type_name in LINEAR_TYPES:
        cells = np.random.default_rng(11).uniform(-1, 1, (20_000, len(SHAPES[type_name]), 3))
        for id_, values in measured(type_name, cells).items():
            assert not np.isnan(values).any(), (type_name, id_)


def test_thin_cells_are_neither_flat_nor_undefined():
    thin = np.array(box(1, 1, 1), float) * [1, 1, 1e-9]
    got = {id_: float(v[0]) for id_, v in measured("hex", thin).items()}
    assert got["ansys.aspect_ratio"] == pytest.approx(1e9)
    assert got["icem.max_warp"] == got["hm.skew"] == got["ansys.parallel_deviation"] == 0.0
    assert got["ansys.jacobian_ratio"] == got["hm.jacobian_gauss"] == 1.0


# A second opinion: the definitions, one cell at a time, without the shortcuts of the kernels.


def unit(v):
    return v / np.linalg.norm(v)


def angle(u, v):
    return math.degrees(math.atan2(np.linalg.norm(np.cross(u, v)), np.dot(u, v)))


def rectangles(m, s):
    """Ratios of the rectangles on two crossing lines: along one, as wide as the other reaches across it."""
    across = np.linalg.norm(s - np.dot(s, unit(m)) * unit(m))
    along = np.linalg.norm(m)
    return max(along / across, across / along)


def face_aspect(points):
    if len(points) == 3:
        worst = 0.0
        for k in range(3):
            a, b, c = points[k], points[(k + 1) % 3], points[(k + 2) % 3]
            median, line = (b + c) / 2 - a, (c - b) / 2
            worst = max(worst, rectangles(median, line), rectangles(line, median))
        return worst / ROOT3
    a, b, c, d = points
    first, second = (b + c - a - d) / 2, (c + d - a - b) / 2
    return max(rectangles(first, second), rectangles(second, first))


def face_parallel(points):
    a, b, c, d = points
    return max(angle(b - a, c - d), angle(c - b, d - a))


def face_skew(points):
    if len(points) == 3:
        acute = []
        for k in range(3):
            a, b, c = points[k], points[(k + 1) % 3], points[(k + 2) % 3]
            between = angle((b + c) / 2 - a, (c - b) / 2)
            acute.append(min(between, 180 - between))
        return 90 - min(acute)
    a, b, c, d = points
    between = angle(b + c - a - d, c + d - a - b)
    return abs(90 - between)


def face_warp(points):
    a, b, c, d = points
    one = angle(np.cross(b - a, c - a), np.cross(c - a, d - a))
    return max(one, angle(np.cross(b - a, d - a), np.cross(c - b, d - b)))


def sections(type_name, x):
    """Cross-sections through the middles of edges."""
    mid = lambda a, b: (x[a] + x[b]) / 2  # noqa: E731
    if type_name == "hex":
        return [
            [mid(0, 4), mid(1, 5), mid(2, 6), mid(3, 7)],
            [mid(0, 1), mid(3, 2), mid(7, 6), mid(4, 5)],
            [mid(0, 3), mid(1, 2), mid(5, 6), mid(4, 7)],
        ]
    if type_name == "wedge":
        return [
            [mid(0, 3), mid(1, 4), mid(2, 5)],
            [mid(0, 1), mid(1, 2), mid(4, 5), mid(3, 4)],
            [mid(1, 2), mid(2, 0), mid(5, 3), mid(4, 5)],
            [mid(2, 0), mid(0, 1), mid(3, 4), mid(5, 3)],
        ]
    if type_name == "pyramid":
        base = [(k, (k + 1) % 4, e) for k in range(4) for e in range(4) if e not in (k, (k + 1) % 4)]
        return [[x[a], x[b], mid(e, 4)] for a, b, e in base]
    pairs = [(0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 0, 2), (2, 3, 0, 1)]
    return [[x[a], x[b], mid(c, d)] for a, b, c, d in pairs]


def by_definition(type_name, x):
    faces = [x[list(face)] for face in CELL_TYPES[type_name].faces]
    quads = [face for face in faces if len(face) == 4]
    edges = lambda face: [np.linalg.norm(face[k] - face[k - 1]) for k in range(len(face))]  # noqa: E731
    area = lambda f: np.linalg.norm(sum(np.cross(f[k - 1], f[k]) for k in range(len(f)))) / 2  # noqa: E731
    found = {
        "ansys.aspect_ratio_faces": max(map(face_aspect, faces)),
        "hm.skew": max(map(face_skew, faces)),
        "hm.aspect": max(max(edges(face)) / min(edges(face)) for face in faces),
    }
    if quads:
        found["ansys.parallel_deviation_faces"] = max(map(face_parallel, quads))
        found["icem.max_warp"] = max(map(face_warp, quads))
        opposite = [edges(face) for face in quads]
        found["femap.taper"] = max(max(e[k] / e[k + 2], e[k + 2] / e[k]) for e in opposite for k in (0, 1))
    if type_name not in ("tri", "quad"):
        cuts = sections(type_name, x)
        found["ansys.aspect_ratio"] = max(found["ansys.aspect_ratio_faces"], *map(face_aspect, cuts))
        if type_name in ("wedge", "hex"):
            cut = max(face_parallel(points) for points in cuts if len(points) == 4)
            found["ansys.parallel_deviation"] = max(found["ansys.parallel_deviation_faces"], cut)
        volume = float(measured(type_name, x, ("volume",))["volume"][0])
        found["femap.explicit"] = abs(volume) / max(map(area, faces))
    if type_name == "tet":
        heights = [3 * abs(volume) / area(face) for face in faces]
        longest = max(np.linalg.norm(x[a] - x[b]) for a, b in CELL_TYPES["tet"].edges)
        found["hm.tet_collapse"] = min(h / math.sqrt(area(f)) for h, f in zip(heights, faces, strict=True)) / 1.24
        found["femap.tet_collapse"] = max(heights) / min(heights)
        found["nastran.tetraar"] = longest / min(heights)
        found["simlab.collapse_ratio"] = min(heights) / longest
    return found


@pytest.mark.parametrize("type_name", LINEAR_TYPES)
def test_the_kernels_agree_with_the_definitions(type_name):
    cells = random_cells(type_name, 21, n=40)
    got = measured(type_name, cells, (*IDS, *(("volume",) if type_name not in ("tri", "quad") else ())))
    for row, x in enumerate(cells):
        for id_, wanted in by_definition(type_name, x).items():
            assert got[id_][row] == pytest.approx(wanted, rel=1e-9, abs=1e-9), (id_, row)


def test_numbers_of_one_quantity_agree_where_two_systems_have_it():
    rng = np.random.default_rng(4)
    quads = np.array(SQUARE, float) + rng.uniform(-0.2, 0.2, (200, 4, 3))
    quad = measured("quad", quads, (*IDS, "gambit.diagonal_ratio", "gambit.stretch", "icem.determinant"))
    np.testing.assert_allclose(quad["nastran.skew"], 90 - quad["hm.skew"], rtol=1e-12)
    np.testing.assert_allclose(quad["seed.quad_diag_ratio_0_1"], 1 / quad["gambit.diagonal_ratio"], rtol=1e-12)
    np.testing.assert_allclose(quad["ideas.stretch"], 1 - quad["gambit.stretch"], rtol=1e-12)
    np.testing.assert_allclose(quad["ansys.jacobian_ratio"], 1 / quad["icem.determinant"], rtol=1e-12)
    plane = quads * [1, 1, 0]
    flat = measured("quad", plane)
    np.testing.assert_allclose(flat["femap.alternate_taper"], flat["hm.taper"], rtol=1e-9)
    tets_ = np.array(REGULAR_TET, float) + rng.uniform(-0.2, 0.2, (200, 4, 3))
    tet = measured("tet", tets_)
    np.testing.assert_allclose(tet["simlab.collapse_ratio"], 1 / tet["nastran.tetraar"], rtol=1e-12)
    hexes = np.array(box(1, 1, 1), float) + rng.uniform(-0.2, 0.2, (200, 8, 3))
    hexa = measured("hex", hexes, (*IDS, "volume", "angle.max"))
    np.testing.assert_allclose(hexa["volume_gauss2"], hexa["volume"], rtol=1e-12)
    assert hexa["ansys.max_corner_angle"].tobytes() == hexa["angle.max"].tobytes()


def test_checks_without_a_row_say_why_and_have_none():
    assert not structural.LEFT_OUT.keys() & METRICS.keys()
    assert all(len(reason) > 20 for reason in structural.LEFT_OUT.values())
    for name, row, system in (
        ("hm.jacobian_corner", "icem.determinant", "HyperMesh"),
        ("pointwise.quad_aspect", "gambit.aspect_ratio", "Pointwise"),
        ("hm.vol_aspect", "nastran.tetraar", "HyperMesh"),
        ("hm.vol_skew", "gambit.equisize_skew", "HyperMesh"),
        ("femap.nastran_warping", "nastran.warp", "FEMAP"),
        ("patran.tri_skew", "hm.skew", "Patran"),
        ("patran.warp", "salome.warp", "Patran"),
    ):
        assert name in structural.LEFT_OUT
        assert any(text.startswith(system) for text in METRICS[row].systems), row


def test_sections_are_never_better_than_faces():
    for type_name in ("tet", "pyramid", "wedge", "hex"):
        got = measured(type_name, random_cells(type_name, 2))
        assert (got["ansys.aspect_ratio"] >= got["ansys.aspect_ratio_faces"]).all()
        if type_name in ("wedge", "hex"):
            assert (got["ansys.parallel_deviation"] >= got["ansys.parallel_deviation_faces"]).all()
