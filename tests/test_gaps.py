"""Points that nearly coincide: cracks between the merge tolerances of CAD and of meshers, and gaps that are meant."""

import numpy as np
import pytest

from meshwright.audit.findings import Options, run_checks
from meshwright.audit.mesh import CellBlock, Mesh


def found(mesh, code="near-points", **options):
    return next((f for f in run_checks(mesh, options=Options(**options)) if f.code == code), None)


def two_sheets(gap, n=4, edge=1.0):
    """Two square sheets of n x n quads in space, side by side, `gap` apart."""
    x, y = np.meshgrid(np.arange(n + 1) * edge, np.arange(n + 1) * edge)
    one = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    at = np.arange(x.size).reshape(n + 1, n + 1)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    points = np.concatenate([one, one + [n * edge + gap, 0, 0]])
    nodes = np.concatenate([quads, quads + len(one)])
    return Mesh(points, (CellBlock("quad", np.arange(len(nodes)), nodes),))


def bricks(n, low, high):
    """(points, hexes) of a block."""
    axes = [np.linspace(a, b, k + 1) for a, b, k in zip(low, high, n, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    row = np.arange(len(points)).reshape(np.array(n) + 1)
    p, q = slice(None, -1), slice(1, None)
    order = [(p, p, p), (q, p, p), (q, q, p), (p, q, p), (p, p, q), (q, p, q), (q, q, q), (p, q, q)]
    return points, np.stack([row[c].ravel() for c in order], axis=1)


def joined(*blocks):
    points = np.concatenate([p for p, _ in blocks])
    start = np.cumsum([0, *(len(p) for p, _ in blocks)])
    nodes = np.concatenate([c + s for (_, c), s in zip(blocks, start, strict=False)])
    return Mesh(points, (CellBlock("hex", np.arange(len(nodes)), nodes),))


def plate(thickness):
    """A block of 6 x 6 x 6 units around an empty slit of 4 x 4 cells, `thickness` wide, whose rim is closed."""
    points, nodes = bricks((6, 6, 6), (0, 0, 0), (6, 6, 6))
    inner = np.flatnonzero((points[:, 2] == 3) & (np.abs(points[:, :2] - 3) < 2).all(axis=1))  # 9 points are doubled
    twin = np.arange(len(points))
    twin[inner] = len(points) + np.arange(9)
    above = points[nodes].mean(axis=1)[:, 2] > 3
    nodes = np.where(above[:, None], twin[nodes], nodes)
    points = np.concatenate([points, points[inner] + [0, 0, thickness / 2]])
    points[inner, 2] -= thickness / 2
    return Mesh(points, (CellBlock("hex", np.arange(len(nodes)), nodes),))


def test_a_gap_of_a_twentieth_of_a_millimetre_is_a_crack_that_cad_does_not_merge_and_a_mesher_does():
    mesh = two_sheets(0.05)  # 5 pairs of points, edges of 1 mm
    finding = found(mesh, unit=1.0)
    assert (finding.severity, finding.entity, finding.count) == ("warning", "point", 10)
    assert finding.detail["cracks"] == finding.detail["pairs"] == 5
    # not merged at 0.001, merged at 0.1
    bands = {band["name"]: band for band in finding.detail["bands"]}
    assert (bands["CAD"]["high"], bands["CAD"]["pairs"]) == (0.001, 0)
    assert (bands["between"]["high"], bands["between"]["pairs"]) == (0.1, 5)
    assert (bands["mesher"]["high"], bands["mesher"]["pairs"]) == (0.5, 0)
    assert finding.detail["by_millimetres"] == [{"low": 0.01, "high": 0.1, "pairs": 5}]
    assert finding.detail["merge_tolerance"] == pytest.approx(0.05)
    assert finding.detail["list"][0]["points"] in [[k, 25 + k - 4] for k in (4, 9, 14, 19, 24)]


@pytest.mark.parametrize(
    ("gap", "unit", "severity"),
    [
        (0.05, 1.0, "warning"),
        (0.0005, 1.0, "info"),  # one point to CAD
        (0.05, 1000.0, "info"),  # 50 mm
        (0.05, 0.01, "info"),  # half a micrometre
        (0.0003, 1000.0, "warning"),  # 0.3 mm in a file in metres
        (0.25, 1.0, "warning"),  # a mesher's band
    ],
)
def test_the_bands_are_in_millimetres_whatever_the_unit_of_the_file(gap, unit, severity):
    assert found(two_sheets(gap), unit=unit).severity == severity


def test_without_a_unit_rims_closer_than_an_eighth_of_their_edges_are_cracks():
    assert found(two_sheets(0.05)).severity == "warning"
    assert found(two_sheets(0.05)).detail["by_share_of_edge"] == [{"low": 0.01, "high": 0.1, "pairs": 5}]
    assert found(two_sheets(0.15)) is None
    assert "bands" not in found(two_sheets(0.05)).detail


def test_points_exactly_in_one_place_are_for_another_check_and_no_gap():
    mesh = two_sheets(0.0)
    assert found(mesh) is None
    assert found(mesh, "duplicate-points").count == 5


def test_points_one_rounding_apart_are_told_and_no_crack():
    mesh = two_sheets(1e-12)
    finding = found(mesh)
    assert finding.severity == "info"
    assert found(mesh, "duplicate-points") is None


def test_loose_triangles_of_a_thin_box_have_no_gaps_where_they_lie_on_each_other():
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    loose = (corners * [1, 1, 0.05])[np.array(quads)].reshape(-1, 3)
    mesh = Mesh(loose, (CellBlock("quad", np.arange(6), np.arange(24).reshape(6, 4)),))
    assert found(mesh) is None
    assert found(mesh, "unmerged-interface").count == 24


def test_a_decade_begins_with_its_power_of_ten():
    finding = found(two_sheets(0.01 * 2**-4, edge=2**-4))  # gap over edge: 0.01 to the last digit or next to it
    (row,) = finding.detail["by_share_of_edge"]
    share = finding.detail["list"][0]["share_of_edge"]
    assert row["low"] <= share < row["high"]


def test_both_sides_of_a_plate_in_a_flow_are_no_crack_and_a_hair_between_two_cells_is():
    # only the points in the middle of the slit are further than one face from each other on the surface
    told = found(plate(0.05))
    assert (told.severity, told.count, told.detail["cracks"]) == ("info", 2, 0)
    torn = found(plate(0.0005))
    assert (torn.severity, torn.count, torn.detail["cracks"]) == ("warning", 2, 1)


def test_two_blocks_with_a_crack_between_them_are_found_point_by_point():
    left = bricks((3, 2, 2), (0, 0, 0), (3, 2, 2))
    right = bricks((3, 2, 2), (3.0005, 0, 0), (6.0005, 2, 2))
    finding = found(joined(left, right))
    assert (finding.severity, finding.count, finding.detail["pairs"]) == ("warning", 18, 9)
    assert finding.detail["longest"] == pytest.approx(0.0005)


def test_the_two_sides_of_a_thin_sheet_of_solid_cells_are_no_gap_whichever_way_its_file_turns_them():
    points, nodes = bricks((4, 4, 1), (0, 0, 0), (4, 4, 0.05))
    assert found(joined((points, nodes)), unit=1.0) is None
    mirrored = nodes[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    assert found(joined((points, mirrored)), unit=1.0) is None
    left, right = bricks((3, 2, 2), (0, 0, 0), (3, 2, 2)), bricks((3, 2, 2), (3.0005, 0, 0), (6.0005, 2, 2))
    turned = [(p, n[:, [4, 5, 6, 7, 0, 1, 2, 3]]) for p, n in (left, right)]
    assert found(joined(*turned)).count == 18


def test_fine_layers_sharp_tips_and_slivers_are_no_gaps():
    # layers of 1e-5 along edges of 1: close points have an edge between them, or are further than their edges
    layers = np.cumsum([0.0, *(1e-5 * 1.2 ** np.arange(30))])
    points, nodes = bricks((3, 3, 30), (0, 0, 0), (3, 3, 1))
    points[:, 2] = layers[np.rint(points[:, 2] * 30).astype(int)]
    assert found(joined((points, nodes)), unit=1.0) is None
    # a wedge of two degrees: its sides close in on the tip
    x = np.arange(1.0, 9.0)
    upper, lower = [np.column_stack([x, side * x * np.tan(np.radians(1.0)), 0 * x]) for side in (1, -1)]
    flat = np.concatenate([[(0, 0, 0)], upper, lower])
    quads = [[9 + i, 10 + i, 2 + i, 1 + i] for i in range(7)]
    blocks = (CellBlock("tri", [0], [[0, 9, 1]]), CellBlock("quad", np.arange(1, 8), quads))
    assert found(Mesh(flat, blocks, dimension=2)) is None


@pytest.mark.parametrize("scale", [1e-300, 1e-20, 1e-3, 1.0, 1e20, 1e300])
def test_shares_of_edges_do_not_depend_on_the_unit_of_the_file(scale):
    mesh = two_sheets(0.05)
    finding = found(Mesh(mesh.points * scale, mesh.blocks))
    assert (finding.severity, finding.count) == ("warning", 10)
    assert finding.detail["list"][0]["share_of_edge"] == pytest.approx(0.05)


def test_points_without_a_place_are_no_pairs():
    mesh = two_sheets(0.05)
    points = mesh.points.copy()
    points[[4, 30]] = [[np.nan], [np.inf]]  # of two pairs
    finding = found(Mesh(points, mesh.blocks))
    assert finding.count == 6
