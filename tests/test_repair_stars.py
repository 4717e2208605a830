"""The worst cell around a point raised, for cells of any type."""

import numpy as np
import pytest
from repair_meshes import box, hybrid_layers, random_tets, random_triangles, solid, sphere, square, with_reversed
from test_repair_refine import pyramids

from meshwright.audit import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.profiles import load
from meshwright.repair import repair
from meshwright.repair.quality import standing, worst_at_points


def bent_pyramids():
    mesh = pyramids()
    points = np.array(mesh.points)
    points[8] += [0.2, -0.25, 0.28]
    return Mesh(points, mesh.blocks)


MESHES = {
    "tets": random_tets,
    "hexes": lambda: solid(box(6, 0.25)[0], hex=box(6)[1]),
    "quads": lambda: solid(square(8, 0.3)[0], quad=square(8)[1]),
    "triangles": random_triangles,
    "pyramids": bent_pyramids,
}


@pytest.mark.parametrize("kind", MESHES)
def test_the_worst_cell_rises_and_no_neighbourhood_gets_worse(kind):
    mesh = MESHES[kind]()
    done = repair(mesh, "raise-worst")
    assert done.changed, done.refused
    assert done.last.worst > done.first.worst + 0.02
    before, after = (worst_at_points(m, standing(m).quality) for m in (mesh, done.after))
    assert after.mean() > before.mean()
    assert not repair(done.after, "raise-worst").changed
    for one, two in zip(mesh.blocks, done.after.blocks, strict=True):
        assert np.array_equal(one.nodes, two.nodes), "nothing is rewired"


def test_shaken_quads_end_nearly_square():
    done = repair(MESHES["quads"](), "raise-worst")
    assert measure(done.after, ["gambit.equiangle_skew"]).values["gambit.equiangle_skew"]["quad"].max() < 0.2


def test_the_result_turns_and_grows_with_the_mesh():
    mesh = MESHES["hexes"]()
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    here = repair(mesh, "raise-worst").last
    there = repair(Mesh(37.0 * mesh.points @ turn.T, mesh.blocks), "raise-worst").last
    assert abs(here.worst - there.worst) < 0.05
    assert abs(here.quality.mean() - there.quality.mean()) < 0.01


def test_it_is_the_same_on_one_thread_and_two():
    mesh = MESHES["hexes"]()
    one, two = (repair(mesh, "raise-worst", threads=n).after.points for n in (1, 2))
    assert np.array_equal(one, two)


def test_layers_inverted_stars_and_curved_surfaces_stay():
    layers = hybrid_layers()
    done = repair(layers, "raise-worst")
    wedges = np.unique(layers.block("wedge").nodes)
    assert np.array_equal(done.after.points[wedges], layers.points[wedges])
    points, tris = sphere(2)
    shell = Mesh(points, (CellBlock("tri", np.arange(len(tris)), tris),))
    assert not repair(shell, "raise-worst").changed
    hexes = box(3)[1]
    wrong = solid(box(3)[0], hex=with_reversed(hexes, "hex", range(len(hexes))))
    assert not repair(wrong, "raise-worst").changed


def test_a_target_plans_it_for_hexes():
    mesh = solid(box(6, 0.38)[0], hex=box(6)[1])
    done = repair(mesh, target=load("fluent"))
    assert "raise-worst" in [step.name for step in done.aim.plan]
    assert done.last.worst > done.first.worst
