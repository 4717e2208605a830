"""Structured blocks in meshes that do not say they have any."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.findings import run_checks
from meshwright.audit.findings.blocks import structured_blocks
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.readers import read

SAMPLES = Path(__file__).parent.parent / "samples"
meshes = runpy.run_path(str(Path(__file__).parent.parent / "benchmarks" / "meshes.py"))


def found(mesh):
    here = [f for f in run_checks(mesh) if f.code == "blocks"]
    return here[0] if here else None


def sizes(mesh):
    finding = found(mesh)
    return None if finding is None else [tuple(block["size"]) for block in finding.detail["sizes"]]


def hexes(points, nodes):
    return Mesh(np.asarray(points, float), (CellBlock("hex", np.arange(len(nodes)), np.asarray(nodes)),))


def quads(points, nodes, dimension=2):
    return Mesh(
        np.asarray(points, float), (CellBlock("quad", np.arange(len(nodes)), np.asarray(nodes)),), dimension=dimension
    )


def swept(mesh, layers):
    """A flat mesh of quadrilaterals carried up in layers."""
    flat, nodes = mesh.points, mesh.blocks[0].nodes
    points = np.vstack([flat + [0, 0, z] for z in range(layers + 1)])
    cells = [np.hstack([nodes + z * len(flat), nodes + (z + 1) * len(flat)]) for z in range(layers)]
    return hexes(points, np.vstack(cells))


def butterfly(inner, outer):
    """Five blocks of a disc: inner x inner in the middle, four of inner x outer around it."""
    points, nodes = {}, []

    def point(p):
        return points.setdefault(tuple(np.round(p, 9) + 0.0), len(points))

    line = np.linspace(-1, 1, inner + 1)
    rim = [(x, -1.0) for x in line[:-1]] + [(1.0, y) for y in line[:-1]]
    rim += [(-x, 1.0) for x in line[:-1]] + [(-1.0, -y) for y in line[:-1]]
    around = ((0, 0), (1, 0), (1, 1), (0, 1))
    for i in range(inner):
        nodes += [[point((line[i + a], line[j + b], 0)) for a, b in around] for j in range(inner)]
    n = len(rim)
    ray = [
        [np.array([x, y, 0]) * (1 + k / outer * (3 / math.hypot(x, y) - 1)) for x, y in rim] for k in range(outer + 1)
    ]
    for k in range(outer):
        nodes += [[point(ray[k + a][(i + b) % n]) for a, b in around] for i in range(n)]
    return quads(np.array(list(points)), nodes)


@pytest.mark.parametrize("n", [(1, 2, 2), (5, 4, 3), (1, 1, 7), (1, 6, 7)])
def test_a_block_is_one_block_of_its_size(n):
    mesh = meshes["as_mesh"]("hex", *meshes["hex_block"](n))
    grid = sorted(n, reverse=True)
    assert sizes(mesh) == (None if grid[1] == 1 else [tuple(grid)])


def test_a_disc_of_five_blocks_has_five_and_four_singular_points():
    finding = found(butterfly(6, 4))
    assert [tuple(block["size"]) for block in finding.detail["sizes"]] == [(6, 6), *[(6, 4)] * 4]
    assert finding.detail["singular_points"]["inside"] == {"3": 4}
    assert (finding.severity, finding.count, finding.detail["cells_in_none"]) == ("info", 6 * 6 + 4 * 6 * 4, 0)


@pytest.mark.parametrize("layers", [1, 2, 7])
def test_a_swept_disc_has_as_many_blocks_and_a_singular_edge_a_layer_and_point(layers):
    finding = found(swept(butterfly(6, 4), layers))
    wanted = [tuple(sorted(s, reverse=True)) for s in ((6, 6, layers), *[(6, 4, layers)] * 4)]
    assert [tuple(block["size"]) for block in finding.detail["sizes"]] == wanted
    assert finding.detail["singular_edges"]["inside"] == {"3": 4 * layers}
    assert finding.detail["singular_edges"]["border"] == {}


def test_an_o_grid_is_one_block_that_closes_and_its_closed_direction_is_named():
    t, r = np.meshgrid(2 * math.pi * np.arange(20) / 20, [1.0, 2.0, 3.0, 4.0])
    row = np.arange(80).reshape(4, 20)
    after = np.roll(row, -1, axis=1)
    nodes = np.stack([row[:-1], row[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    points = np.stack([(r * np.cos(t)).ravel(), (r * np.sin(t)).ravel(), 0 * t.ravel()], axis=1)
    for mesh in (quads(points, nodes), quads(points + [0, 0, 1], nodes, 3)):
        assert found(mesh).detail["sizes"] == [{"size": [20, 3], "cells": 60, "closed": [0]}]
    assert found(swept(quads(points, nodes), 2)).detail["sizes"] == [{"size": [20, 3, 2], "cells": 120, "closed": [0]}]


def test_a_re_entrant_corner_cuts_an_l_into_three_blocks_and_a_notch_in_space_too():
    points, nodes = meshes["hex_block"]((4, 4, 4), jitter=0.0)
    middle = points[nodes].mean(axis=1)
    bar = hexes(points, nodes[~((middle[:, 0] > 0.5) & (middle[:, 1] > 0.5))])
    assert sizes(bar) == [(4, 2, 2)] * 3
    assert found(bar).detail["singular_edges"]["border"] == {"3": 4}
    corner = hexes(points, nodes[~(middle > 0.5).all(axis=1)])
    # three planes cut a cube without one octant into seven
    assert sizes(corner) == [(2, 2, 2)] * 7
    assert found(corner).detail["singular_edges"]["border"] == {"3": 6}


def test_a_mesh_without_any_grid_has_no_blocks():
    rng = np.random.default_rng(1)
    points, cubes = meshes["hex_block"]((3, 3, 3))
    tets = meshes["split_to_tets"](cubes)
    # every tetrahedron as four hexahedra
    middle = {}

    def point(*corners):
        key = tuple(sorted(corners))
        return middle.setdefault(key, len(middle))

    nodes = []
    for cell in tets.tolist():
        for i in range(4):
            a, (b, c, d) = cell[i], [cell[j] for j in range(4) if j != i]
            nodes.append(
                [point(a), point(a, b), point(a, b, c), point(a, c)]
                + [point(a, d), point(a, b, d), point(a, b, c, d), point(a, c, d)]
            )
    places = [points[list(key)].mean(axis=0) for key in middle]
    assert found(hexes(places, nodes)) is None
    assert found(read(SAMPLES / "circle" / "3-paving.msh")) is None
    # hexahedra that have nothing to do with each other
    alone = rng.random((40, 3))
    assert found(hexes(alone, np.arange(40).reshape(5, 8))) is None


def test_samples_have_the_blocks_they_were_made_of():
    wanted = {
        "aerofoil/naca0012-o.v41.msh.gz": [(96, 36)],
        "aerofoil/naca0012-c.msh.gz": [(96, 36), (36, 28), (36, 28)],  # the wake cut meets the trailing edge
        "aerofoil/naca0012-c-cut.msh.gz": [(152, 36)],
        "circle/1-mapping.msh": [(12, 12)],
        "circle/4-multiblock.msh": [(12, 12), *[(12, 6)] * 4],
        "hybrid/hybrid.v41.msh.gz": [(6, 6, 3)],
        "circle/5-layer-triangulation.msh": [(48, 6)],
    }
    for name, blocks in wanted.items():
        assert sizes(read(SAMPLES / name)) == blocks, name


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_no_numbering_of_cells_points_and_corners_changes_the_blocks(seed):
    rng = np.random.default_rng(seed)
    mesh = swept(butterfly(3, 2), 3)
    order, cells = rng.permutation(len(mesh.points)), rng.permutation(mesh.n_cells)
    nodes = np.argsort(order)[mesh.blocks[0].nodes][cells]
    spin = np.array([1, 2, 3, 0, 5, 6, 7, 4])
    tilt = np.array([4, 5, 1, 0, 7, 6, 2, 3])  # another face becomes the bottom, still right-handed
    for row in nodes:
        for _ in range(rng.integers(4)):
            row[:] = row[spin] if rng.random() < 0.5 else row[tilt]
    other = hexes(mesh.points[order], nodes)
    assert sizes(other) == sizes(mesh)
    first, second = structured_blocks(mesh), structured_blocks(other)
    assert len(first.singular) == len(second.singular)
    # cells that shared a block still do
    pairs = {(int(a), int(b)) for a, b in zip(first.block[cells], second.block, strict=True)}
    assert len(pairs) == len(first.sizes)


def test_cells_listed_twice_or_folded_do_no_harm():
    points, nodes = meshes["hex_block"]((3, 3, 3))
    found(hexes(points, np.vstack([nodes, nodes[:3]])))
    folded = nodes.copy()
    folded[4, [2, 6]] = folded[4, [1, 5]]
    found(hexes(points, folded))
    found(hexes(points * np.nan, nodes))
    assert found(hexes(points, nodes[:1])) is None
