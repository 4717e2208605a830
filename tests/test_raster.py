"""Pictures without a graphics card: what covers what, and that nothing bad is ever left out."""

import dataclasses
import io
import math

import matplotlib.image
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from meshwright.audit import audit, read
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import CellBlock, Faces, Mesh
from meshwright.reports.png import png
from meshwright.reports.raster import DARK, LIGHT, VIEWS, picture
from meshwright.reports.raster_scene import Camera, scene_of, shapes_of, views_of

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
RED, BLUE = (200, 0, 0), (0, 0, 200)
NONE = np.empty(0, int)
SQUARE = (100, 100)
"""Too small for axes, so that all that is drawn is the mesh."""


def row_of_cubes(n, scale=1.0, offset=0.0):
    """n unit cubes side by side along x, each with its own points."""
    points = scale * (CUBE + np.arange(n)[:, None, None] * (1.0, 0, 0)).reshape(-1, 3) + offset
    return Mesh(points, (CellBlock("hex", np.arange(n), np.arange(8 * n).reshape(n, 8)),))


def block(n):
    """n x n x n hexes that share their points."""
    line = np.arange(n + 1.0)
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    i, j, k = (a.ravel() for a in np.meshgrid(*3 * [np.arange(n)], indexing="ij"))
    row = lambda a, b, c: ((i + a) * (n + 1) + j + b) * (n + 1) + k + c  # noqa: E731
    corners = [row(*c) for c in CUBE.astype(int)]
    return Mesh(points, (CellBlock("hex", np.arange(n**3), np.column_stack(corners)),))


BLOCK = block(12)


def covered(image, theme=LIGHT):
    return (image != np.array(theme.back)).any(axis=2)


def reddish(image):
    whole = image.astype(int)
    return whole[..., 0] - np.maximum(whole[..., 1], whole[..., 2])


@pytest.mark.parametrize("view", ["x", "y", "z"])
def test_a_cube_seen_along_an_axis_is_a_square(view):
    share = covered(picture(row_of_cubes(1), NONE, size=SQUARE, view=view)).mean()
    assert share == pytest.approx(0.96**2, abs=0.005)  # 94 of 100 pixels each way, and its outline of a pixel


def test_a_cube_seen_askew_covers_the_projections_of_its_three_sides():
    image = picture(row_of_cubes(1), NONE, size=(200, 100), view="iso")
    turn = Camera.fitting(CUBE, "iso", (0, 0, 200, 100)).turn
    seen = CUBE @ turn.T
    wide, tall = np.ptp(seen, axis=0)[:2]
    scale = 0.94 * min(200 / wide, 100 / tall)
    area = np.abs(turn[2]).sum() * scale**2  # each side of area 1 is seen by the cosine of its tilt
    outline = ConvexHull(seen[:, :2]).area * scale  # its length, in 2-D
    assert covered(image).sum() == pytest.approx(area + outline, rel=0.01)


def test_a_rectangle_keeps_its_proportions():
    image = covered(picture(row_of_cubes(4), NONE, size=SQUARE, view="z"))
    assert image.any(axis=0).sum() / image.any(axis=1).sum() == pytest.approx(4, rel=0.06)


def test_right_is_x_and_up_is_z_in_a_view_from_the_front():
    image = picture(row_of_cubes(2), [1], RED, size=SQUARE, view="y")
    columns = np.flatnonzero((reddish(image) > 50).any(axis=0))
    assert columns.min() >= 49
    tall = Mesh(CUBE * (1, 1, 1), (CellBlock("tet", [0], [[0, 1, 3, 4]]),))
    rows = covered(picture(tall, NONE, size=SQUARE, view="y")).sum(axis=1)
    assert rows[10] < rows[90]  # a corner up at z = 1, an edge down at z = 0


def test_a_cell_behind_another_is_hidden_by_it():
    colours = [RED, BLUE]
    image = picture(row_of_cubes(2), [0, 1], colours, size=SQUARE, view="x").astype(int)
    blue, red = image[..., 2] > image[..., 0] + 60, image[..., 0] > image[..., 2] + 60
    assert blue.sum() > 8000
    assert red.sum() == 0


def test_a_cell_inside_shines_through_the_shell_and_one_outside_is_stronger():
    middle, corner = 6 * 144 + 6 * 12 + 6, 11 * 144 + 11  # the second at x = 11, y = 0, z = 11: nearest to the eye
    inside, outside = (
        reddish(picture(BLOCK, [row], RED, size=(400, 400), view="iso")).max() for row in (middle, corner)
    )
    assert 60 < inside < outside


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 12**3 - 1), st.sampled_from([*VIEWS, "all"]), st.sampled_from([LIGHT, DARK]))
def test_a_bad_cell_always_leaves_a_pixel(row, view, theme):
    image = picture(BLOCK, [row], RED, size=(64, 48), view=view, theme=theme)
    assert reddish(image).max() > 60


def test_one_cell_in_a_million_leaves_a_pixel():
    n = 1000
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    points = np.stack(np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij"), -1).reshape(-1, 2)
    points = np.column_stack([points, np.zeros(len(points))])
    row = lambda a, b: (i + a) * (n + 1) + j + b  # noqa: E731
    nodes = np.column_stack([row(0, 0), row(1, 0), row(1, 1), row(0, 1)])
    plane = Mesh(points, (CellBlock("quad", np.arange(n * n), nodes),), dimension=2)
    image = picture(plane, [123_456], RED, size=(90, 90))
    y, x = np.unravel_index(reddish(image).argmax(), image.shape[:2])
    assert reddish(image).max() > 100
    assert (x / 90, 1 - y / 90) == (pytest.approx(0.123, abs=0.05), pytest.approx(0.456, abs=0.05))


@pytest.mark.parametrize("scale", [1e-200, 1e-12, 1.0, 1e12, 1e200, 1e308 / 4])
def test_size_changes_nothing(scale):
    image = picture(row_of_cubes(2, scale), [1], RED, size=SQUARE)
    assert np.array_equal(image, picture(row_of_cubes(2), [1], RED, size=SQUARE))


def test_a_mesh_far_from_the_origin_looks_the_same():
    far, near = (picture(row_of_cubes(2, 1.0, offset), [1], RED, size=SQUARE) for offset in (1e9, 0.0))
    assert np.array_equal(far, near)


def test_points_that_are_not_finite_are_left_out_and_the_rest_is_shown():
    sound = row_of_cubes(3)
    points = sound.points.copy()
    points[16] = math.nan
    broken = dataclasses.replace(sound, points=points)
    image = picture(broken, [2], RED, size=SQUARE, view="y")
    assert covered(image).sum() > 1000
    assert reddish(image).max() > 60  # a dot at the mean of the corners that are finite
    points[:] = math.inf
    assert not covered(picture(dataclasses.replace(sound, points=points), [0], RED, size=SQUARE)).any()


def test_a_cell_without_size_is_a_dot():
    flat = Mesh(np.zeros((8, 3)), (CellBlock("hex", [0], [np.arange(8)]),))
    assert reddish(picture(flat, [0], RED, size=SQUARE)).max() > 60


TRIANGLE = Mesh(CUBE[:4], (CellBlock("tri", [0, 1], [[0, 1, 2], [0, 2, 3]]),), dimension=2)
POLYHEDRON = Mesh(
    CUBE,
    (CellBlock("polyhedron", [0], offsets=[0, 6], items=np.arange(6)),),
    faces=Faces(
        np.arange(0, 25, 4), [0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7], [0] * 6, [-1] * 6
    ),
)
SHELL = Mesh(CUBE, (CellBlock("quad", [0, 1], [[0, 1, 2, 3], [1, 5, 6, 2]]),))
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
MIDDLES = [CORNERS[[a, b]].mean(axis=0) for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
TET10 = Mesh(np.array([*CORNERS, *MIDDLES]), (CellBlock("tet10", [0], [np.arange(10)]),))
POLYGON = Mesh(CUBE[:4], (CellBlock("polygon", [0], offsets=[0, 4], items=[0, 1, 2, 3]),), dimension=2)


@pytest.mark.parametrize("mesh", [TRIANGLE, POLYHEDRON, SHELL, TET10, POLYGON], ids=lambda mesh: mesh.blocks[0].type)
def test_every_kind_of_mesh_is_drawn_and_its_cells_are_coloured(mesh):
    plain, marked = (picture(mesh, rows, RED, size=(200, 150)) for rows in (NONE, [0]))
    assert covered(plain).mean() > 0.1
    assert reddish(plain).max() <= 0
    assert (reddish(marked) > 60).sum() > 300


@pytest.mark.parametrize(("entity", "row"), [("face", 0), ("point", 3)])
def test_faces_and_points_can_be_shown_too(entity, row):
    image = picture(row_of_cubes(1), [row], RED, entity=entity, size=SQUARE)
    assert (reddish(image) > 60).sum() >= 4


def test_a_planar_mesh_is_seen_from_above_alone_and_a_solid_from_three_sides():
    assert views_of(scene_of(TRIANGLE), flat=True) == ("z",)
    assert views_of(scene_of(row_of_cubes(3)), flat=False)[0] == "iso"
    assert set(views_of(scene_of(row_of_cubes(3)), flat=False)[1:]) == {"y", "z"}  # along x there is least to see
    plate = Mesh(CUBE[:4], (CellBlock("quad", [0], [[0, 1, 2, 3]]),))
    assert views_of(scene_of(plate), flat=False) == ("iso", "z")


def test_creases_are_the_edges_of_a_cube_and_not_the_lines_between_its_cells():
    assert len(scene_of(row_of_cubes(1)).feature_edges) == 12
    assert len(scene_of(block(4)).feature_edges) == 12 * 4
    assert len(scene_of(block(4)).edges) == 2 * 6 * 16


def test_shapes_know_whose_they_are():
    shapes = shapes_of(row_of_cubes(3), "cell", np.array([2, 0]))
    assert np.bincount(shapes.owner).tolist() == [6, 6]
    assert shapes.middles.tolist() == [[2.5, 0.5, 0.5], [0.5, 0.5, 0.5]]
    assert shapes.sizes.tolist() == [1, 1]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"rows": [7]}, "rows of cells go from 0 to 1, got 7"),
        ({"rows": [-1]}, "got -1"),
        ({"rows": [0], "view": "w"}, "unknown view 'w'"),
        ({"rows": [0], "size": (3, 100)}, "16 to 8192"),
        ({"rows": [0], "size": (10**6, 100)}, "16 to 8192"),
    ],
)
def test_what_cannot_be_drawn_is_refused(options, said):
    with pytest.raises(UsageError, match=said):
        picture(row_of_cubes(2), **options)


def decoded(data):
    """By Pillow, which matplotlib reads with."""
    return np.rint(255 * matplotlib.image.imread(io.BytesIO(data), "png")[..., :3]).astype(np.uint8)


def test_a_picture_of_few_colours_is_kept_to_the_bit():
    image = np.random.default_rng(1).integers(0, 4, (37, 53, 3)).astype(np.uint8) * 80
    assert len(np.unique(image.reshape(-1, 3), axis=0)) == 64
    assert np.array_equal(decoded(png(image)), image)


def test_every_colour_is_kept_where_that_is_asked_for():
    image = np.random.default_rng(2).integers(0, 256, (37, 53, 3)).astype(np.uint8)
    assert np.array_equal(decoded(png(image, exact=True)), image)


def test_a_rare_strong_colour_is_not_lost_among_a_thousand_greys():
    rng = np.random.default_rng(3)
    image = np.clip(rng.integers(90, 240, (200, 300, 1)) + rng.integers(-4, 5, (200, 300, 3)), 0, 255).astype(np.uint8)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 5000
    image[50, 70] = (200, 20, 20)
    found = decoded(png(image)).astype(int)
    assert np.abs(found[50, 70] - (200, 20, 20)).max() < 24
    assert np.abs(found - image).mean() < 6


def test_the_demo_mesh_with_its_worst_cells_takes_few_bytes(request):
    mesh = read(request.config.rootpath / "samples" / "demo.msh.gz")
    values = audit(mesh).measured.values["gambit.equiangle_skew"]["tet"]
    rows = mesh.block("tet").rows[np.argsort(values)[-100:]]
    assert len(png(picture(mesh, rows))) < 60_000
