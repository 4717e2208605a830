"""OpenFOAM's checkMesh as second opinion: every number it prints, on a dozen meshes, beside ours.

A line of its report with a figure in it that is neither compared nor skipped for a reason fails the test.
"""

import math
import runpy
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import Voronoi

from meshwright.audit.connectivity import cell_components, edges, faces, faces_of_cells, nodes_of_cells
from meshwright.audit.geometry import bounds, cell_geometry, face_geometry
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Faces, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.readers.openfoam.reader import read_openfoam

HERE = Path(__file__).parent
foam = runpy.run_path(str(HERE / "foam_cases.py"))
parse = runpy.run_path(str(HERE / "checkmesh_report.py"))["parse"]
hybrid_mesh = runpy.run_path(str(HERE / "hybrid.py"))["hybrid_mesh"]

FACE_IDS = (
    "face.area", "openfoam.non_orthogonality_deg", "openfoam.skewness", "openfoam.face_weight", "openfoam.volume_ratio",
    "openfoam.flatness", "openfoam.face_pyramid", "openfoam.concave_angle",
)  # fmt: skip


def aspect_of_an_inverted_cell(mesh):
    """1e-150 in place of a volume below it."""
    seen = on_cells(mesh, np.abs(face_geometry(mesh).area), False).sum(axis=1)
    return (seen / 6 / np.maximum(cell_geometry(mesh).volume, 1e-150) ** (2 / 3)).max()


def supplement_of_the_turn(mesh):
    """The arc sine of a turn: the largest one of all corners of all faces, nearest to a right angle."""
    table, worst = faces(mesh), 0.0
    for (a, b), area in zip(loops(table, table.owner >= 0), face_geometry(mesh).area, strict=True):
        p = mesh.points[table.nodes[a:b]]
        edge = p - np.roll(p, 1, axis=0)
        edge /= np.linalg.norm(edge, axis=1)[:, None]
        turn = np.cross(edge, np.roll(edge, -1, axis=0))
        worst = max(worst, np.linalg.norm(turn[turn @ area < 0], axis=1).max(initial=0))
    return math.degrees(math.asin(min(worst, 1)))


def mean_ratio_of_signed_volumes(mesh):
    """Of two negative volumes the larger over the smaller, which is above 1."""
    table, volume = faces(mesh), cell_geometry(mesh).volume
    pair = volume[np.stack([table.owner, table.neighbour])[:, table.neighbour >= 0]]
    return (pair.min(axis=0) / pair.max(axis=0)).mean()


KNOWN = {
    ("broken", "aspect ratio"): (math.inf, aspect_of_an_inverted_cell),
    ("broken", "concave angle"): (172.41678946902798, supplement_of_the_turn),
    ("broken", "mean volume ratio"): (0.39052492575675235, mean_ratio_of_signed_volumes),
}
"""(case, quantity) in which the two differ: our number, and what makes OpenFOAM's. All three are its shortcuts."""


def stretched_mesh():
    """Few cells, pulled about until some have slack, folded and concave faces."""
    return hybrid_mesh(3, n=4, jitter=0.45)


def broken_mesh():
    """The same but worse: inverted cells, faces seen from behind."""
    return hybrid_mesh(5, n=4, jitter=0.7)


def slender_mesh():
    """Boxes of 1 by 1 by 1/4000, one of them a third of its neighbour's height."""
    mesh = hybrid_mesh(2, n=3, jitter=0.0)
    x, y, z = mesh.points.T
    return Mesh(np.column_stack([x, y, np.where(z < 1, z / 300, z) / 4000]), mesh.blocks)


def voronoi_mesh():
    """The bounded cells of a random Voronoi diagram, in one piece: general polyhedra."""
    n = 200
    diagram = Voronoi(np.random.default_rng(11).uniform(0, 1, (n, 3)))
    bounded = [c for c in range(n) if -1 not in diagram.regions[diagram.point_region[c]]]
    row = {c: r for r, c in enumerate(bounded)}
    loops, owner, neighbour = [], [], []
    for (a, b), ridge in zip(diagram.ridge_points.tolist(), diagram.ridge_vertices, strict=True):
        if a not in row and b not in row:
            continue
        low, high = (b, a) if a not in row or (b in row and row[b] < row[a]) else (a, b)
        p = diagram.vertices[ridge]
        area = np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)
        loops.append(ridge if area @ (diagram.points[high] - diagram.points[low]) > 0 else ridge[::-1])
        owner.append(row[low])
        neighbour.append(row.get(high, -1))
    used, nodes = np.unique(np.concatenate(loops), return_inverse=True)
    table = Faces(np.cumsum([0, *map(len, loops)]), nodes, owner, neighbour)
    of_cell = [np.flatnonzero((table.owner == r) | (table.neighbour == r)) for r in range(len(bounded))]
    block = CellBlock("polyhedron", np.arange(len(bounded)), offsets=np.cumsum([0, *map(len, of_cell)]),
                      items=np.concatenate(of_cell))  # fmt: skip
    return Mesh(diagram.vertices[used], (block,), faces=table)


def sample(name):
    def build(case, shared):
        del shared
        shutil.copytree(HERE.parent / "samples" / name, case)
        return foam["settle"](case)

    return build


def cavity(case, shared):
    zipfile.ZipFile(shared() / "meshes/openfoam/OpenFOAM.zip").extractall(case)
    return foam["settle"](case / "OpenFOAM/cavity")


CASES = {
    "leaning blocks": lambda case, _: foam["block_mesh"](case, foam["LEANING"]),
    "dual of leaning blocks": lambda case, _: foam["dual"](case, foam["LEANING"], 30),
    "dual of a cube": lambda case, _: foam["dual"](case, foam["CUBE"].replace("N", "5"), 60),
    "some cells refined": lambda case, _: foam["refined"](case, foam["LEANING"], range(0, 120, 7)),
    "ball cut out": lambda case, _: foam["snapped"](case, 7),
    "sector": lambda case, _: foam["block_mesh"](case, foam["SECTOR"]),
    "hybrid": lambda case, _: foam["write_case"](case, hybrid_mesh(3, n=4, jitter=0.2)),
    "stretched": lambda case, _: foam["write_case"](case, stretched_mesh()),
    "broken": lambda case, _: foam["write_case"](case, broken_mesh()),
    "slender": lambda case, _: foam["write_case"](case, slender_mesh()),
    "voronoi": lambda case, _: foam["write_case"](case, voronoi_mesh()),
    "sample of all types": sample("hybrid/hybrid-openfoam"),
    "sample of hexagonal prisms": sample("cells/polyhedron-openfoam"),
    "sample of an aerofoil": sample("aerofoil/naca0012-c-openfoam"),
    "cavity": cavity,
}


def on_cells(mesh, columns, inner_alone, back=1):
    """(n_cells, k) sums over the faces of each cell of (f, k) numbers, `back` times them for the neighbour."""
    table = faces(mesh)
    inner = table.neighbour >= 0
    own = inner if inner_alone else np.ones(len(table), bool)
    sums = np.zeros((mesh.n_cells, columns.shape[1]))
    np.add.at(sums, table.owner[own], columns[own])
    np.add.at(sums, table.neighbour[inner], back * columns[inner])
    return sums


def concave_cells(mesh):
    """Cells one of whose face centres lies before the plane of another of their faces, by OpenFOAM's 1e-6."""
    offsets, items = faces_of_cells(mesh)
    table, geometry, count = faces(mesh), face_geometry(mesh), 0
    with np.errstate(invalid="ignore"):
        for c in range(mesh.n_cells):
            rows = items[offsets[c] : offsets[c + 1]]
            normal = geometry.area[rows] * np.where(table.owner[rows] == c, 1, -1)[:, None]
            way = geometry.centre[rows][None] - geometry.centre[rows][:, None]
            cosine = (normal[:, None] * way).sum(axis=2)
            cosine /= np.linalg.norm(normal, axis=1)[:, None] * np.linalg.norm(way, axis=2)
            count += bool((cosine[~np.eye(len(rows), dtype=bool)] > -1e-6).any())
    return count


def figures(mesh, directions):
    """The quantities of a report from our tables and metrics."""
    table, geometry, volume = faces(mesh), face_geometry(mesh), cell_geometry(mesh).volume
    face = {id_: by["face"] for id_, by in measure(mesh, FACE_IDS, threads=1).values.items()}
    inner, nodes = table.neighbour >= 0, np.diff(table.offsets)
    ours = {"points": len(mesh.points), "faces": len(table), "internal faces": inner.sum(), "cells": mesh.n_cells}
    ours["faces per cell"] = (len(table) + inner.sum()) / mesh.n_cells
    kinds = [zone.kind for zone in mesh.zones]
    ours |= {"patches": kinds.count("patch"), "cell zones": kinds.count("cellZone")}
    ours |= {"face zones": kinds.count("faceZone"), "point zones": kinds.count("pointZone")}
    ours |= {name: mesh.counts.get(name, 0) for name in ("hex", "wedge", "pyramid", "tet", "polyhedron")}
    ours |= {"OpenFOAM wedges": 0, "tet wedges": 0, "regions": cell_components(mesh).max() + 1}
    ours |= {f"box {i}": value for i, value in enumerate(bounds(mesh).ravel())}

    outside = np.zeros(len(mesh.points), bool)
    outside[np.concatenate([table.nodes[a:b] for a, b in loops(table, ~inner)])] = True
    every = edges(mesh)
    rim = {tuple(sorted(pair)) for a, b in loops(table, ~inner)
           for pair in zip(table.nodes[a:b].tolist(), np.roll(table.nodes[a:b], -1).tolist(), strict=True)}  # fmt: skip
    within = np.array([tuple(pair) not in rim for pair in every.tolist()])
    touching = outside[every[within]].sum(axis=1)
    ours |= {"internal points": (~outside).sum(), "edges": len(every), "internal edges": within.sum()}
    ours |= {"edges from the boundary": (touching == 1).sum(), "edges across": (touching == 2).sum()}
    count = on_cells(mesh, np.ones((len(table), 1)), True)[:, 0]
    ours |= {"cells of one inner face": (count == 1).sum(), "cells of two inner faces": (count == 2).sum()}

    area = face["face.area"]
    hull = geometry.area[~inner].sum(axis=0) / area[~inner].sum()
    ours |= {f"boundary openness {i}": value for i, value in enumerate(hull)}
    signed = on_cells(mesh, geometry.area, False, back=-1)
    plain = on_cells(mesh, np.abs(geometry.area), False)
    ours["openness"] = (np.abs(signed) / np.where(plain > 0, plain, 1)).max()
    seen = plain[:, directions]
    aspect = seen.max(axis=1) / seen.min(axis=1)
    if directions.all():
        with np.errstate(invalid="ignore", divide="ignore"):
            bulk = np.where(volume > 0, plain.sum(axis=1) / 6 / volume ** (2 / 3), np.inf)
        aspect = np.maximum(aspect, bulk)
    ours |= {"aspect ratio": aspect.max(), "slender cells": (aspect > 1000).sum()}
    ours |= {"least area": area.min(), "largest area": area.max()}
    ours |= {"least volume": volume.min(), "largest volume": volume.max(), "volume": volume.sum()}
    ours["cells without volume"] = (volume <= 0).sum()

    angle = face["openfoam.non_orthogonality_deg"][inner]
    cosine = np.cos(np.radians(angle))
    ours |= {
        "worst non-orthogonality": angle.max(),
        "mean non-orthogonality": math.degrees(math.acos(min(cosine.mean(), 1))),
    }
    ours |= {
        "severely non-orthogonal": ((angle > 70) & (angle < 90)).sum(),
        "beyond a right angle": (angle >= 90).sum(),
    }
    ours["non-orthogonal"] = (angle > 70).sum()
    ours["faces of negative pyramids"] = (face["openfoam.face_pyramid"] < -1e-15).sum()
    skew = face["openfoam.skewness"]
    ours |= {"skewness": skew.max(), "skew faces": (skew > 4).sum()}
    length = np.linalg.norm(mesh.points[every[:, 1]] - mesh.points[every[:, 0]], axis=1)
    ours |= {"shortest edge": length.min(), "longest edge": length.max()}
    turn = face["openfoam.concave_angle"]
    ours |= {"concave faces": (turn >= 10).sum(), "concave angle": turn.max()}
    flat = face["openfoam.flatness"][nodes > 3]
    ours |= {"least flatness": flat.min(initial=1), "mean flatness": flat.mean() if len(flat) else 1.0}
    ours |= {"warped faces": (flat < 0.8).sum(), "0.8": 0.8, "0.05": 0.05, "0.01": 0.01}
    determinant = determinants(mesh, directions)
    ours |= {"least determinant": determinant.min(), "mean determinant": determinant.mean()}
    ours["undetermined cells"] = (determinant < 1e-3).sum()
    ours["concave cells"] = concave_cells(mesh)
    for name, id_, limit in (("weight", "openfoam.face_weight", 0.05), ("volume ratio", "openfoam.volume_ratio", 0.01)):
        column = face[id_][inner]
        ours |= {f"least {name}": column.min(), f"mean {name}": column.mean()}
        ours[f"faces of small {name}"] = (column < limit).sum()
    return ours


def loops(table, chosen):
    rows = np.flatnonzero(chosen)
    return zip(table.offsets[rows].tolist(), table.offsets[rows + 1].tolist(), strict=True)


def determinants(mesh, directions):
    """`openfoam.determinant`; in 2-D, where OpenFOAM leaves out the direction of empty patches, from the areas."""
    if directions.all():
        found = measure(mesh, ["openfoam.determinant"], threads=1).values["openfoam.determinant"]
        return np.concatenate([found[block.type] for block in mesh.blocks])
    area = face_geometry(mesh).area
    count = on_cells(mesh, np.ones((len(area), 1)), True)[:, 0]
    mean = on_cells(mesh, np.linalg.norm(area, axis=1)[:, None], True)[:, 0] / count
    products = (area[:, :, None] * area[:, None]).reshape(-1, 9)
    tensor = on_cells(mesh, products, True).reshape(-1, 3, 3) / mean[:, None, None] ** 2
    (out,) = np.flatnonzero(~directions)
    tensor[:, out, out] = 1.0
    return np.abs(np.linalg.det(tensor)) / 8


ANGLES = {"worst non-orthogonality", "mean non-orthogonality"}


def same(name, ours, theirs):
    """Whether two numbers agree to all digits that both can have: OpenFOAM takes its angles from a cosine."""
    if name in ANGLES:
        return abs(math.cos(math.radians(ours)) - math.cos(math.radians(theirs))) < 1e-13
    return ours == pytest.approx(theirs, rel=1e-10, abs=1e-13)


@pytest.fixture(scope="module")
def looked_at(tmp_path_factory, request):
    """{name of a case: (our mesh, what checkMesh says of it)}, each made when first asked for."""
    made = {}

    def look(name):
        if name not in made:
            case = CASES[name](tmp_path_factory.mktemp("foam") / "case", lambda: request.getfixturevalue("shared"))
            report = foam["tool"]("checkMesh", case, "-constant", "-allGeometry", "-allTopology")
            made[name] = read_openfoam(case), parse(report)
        return made[name]

    return look


@pytest.mark.parametrize("name", CASES)
def test_every_number_that_checkmesh_prints_is_ours(name, looked_at):
    mesh, (theirs, patches, zones, counts, directions, left) = looked_at(name)
    assert left == []
    assert len(theirs) > 40
    theirs = dict(theirs)
    ours = figures(mesh, directions)
    for key in [key for case, key in KNOWN if case == name]:
        stated, explain = KNOWN[name, key]
        assert (ours[key], explain(mesh)) == (pytest.approx(stated, rel=1e-9), pytest.approx(theirs[key], rel=1e-9)), (
            key
        )
        assert not same(key, float(ours[key]), theirs.pop(key)), key
    assert {key: (ours[key], value) for key, value in theirs.items() if not same(key, float(ours[key]), value)} == {}
    told = {zone.name: zone for zone in mesh.zones if zone.kind == "patch"}
    for patch, numbers in patches.items():
        rows = told[patch].members
        used = np.unique(
            np.concatenate([mesh.faces.nodes[mesh.faces.offsets[f] : mesh.faces.offsets[f + 1]] for f in rows])
        )
        corners = mesh.points[used]
        assert numbers == pytest.approx([len(rows), len(used), *corners.min(axis=0), *corners.max(axis=0)], abs=1e-15)
    check_zones(mesh, zones)
    sides = np.diff(mesh.block("polyhedron").offsets) if "polyhedron" in mesh.counts else np.array([], int)
    assert counts == dict(zip(*(array.tolist() for array in np.unique(sides, return_counts=True)), strict=True))


def check_zones(mesh, zones):
    """Cells, points, volume and box of the cell zones; of an empty one OpenFOAM prints a box turned inside out."""
    offsets, items = nodes_of_cells(mesh)
    volume = cell_geometry(mesh).volume
    for zone in mesh.cell_zones:
        rows = zone.members
        numbers = zones.pop(zone.name)
        used = np.unique(np.concatenate([items[:0], *(items[offsets[c] : offsets[c + 1]] for c in rows)]))
        corners = mesh.points[used]
        box = [*corners.min(axis=0), *corners.max(axis=0)] if len(rows) else numbers[3:]
        assert numbers == pytest.approx([len(rows), len(used), volume[rows].sum(), *box], rel=1e-12, abs=1e-15)
    assert zones == {}


@pytest.mark.parametrize("name", CASES)
def test_the_metrics_of_cells_have_the_extremes_of_checkmesh(name, looked_at):
    """Those of them that are defined on all types of a mesh."""
    mesh, (theirs, _, _, _, directions, _) = looked_at(name)
    seen = 0
    for id_, reduce, key in (
        ("volume", np.min, "least volume"),
        ("edge.min", np.min, "shortest edge"),
        ("edge.max", np.max, "longest edge"),
        ("openfoam.openness", np.max, "openness"),
        ("openfoam.aspect_ratio", np.max, "aspect ratio"),
        ("openfoam.min_flatness", np.min, "least flatness"),
        ("openfoam.concave", lambda column: (column > -1e-6).sum(), "concave cells"),
    ):
        if (name, key) in KNOWN:
            continue
        flat = id_ == "openfoam.aspect_ratio" and not directions.all()
        if (
            id_ in METRICS
            and all(block.type in METRICS[id_].on for block in mesh.blocks)
            and key in theirs
            and not flat
        ):
            columns = measure(mesh, [id_], threads=1).values[id_].values()
            assert same(key, float(reduce(np.concatenate(list(columns)))), theirs[key]), id_
            seen += 1
    assert seen >= 3


def test_the_cases_show_every_fault_that_is_counted(looked_at):
    seen = set()
    for name in CASES:
        if name != "cavity":
            seen |= {key for key, value in looked_at(name)[1][0].items() if value > 0}
    faults = {
        "severely non-orthogonal", "beyond a right angle", "faces of negative pyramids", "skew faces", "concave faces",
        "warped faces", "undetermined cells", "concave cells", "faces of small volume ratio", "slender cells",
        "cells without volume", "faces of small weight",
    }  # fmt: skip
    assert faults - seen == set()


def test_checkmesh_turns_a_concave_angle_beyond_a_right_one_into_its_supplement(tmp_path):
    # An L whose inner corner is pulled out: the rim turns back by 120 degrees there.
    ring = [(0, 0), (2, 0), (2, 2), (1, 2 - 3**0.5), (0, 2)]
    points = np.array([(x, y, z) for z in (0, 1) for x, y in ring], float)
    sides = [(4, 3, 2, 1, 0), (5, 6, 7, 8, 9), *((i, (i + 1) % 5, (i + 1) % 5 + 5, i + 5) for i in range(5))]
    table = Faces(np.cumsum([0, *map(len, sides)]), np.concatenate(sides), [0] * 7, [-1] * 7)
    mesh = Mesh(points, (CellBlock("polyhedron", [0], offsets=[0, 7], items=np.arange(7)),), faces=table)
    case = foam["write_case"](tmp_path / "case", mesh)
    theirs = parse(foam["tool"]("checkMesh", case, "-constant", "-allGeometry", "-allTopology"))[0]
    turn = measure(mesh, ["openfoam.concave_angle"], threads=1).values["openfoam.concave_angle"]["face"]
    assert (theirs["concave faces"], theirs["concave angle"]) == (2, pytest.approx(60, rel=1e-12))
    assert turn[:2] == pytest.approx([120, 120], rel=1e-12)
