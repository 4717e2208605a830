"""Structured blocks and the passes that place the points inside, and the smoothers that go point by point."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from repair_meshes import box, hybrid_layers, random_tets, random_triangles, solid, square

from meshwright.audit import measure
from meshwright.audit.errors import UsageError
from meshwright.audit.geometry import total_volume
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.readers import read
from meshwright.repair import repair
from meshwright.repair.blocks import inside, structured_grids
from meshwright.repair.cell_quality import KINDS, quality_at
from meshwright.repair.even import _cells, _soft_skew
from meshwright.repair.guards import broken
from meshwright.repair.held import held_points
from meshwright.repair.laplace import laplace, odt, smart_laplace
from meshwright.repair.outcome import Options, Pass
from meshwright.repair.quality import standing
from meshwright.repair.sizes import signed_sizes
from meshwright.repair.tfi import tfi_points

OPEN2 = (False, False)
PLACING = ("tfi", "tfi-even", "hermite", "winslow", "elliptic", "elliptic-normal")
HEX = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
QUAD = [(0, 0), (1, 0), (1, 1), (0, 1)]


def mesh_of(table, closed=()):
    """The mesh of a grid of points (n0 + 1, n1 + 1[, n2 + 1], 2 or 3); closed: axes whose last layer is the first."""
    d = table.ndim - 1
    ids = np.arange(table[..., 0].size).reshape(table.shape[:-1])
    for axis in closed:
        ids = np.concatenate([np.take(ids, range(ids.shape[axis] - 1), axis), np.take(ids, [0], axis)], axis)
    n = [k - 1 for k in ids.shape]
    corners = HEX if d == 3 else QUAD
    cells = np.stack([ids[tuple(slice(a, a + k) for a, k in zip(c, n, strict=True))] for c in corners], -1)
    points = np.zeros((ids.size, 3))
    points[:, : table.shape[-1]] = table.reshape(-1, table.shape[-1])
    used, cells = np.unique(cells.reshape(-1, 2**d), return_inverse=True)
    return solid(points[used], **{"hex" if d == 3 else "quad": cells.reshape(-1, 2**d)})


def thrown(table, by, seed=1):
    """The grid with its points inside thrown about."""
    out = np.array(table)
    at = tuple(slice(1, -1) for _ in table.shape[:-1])
    out[at] += np.random.default_rng(seed).uniform(-by, by, out[at].shape)
    return out


def graded(n, power):
    return np.linspace(0.0, 1.0, n + 1) ** power


def quarter(radial, around):
    """A quarter of the ring between radii 1 and 2; radial, around: parts of the way, 0 to 1."""
    r, t = np.meshgrid(1.0 + radial, 0.5 * np.pi * around, indexing="ij")
    return np.stack([r * np.cos(t), r * np.sin(t)], axis=-1)


def swan(n):
    """The unit square with a parabola for its top, that dips to a quarter, and another for its right side."""
    s = graded(n, 1.0)
    x = np.zeros((n + 1, n + 1, 2))
    x[:, 0], x[:, -1] = np.stack([s, 0 * s], -1), np.stack([s, 1 - 3 * s + 3 * s * s], -1)
    x[0], x[-1] = np.stack([0 * s, s], -1), np.stack([1 + 2 * s - 2 * s * s, s], -1)
    return tfi_points(x, OPEN2)


def deep_bump(n=40, depth=0.9, power=1.0):
    """A plate, 4 x 1, with a narrow bump in its floor."""
    s, t = graded(2 * n, 1.0), graded(n, power)
    x = np.zeros((2 * n + 1, n + 1, 2))
    x[:, 0] = np.stack([4.0 * s, depth * np.exp(-(((4.0 * s - 2.0) / 0.35) ** 2))], -1)
    x[:, -1] = np.stack([4.0 * s, 1.0 + 0 * s], -1)
    for e in (0, -1):
        x[e] = x[e, 0] + (x[e, -1] - x[e, 0]) * t[:, None]
    return tfi_points(x, OPEN2)


def brick(*axes):
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def worst_angle(mesh):
    return float(measure(mesh, ["angle.min"]).values["angle.min"]["quad"].min())


def turned(points, degrees=33.0):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def shuffled(mesh, seed=5):
    """(mesh, number of each old point): points and cells in another order, corners of cells from another start."""
    r = np.random.default_rng(seed)
    into = r.permutation(len(mesh.points))
    points = np.empty_like(mesh.points)
    points[into] = mesh.points
    blocks = []
    for block in mesh.blocks:
        nodes = into[block.nodes][r.permutation(len(block))]
        turns = r.integers(0, 4, len(nodes))
        for k in range(len(nodes)):
            around = np.roll(np.arange(4), turns[k])
            nodes[k] = nodes[k][around if block.type == "quad" else np.r_[around, around + 4]]
        blocks.append(CellBlock(block.type, block.rows, nodes))
    return Mesh(points, tuple(blocks), dimension=mesh.dimension), into


# the grids


@pytest.mark.parametrize(
    ("name", "make", "size"), [("quad", lambda: square(7), (7, 7)), ("hex", lambda: box(4), (4, 4, 4))]
)
def test_the_grid_of_a_brick_names_every_point_once_and_neighbours_share_an_edge(name, make, size):
    points, cells = make()
    mesh, _ = shuffled(solid(points, **{name: cells}))
    (grid,) = structured_grids(mesh)
    assert grid.points.shape == tuple(n + 1 for n in size)
    assert grid.closed == (False,) * len(size)
    assert np.array_equal(np.unique(grid.points), np.arange(len(points)))
    assert np.array_equal(np.sort(grid.cells), np.arange(len(cells)))
    for axis in range(len(size)):
        steps = np.linalg.norm(np.diff(mesh.points[grid.points], axis=axis), axis=-1)
        assert np.allclose(steps, 1.0 / size[axis])


def test_a_disc_of_five_blocks_falls_into_five_grids_that_share_their_sides():
    core = brick(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5))
    mesh = disc(core, 3)
    grids = structured_grids(mesh)
    assert sorted(tuple(sorted(np.array(g.points.shape) - 1)) for g in grids) == [(3, 4)] * 4 + [(4, 4)]
    assert sum(len(g.cells) for g in grids) == mesh.n_cells


def disc(core, layers):
    """A square grid `core` from -1 to 1 with `layers` of cells around it out to the circle of radius 3."""
    n = len(core) - 1
    ids = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    ring = np.concatenate([ids[:-1, 0], ids[-1, :-1], ids[:0:-1, -1], ids[0, :0:-1]])
    flat = core.reshape(-1, 2)
    points, cells, before = [flat], [mesh_of(core).blocks[0].nodes], ring
    angle = np.arctan2(*flat[ring].T[::-1])
    rim = 3.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for k in range(1, layers + 1):
        after = sum(map(len, points)) + np.arange(len(ring))
        points.append(flat[ring] + (rim - flat[ring]) * k / layers)
        cells.append(np.stack([before, after, np.roll(after, -1), np.roll(before, -1)], axis=1))
        before = after
    xy = np.vstack(points)
    return solid(np.c_[xy, 0.0 * xy[:, 0]], quad=np.vstack(cells))


def test_an_l_shape_and_a_border_of_zones_cut_a_grid_straight_through():
    points, cells = square(8)
    middle = points[cells].mean(axis=1)
    corner = (middle[:, 0] > 0.5) & (middle[:, 1] > 0.5)
    ell = solid(points, quad=cells[~corner])
    assert sorted(g.points.shape for g in structured_grids(ell)) == [(5, 5)] * 3
    zones = tuple(Zone(n, "zone", "", "cell", np.flatnonzero(m)) for n, m in (("a", corner), ("b", ~corner)))
    assert (
        sorted(g.points.shape for g in structured_grids(replace(solid(points, quad=cells), zones=zones)))
        == [(5, 5)] * 4
    )


def test_listed_elements_inside_cut_a_grid():
    points, cells = square(8)
    wall = np.array([[4 + 9 * j, 4 + 9 * (j + 1)] for j in range(8)])
    mesh = replace(solid(points, quad=cells), boundary=(CellBlock("line", np.arange(8), wall),))
    assert sorted(sorted(g.points.shape) for g in structured_grids(mesh)) == [[5, 9]] * 2


def test_a_ring_is_a_grid_with_a_closed_direction_and_a_shifted_one_is_none():
    r, t = np.meshgrid(np.linspace(1, 2, 5), np.linspace(0, 2 * np.pi, 13), indexing="ij")
    ring = np.stack([r * np.cos(t), r * np.sin(t)], axis=-1)
    (grid,) = structured_grids(mesh_of(ring, closed=[1]))
    assert sorted(zip(grid.points.shape, grid.closed, strict=True)) == [(5, False), (13, True)]
    # a bar of 4 x 4 x 8 hexes joined to a ring after a quarter of a turn
    n, m = 4, 8
    ids = np.arange((n + 1) ** 2 * m).reshape(n + 1, n + 1, m)
    for turns, expected in ((0, 1), (1, 0)):
        table = np.concatenate([ids, np.rot90(ids[:, :, 0], turns)[:, :, None]], axis=2)
        cells = np.stack([table[a : a + n, b : b + n, c : c + m] for a, b, c in HEX], -1).reshape(-1, 8)
        x, y, t = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1), 2 * np.pi * np.arange(m) / m,
                              indexing="ij")  # fmt: skip
        bent = np.stack([(4.0 + x) * np.cos(t), (4.0 + x) * np.sin(t), y], -1)
        assert len(structured_grids(solid(bent.reshape(-1, 3), hex=cells))) == expected


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.0, 0.3), st.booleans())
def test_any_part_of_a_brick_falls_into_grids_that_fit_its_cells(seed, holes, solid_cells):
    r = np.random.default_rng(seed)
    if solid_cells:
        table = brick(*(np.arange(n + 1.0) for n in r.integers(2, 6, 3)))
    else:
        table = brick(*(np.arange(n + 1.0) for n in r.integers(2, 9, 2)))
    d = table.ndim - 1
    whole, _ = shuffled(mesh_of(table), seed)
    keep = np.flatnonzero(r.random(whole.n_cells) >= holes)
    if not len(keep):
        return
    mesh = solid(whole.points, **{"hex" if d == 3 else "quad": whole.blocks[0].nodes[keep]})
    cells = [g.cells for g in structured_grids(mesh)]
    assert len(np.unique(np.concatenate([[], *cells]))) == sum(map(len, cells))
    for grid in structured_grids(mesh):
        size = np.array(grid.points.shape) - 1
        assert len(grid.cells) == size.prod()
        corners = [tuple(slice(a, a + n) for a, n in zip(c, size, strict=True)) for c in (HEX if d == 3 else QUAD)]
        expected = np.stack([grid.points[at].ravel() for at in corners], axis=1)
        assert np.array_equal(np.sort(expected, axis=1), np.sort(mesh.blocks[0].nodes[grid.cells], axis=1))
        # unit cells: neighbours in the table are one apart, in one direction each
        for axis in range(d):
            steps = np.diff(mesh.points[grid.points], axis=axis)
            assert np.abs(steps - steps[(0,) * d]).max() == 0.0


def test_hexes_with_corners_in_common_form_no_grid_and_do_no_harm():
    table = brick(*(np.arange(5.0),) * 3)
    mesh = mesh_of(table)
    nodes = np.array(mesh.blocks[0].nodes)
    nodes[nodes == nodes[21, 6]] = nodes[21, 5]  # two points inside become one
    mesh = solid(mesh.points, hex=nodes)
    for name in ("tfi", "winslow"):
        assert repair(mesh, name).after.n_cells == mesh.n_cells
    assert all(len(np.unique(g.points)) == g.points.size for g in structured_grids(mesh))


# transfinite interpolation


@pytest.mark.parametrize("name", ["tfi", "hermite"])
@pytest.mark.parametrize("powers", [(1.0, 1.0), (2.0, 1.0), (1.7, 1.5)])
def test_a_quarter_of_a_ring_gets_its_analytic_points_back(name, powers):
    exact = quarter(graded(8, powers[0]), graded(12, powers[1]))
    done = repair(mesh_of(thrown(exact, 0.02)), name)
    assert np.abs(done.after.points[:, :2] - exact.reshape(-1, 2)).max() < 1e-12
    assert done.steps[0].changed == 7 * 11
    assert not done.refused


def test_a_graded_sector_of_a_pipe_gets_its_analytic_points_back():
    flat = quarter(graded(6, 1.6), graded(7, 1.0))
    z = graded(5, 1.4)
    exact = np.concatenate([np.repeat(flat[:, :, None], 6, axis=2), np.broadcast_to(z[:, None], (7, 8, 6, 1))], axis=-1)
    done = repair(mesh_of(thrown(exact, 0.02)), "tfi")
    assert np.abs(done.after.points - exact.reshape(-1, 3)).max() < 1e-12


def test_a_ring_gets_rings_at_the_mean_spacing_of_its_lines():
    r, t = np.meshgrid(1.0 + graded(6, 2.0), np.linspace(0, 2 * np.pi, 25), indexing="ij")
    exact = np.stack([r * np.cos(t), r * np.sin(t)], axis=-1)
    exact[1:-1] = np.stack([r * np.cos(t + 0.03), r * np.sin(t + 0.03)], axis=-1)[1:-1]  # all lines bent alike
    done = repair(mesh_of(exact, closed=[1]), "tfi")
    way = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(exact[:, 0], axis=0), axis=1))]
    radii = np.linalg.norm(done.after.points, axis=1).reshape(7, 24)
    assert np.abs(radii - (1.0 + way / way[-1])[:, None]).max() < 1e-12
    assert not repair(done.after, "tfi").changed


def bent_box(n=6, by=0.12):
    """A cube of n x n x n hexes whose sides bulge and twist."""
    x = brick(*(graded(n, 1.0),) * 3)
    u, v, w = (np.pi * x[..., a] for a in range(3))
    return x + by * np.stack([np.sin(v) * np.cos(2 * w), np.cos(2 * u) * np.sin(w), np.sin(u + v)], axis=-1)


def measures(mesh):
    """(worst and mean scaled Jacobian, worst and mean equiangle skew)"""
    found = measure(mesh, ["verdict.scaled_jacobian", "gambit.equiangle_skew"]).values
    (jacobian,), (skew,) = (list(found[name].values()) for name in found)
    return np.array([jacobian.min(), jacobian.mean(), 1.0 - skew.max(), 1.0 - skew.mean()])


@pytest.mark.parametrize("table", [bent_box(), quarter(graded(9, 1.0), graded(7, 1.0)) ** 1.3, deep_bump(16, 0.5)])
def test_even_angles_are_nowhere_worse_than_those_of_interpolation_and_better_in_the_mean(table):
    plain = repair(mesh_of(thrown(table, 0.01)), "tfi")
    done = repair(plain.before, "tfi-even")
    assert (measures(done.after) >= measures(plain.after) - 1e-9).all()
    assert measures(done.after)[3] > measures(plain.after)[3] + 1e-4
    again = repair(plain.after, "tfi-even")
    assert np.array_equal(again.after.points, done.after.points)
    assert repair(done.after, "tfi-even").after is done.after


@pytest.mark.parametrize("table", [bent_box(3), thrown(deep_bump(5, 0.4), 0.02)])
def test_the_slope_of_the_soft_skew_is_that_of_finite_differences(table):
    cells = _cells(np.arange(table[..., 0].size).reshape(table.shape[:-1]))
    x = np.zeros((table[..., 0].size, 3))
    x[:, : table.shape[-1]] = table.reshape(x.shape[0], -1)
    slope, unused = np.empty_like(x), np.empty_like(x)
    _soft_skew(x, cells, slope)
    for p in range(0, len(x), 7):
        for a in range(table.shape[-1]):
            h = np.zeros_like(x)
            h[p, a] = 1e-6
            there = (_soft_skew(x + h, cells, unused) - _soft_skew(x - h, cells, unused)) / 2e-6
            assert slope[p, a] == pytest.approx(there, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_gmsh_places_the_points_of_a_transfinite_surface_alike(seed):
    gmsh = pytest.importorskip("gmsh")
    r = np.random.default_rng(seed)
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        geo = gmsh.model.geo
        at = [(1, 0), (3, 0), (0, 3), (0, 1.5), (0, 0), (1.0 + 0.3 * r.random(), 0.6 + 0.3 * r.random())]
        p = [geo.addPoint(x, y, 0) for x, y in at]
        sides = [geo.addLine(p[0], p[1]), geo.addCircleArc(p[1], p[4], p[2]), geo.addLine(p[2], p[3]),
                 geo.addSpline([p[3], p[5], p[0]])]  # fmt: skip
        growth = 1.0 + 0.3 * r.random()
        for side, n, grows in zip(sides, (9, 13, 9, 13), (growth, 1.0, -growth, 1.0), strict=True):
            geo.mesh.setTransfiniteCurve(side, n, "Progression", grows)
        surface = geo.addPlaneSurface([geo.addCurveLoop(sides)])
        geo.mesh.setTransfiniteSurface(surface)
        geo.mesh.setRecombine(2, surface)
        geo.synchronize()
        gmsh.model.mesh.generate(2)
        tags, points, _ = gmsh.model.mesh.getNodes()
        cells = gmsh.model.mesh.getElements(2)[2][0].reshape(-1, 4)
    finally:
        gmsh.finalize()
    used, cells = np.unique(cells, return_inverse=True)
    order = np.argsort(tags)
    points = points.reshape(-1, 3)[order[np.searchsorted(tags[order], used)]]
    mesh = solid(points, quad=cells.reshape(-1, 4))
    (grid,) = structured_grids(mesh)
    there = tfi_points(points[grid.points][..., :2], OPEN2)
    assert np.abs(there - points[grid.points][..., :2]).max() < 1e-8  # gmsh walks curves to about that


@pytest.mark.parametrize(
    ("file", "grids", "points"),
    [
        ("su2/mesh_wedge_inv.su2", 1, 73 * 48),
        ("vtk/sfepy_hsphere8.vtk", 3, 3 * 125),
        ("fluent_legacy/disk.msh.gz", 1, 71 * 85),
    ],
)
def test_meshes_that_other_programs_made_by_transfinite_interpolation_stay_and_come_back(shared, file, grids, points):
    mesh = repair(read(shared / "meshes" / file), "tfi").after
    found = structured_grids(mesh)
    inner = np.concatenate([g.points[inside(g.closed)].ravel() for g in found])
    assert (len(found), len(np.unique(inner))) == (grids, points)
    edge = min(np.linalg.norm(np.diff(mesh.points[g.points], axis=a), axis=-1).min() for g in found for a in range(2))
    spoilt = np.array(mesh.points)
    d = mesh.cell_dimension
    spoilt[inner, :d] += np.random.default_rng(2).uniform(-0.3 * edge, 0.3 * edge, (len(inner), d))
    done = repair(replace(mesh, points=spoilt), "tfi")
    assert done.changed
    # the files hold a few digits
    assert np.abs(done.after.points - mesh.points).max() < 1e-5 * np.ptp(mesh.points)


# elliptic smoothing


@pytest.mark.parametrize("name", ["winslow", "elliptic"])
@pytest.mark.parametrize("n", [20, 33])
def test_the_folded_grid_of_the_swan_becomes_valid_and_its_angles_rise(name, n):
    mesh = mesh_of(swan(n))
    before = standing(mesh)
    assert before.bad >= 5
    done = repair(mesh, name)
    assert done.last.bad == 0
    assert (signed_sizes(done.after) > 0.0).all()
    assert worst_angle(done.after) > worst_angle(mesh) + 5.0
    assert total_volume(done.after) == pytest.approx(total_volume(mesh), rel=1e-12)
    assert done.last.quality.min() > 0.15


def test_vtk_finds_no_cell_of_the_swan_folded_any_more():
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    def folded(mesh):
        grid = vtk.vtkUnstructuredGrid()
        points = vtk.vtkPoints()
        for p in mesh.points:
            points.InsertNextPoint(*p)
        grid.SetPoints(points)
        for cell in mesh.blocks[0].nodes.tolist():
            grid.InsertNextCell(vtk.VTK_QUAD, 4, cell)
        quality = vtk.vtkMeshQuality()
        quality.SetInputData(grid)
        quality.SetQuadQualityMeasureToJacobian()
        quality.Update()
        return int(np.count_nonzero(vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality")) <= 0.0))

    mesh = mesh_of(swan(24))
    assert folded(mesh) > 0
    assert folded(repair(mesh, "elliptic").after) == 0


def test_hexes_over_the_swan_become_valid_between_valid_ends():
    flat = swan(14)
    ends = repair(mesh_of(flat), "winslow").after.points[:, :2].reshape(15, 15, 2)
    z = np.linspace(0.0, 1.0, 8)
    table = np.concatenate([np.repeat(ends[:, :, None], 8, 2), np.broadcast_to(z[:, None], (15, 15, 8, 1))], -1)
    folded = np.array(table)
    folded[1:-1, 1:-1, 1:-1, :2] = flat[1:-1, 1:-1, None]
    mesh = mesh_of(folded)
    assert standing(mesh).bad > 0
    done = repair(mesh, "winslow")
    assert done.last.bad == 0
    # the equations of the flat grid hold in every layer: the third direction adds nothing to them
    assert np.abs(done.after.points - table.reshape(-1, 3)).max() < 1e-7


@pytest.mark.parametrize(
    "axes", [(graded(9, 1.0), graded(14, 1.0)), (graded(5, 1.0), 2.0 * graded(6, 1.0), graded(7, 1.0))]
)
def test_winslow_on_a_brick_gives_the_even_grid(axes):
    exact = brick(*axes)
    done = repair(mesh_of(thrown(exact, 0.04)), "winslow")
    assert np.abs(done.after.points[:, : len(axes)] - exact.reshape(-1, len(axes))).max() < 1e-9


@pytest.mark.parametrize("axes", [(graded(9, 2.0), graded(14, 1.5)), (graded(5, 1.5), graded(6, 2.0), graded(7, 1.0))])
def test_thomas_and_middlecoff_keep_the_grading_of_a_brick(axes):
    exact = brick(*axes)
    smallest = min(np.diff(a).min() for a in axes)
    done = repair(mesh_of(thrown(exact, 0.3 * smallest)), "elliptic")
    assert done.changed
    assert np.abs(done.after.points[:, : len(axes)] - exact.reshape(-1, len(axes))).max() < 1e-9 * smallest


def test_the_control_keeps_the_first_cell_at_a_wall_where_winslow_spreads_it():
    flat = deep_bump(20, depth=0.3, power=2.5)
    wall = np.linalg.norm(flat[0, 1] - flat[0, 0])
    height = {}
    for name in ("elliptic", "winslow"):
        x = repair(mesh_of(thrown(flat, 3e-4)), name).after.points.reshape(41, 21, 3)
        height[name] = np.linalg.norm(x[3:-3, 1] - x[3:-3, 0], axis=1)
    assert np.median(height["elliptic"]) < 1.5 * wall
    assert np.median(height["winslow"]) > 3.0 * wall


def angle_at_floor(mesh, shape):
    """Smallest angle, in degrees, between the floor of a plate and the lines that leave it."""
    x = mesh.points[:, :2].reshape(*shape, 2)
    along, up = x[2:, 0] - x[:-2, 0], (x[:, 1] - x[:, 0])[1:-1]
    cosine = np.abs(np.sum(along * up, axis=1)) / np.linalg.norm(along, axis=1) / np.linalg.norm(up, axis=1)
    return float(np.degrees(np.arccos(cosine)).min())


@pytest.mark.parametrize("power", [1.0, 1.6])
def test_lines_leave_the_sides_normally_where_that_is_asked_for(power):
    mesh = mesh_of(deep_bump(20, depth=0.3, power=power))
    plain, normal = (repair(mesh, name) for name in ("elliptic", "elliptic-normal"))
    assert angle_at_floor(plain.after, (41, 21)) < 65.0
    assert angle_at_floor(normal.after, (41, 21)) > 79.0
    assert normal.last.bad == 0
    assert normal.last.worst > plain.last.worst


def test_a_control_that_does_not_settle_is_refused_and_nothing_moves():
    done = repair(mesh_of(deep_bump(40, depth=0.5, power=3.0)), "elliptic-normal")
    assert not done.changed
    assert "does not come to a solution" in done.refused[0]


def test_a_ring_is_smoothed_by_winslow_and_refused_by_the_control_that_no_side_tells():
    r, t = np.meshgrid(np.linspace(1, 3, 9), np.linspace(0, 2 * np.pi, 33), indexing="ij")
    mesh = mesh_of(np.stack([r * np.cos(t), r * np.sin(t)], axis=-1), closed=[1])
    inside = np.abs(np.linalg.norm(mesh.points, axis=1) - 2.0) < 0.99
    points = np.array(mesh.points)
    points[inside, :2] += np.random.default_rng(0).uniform(-0.07, 0.07, (int(inside.sum()), 2))
    mesh = replace(mesh, points=points)
    done = repair(mesh, "winslow")
    radii = np.unique(np.round(np.linalg.norm(done.after.points, axis=1), 7))
    assert len(radii) == 9
    # rings of a conformal map: the ratio of the radii is the same from ring to ring, but for the discretisation
    assert np.allclose(radii[1:] / radii[:-1], 3.0**0.125, rtol=0.01)
    refused = repair(mesh, "elliptic")
    assert not refused.changed
    assert "winslow" in refused.refused[0]


# all of them


@pytest.mark.parametrize("names", ["tfi,elliptic", "winslow,smart-laplace", "hermite,relax"])
def test_passes_that_would_undo_one_another_are_not_run_together(names):
    with pytest.raises(UsageError, match="undo one another"):
        repair(mesh_of(swan(8)), names)


def test_a_repair_with_other_passes_comes_to_rest():
    mesh = mesh_of(swan(18))
    done = repair(mesh, "orient,untangle,elliptic")
    assert done.last.bad == 0
    assert not any("stopped" in text for text in done.refused)
    assert not repair(done.after, "orient,untangle,elliptic").changed


@pytest.mark.parametrize("name", PLACING)
def test_a_second_run_changes_nothing(name):
    for table in (swan(18), thrown(quarter(graded(8, 1.4), graded(9, 1.0)), 0.02), deep_bump(16, 0.5)):
        done = repair(mesh_of(table), name)
        again = repair(done.after, name)
        assert again.after is done.after


@pytest.mark.parametrize("name", PLACING)
def test_a_turned_scaled_shifted_and_renumbered_mesh_gets_the_same_places(name):
    mesh = mesh_of(thrown(quarter(graded(8, 1.5), graded(9, 1.0)), 0.02))
    done = repair(mesh, name)
    assert done.changed
    other, into = shuffled(replace(mesh, points=17.0 * turned(mesh.points) + [40.0, -30.0, 0.0]))
    again = repair(other, name)
    expected = 17.0 * turned(done.after.points) + [40.0, -30.0, 0.0]
    assert np.abs(again.after.points[into] - expected).max() < 1e-7


@pytest.mark.parametrize("name", PLACING)
def test_sides_and_borders_between_blocks_stay_to_the_last_bit(name):
    mesh = disc(brick(np.linspace(-1, 1, 7), np.linspace(-1, 1, 7)), 4)
    sides = np.unique(np.concatenate([np.r_[g.points[0], g.points[-1], g.points[:, 0], g.points[:, -1]]
                                      for g in structured_grids(mesh)]))  # fmt: skip
    free = np.setdiff1d(np.arange(len(mesh.points)), sides)
    points = np.array(mesh.points)
    points[free, :2] += np.random.default_rng(3).uniform(-0.1, 0.1, (len(free), 2))
    done = repair(replace(mesh, points=points), name)
    assert done.changed
    assert np.array_equal(done.after.points[sides], points[sides])
    assert done.last.worst > done.first.worst


@pytest.mark.parametrize("name", PLACING)
def test_a_block_with_a_held_point_inside_stays_and_is_told_of(name):
    points, cells = square(8, 0.3)
    mesh = replace(solid(points, quad=cells), zones=(Zone("probe", "node set", "", "point", np.array([40])),))
    done = repair(mesh, name)
    assert not done.changed
    assert "1 held points inside" in done.refused[0]


def test_a_block_that_would_get_worse_stays_and_the_others_are_placed():
    one = mesh_of(thrown(quarter(graded(8, 1.0), graded(8, 1.0)), 0.03))
    two = repair(mesh_of(swan(20)), "winslow").after  # its transfinite interpolation folds
    points = np.vstack([one.points + [10.0, 0.0, 0.0], two.points])
    mesh = solid(points, quad=np.vstack([one.blocks[0].nodes, two.blocks[0].nodes + len(one.points)]))
    done = repair(mesh, "tfi")
    moved = (done.after.points != mesh.points).any(axis=1)
    assert moved[: len(one.points)].sum() == 7 * 7
    assert not moved[len(one.points) :].any()
    assert len(done.refused) == 1
    assert "20 x 20" in done.refused[0]
    assert "more cells inverted or turned over" in done.refused[0]


def test_surfaces_in_space_and_meshes_without_blocks_are_left_alone():
    points, cells = square(6, 0.2)
    dome = np.c_[points[:, :2], np.sin(3.0 * points[:, 0])]
    shell = Mesh(dome, (CellBlock("quad", np.arange(len(cells)), cells),), dimension=3)
    assert "surface in space" in repair(shell, "tfi").refused[0]
    points, tris = square(3)[0], np.array([[0, 1, 5], [0, 5, 4]])
    assert "no structured block" in repair(solid(points[:6], tri=tris), "tfi").refused[0]


@settings(max_examples=15, deadline=None)
@given(st.integers(3, 7), st.integers(3, 7), st.integers(0, 10**6), st.floats(0.0, 0.3))
def test_tfi_reproduces_straight_sided_quadrilaterals(n, m, seed, skew):
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    corner = corner + np.random.default_rng(seed).uniform(-skew, skew, (4, 2))
    s, t = np.meshgrid(graded(n, 1.0), graded(m, 1.0), indexing="ij")
    w = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t], axis=-1)
    exact = w @ corner
    assert np.abs(tfi_points(thrown(exact, 0.1, seed), OPEN2) - exact).max() < 1e-13


# smoothing point by point


def arrow(kind):
    """A V of triangles or quads around one point in its tip; the mean of its neighbours lies outside."""
    rim = [(0, 0), (4, 3), (3.5, 3.3), (0, 1), (-3.5, 3.3), (-4, 3)]
    points = np.array([(*p, 0.0) for p in [(0.0, 0.5), *rim]], float)
    if kind == "tri":
        return solid(points, tri=[[0, 1 + k, 1 + (k + 1) % 6] for k in range(6)])
    return solid(points, quad=[[0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 1]])


@pytest.mark.parametrize("kind", ["tri", "quad"])
def test_plain_smoothing_harms_a_concave_patch_and_is_rolled_back_and_the_guarded_one_does_not(kind):
    mesh = arrow(kind)
    assert (signed_sizes(mesh) > 0.0).all()
    proposal = laplace(mesh, Options()).mesh
    assert (signed_sizes(proposal) < 0.0).any()
    done = repair(mesh, "laplace")
    assert done.steps[0].state == "rolled back"
    assert done.after is mesh
    for name in ("smart-laplace", "odt"):
        done = repair(mesh, name)
        assert (signed_sizes(done.after) > 0.0).all()
        assert done.last.worst >= done.first.worst


@pytest.mark.parametrize("kind", ["tri", "quad"])
def test_a_surface_that_plain_smoothing_would_turn_over_is_refused(kind):
    flat = arrow(kind)
    wall = replace(flat, points=flat.points[:, [2, 0, 1]], dimension=3)
    done = repair(wall, "laplace")
    assert not done.changed
    assert "turned over" in done.refused[0]
    guarded = repair(wall, "smart-laplace").after
    assert np.abs(guarded.points - repair(flat, "smart-laplace").after.points[:, [2, 0, 1]]).max() < 1e-12


def test_blocks_in_a_plane_above_the_ground_are_placed_as_on_it():
    flat = mesh_of(swan(18))
    high = replace(flat, points=flat.points + [0.0, 0.0, 2.0], dimension=3)
    one, two = repair(flat, "elliptic").after.points, repair(high, "elliptic").after.points
    assert np.array_equal(one[:, :2], two[:, :2])
    assert (two[:, 2] == 2.0).all()
    smooth = repair(flat, "winslow").after
    again = repair(replace(smooth, points=smooth.points + [0.0, 0.0, 2.0], dimension=3), "tfi")
    assert not again.changed
    assert "turned over" in again.refused[0]


def test_a_flat_triangle_that_is_turned_over_whole_is_seen_by_the_driver():
    mesh = arrow("tri")
    row = Pass("p", "p", laplace, nothing_worse="in regions")
    outcome = laplace(mesh, Options())
    # as if nothing was wrong with the qualities, which have no sign
    same = standing(mesh)
    assert "turned over" in broken(row, mesh, outcome, same, same, Options())


def test_plain_smoothing_of_tets_is_rolled_back_and_the_guarded_ones_raise_the_worst_and_the_mean():
    mesh = random_tets(300)
    assert not repair(mesh, "laplace").changed
    for name in ("smart-laplace", "odt"):
        done = repair(mesh, name)
        assert done.last.worst > done.first.worst
        assert done.last.quality.mean() > standing(done.before).quality.mean() + 0.04
        assert not repair(done.after, name).changed


def pyramids(n=4, jitter=0.2):
    """Every hex of a thrown block cut into six pyramids over its faces."""
    points, hexes = box(n, jitter)
    apex = len(points) + np.arange(len(hexes))
    sides = ([0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0])
    return solid(np.vstack([points, points[hexes].mean(axis=1)]),
                 pyramid=np.vstack([np.c_[hexes[:, side], apex] for side in sides]))  # fmt: skip


TYPES = {
    "tri": lambda: random_triangles(8),
    "quad": lambda: solid(square(9, 0.4)[0], quad=square(9)[1]),
    "tet": lambda: random_tets(150),
    "pyramid": lambda: pyramids(3),
    "hex": lambda: solid(box(5, 0.35)[0], hex=box(5)[1]),
    "wedges and tets": hybrid_layers,
}


@pytest.mark.parametrize("kind", TYPES)
def test_a_guarded_pass_lets_no_neighbourhood_fall_and_keeps_what_is_held(kind):
    mesh = TYPES[kind]()
    for run in (smart_laplace, odt):
        outcome = run(mesh, Options())
        if run is smart_laplace:
            assert outcome.changed > 0
        first, last = standing(mesh), standing(outcome.mesh)
        row = Pass("p", "p", run)
        assert broken(row, mesh, outcome, first, last, Options()) == ""
        held = held_points(mesh, Options())
        assert np.array_equal(outcome.mesh.points[held], mesh.points[held])


@kernel
def qualities(points, cells, kind, z, out):
    for c in range(cells.shape[0]):
        out[c] = quality_at(points, cells, c, kind, (0.0, 0.0, z))


@pytest.mark.parametrize("kind", KINDS)
def test_the_quality_by_which_moves_are_kept_is_the_drivers(kind):
    mesh = TYPES[kind]()
    nodes = mesh.blocks[0].nodes
    cells = np.full((len(nodes), 8), -1)
    cells[:, : nodes.shape[1]] = nodes
    own, expected = np.empty(len(nodes)), standing(mesh).quality
    qualities(mesh.points, cells, KINDS.index(kind), 1.0, own)
    right = signed_sizes(mesh) > 0.0
    assert np.abs(own - expected)[right].max() < 1e-12
    assert (own[~right] < (-1.0 if kind in ("tri", "quad") else 0.0)).all()


@pytest.mark.parametrize("name", ["laplace", "smart-laplace", "odt"])
def test_smoothing_does_not_depend_on_threads_or_on_a_turn_of_the_mesh(name):
    mesh = random_triangles(12)
    one, two = repair(mesh, name, threads=1), repair(mesh, name, threads=3)
    assert one.changed
    assert np.array_equal(one.after.points, two.after.points)
    other = repair(replace(mesh, points=5.0 * turned(mesh.points)), name)
    assert np.abs(other.after.points - 5.0 * turned(one.after.points)).max() < 1e-9


def test_plain_smoothing_of_a_thrown_square_comes_near_to_the_even_one():
    mesh = solid(square(6, 0.3)[0], quad=square(6)[1])
    done = repair(mesh, "laplace")
    assert np.abs(done.after.points - square(6)[0]).max() < 0.03


@pytest.mark.parametrize("start", [(0.3, -0.4), (-0.2, 0.6)])
def test_odt_puts_a_point_among_points_of_a_circle_into_its_centre_wherever_it_starts(start):
    t = 2.0 * np.pi * np.arange(7) / 7.0
    rim = np.c_[np.cos(t), np.sin(t), 0 * t]
    mesh = solid(np.vstack([[*start, 0.0], rim]), tri=[[0, 1 + k, 1 + (k + 1) % 7] for k in range(7)])
    assert np.abs(repair(mesh, "odt").after.points[0]).max() < 1e-12
    ball = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
    tets = [[0, 1 + i, 3 + j, 5 + k] if (i + j + k) % 2 == 0 else [0, 3 + j, 1 + i, 5 + k]
            for i in (0, 1) for j in (0, 1) for k in (0, 1)]  # fmt: skip
    mesh = solid(np.vstack([[*start, 0.1], ball]), tet=tets)
    assert (signed_sizes(mesh) > 0.0).all()
    assert np.abs(repair(mesh, "odt").after.points[0]).max() < 1e-12


def test_points_of_a_surface_move_in_planes_alone():
    points, quads = square(8, 0.35)
    roof = np.c_[points[:, :2], np.abs(points[:, 0] - 0.5)]
    mesh = Mesh(roof, (CellBlock("quad", np.arange(len(quads)), quads),), dimension=3)
    assert (roof[:, 0] != 0.5).sum() > 60  # the ridge runs through cells: there nothing is plane
    for name in ("laplace", "smart-laplace"):
        after = repair(mesh, name).after.points
        moved = (after != roof).any(axis=1)
        assert moved.sum() > 15
        assert np.abs(after[moved, 2] - np.abs(after[moved, 0] - 0.5)).max() < 1e-12
