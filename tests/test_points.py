"""Metrics of points: CFX's control volumes, and valence."""

import json
import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshwright.audit.connectivity import faces, faces_of_cells
from meshwright.audit.geometry import total_volume
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Faces, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.metrics.dual import dual_tables, gather_block
from meshwright.audit.metrics.dual_fields import SECTOR_MIN, new_fields

hybrid_mesh = runpy.run_path(str(Path(__file__).parent / "hybrid.py"))["hybrid_mesh"]

POINT_METRICS = tuple(id_ for id_, row in METRICS.items() if row.entity == "point")
CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def values(mesh, *ids, threads=1):
    found = measure(mesh, ids or POINT_METRICS, threads=threads).values
    return {id_: by_key["point"] for id_, by_key in found.items() if by_key}


def mesh_of(points, cells):
    kinds = {}
    for row, (kind, nodes) in enumerate(cells):
        kinds.setdefault(kind, []).append((row, nodes))
    blocks = [CellBlock(k, [r for r, _ in of], np.array([n for _, n in of])) for k, of in kinds.items()]
    return Mesh(np.array(points, dtype=float), tuple(blocks))


def as_polyhedra(mesh):
    """The same mesh told by its faces alone."""
    found = faces(mesh)
    own = Faces(found.offsets, found.nodes, found.owner, found.neighbour)
    offsets, items = faces_of_cells(mesh)
    return Mesh(
        mesh.points, (CellBlock("polyhedron", np.arange(mesh.n_cells), offsets=offsets, items=items),), faces=own
    )


def test_the_reference_meshes_have_their_golden_values(shared):
    golden = json.loads((shared / "reference" / "golden.json").read_text())
    names = {"connectivity_number": "cfx.connectivity_number"}
    checked = 0
    for case in golden["meshes"]:
        if "nodes_values" not in case:
            continue
        got = values(mesh_of(case["points"], case["cells"]))
        for point, wanted in enumerate(case["nodes_values"]):
            for key, value in wanted.items():
                assert got[names.get(key, key)][point] == pytest.approx(float(value), rel=1e-9), (case["name"], key)
                checked += 1
    assert checked > 200


def test_two_bricks_of_lengths_one_and_three_expand_by_three_where_they_meet():
    points = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1, 4)]
    mesh = mesh_of(points, [("hex", [0, 1, 4, 3, 6, 7, 10, 9]), ("hex", [1, 2, 5, 4, 7, 8, 11, 10])])
    got = values(mesh)
    assert got["cfx.expansion_factor"].tolist() == pytest.approx([1, 3, 1] * 4)
    assert got["cfx.element_volume_ratio"].tolist() == pytest.approx([1, 3, 1] * 4)
    # the dual faces of the long brick are 1/2 x 1/2 across its length and 3/2 x 1/2 along it
    assert got["cfx.aspect_ratio"].tolist() == pytest.approx([1, 3, 3] * 4)
    assert got["cfx.orthogonality_angle"].tolist() == pytest.approx([90] * 12)
    assert got["valence"].tolist() == [3, 4, 3] * 4
    assert got["cfx.connectivity_number"].tolist() == [1, 2, 1] * 4


def test_a_sheared_brick_has_dual_faces_at_45_degrees_to_their_edges():
    mesh = mesh_of([(x + z, y, z) for x, y, z in CUBE], [("hex", range(8))])
    got = values(mesh)
    # edges along z lean by 45 degrees against the dual faces across them, and the faces across x lean likewise
    assert got["cfx.orthogonality_angle_min"].tolist() == pytest.approx([45] * 8)
    # two dual faces of area sqrt(2)/4 and 1/4 lean, one of area 1/4 does not: across x sqrt(2)/4, y 1/4, z 1/4
    weights = np.array([math.sqrt(2), 1, 1])
    mean = weights @ (45, 90, 45) / weights.sum()
    assert sorted(set(np.round(got["cfx.orthogonality_angle"], 9))) == pytest.approx([mean])


def test_the_sectors_of_all_points_fill_the_mesh():
    for seed in range(3):
        mesh = hybrid_mesh(seed)
        total = 0.0
        for block in mesh.blocks:
            fields = new_fields(len(mesh.points))
            own = np.arange(block.nodes.size).reshape(block.nodes.shape)  # no two cells share a point
            fields = new_fields(block.nodes.size)
            gather_block(mesh.points[block.nodes.ravel()], own, dual_tables(block.type), fields)
            total += fields[:, SECTOR_MIN].sum()
        assert total == pytest.approx(total_volume(mesh), rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_cells_told_by_their_faces_score_what_they_score_by_their_nodes(seed):
    mesh = hybrid_mesh(seed)
    plain, told = values(mesh), values(as_polyhedra(mesh))
    assert plain.keys() == told.keys() == set(POINT_METRICS)
    for id_ in plain:
        np.testing.assert_allclose(told[id_], plain[id_], rtol=1e-10, atol=1e-10, err_msg=id_)


def test_motion_scale_and_mirroring_change_nothing():
    mesh = hybrid_mesh(1)
    here = values(mesh)
    turn = Rotation.from_euler("xyz", (0.3, -1.1, 2.0)).as_matrix()
    for points in (mesh.points @ turn.T, mesh.points + 1e4, mesh.points * 2.0**-300, mesh.points * (1, 1, -1)):
        there = values(Mesh(points, mesh.blocks))
        for id_ in here:
            np.testing.assert_allclose(there[id_], here[id_], rtol=1e-8, atol=1e-8, err_msg=id_)


def test_one_and_two_threads_give_the_same_bytes():
    mesh = hybrid_mesh(2)
    one, two = values(mesh, threads=1), values(mesh, threads=2)
    assert all(one[id_].tobytes() == two[id_].tobytes() for id_ in one)


def test_an_inverted_sector_expands_without_bound():
    pushed = [*CUBE[:6], (0.2, 0.2, 0.2), CUBE[7]]  # the far corner pushed past the middle
    mesh = mesh_of(pushed, [("hex", range(8))])
    assert math.isinf(values(mesh, "cfx.expansion_factor")["cfx.expansion_factor"].max())


def test_a_collapsed_edge_has_no_angle_but_a_ratio_without_bound():
    wedge = [*CUBE[:6], (1, 0, 1), (0, 0, 1)]  # the far top edge pulled onto the near one
    got = values(mesh_of(wedge, [("hex", range(8))]))
    assert np.isnan(got["cfx.face_angle_min"][[5, 6]]).all()
    assert np.isinf(got["cfx.edge_length_ratio"][[5, 6]]).all()
    assert np.isfinite(got["cfx.face_angle_min"][[0, 1, 2, 3]]).all()


def test_points_around_a_coordinate_that_is_not_finite_have_no_number():
    points = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)]
    points[0] = (math.nan, 0, 0)
    mesh = mesh_of(points, [("hex", [0, 1, 4, 3, 6, 7, 10, 9]), ("hex", [1, 2, 5, 4, 7, 8, 11, 10])])
    got = values(mesh, "cfx.expansion_factor", "cfx.orthogonality_angle", "cfx.face_angle_max")
    for id_ in got:
        assert np.isnan(got[id_][[0, 1, 3, 4, 6, 7, 9, 10]]).all(), id_
        assert np.isfinite(got[id_][[2, 5, 8, 11]]).all(), id_


def test_a_flat_mesh_has_angles_and_valence_but_no_control_volumes():
    points = [(x, y, 0) for y in range(3) for x in range(3)]
    quads = [("quad", [a, a + 1, a + 4, a + 3]) for a in (0, 1, 3, 4)]
    flat = Mesh(np.array(points, dtype=float), mesh_of(points, quads).blocks, dimension=2)
    got = values(flat)
    assert "cfx.expansion_factor" not in got
    assert got["valence"].tolist() == [2, 3, 2, 3, 4, 3, 2, 3, 2]
    assert got["cfx.face_angle_max"].tolist() == pytest.approx([90] * 9)


def test_a_dart_has_its_reflex_corner_at_the_point_and_points_without_a_cell_have_nothing():
    mesh = Mesh(np.array([(0, 0, 0), (1, 1, 0), (2, 0, 0), (1, 3, 0), (9, 9, 0)], dtype=float),
                (CellBlock("quad", [0], [[0, 1, 2, 3]]),), dimension=2)  # fmt: skip
    got = values(mesh, "cfx.face_angle_max", "cfx.face_angle_min")
    assert got["cfx.face_angle_max"][1] == pytest.approx(270)
    assert got["cfx.face_angle_min"][1] == pytest.approx(270)
    assert np.isnan(got["cfx.face_angle_max"][4])
