"""Boundary layers: columns of prisms on walls, measured and compared."""

from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.connectivity import faces
from meshwright.audit.findings import run_checks
from meshwright.audit.findings.columns import wall_columns
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.readers import read

SAMPLES = Path(__file__).parent.parent / "samples"


def found(mesh, code):
    here = [f for f in run_checks(mesh) if f.code == code]
    return here[0] if here else None


def heights(first, growth, n):
    return np.concatenate([[0.0], np.cumsum(first * growth ** np.arange(n))])


def plate(kind, z, nx=4, ny=3, roles=("wall",), scale=1.0):
    """Unit squares (or their halves) carried up through the heights z; zones: floor and roof, as `roles` says."""
    x, y, up = np.meshgrid(np.arange(nx + 1.0), np.arange(ny + 1.0), z, indexing="ij")
    at = np.arange(x.size).reshape(x.shape)
    low = [at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]]
    corners = np.stack([a[:, :, :-1] for a in low] + [a[:, :, 1:] for a in low], axis=-1).reshape(-1, 8)
    floor, roof = (np.stack([a[:, :, k] for a in low], axis=-1).reshape(-1, 4) for k in (0, -1))
    points = np.column_stack([x.ravel(), y.ravel(), up.ravel()]) * scale
    if kind == "wedge":
        corners = np.concatenate([corners[:, [0, 1, 2, 4, 5, 6]], corners[:, [0, 2, 3, 4, 6, 7]]])
        floor, roof = (np.concatenate([a[:, [0, 1, 2]], a[:, [0, 2, 3]]]) for a in (floor, roof))
    sides = (floor, roof)[: len(roles)]
    elements = np.concatenate(sides)
    boundary = (CellBlock("tri" if kind == "wedge" else "quad", range(len(elements)), elements),)
    zones, start = [], 0
    for name, role, side in zip(("floor", "roof"), roles, sides, strict=False):
        zones.append(Zone(name, "patch", role, "face", np.arange(start, start + len(side))))
        start += len(side)
    return Mesh(points, (CellBlock(kind, range(len(corners)), corners),), boundary=boundary, zones=tuple(zones))


def strip(z, nx=5):
    """The same in 2-D."""
    x, y = np.meshgrid(np.arange(nx + 1.0), z)
    row = np.arange(x.size).reshape(x.shape)
    nodes = np.stack([row[:-1, :-1], row[:-1, 1:], row[1:, 1:], row[1:, :-1]], axis=-1).reshape(-1, 4)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    lines = CellBlock("line", range(nx), [[i, i + 1] for i in range(nx)])
    zones = (Zone("wall", "patch", "wall", "face", range(nx)),)
    return Mesh(points, (CellBlock("quad", range(len(nodes)), nodes),), boundary=(lines,), zones=zones, dimension=2)


def as_polyhedra(mesh):
    own = faces(mesh)
    items = [np.flatnonzero((own.owner == c) | (own.neighbour == c)) for c in range(mesh.n_cells)]
    block = CellBlock(
        "polyhedron", range(mesh.n_cells), offsets=np.cumsum([0, *map(len, items)]), items=np.concatenate(items)
    )
    floor = [f for f in range(len(own)) if np.all(mesh.points[own.nodes[own.offsets[f] : own.offsets[f + 1]], 2] == 0)]
    table = Faces(own.offsets, own.nodes, own.owner, own.neighbour)
    return Mesh(mesh.points, (block,), faces=table, zones=(Zone("floor", "patch", "wall", "face", floor),))


@pytest.mark.parametrize("kind", ["hex", "wedge", "polyhedron", "quad"])
@pytest.mark.parametrize("growth", [1.0, 1.2, 1.5])
def test_an_extruded_plate_has_the_layers_it_was_given(kind, growth):
    first, n = 0.01, 8
    z = heights(first, growth, n)
    mesh = strip(z) if kind == "quad" else plate("hex" if kind == "polyhedron" else kind, z)
    mesh = as_polyhedra(mesh) if kind == "polyhedron" else mesh
    finding = found(mesh, "boundary-layers")
    (row,) = finding.detail["zones"]
    assert row["layers"] == {"min": n, "mean": n, "max": n}
    total = first * n if growth == 1 else first * (growth**n - 1) / (growth - 1)
    for name, wanted in (("first_height", first), ("total_thickness", total), ("growth", growth)):
        assert list(row[name].values()) == pytest.approx([wanted] * 3, rel=1e-10), name
    assert row["max_thickness_jump"] == pytest.approx(1.0, rel=1e-12)
    assert (row["without_layers"], row["shortened"], row["collapsed"]) == (0, 0, 0)
    assert (finding.severity, finding.count) == ("info", row["columns"])
    assert found(mesh, "layer-collapse") is None


def test_powers_of_two_come_out_without_rounding():
    (row,) = found(plate("hex", heights(2.0**-9, 2.0, 6)), "boundary-layers").detail["zones"]
    assert row["growth"] == {"min": 2.0, "mean": 2.0, "max": 2.0}
    assert row["first_height"] == {"min": 2.0**-9, "mean": 2.0**-9, "max": 2.0**-9}
    assert row["total_thickness"]["max"] == 2.0**-9 * 63


@pytest.mark.parametrize("scale", [1e-200, 1e-3, 1e160])
def test_counts_and_growth_do_not_depend_on_the_unit(scale):
    (row,) = found(plate("wedge", heights(0.01, 1.2, 5), scale=scale), "boundary-layers").detail["zones"]
    assert row["layers"]["min"] == row["layers"]["max"] == 5
    assert row["growth"]["mean"] == pytest.approx(1.2, rel=1e-9)
    assert row["first_height"]["mean"] == pytest.approx(0.01 * scale, rel=1e-9)


def test_a_column_ends_where_cells_are_no_longer_flatter_than_wide():
    # heights 0.1 0.2 0.4 0.8 1.6: four are less than the width of 1
    (row,) = found(plate("hex", heights(0.1, 2.0, 5)), "boundary-layers").detail["zones"]
    assert row["layers"] == {"min": 4, "mean": 4.0, "max": 4}
    assert found(plate("hex", np.arange(5.0)), "boundary-layers") is None
    # half a unit square is as wide as the triangle of equal sides and half its area: sqrt(2 / sqrt 3) = 1.0746
    assert found(plate("wedge", [0, 0.1, 1.17]), "boundary-layers").detail["zones"][0]["layers"]["max"] == 2
    assert found(plate("wedge", [0, 0.1, 1.18]), "boundary-layers") is None


def test_cells_that_are_a_little_flatter_than_wide_are_no_boundary_layer():
    assert found(plate("hex", heights(0.51, 1.0, 6)), "boundary-layers") is None
    assert found(plate("hex", heights(0.49, 1.0, 6)), "boundary-layers").detail["zones"][0]["layers"]["max"] == 6


def test_in_a_channel_each_wall_has_the_layers_up_to_the_highest_cell():
    half = heights(0.01, 1.5, 5)
    z = np.concatenate([half, 2 * half[-1] - half[-2::-1]])
    channel = plate("hex", z, roles=("wall", "wall"))
    rows = found(channel, "boundary-layers").detail["zones"]
    assert [row["layers"]["max"] for row in rows] == [5, 5]
    assert [row["growth"]["min"] for row in rows] == pytest.approx([1.5, 1.5])
    assert [row["layers"]["max"] for row in found(plate("hex", z), "boundary-layers").detail["zones"]] == [10]


def without(mesh, rows):
    """The mesh without these hexahedra, each of them as six pyramids."""
    block = mesh.blocks[0]
    keep = np.setdiff1d(np.arange(len(block)), rows)
    apex = len(mesh.points) + np.arange(len(rows))
    points = np.vstack([mesh.points, mesh.points[block.nodes[rows]].mean(axis=1)])
    sides = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
    pyramids = [[*block.nodes[row][list(side)], top] for row, top in zip(rows, apex, strict=True) for side in sides]
    blocks = (
        CellBlock("hex", range(len(keep)), block.nodes[keep]),
        CellBlock("pyramid", len(keep) + np.arange(len(pyramids)), pyramids),
    )
    return Mesh(points, blocks, mesh.boundary, zones=mesh.zones)


def test_a_column_that_loses_its_prisms_is_a_collapse_and_one_step_is_only_counted():
    n = 6
    mesh = plate("hex", heights(0.01, 1.2, n), nx=5, ny=5)
    column = 12  # the middle of 5 x 5; its cells are 12 n to 12 n + n - 1
    for lost, collapsed in ((1, False), (2, False), (3, True), (6, True)):
        hollow = without(mesh, np.arange(column * n + n - lost, column * n + n))
        row = found(hollow, "boundary-layers").detail["zones"][0]
        assert row["layers"] == {"min": n - lost, "mean": pytest.approx(n - lost / 25), "max": n}
        assert (row["shortened"], row["collapsed"]) == (1, int(collapsed))
        finding = found(hollow, "layer-collapse")
        assert (finding is not None) == collapsed
        if collapsed:
            assert finding.severity == "warning"
            wall = wall_columns(hollow)[0]
            assert finding.rows.tolist() == [wall.cell[np.argmin(wall.layers)]]
        if lost < n:
            thick = heights(0.01, 1.2, n)
            assert row["max_thickness_jump"] == pytest.approx(thick[n] / thick[n - lost])


def test_a_wall_of_which_most_has_no_layers_has_not_lost_any():
    n = 4
    mesh = plate("hex", heights(0.01, 1.2, n), nx=4, ny=1)
    hollow = without(mesh, np.arange(n, 4 * n))
    assert found(hollow, "boundary-layers").detail["zones"][0]["layers"]["max"] == n
    assert found(hollow, "layer-collapse") is None


def test_without_walls_there_are_no_layers_and_a_shell_has_none():
    assert found(plate("hex", heights(0.01, 1.2, 5), roles=("inlet",)), "boundary-layers") is None
    x, y, z = plate("hex", heights(0.01, 1.2, 1)).points.T
    floor = np.flatnonzero(z == 0)
    shell = Mesh(
        np.stack([x, y, z], axis=1),
        (CellBlock("tri", [0], [floor[:3]]),),
        zones=(Zone("wall", "p", "wall", "face", []),),
    )
    assert found(shell, "boundary-layers") is None


@pytest.mark.parametrize("name", ["hybrid.msh.gz", "hybrid.fluent.msh.gz", "hybrid-openfoam"])
def test_the_hybrid_sample_has_five_layers_growing_by_a_fifth(name):
    table = {row["zone"]: row for row in found(read(SAMPLES / "hybrid" / name), "boundary-layers").detail["zones"]}
    row = table["wall"]
    assert (row["columns"], row["layers"]["min"], row["layers"]["max"]) == (72, 5, 5)
    assert row["first_height"]["mean"] == pytest.approx(0.05)
    assert row["growth"]["max"] == pytest.approx(1.2)
    assert row["total_thickness"]["mean"] == pytest.approx(0.05 * (1.2**5 - 1) / 0.2)


def test_the_prisms_around_the_car_are_counted_on_the_side_of_the_air():
    (row,) = found(read(SAMPLES / "demo.msh.gz"), "boundary-layers").detail["zones"]
    assert (row["zone"], row["columns"], row["layers"]["min"], row["layers"]["max"]) == ("car", 2878, 5, 5)
    assert row["growth"]["mean"] == pytest.approx(1.35, rel=1e-4)
