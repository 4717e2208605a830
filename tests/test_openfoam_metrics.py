"""OpenFOAM's cell metrics: closed forms, broken cells, and checkMesh on the same mesh."""

import math
import os
import re
import runpy
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.connectivity import faces
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import NO_CELL

_HERE = Path(__file__).parent
_GOLDEN = runpy.run_path(str(_HERE / "test_golden.py"))
values_of, box = _GOLDEN["values_of"], _GOLDEN["box"]
hybrid_mesh = runpy.run_path(str(_HERE / "hybrid.py"))["hybrid_mesh"]

ASPECT, PYRAMID, FLATNESS = "openfoam.aspect_ratio", "openfoam.min_pyramid", "openfoam.min_flatness"
CONCAVE, OPEN = "openfoam.concave", "openfoam.openness"
ROOT2, ROOT3 = math.sqrt(2), math.sqrt(3)
CORNER = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
MITRE = [(0, 0, 0), (1, 0, 0), (0.5, 0.5, 0), (0, 1, 0)]
SADDLE_BASE = [(0, 0, 0.25), (1, 0, -0.25), (1, 1, 0.25), (0, 1, -0.25), *box(1, 1, 1)[4:]]
BOW_TIE_TOP = [*SQUARE, (0, 0, 1), (1, 1, 1), (1, 0, 1), (0, 1, 1)]
TURNED = [((x - y) / ROOT2, (x + y) / ROOT2, z) for x, y, z in box(1, 1, 1)]
PUSHED_IN = [*box(1, 1, 1)[:6], (0.2, 0.2, 0.2), (0, 1, 1)]

CLOSED_FORMS = [
    ("cube", "hex", box(1, 1, 1), ASPECT, 1.0),
    # areas 16, 8 and 4 along the axes against 28/6 over 8^(2/3) = 7/6
    ("1 x 2 x 4 box", "hex", box(1, 2, 4), ASPECT, 4.0),
    # along x and y 4 faces of cos 45 degrees: 2 sqrt 2 against 2 along z
    ("cube turned by 45 degrees about z", "hex", TURNED, ASPECT, ROOT2),
    # three faces of 1/2 and the slanted one, 1/2 along each axis: 1 each; (1 + 1 + 1)/6 over (1/6)^(2/3)
    ("corner of a cube", "tet", CORNER, ASPECT, 0.5 * 6 ** (2 / 3)),
    ("mirrored cube", "hex", box(1, 1, -1), ASPECT, math.inf),
    ("cube without height", "hex", box(1, 1, 0), ASPECT, math.inf),
    ("all corners in one point", "hex", [(1, 2, 3)] * 8, ASPECT, math.inf),
    ("cube", "hex", box(1, 1, 1), PYRAMID, 1 / 6),
    ("mirrored cube", "hex", box(1, 1, -1), PYRAMID, -1 / 6),
    ("corner of a cube: a quarter of 1/6", "tet", CORNER, PYRAMID, 1 / 24),
    ("cube without height", "hex", box(1, 1, 0), PYRAMID, 0.0),
    ("cube", "hex", box(1, 1, 1), FLATNESS, 1.0),
    # four triangles of sqrt(h^2 + 1/4)/2 over an area of 1: 1/sqrt(1 + 4 h^2)
    ("cube on a saddle of h = 1/4", "hex", SADDLE_BASE, FLATNESS, 1 / math.sqrt(1.25)),
    ("tet: triangles are flat", "tet", CORNER, FLATNESS, 1.0),
    ("top in a figure of eight", "hex", BOW_TIE_TOP, FLATNESS, 0.0),
    ("cube without height: sides of no area have no shape", "hex", box(1, 1, 0), FLATNESS, 1.0),
    ("all corners in one point", "hex", [(1, 2, 3)] * 8, FLATNESS, 1.0),
    # from the centre of one side to that of the next: (-1/2, 0, 1/2)
    ("cube", "hex", box(1, 1, 1), CONCAVE, -1 / ROOT2),
    # from (1/3, 1/3, 0) to (0, 1/3, 1/3), seen along -x and -z
    ("corner of a cube: from the slanted face to another", "tet", CORNER, CONCAVE, -1 / ROOT3),
    ("mirrored cube: the opposite face lies before each face", "hex", box(1, 1, -1), CONCAVE, 1.0),
    ("two sides in one plane", "hex", [*MITRE, *((x, y, 1) for x, y, _ in MITRE)], CONCAVE, 0.0),
    ("all corners in one point", "hex", [(1, 2, 3)] * 8, CONCAVE, 0.0),
    ("cube", "hex", box(1, 1, 1), OPEN, 0.0),
    ("all corners in one point", "hex", [(1, 2, 3)] * 8, OPEN, 0.0),
]


@pytest.mark.parametrize(
    ("what", "kind", "points", "metric", "value"), CLOSED_FORMS, ids=[f"{r[3]}-{r[1]}-{r[0]}" for r in CLOSED_FORMS]
)
def test_closed_forms(what, kind, points, metric, value):
    assert values_of(kind, points, [metric])[metric] == pytest.approx(value, rel=1e-12, abs=1e-15)


def test_a_cell_with_a_corner_pushed_in_is_concave():
    assert values_of("hex", PUSHED_IN, [CONCAVE])[CONCAVE] > 0.2


def test_a_cell_given_by_its_nodes_is_closed():
    rng = np.random.default_rng(6)
    for kind, n in (("tet", 4), ("pyramid", 5), ("wedge", 6), ("hex", 8)):
        for _ in range(20):
            assert values_of(kind, rng.uniform(-1, 1, (n, 3)), [OPEN])[OPEN] < 1e-14


def write_case(mesh, folder):
    """An OpenFOAM case of this mesh with one patch, inner faces in the order OpenFOAM wants."""
    table = faces(mesh)
    inside = np.flatnonzero(table.neighbour != NO_CELL)
    inside = inside[np.lexsort((table.neighbour[inside], table.owner[inside]))]
    order = [*inside, *np.flatnonzero(table.neighbour == NO_CELL)]
    loops = [table.nodes[table.offsets[f] : table.offsets[f + 1]] for f in order]
    text = {
        "points": ("vectorField", ["(" + " ".join(map(repr, p)) + ")" for p in mesh.points.tolist()]),
        "faces": ("faceList", [f"{len(loop)}({' '.join(map(str, loop))})" for loop in loops]),
        "owner": ("labelList", [str(table.owner[f]) for f in order]),
        "neighbour": ("labelList", [str(table.neighbour[f]) for f in inside]),
        "boundary": (
            "polyBoundaryMesh",
            [f"walls {{ type wall; nFaces {len(order) - len(inside)}; startFace {len(inside)}; }}"],
        ),
    }
    poly, system = folder / "constant" / "polyMesh", folder / "system"
    for made in (poly, system, folder / "0"):
        made.mkdir(parents=True)
    head = "FoamFile {{ version 2.0; format ascii; class {}; object {}; }}\n"
    for name, (kind, rows) in text.items():
        (poly / name).write_text(head.format(kind, name) + f"{len(rows)}\n(\n" + "\n".join(rows) + "\n)\n")
    control = (
        "startFrom startTime; startTime 0; endTime 1; deltaT 1; writeInterval 1; writePrecision 17; writeFormat ascii;"
    )
    schemes = "gradSchemes {} divSchemes {} laplacianSchemes {}"
    for name, body in (("controlDict", "application none; " + control), ("fvSchemes", schemes), ("fvSolution", "")):
        (system / name).write_text(head.format("dictionary", name) + body)
    return folder


@pytest.mark.parametrize("jitter", [0.1, 0.45])
def test_checkmesh_says_the_same_of_a_mesh_of_all_four_types(jitter, tmp_path):
    if shutil.which("checkMesh") is None:
        pytest.skip("checkMesh of OpenFOAM is not installed")
    mesh = hybrid_mesh(3, n=5, jitter=jitter)
    case = write_case(mesh, tmp_path / "case")
    run = subprocess.run(
        ["checkMesh", "-case", str(case), "-allGeometry", "-writeFields", "(aspectRatio)"],
        capture_output=True, text=True, check=False, timeout=120, cwd=case,
        env={**os.environ, "WM_PROJECT_DIR": os.environ.get("WM_PROJECT_DIR", "/usr/share/openfoam")},
    )  # fmt: skip
    report = run.stdout
    assert run.returncode == 0, report[-2000:] + run.stderr[-2000:]

    def stated(pattern):
        found = re.search(pattern, report)
        return float(found[1]) if found else 0.0

    values = measure(mesh, [ASPECT, PYRAMID, FLATNESS, CONCAVE]).values
    v = {id_: np.empty(mesh.n_cells) for id_ in values}
    for block in mesh.blocks:
        for id_, by_type in values.items():
            v[id_][block.rows] = by_type[block.type]
    field = (case / "0" / "aspectRatio").read_text()
    theirs = np.array(field[field.index("(\n") + 2 : field.index("\n)")].split(), dtype=float)
    inverted = theirs > 1e30  # checkMesh divides by 1e-150 to the 2/3 where the volume is negative
    np.testing.assert_array_equal(np.isinf(v[ASPECT]), inverted)
    np.testing.assert_allclose(v[ASPECT][~inverted], theirs[~inverted], rtol=1e-9)
    assert v[FLATNESS].min() == pytest.approx(stated(r"minimum flatness, maximum warpage\) = (\S+)"), rel=1e-9) or (
        v[FLATNESS].min() == pytest.approx(stated(r"butterfly\) : min = (\S+)"), rel=1e-9)
    )
    assert (v[CONCAVE] > -1e-6).sum() == stated(r"Concave cells .*number of cells: (\d+)")
    assert ((v[PYRAMID] < 0).sum() > 0) == (stated(r"face pyramids: (\d+) faces") > 0)
    assert (jitter > 0.2) == ((v[CONCAVE] > -1e-6).sum() > 0)
