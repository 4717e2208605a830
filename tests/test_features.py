"""Classes of points, corners and curves of the geometry, and edges that need not be kept."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.findings import Options, run_checks
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.node_classes import CORNER, CURVE, SURFACE, UNUSED, VOLUME, features, node_classes

meshes = runpy.run_path(str(Path(__file__).parent.parent / "benchmarks" / "meshes.py"))
hybrid_mesh = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))["hybrid_mesh"]


def found(mesh, **options):
    here = [f for f in run_checks(mesh, options=Options(**options)) if f.code == "features"]
    return here[0] if here else None


def cube(n=4, kind="hex", **more):
    points, nodes = meshes["hex_block"]((n, n, n), jitter=0.2)
    nodes = nodes if kind == "hex" else meshes["split_to_tets"](nodes)
    return Mesh(points, (CellBlock(kind, np.arange(len(nodes)), nodes),), **more)


@pytest.mark.parametrize("kind", ["hex", "tet"])
@pytest.mark.parametrize("n", [1, 4])
def test_a_cube_has_8_corners_12_curves_and_6_surfaces(kind, n):
    mesh = cube(n, kind)
    detail = found(mesh).detail
    assert (detail["corners"], detail["curves"], detail["surfaces"]) == (8, 12, 6)
    assert detail["feature_edges"] == 12 * n
    assert detail["points"] == {
        "corner": 8, "curve": 12 * (n - 1), "surface": 6 * (n - 1) ** 2, "volume": (n - 1) ** 3,
    }  # fmt: skip
    on_hull = (np.isclose(mesh.points, 0) | np.isclose(mesh.points, 1)).sum(axis=1)
    assert node_classes(mesh).tolist() == (3 - on_hull).tolist()


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1.0, 1e150])
def test_neither_scale_nor_turning_nor_the_order_of_the_points_changes_a_class(scale):
    mesh = cube(3)
    rng = np.random.default_rng(1)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    order = rng.permutation(len(mesh.points))
    nodes = np.argsort(order)[mesh.blocks[0].nodes]
    other = Mesh((mesh.points @ turn)[order] * scale, (CellBlock("hex", np.arange(27), nodes),))
    assert node_classes(other).tolist() == node_classes(mesh)[order].tolist()


def solid_cylinder(n, layers=2, **more):
    """Wedges around an axis."""
    t = 2 * math.pi * np.arange(n) / n
    ring = np.vstack([np.stack([np.cos(t), np.sin(t)], axis=1), [(0, 0)]])
    points = np.vstack([np.column_stack([ring, np.full(n + 1, float(z))]) for z in range(layers + 1)])
    nodes = [
        [*(z * (n + 1) + p for p in (n, i, (i + 1) % n)), *((z + 1) * (n + 1) + p for p in (n, i, (i + 1) % n))]
        for z in range(layers)
        for i in range(n)
    ]
    return Mesh(points, (CellBlock("wedge", np.arange(len(nodes)), np.array(nodes)),), **more)


def test_the_caps_of_a_cylinder_are_kept_and_a_line_drawn_along_facets_of_5_degrees_may_be_suppressed():
    n = 72
    seam = CellBlock("line", [0, 1], [[0, n + 1], [n + 1, 2 * (n + 1)]])
    rim = CellBlock("line", [0, 1], [[0, 1], [1, 2]])
    mesh = solid_cylinder(n, boundary=(seam,))
    detail = found(mesh).detail
    assert (detail["corners"], detail["curves"], detail["surfaces"]) == (0, 2, 3)
    assert detail["feature_edges"] == 2 * n
    assert sorted(map(sorted, detail["suppressible"])) == [[0, n + 1], [n + 1, 2 * (n + 1)]]
    assert found(solid_cylinder(n, boundary=(rim,))).detail["suppressible_edges"] == 0
    # at 4 degrees every facet is a surface
    assert found(mesh, feature_angle=4.0).detail["surfaces"] == n + 2
    assert found(mesh, feature_angle=4.0).detail["suppressible_edges"] == 0


def test_the_border_of_two_zones_on_a_flat_side_may_be_suppressed_and_on_an_edge_of_the_body_not():
    points, nodes = meshes["hex_block"]((2, 1, 1), jitter=0.0)
    block = CellBlock("hex", [0, 1], nodes)
    roofs = CellBlock("quad", [0, 1, 2], [nodes[0][4:], nodes[1][4:], nodes[1][[1, 2, 6, 5]]])
    zones = tuple(Zone(name, "group", "", "face", [i]) for i, name in enumerate(("left", "right", "end")))
    mesh = Mesh(points, (block,), boundary=(roofs,), zones=zones)
    detail = found(mesh).detail
    middle = sorted(set(nodes[0][4:]) & set(nodes[1][4:]))
    assert middle in [sorted(pair) for pair in detail["suppressible"]]
    assert sorted(set(nodes[1][4:]) & set(nodes[1][[1, 2, 6, 5]])) not in [sorted(p) for p in detail["suppressible"]]


def test_a_surface_between_two_materials_is_a_surface_and_its_rim_a_curve():
    points, nodes = meshes["hex_block"]((4, 4, 4), jitter=0.0)
    low = np.flatnonzero(points[nodes].mean(axis=1)[:, 2] < 0.5)
    high = np.setdiff1d(np.arange(64), low)
    zones = tuple(Zone(name, "zone", "", "cell", rows) for name, rows in (("low", low), ("high", high)))
    mesh = Mesh(points, (CellBlock("hex", np.arange(64), nodes),), zones=zones)
    classes = node_classes(mesh)
    between = points[:, 2] == 0.5
    on_hull = ((points[:, :2] == 0) | (points[:, :2] == 1)).sum(axis=1)
    assert classes[between & (on_hull == 0)].tolist() == [SURFACE] * 9
    assert set(classes[between & (on_hull == 1)].tolist()) == {CURVE}
    assert set(classes[between & (on_hull == 2)].tolist()) == {CORNER}
    assert found(mesh).detail["surfaces"] == 6 + 4 + 1  # the four sides are cut in two by the plane between


def test_flat_meshes_have_curves_around_them_and_corners_where_they_turn():
    x, y = np.meshgrid(np.arange(4.0), np.arange(3.0))
    row = np.arange(12).reshape(3, 4)
    nodes = np.stack([row[:-1, :-1], row[:-1, 1:], row[1:, 1:], row[1:, :-1]], axis=-1).reshape(-1, 4)
    points = np.vstack([np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), [(9, 9, 0)]])
    mesh = Mesh(points, (CellBlock("quad", range(6), nodes),), dimension=2)
    classes = node_classes(mesh)
    assert classes.tolist() == [
        CORNER, CURVE, CURVE, CORNER, CURVE, SURFACE, SURFACE, CURVE, CORNER, CURVE, CURVE, CORNER, UNUSED,
    ]  # fmt: skip
    assert (found(mesh).detail["curves"], found(mesh).detail["surfaces"]) == (4, 1)
    shell = Mesh(points + [0, 0, 1], mesh.blocks)
    assert node_classes(shell).tolist() == classes.tolist()
    folded = Mesh(points + (points[:, :1] > 1.5) * (points[:, :1] - 1) * [0, 0, 0.3], mesh.blocks)
    assert features(folded).n_surfaces == 2
    assert node_classes(folded)[5] == CURVE
    turned = nodes.copy()
    turned[::2] = turned[::2, ::-1]
    assert node_classes(Mesh(folded.points, (CellBlock("quad", range(6), turned),))).tolist() == (
        node_classes(folded).tolist()
    )


def test_the_border_of_two_materials_in_a_flat_mesh_is_a_curve_and_meets_the_rim_in_corners():
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0))
    row = np.arange(20).reshape(4, 5)
    nodes = np.stack([row[:-1, :-1], row[:-1, 1:], row[1:, 1:], row[1:, :-1]], axis=-1).reshape(-1, 4)
    left = np.flatnonzero(np.arange(12) % 4 < 2)
    zones = tuple(
        Zone(name, "zone", "", "cell", rows) for name, rows in (("a", left), ("b", np.setdiff1d(range(12), left)))
    )
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    mesh = Mesh(points, (CellBlock("quad", range(12), nodes),), dimension=2, zones=zones)
    assert node_classes(mesh)[[2, 7, 12, 17]].tolist() == [CORNER, CURVE, CURVE, CORNER]
    assert node_classes(mesh)[6] == SURFACE
    assert found(mesh).detail["curves"] == 7


def test_nodes_of_higher_order_follow_the_edge_or_face_they_lie_on():
    # nodes of VTK's hexahedron of 27: corners, edges 8 to 19, faces 20 to 25, the middle
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    sides = [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)]
    middles = [corners[list(part)].mean(axis=0) for part in (*edges, *sides, range(8))]
    mesh = Mesh(np.vstack([corners, middles]), (CellBlock("hex27", [0], [range(27)]),))
    assert node_classes(mesh).tolist() == [CORNER] * 8 + [CURVE] * 12 + [SURFACE] * 6 + [VOLUME]
    two = np.vstack([mesh.points, mesh.points + [1, 0, 0]])
    _, first, same = np.unique(two, axis=0, return_index=True, return_inverse=True)
    pair = Mesh(two[first], (CellBlock("hex27", [0, 1], same.reshape(2, 27)),))
    x = pair.points
    wanted = 3 - (np.isin(x[:, 0], (0, 2)).astype(int) + np.isin(x[:, 1], (0, 1)) + np.isin(x[:, 2], (0, 1)))
    assert node_classes(pair).tolist() == wanted.tolist()


@pytest.mark.parametrize("seed", range(3))
def test_the_hull_of_a_hybrid_mesh_is_found_whatever_its_cells(seed):
    mesh = hybrid_mesh(seed, jitter=0.0)
    detail = found(mesh).detail
    assert (detail["corners"], detail["curves"], detail["surfaces"]) == (8, 12, 6)


def test_undefined_points_and_folded_cells_are_classified_without_an_error():
    mesh = cube(2)
    points = mesh.points.copy()
    points[3] = np.nan
    points[5] = np.inf
    assert len(node_classes(Mesh(points, mesh.blocks))) == 27
    flat = Mesh(mesh.points * 0.0, mesh.blocks)
    assert set(node_classes(flat).tolist()) <= {CORNER, CURVE, SURFACE, VOLUME}
    twice = np.vstack([mesh.blocks[0].nodes, mesh.blocks[0].nodes[:2]])
    assert len(node_classes(Mesh(mesh.points, (CellBlock("hex", range(10), twice),)))) == 27
