"""Kinds of elements: their order, elements of one dimension, pyramids out of place; and ugly meshes of every kind."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.connectivity import faces
from meshwright.audit.findings import CHECKS, Options, run_checks
from meshwright.audit.findings.options import SizeRegion
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.parallel import limited_to
from meshwright.audit.readers import read

SAMPLES = Path(__file__).parent.parent / "samples"
hybrid_mesh = runpy.run_path(str(Path(__file__).with_name("hybrid.py")))["hybrid_mesh"]
meshes = runpy.run_path(str(Path(__file__).parent.parent / "benchmarks" / "meshes.py"))

TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
OWN = [
    code
    for code, check in CHECKS.items()
    if check.find.__module__.rpartition(".")[2]
    in ("blocks", "chords", "delaunay", "divisions", "features", "kinds", "layers", "requests", "sizes", "walls")
]


def found(mesh, code, **options):
    here = [f for f in run_checks(mesh, options=Options(**options)) if f.code == code]
    return here[0] if here else None


def test_second_order_is_a_warning_for_finite_volumes_and_first_order_tets_for_finite_elements():
    curved = read(SAMPLES / "cells" / "tet10.v41.msh")
    straight = Mesh(np.array(TET, float), (CellBlock("tet", [0], [[0, 1, 2, 3]]),))
    cfd = found(curved, "element-order", discipline="cfd")
    assert (cfd.severity, cfd.count) == ("warning", curved.n_cells)
    assert "tet10" in cfd.message
    fea = found(straight, "element-order", discipline="fea")
    assert (fea.severity, fea.rows.tolist()) == ("warning", [0])
    for mesh, discipline in ((curved, "fea"), (straight, "cfd"), (curved, ""), (straight, "")):
        assert found(mesh, "element-order", discipline=discipline) is None
    cube = Mesh(np.array(CUBE, float), (CellBlock("hex", [0], [range(8)]),))
    assert found(cube, "element-order", discipline="fea") is None


def test_simplices_are_named_with_their_constant_strain_where_finite_elements_are_meant():
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0)], float)
    mesh = Mesh(points, (CellBlock("quad", [0], [[0, 1, 2, 3]]), CellBlock("tri", [1], [[1, 4, 2]])))
    finding = found(mesh, "simplex-elements", discipline="fea")
    assert (finding.severity, finding.rows.tolist(), finding.detail["simplices"]) == ("info", [1], {"tri": 1})
    assert "constant" in finding.message
    assert found(mesh, "simplex-elements") is None


def framed():
    """A plate with a stiffener along one edge and a post of two bars that ends in the air."""
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 1, 2), (1, 1, 5)], float)
    bars = CellBlock("line", [0, 1, 2], [[0, 1], [2, 4], [4, 5]])
    return Mesh(points, (CellBlock("quad", [0], [[0, 1, 2, 3]]),), boundary=(bars,), boundary_ids=[7, 8, 9])


def test_bars_have_their_lengths_and_free_ends_measured_where_finite_elements_are_meant():
    finding = found(framed(), "line-elements", discipline="fea")
    assert (finding.severity, finding.entity, finding.ids(framed()).tolist()) == ("info", "edge", [7, 8, 9])
    assert finding.detail["length"] == {"min": 1.0, "mean": 2.0, "max": 3.0}
    assert finding.detail["total_length"] == 6.0
    assert (finding.detail["free_ends"], finding.detail["free_end_points"]) == (1, [5])
    assert finding.places(framed(), 1) == [[0.5, 0.0, 0.0]]


def test_bars_are_a_warning_for_finite_volumes_and_nothing_unless_asked():
    finding = found(framed(), "line-elements", discipline="cfd")
    assert (finding.severity, finding.count) == ("warning", 3)
    assert found(framed(), "line-elements") is None


def test_lines_around_a_flat_mesh_are_its_boundary():
    mesh = framed()
    flat = np.where([[True, True, False]], mesh.points, 0.0)
    flat[4:, 0] += [1, 2]
    around = CellBlock("line", range(4), [[0, 1], [1, 2], [2, 3], [3, 0]])
    for lines, count in ((around, 0), (CellBlock("line", range(5), [*around.nodes.tolist(), [2, 4]]), 1)):
        plate = Mesh(flat, mesh.blocks, boundary=(lines,), dimension=2)
        for discipline in ("cfd", "fea"):
            finding = found(plate, "line-elements", discipline=discipline)
            assert (0 if finding is None else finding.count) == count


def test_a_lone_pyramid_beside_a_pyramid_is_out_of_place_and_a_transition_is_not():
    points = np.array([*CUBE, (0.5, 0.5, 2), (0.5, 0.5, -1)], float)
    hexa, top, low = CellBlock("hex", [0], [range(8)]), [4, 5, 6, 7, 8], [0, 3, 2, 1, 9]
    # two pyramids base to base
    pair = Mesh(points[[4, 5, 6, 7, 8, 9]], (CellBlock("pyramid", [0, 1], [[0, 1, 2, 3, 4], [0, 3, 2, 1, 5]]),))
    finding = found(pair, "misplaced-pyramids")
    assert (finding.severity, finding.rows.tolist(), finding.detail["base_on_pyramid"]) == ("info", [0, 1], 2)
    # on a cube, but with nothing beside
    lone = found(Mesh(points, (hexa, CellBlock("pyramid", [1, 2], [top, low]))), "misplaced-pyramids")
    assert (lone.rows.tolist(), lone.detail["no_tetrahedron_beside"], lone.detail["base_on_boundary"]) == ([1, 2], 2, 0)
    # with a tetrahedron beside one of them
    more = np.vstack([points, [(3, 0.5, 1.5)]])
    tet = CellBlock("tet", [3], [[5, 6, 8, 10]])
    mixed = Mesh(more, (hexa, CellBlock("pyramid", [1, 2], [top, low]), tet))
    assert found(mixed, "misplaced-pyramids").rows.tolist() == [2]
    assert found(read(SAMPLES / "hybrid" / "hybrid.msh.gz"), "misplaced-pyramids") is None
    assert found(read(SAMPLES / "demo.v41.msh.gz"), "misplaced-pyramids") is None


def own_faces(mesh):
    f = faces(mesh)
    return Faces(f.offsets, f.nodes, f.owner, f.neighbour)


def polyhedra(mesh):
    own = own_faces(mesh)
    items = [np.flatnonzero((own.owner == c) | (own.neighbour == c)) for c in range(mesh.n_cells)]
    block = CellBlock(
        "polyhedron", range(mesh.n_cells), offsets=np.cumsum([0, *map(len, items)]), items=np.concatenate(items)
    )
    return Mesh(mesh.points, (block,), faces=own, zones=(Zone("wall", "patch", "wall", "face", range(len(own))),))


def ugly_meshes():
    """Meshes that nothing may choke on, by what is wrong with them."""
    base = hybrid_mesh(0)
    boundary = CellBlock("tri", [0, 1], [[0, 1, 2], [2, 2, 2]]), CellBlock("line", [2, 3], [[0, 1], [3, 3]])
    zones = (Zone("wall", "group", "", "face", range(4)), Zone("all", "group", "solid", "cell", range(base.n_cells)))
    listed = Mesh(base.points, base.blocks, boundary=boundary, zones=zones)
    yield "zones of elements that are no faces", listed
    for name, value in (("nan", np.nan), ("infinity", np.inf), ("huge", 1.7e308), ("tiny", 5e-324)):
        points = base.points.copy()
        points[::5] = value
        yield f"{name} here and there", Mesh(points, base.blocks, boundary=boundary, zones=zones)
        yield f"{name} everywhere", Mesh(np.full_like(points, value), base.blocks, boundary=boundary, zones=zones)
        yield f"polyhedra with {name}", polyhedra(Mesh(points, base.blocks))
    for scale in (1e-300, 1e-100, 1e100, 1e300):
        yield f"scaled by {scale}", Mesh(base.points * scale, base.blocks, boundary=boundary, zones=zones)
        yield f"polyhedra scaled by {scale}", polyhedra(Mesh(base.points * scale, base.blocks))
    for block in base.blocks:
        alone = CellBlock(block.type, [0], block.nodes[:1])
        yield f"one {block.type}", Mesh(base.points, (alone,), boundary=boundary, zones=zones[:1])
        twice = CellBlock(block.type, range(3), block.nodes[[0, 0, 0]])
        yield f"one {block.type} three times", Mesh(base.points, (twice,))
        folded = block.nodes.copy()
        folded[:, 1] = folded[:, 0]
        yield f"folded {block.type}", Mesh(base.points, (CellBlock(block.type, range(len(folded)), folded),))
        point = CellBlock(block.type, [0], np.zeros((1, block.nodes.shape[1]), int))
        yield f"a {block.type} of one point", Mesh(base.points, (point,))
    rng = np.random.default_rng(0)
    for dimension in (2, 3):
        points = rng.random((30, 3)) * ([1, 1, 0] if dimension == 2 else 1)
        soup = CellBlock("tri", range(40), rng.integers(0, 30, (40, 3)))
        quads = CellBlock("quad", range(40, 60), rng.integers(0, 30, (20, 4)))
        loops = CellBlock("polygon", range(60, 64), offsets=[0, 3, 8, 12, 18], items=rng.integers(0, 30, 18))
        yield (
            f"a soup in {dimension}-D",
            Mesh(
                points,
                (soup, quads, loops),
                boundary=(CellBlock("line", [0, 1], [[0, 1], [5, 5]]),),
                dimension=dimension,
            ),
        )
    fan = [(0, 1, 2 + i, 3 + i) for i in range(2000)]
    yield "a fan around one edge", Mesh(rng.random((2100, 3)), (CellBlock("tet", range(2000), fan),))


@pytest.mark.parametrize(("name", "mesh"), list(ugly_meshes()), ids=lambda part: part if isinstance(part, str) else "")
def test_ugly_meshes_are_looked_at_without_an_error_and_described_in_json(name, mesh):
    sizes = (
        SizeRegion("all", 0.1),
        SizeRegion("wall", 0.1, "zone", "*"),
        SizeRegion("b", 1, "sphere", place=(0, 0, 0, 1)),
    )
    for options in (Options(), Options("cfd", axis="x", sizes=sizes), Options("fea", axis="y", feature_angle=60.0)):
        for finding in run_checks(mesh, options=options):
            json.dumps(finding.detail, allow_nan=False)
            assert finding.code not in OWN or len(finding.message) > 20, name


@pytest.mark.parametrize(
    "name", ["demo.msh.gz", "circle/8-layer-transition-multiblock.msh", "aerofoil/naca0012-c.msh.gz"]
)
def test_what_is_found_does_not_depend_on_the_number_of_threads(name):
    seen = []
    for threads in (1, 2, 5):
        with limited_to(threads):
            seen.append([(f.code, f.rows.tolist(), f.message, f.detail) for f in run_checks(read(SAMPLES / name))])
    assert seen[0] == seen[1] == seen[2]
    assert {row[0] for row in seen[0]} & set(OWN)


@pytest.mark.parametrize("kind", ["hex", "tet"])
def test_a_sound_block_gets_no_warning_under_any_discipline_that_suits_it(kind):
    points, nodes = meshes["hex_block"]((5, 6, 7))
    mesh = meshes["as_mesh"](kind, points, nodes if kind == "hex" else meshes["split_to_tets"](nodes))
    for discipline in ("", "cfd", "fea" if kind == "hex" else ""):
        assert [f.code for f in run_checks(mesh, options=Options(discipline)) if f.severity != "info"] == []
