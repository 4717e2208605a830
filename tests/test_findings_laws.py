"""Laws: turning, moving, scaling and renumbering a mesh does not change what is found in it."""

import runpy
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.connectivity import faces
from meshwright.audit.findings import face_handedness, run_checks
from meshwright.audit.mesh import CellBlock, Faces, Mesh

hybrid_mesh = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))["hybrid_mesh"]
MIRROR = {"tet": [0, 2, 1, 3], "pyramid": [0, 3, 2, 1, 4], "wedge": [3, 4, 5, 0, 1, 2], "hex": [4, 5, 6, 7, 0, 1, 2, 3]}


def damaged(seed):
    """A hybrid mesh with some cells reversed, a point moved too far, a cell doubled and a point nobody uses."""
    rng = np.random.default_rng(seed)
    mesh = hybrid_mesh(seed)
    points = np.concatenate([mesh.points, [[9.0, 9.0, 9.0]]])
    for p in rng.choice(len(mesh.points), 2, replace=False):
        points[p] += rng.uniform(-1.5, 1.5, 3)
    blocks = []
    for block in mesh.blocks:
        nodes = block.nodes.copy()
        for c in np.flatnonzero(rng.random(len(nodes)) < 0.1):
            nodes[c] = nodes[c][MIRROR[block.type]]
        blocks.append(CellBlock(block.type, block.rows, nodes))
    last = blocks[-1]
    blocks[-1] = CellBlock(
        last.type,
        np.append(last.rows, mesh.n_cells),
        np.concatenate([last.nodes, last.nodes[rng.integers(len(last), size=1)]]),
    )
    return Mesh(points, tuple(blocks))


EXEMPT = {
    "size-jump": "the size of a cell is that of its box, which turns with the axes",
    "misplaced-pyramids": "which of two copies of a cell lies behind a face depends on their order",
    "delaunay-violations": "the same",
    "blocks": "the same",
}


def found_in(mesh, names=None):
    """code -> the cells concerned by their names, or how many entities; copies are named by whichever comes later."""
    names = np.arange(mesh.n_cells) if names is None else names
    return {
        f.code: sorted(names[f.rows].tolist()) if f.entity == "cell" and f.code != "duplicate-cells" else f.count
        for f in run_checks(mesh)
        if f.code not in EXEMPT
    }


def with_points(mesh, points):
    return Mesh(points, mesh.blocks, faces=mesh.faces)


def with_own_faces(mesh, rng):
    f = faces(mesh)
    nodes = f.nodes.copy()
    for row in rng.choice(len(f), 3, replace=False):
        nodes[f.offsets[row] : f.offsets[row + 1]] = nodes[f.offsets[row] : f.offsets[row + 1]][::-1]
    return Mesh(mesh.points, mesh.blocks, faces=Faces(f.offsets, nodes, f.owner, f.neighbour))


def rotation(rng):
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), own=st.booleans(), power=st.integers(-40, 40))
def test_turning_moving_and_scaling_change_no_finding(seed, own, power):
    rng = np.random.default_rng(seed)
    mesh = damaged(seed)
    mesh = with_own_faces(mesh, rng) if own else mesh
    before = found_in(mesh)
    assert "duplicate-cells" in before
    assert "unused-points" in before
    assert found_in(with_points(mesh, mesh.points @ rotation(rng))) == before
    assert found_in(with_points(mesh, mesh.points + 1e4 * rng.uniform(-1, 1, 3))) == before
    assert found_in(with_points(mesh, mesh.points * 10.0**power)) == before
    per_face, per_cell = face_handedness(mesh)
    moved = face_handedness(with_points(mesh, mesh.points @ rotation(rng) * 10.0**power))
    assert np.array_equal(moved[0], per_face)
    assert np.array_equal(moved[1], per_cell)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_renumbering_cells_and_points_changes_no_finding(seed):
    rng = np.random.default_rng(seed)
    mesh = damaged(seed)
    point_at = rng.permutation(len(mesh.points))  # new row -> old row
    row_of = np.argsort(point_at)  # old row -> new row
    cell_at = rng.permutation(mesh.n_cells)
    place = np.argsort(cell_at)
    blocks = []
    for block in mesh.blocks:
        order = np.argsort(place[block.rows])
        blocks.append(CellBlock(block.type, place[block.rows][order], row_of[block.nodes][order]))
    again = Mesh(mesh.points[point_at], tuple(blocks))
    assert found_in(again, names=cell_at) == found_in(mesh)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_mirroring_a_sound_mesh_is_one_convention_and_mirroring_it_twice_is_nothing(seed):
    mesh = hybrid_mesh(seed)
    mirrored = with_points(mesh, mesh.points * [-1.0, 1.0, 1.0])
    found, plain = found_in(mirrored), found_in(mesh)
    assert found.pop("node-order-convention") == list(range(mesh.n_cells))
    assert found == plain
    assert found_in(with_points(mesh, mesh.points * [-1.0, -1.0, 1.0])) == plain
    assert [f.code for f in run_checks(mesh) if f.severity != "info"] == []
