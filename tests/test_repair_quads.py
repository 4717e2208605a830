"""Quads cleaned up: four meet at most points, none is lost that is needed, nothing gets worse."""

import numpy as np
import pytest
from repair_meshes import in_two_zones, random_tets, random_triangles, solid, square

from meshwright.audit.connectivity import faces
from meshwright.repair import repair
from meshwright.repair.quality import standing


def quads_of(mesh):
    return mesh.block("quad").nodes.astype(np.int64)


def area(mesh):
    q, x = quads_of(mesh), mesh.points
    d, e = x[q[:, 2]] - x[q[:, 0]], x[q[:, 3]] - x[q[:, 1]]
    return 0.5 * (d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0])


def irregular(mesh):
    """Sum of squares of 4 less the quads at each inner point."""
    q = quads_of(mesh)
    rim = np.unique(faces(mesh).nodes.reshape(-1, 2)[faces(mesh).neighbour < 0])
    count = np.bincount(q.ravel(), minlength=len(mesh.points))
    inner = np.setdiff1d(np.unique(q), rim)
    return int(((count[inner] - 4) ** 2).sum())


def with_doublet():
    """A grid, one quad of which is two around a point in its middle."""
    points, quads = square(4)
    a, b, c, d = quads[5]
    points = np.vstack([points, [points[quads[5]].mean(axis=0)]])
    p = len(points) - 1
    return solid(points, quad=np.vstack([np.delete(quads, 5, axis=0), [[a, b, c, p], [a, p, c, d]]]))


def with_diamond():
    """A grid, one point of which is opened into a quad with three quads at its ends."""
    points, quads = square(4)
    n = 5
    at = 2 * n + 2
    points = np.vstack([points, points[at] + [0.06, 0.06, 0.0]])
    points[at] -= [0.06, 0.06, 0.0]
    twin = len(points) - 1
    quads = np.array(quads)
    upper = np.flatnonzero((quads == at).any(axis=1) & (quads.max(axis=1) > at + n))
    right = [t for t in upper if at + n + 1 in quads[t]]
    for t in right:
        quads[t][quads[t] == at] = twin
    # the corner quad goes to the twin; the new one lies between both and the two neighbours that it met
    return solid(points, quad=np.vstack([quads, [[at, at + 1, twin, at + n]]]))


def split_triangles():
    """Triangles cut into three quads each: few points have four."""
    mesh = random_triangles(5)
    x, t = mesh.points, mesh.block("tri").nodes.astype(np.int64)
    sides = np.sort(np.stack([t, np.roll(t, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    ends, which = np.unique(sides, axis=0, return_inverse=True)
    m = len(x) + which.reshape(-1, 3)
    centre = len(x) + len(ends) + np.arange(len(t))
    points = np.vstack([x, x[ends].mean(axis=1), x[t].mean(axis=1)])
    return solid(points, quad=np.vstack([np.stack([t[:, k], m[:, k], centre, m[:, k - 1]], axis=1) for k in range(3)]))


@pytest.mark.parametrize(("make", "lost"), [(with_doublet, 1), (with_diamond, 1)])
def test_a_fault_in_a_grid_is_taken_out_and_the_grid_is_there_again(make, lost):
    mesh = make()
    assert irregular(mesh) > 0
    done = repair(mesh, "clean-quads")
    assert done.after.n_cells == 16
    assert len(done.after.points) == len(mesh.points) - lost
    assert irregular(done.after) == 0
    assert done.last.worst > 0.85
    assert not repair(done.after, "clean-quads").changed


def test_quads_of_triangles_get_nearer_to_a_grid():
    mesh = split_triangles()
    done = repair(mesh, "clean-quads")
    assert done.changed, done.refused
    assert irregular(done.after) < 0.8 * irregular(mesh)
    assert (area(done.after) > 0).all()
    assert np.isclose(area(done.after).sum(), 1.0, rtol=1e-12)
    assert done.last.worst > done.first.worst
    assert standing(done.after).bad == 0
    x = done.after.points
    rim = x[faces(done.after).nodes.reshape(-1, 2)[faces(done.after).neighbour < 0]]
    assert ((rim == 0) | (rim == 1)).any(axis=2).all(), "nothing is torn inside"
    assert not repair(done.after, "clean-quads").changed


def test_borders_of_zones_stay():
    mesh = in_two_zones(split_triangles())
    done = repair(mesh, "clean-quads")
    before, after = ([area(m)[zone.members].sum() for zone in m.zones] for m in (mesh, done.after))
    assert np.allclose(before, after, rtol=1e-12)


def test_a_good_grid_and_other_meshes_are_left_alone():
    points, quads = square(5, 0.1)
    assert not repair(solid(points, quad=quads), "clean-quads").changed
    assert not repair(random_tets(30), "clean-quads").changed
