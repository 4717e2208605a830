"""Meshes from the wild, each read once: counts, zones, volumes, worst cells and findings against independent values.

The counts are those of the index beside the meshes, made with other programs; volumes and skewness are computed here in
plain numpy from the faces, and by VTK. What is special to one reader stands in the tests of that reader.
"""

import ast
import csv
import math
import zipfile

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.geometry import cell_geometry
from meshwright.audit.readers import read
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise

FORMATS = ("fluent_legacy", "gmsh")

# What these files are known to hold: points, cells, dimension.
KNOWN = {
    "fluent_legacy/elbow.cas.gz": (9203, {"tet": 45637}, 3),
    "fluent_legacy/mixer-ran_2019r3.cas.gz": (43413, {"hex": 860, "polyhedron": 13075}, 3),
    "fluent_legacy/axial_comp.msh": (16660, {"hex": 13856}, 3),
    "fluent_legacy/plate.cas.gz": (6324, {"hex": 3025}, 3),
    "fluent_legacy/flow_over_cylinder.msh": (47545, {"tri": 21, "quad": 46928}, 2),
    "fluent_legacy/Static_Mixer_Parameters_legacy_text.cas.gz": (82247, {"polyhedron": 22771}, 3),
    "fluent_legacy/Static_Mixer_Parameters_legacy_binary.cas.gz": (82247, {"polyhedron": 22771}, 3),
    "fluent_legacy/petsc_cube_5tets.cas": (8, {"tet": 5}, 3),
    "fluent_legacy/petsc_cube_5tets_ascii.cas": (8, {"tet": 5}, 3),
    "openfoam/cavity": (882, {"hex": 400}, 3),
    "openfoam/64BitFloats": (12, {"hex": 2}, 3),
}

# The index's words for elements; third order counts as its corners.
WORDS = {
    "poly": "polyhedron",
    "Point": "vertex",
    "Line 2": "line",
    "Line 3": "line3",
    "Line 4": "line",
    "Triangle 3": "tri",
    "Triangle 6": "tri6",
    "Triangle 10": "tri",
    "Quadrilateral 4": "quad",
    "Quadrilateral 8": "quad8",
    "Quadrilateral 9": "quad9",
    "Tetrahedron 4": "tet",
    "Tetrahedron 20": "tet",
    "Prism 6": "wedge",
    "Pyramid 5": "pyramid",
    "Hexahedron 8": "hex",
    "Hexahedron 20": "hex20",
}

# Mirrored throughout: two hex meshes (by VTK's volume sign as well) and a flat one whose normal is -z.
MIRRORED = {
    "gmsh/dealii_grid_in_msh_01.3da.v4.msh": 200,
    "gmsh/dealii_grid_in_msh_01.3da.v41.msh": 200,
    "gmsh/horn.msh": 5239,
}
# Every finding of every mesh but those; the unused points were counted with a plain scan of the face sections.
FINDINGS = {
    "fluent_legacy/flow_over_cylinder.msh": {"mixed-element-types": 21},
    "fluent_legacy/Static_Mixer_Parameters_legacy_binary.cas.gz": {"hanging-nodes": 50},
    "fluent_legacy/Static_Mixer_Parameters_legacy_text.cas.gz": {"hanging-nodes": 50},
    "fluent_legacy/axial_comp.msh": {"nonconformal-interface": 419},
    "fluent_legacy/mixer-ran_2019r3.cas.gz": {"mixed-element-types": 860, "unused-points": 2107, "hanging-nodes": 585},
    "gmsh/horn.msh": {"near-points": 28},
    "gmsh/shelf.msh": {"open-edges": 48, "not-watertight": 48},
    "gmsh/petsc_hybrid_tetwedge.msh": {"mixed-element-types": 99},
    "gmsh/petsc_pyr_tet.msh": {"mixed-element-types": 24},
    "gmsh/rectangle-mix-p2.msh": {"mixed-element-types": 42},
}

# Corners of the faces of each type, outward; a flat cell is its own face.
FACES = {
    "tri": ["012"],
    "quad": ["0123"],
    "tet": ["021", "013", "123", "032"],
    "pyramid": ["0321", "014", "124", "234", "304"],
    "wedge": ["021", "345", "0143", "1254", "2035"],
    "hex": ["0321", "4567", "0154", "1265", "2376", "3047"],
}


@pytest.fixture(scope="module")
def meshes(shared, tmp_path_factory):
    """Every mesh of the formats read natively, by its place in the collection."""
    found = {
        f"{path.parent.name}/{path.name}": read(path) for f in FORMATS for path in (shared / "meshes" / f).iterdir()
    }
    cases = tmp_path_factory.mktemp("openfoam")
    zipfile.ZipFile(shared / "meshes/openfoam/OpenFOAM.zip").extractall(cases)
    # Its boundary file announces two patches and holds one; checkMesh refuses it too.
    boundary = cases / "OpenFOAM/64BitFloats/constant/polyMesh/boundary"
    boundary.write_text(boundary.read_text().replace("\n2\n(", "\n1\n("))
    return found | {f"openfoam/{name}": read(cases / "OpenFOAM" / name) for name in ("cavity", "64BitFloats")}


@pytest.fixture(scope="module")
def documents(meshes):
    """The audit of each of them."""
    return {path: summarise(audit(mesh), sha256="") for path, mesh in meshes.items()}


@pytest.mark.parametrize("path", KNOWN)
def test_a_known_mesh_has_its_points_and_cells(meshes, path):
    mesh = meshes[path]
    assert (len(mesh.points), mesh.counts, mesh.dimension) == KNOWN[path]


def test_every_mesh_has_the_counts_of_the_index(shared, meshes):
    lines = (shared / "meshes/INDEX.tsv").read_text().splitlines()
    rows = {row["path"]: row for row in csv.DictReader(lines, delimiter="\t") if row["format"] in FORMATS}
    assert len(rows) == 36
    assert rows.keys() == {path for path in meshes if not path.startswith("openfoam")}
    for path, row in rows.items():
        mesh, expected = meshes[path], {}
        for word, n in ast.literal_eval(row["cells"]).items():
            expected[WORDS.get(word, word)] = n
        found = {block.type: len(block) for block in (*mesh.blocks, *mesh.boundary)}
        assert (path, len(mesh.points), found) == (path, int(row["nodes"]), expected)
        assert (path, row["dim"][0]) == (path, str(mesh.dimension if path != "gmsh/shelf.msh" else 2))


def test_every_zone_has_a_name_and_every_fluent_cell_and_face_is_in_one(meshes):
    for path, mesh in meshes.items():
        assert mesh.zones, path
        assert all(zone.name.strip() and len(zone.members) for zone in mesh.zones), path
        assert len({(zone.entity, zone.name) for zone in mesh.zones}) == len(mesh.zones), path
        if path.startswith("fluent"):
            assert sum(len(z.members) for z in mesh.zones if z.entity == "cell") == mesh.n_cells, path
            assert sum(len(z.members) for z in mesh.zones if z.entity == "face") == len(mesh.faces), path
            assert {z.role for z in mesh.zones if z.entity == "cell"} <= {"fluid", "solid"}, path


def test_the_text_and_the_binary_static_mixer_are_the_same_mesh(meshes):
    text, twin = (meshes[f"fluent_legacy/Static_Mixer_Parameters_legacy_{kind}.cas.gz"] for kind in ("text", "binary"))
    assert np.array_equal(text.points, twin.points)  # 17 digits are printed: to the last bit
    for name in ("offsets", "nodes", "owner", "neighbour"):
        assert np.array_equal(getattr(text.faces, name), getattr(twin.faces, name))
    assert [(z.name, z.role, z.members.tolist()) for z in text.zones] == [
        (z.name, z.role, z.members.tolist()) for z in twin.zones
    ]


def surface_integral(mesh):
    """Volume (or area) by the divergence theorem over the boundary faces (edges) alone: no cell is looked at."""
    faces, total = mesh.faces, 0.0
    for face in np.flatnonzero(faces.neighbour < 0).tolist():
        x = mesh.points[faces.nodes[faces.offsets[face] : faces.offsets[face + 1]]]
        if len(x) == 2:
            total += (x[0, 0] * x[1, 1] - x[1, 0] * x[0, 1]) / 2
            continue
        centre, after = x.mean(axis=0), np.roll(x, -1, axis=0)
        total += np.sum(np.cross(x - centre, after - centre) * (x + after + centre)) / 18
    return abs(total)


def test_cells_fill_the_space_inside_the_boundary_and_none_is_inside_out(meshes):
    checked = 0
    for path, mesh in meshes.items():
        if mesh.cell_dimension == 2 and mesh.dimension == 3:
            continue  # a shell encloses nothing
        volume = cell_geometry(mesh).volume
        if path in MIRRORED:
            assert volume.max() < 0, path
            continue
        assert volume.min() > 0, path
        if mesh.faces is not None:
            # Where faces are warped the volume of a face is a matter of definition: polyhedra agree to 5 digits.
            bound = 2e-5 if "polyhedron" in mesh.counts else 1e-9
            assert volume.sum() == pytest.approx(surface_integral(mesh), rel=bound), path
            checked += 1
    assert checked >= 20


@pytest.mark.parametrize(
    ("path", "size"),
    [
        ("fluent_legacy/lid_driven_cavity.msh", 1.0),
        ("fluent_legacy/petsc_square.cas", 1.0),
        ("fluent_legacy/petsc_cube_5tets.cas", 1000.0),
        ("gmsh/petsc_gmsh-3d-ascii.msh2", 1.0),
        ("gmsh/petsc_pyr_tet.msh", 1.0),
        ("gmsh/petsc_cube_q3.msh", 1.0),
        ("gmsh/rectangle-mix-p2.msh", 3.0),
        ("gmsh/dealii_input_v2.msh", 4.0),
        ("openfoam/cavity", 1e-4),
    ],
)
def test_boxes_have_the_size_of_their_bounds(meshes, path, size):
    mesh = meshes[path]
    extent = np.ptp(mesh.points, axis=0)[: mesh.dimension]
    assert math.prod(extent) == pytest.approx(size, rel=1e-5)
    assert cell_geometry(mesh).volume.sum() == pytest.approx(math.prod(extent), rel=1e-9)


FIGURES = {
    *("features", "blocks", "size-jump", "chordal-deviation", "delaunay-violations", "misplaced-pyramids"),
    *("boundary-layers", "wall-orthogonality"),
}
"""Findings that describe a mesh and name no fault."""


def test_findings_are_true_and_no_others_are_made(documents):
    for path, document in documents.items():
        found = {f["code"]: f["count"] for f in document["findings"] if f["code"] not in FIGURES}
        expected = FINDINGS.get(path, {})
        if path in MIRRORED:
            expected = expected | {"node-order-convention": MIRRORED[path]}
        assert (path, found) == (path, expected)
        warned = "node-order-convention" in found or "unused-points" in found
        assert (path, document["gate"]["verdict"]) == (path, "warn" if warned else "pass")


def plain_skew(points, kind):
    """Equi-angle skew of (n, corners, 3) cells by arc cosines."""
    worst = np.zeros(len(points))
    for face in FACES[kind]:
        x = points[:, [int(corner) for corner in face]]
        before, after = np.roll(x, 1, axis=1) - x, np.roll(x, -1, axis=1) - x
        lengths = np.linalg.norm(before, axis=2) * np.linalg.norm(after, axis=2)
        angles = np.degrees(np.arccos(np.clip(np.sum(before * after, axis=2) / lengths, -1, 1)))
        ideal = 60.0 if len(face) == 3 else 90.0
        worst = np.maximum(worst, (angles.max(axis=1) - ideal) / (180 - ideal))
        worst = np.maximum(worst, (ideal - angles.min(axis=1)) / ideal)
    return worst


def test_skewness_tables_and_worst_cells_are_those_of_plain_arc_cosines(meshes, documents):
    compared = 0
    for path, mesh in meshes.items():
        document = documents[path]
        shares = {row["type"]: row for row in document["quality"]}
        for block in mesh.blocks:
            kind = CELL_TYPES[block.type].corners
            if kind == "polyhedron":
                continue
            skew = plain_skew(mesh.points[block.nodes[:, : CELL_TYPES[kind].n_nodes]], kind)
            row = shares[block.type]
            assert (path, row["count"], row["over_0_8"]) == (path, len(skew), np.count_nonzero(skew > 0.8))
            assert row["worst_equiangle_skew"] == pytest.approx(skew.max(), abs=1e-6), path
            below = np.cumsum(document["distributions"]["equiangle_skew"]["counts"][block.type])
            for k in range(1, 10):  # a cell on an edge to rounding may fall either way
                least, most = (np.count_nonzero(skew < k / 10 + slack) for slack in (-1e-8, 1e-8))
                assert least <= below[k - 1] <= most, (path, k)
            assert below[-1] == len(skew), path
            by_id = dict(zip(mesh.ids_of_cells(block.rows).tolist(), range(len(block)), strict=True))
            for worst in document["metrics"]["gambit.equiangle_skew"][block.type]["worst"]:
                at = by_id[worst["cell"]]
                assert worst["value"] == pytest.approx(skew[at], abs=1e-6), path
                corners = mesh.points[block.nodes[at][: CELL_TYPES[kind].n_nodes]]
                assert worst["centroid"] == pytest.approx(corners.mean(axis=0), abs=1e-9 * np.abs(corners).max()), path
            compared += 1
    assert compared >= 36


def test_vtk_measures_the_same_volumes_and_areas(meshes):
    filters = pytest.importorskip("vtkmodules.vtkFiltersVerdict", reason="VTK is the oracle")
    arrays = pytest.importorskip("vtkmodules.util.numpy_support")
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    for path, mesh in meshes.items():
        own = audit(mesh, "volume,area").measured.values["volume" if mesh.cell_dimension == 3 else "area"]
        for block in mesh.blocks:
            corners = CELL_TYPES[CELL_TYPES[block.type].corners]
            if corners.name == "polyhedron":
                continue
            nodes = np.ascontiguousarray(block.nodes[:, : corners.n_nodes], dtype=np.int64)
            points, cells, grid = vtkPoints(), vtkCellArray(), vtkUnstructuredGrid()
            points.SetData(arrays.numpy_to_vtk(mesh.points))
            ends = np.arange(0, nodes.size + 1, nodes.shape[1], dtype=np.int64)
            cells.SetData(arrays.numpy_to_vtkIdTypeArray(ends), arrays.numpy_to_vtkIdTypeArray(nodes.ravel()))
            grid.SetPoints(points)
            grid.SetCells(corners.vtk, cells)
            sizes = filters.vtkCellSizeFilter()
            sizes.SetInputData(grid)
            sizes.Update()
            name = "Volume" if mesh.cell_dimension == 3 else "Area"
            found = arrays.vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray(name))
            np.testing.assert_allclose(np.abs(own[block.type]), np.abs(found), rtol=1e-9, err_msg=path)
            if mesh.cell_dimension == 3:
                assert np.all(np.sign(own[block.type]) == (-1 if path in MIRRORED else 1)), path
