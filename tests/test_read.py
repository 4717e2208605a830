"""One reading function for all formats: content decides, errors are one tree, nothing heavy is imported early."""

import csv
import gzip
import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.errors import ReadError, UnsupportedError, UsageError
from meshwright.audit.readers import FORMATS, guess_format, read

GMSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
3
1 0 0 0
2 1 0 0
3 0 1 0
$EndNodes
$Elements
1
1 2 2 1 1 1 2 3
$EndElements
"""
# path -> points, cells and boundary elements, from independent readings of these files
REAL = {
    "abaqus/solid2.inp": (200, {"tet": 559}),
    "medit/mmg_cube.mesh": (152, {"tet": 373, "line": 60, "tri": 300}),
    "medit/ega.meshb": (421, {"tet": 2122, "line": 76, "tri": 296}),
    "nastran/contact_model.bdf": (1080, {"hex": 675}),
    "netgen/shaft.vol.gz": (958, {"tet": 2690, "tri": 1748, "line": 708}),
    "su2/mesh_NACA0012_inv.su2": (5233, {"tri": 10216, "line": 250}),
    "tetgen/octahedron.node": (330, {"tet": 1224}),
    "ugrid/box.b8.ugrid": (8000, {"hex": 6859, "quad": 2166}),
    "vtk/TriQuadraticHexahedron.vtu": (117, {"hex27": 7}),
    "vtk/grid_in_vtk_3d_04.vtk": (889, {"hex": 512, "quad": 259}),
    "xdmf/mesh.xdmf": (970, {"tri6": 484}),
    "surface/Vase.stl": (5457, {"tri": 10910}),
    "surface/shark.ply": (2560, {"polygon": 121, "quad": 2253, "tri": 188}),
    "surface/trimesh_ballA.off": (1900, {"tri": 3796}),
    "avs_ucd/3d_test_abaqus.ucd": (576, {"hex": 375, "quad": 150}),
    "med/ShapeRecognCone.med": (957, {"tri": 1910, "line": 97}),
    "gmsh/petsc_pyr_tet.msh": (62, {"tet": 186, "pyramid": 24, "quad": 24}),
    "fluent_legacy/elbow.cas.gz": (9203, {"tet": 45637}),
}


@pytest.mark.parametrize("name", REAL)
def test_real_files_have_the_counts_of_the_index(shared: Path, name: str) -> None:
    mesh = read(shared / "meshes" / name)
    points, cells = REAL[name]
    assert len(mesh.points) == points
    assert {block.type: len(block) for block in (*mesh.blocks, *mesh.boundary)} == cells
    assert mesh.path == str(shared / "meshes" / name)
    indexed = {row["path"]: row for row in csv.DictReader(_lines(shared / "meshes/INDEX.tsv"), delimiter="\t")}
    assert indexed[name]["nodes"] in (str(points), "")


def _lines(path: Path) -> list[str]:
    return path.read_text().splitlines()


@pytest.mark.parametrize(
    ("folder", "words"),
    [
        ("ansys_cdb/hex.cdb", "ANSYS Mechanical APDL"),
        ("cgns/cylinder3D.cgns", "CGNS"),
        ("fluent_h5/case.cas.h5", "Fluent HDF5"),
        ("gambit_neu/cube.neu", "GAMBIT"),
        ("femap_neu/cp2anti.neu", "FEMAP"),
        ("femap_neu/all_elem_test_giv_eb.neu", "FEMAP"),
        ("ideas_unv/dealii_mesh.unv", "I-DEAS"),
        ("lsdyna/mesh.k", "LS-DYNA"),
        ("mfem_native/amr-hex.mesh", "MFEM"),
        ("avs_ucd/cellsnd.bin.inp", "binary AVS"),
        ("openfoam/OpenFOAM.zip", "zip"),
    ],
)
def test_formats_that_are_not_read_are_named_with_advice(shared: Path, folder: str, words: str) -> None:
    with pytest.raises(UnsupportedError, match=words) as caught:
        read(shared / "meshes" / folder)
    assert "can be read (" in str(caught.value)


def test_content_decides_and_not_the_suffix(tmp_path: Path) -> None:
    for name in ("mesh.inp", "mesh.stl", "mesh", "mesh.msh"):
        (tmp_path / name).write_text(GMSH)
        assert guess_format(tmp_path / name).name == "gmsh"
        assert read(tmp_path / name).counts == {"tri": 1}


def test_packed_files_are_read_whatever_they_are_called(tmp_path: Path) -> None:
    (tmp_path / "mesh.msh").write_bytes(gzip.compress(GMSH.encode()))
    assert read(tmp_path / "mesh.msh").dimension == 2


def test_standard_input_is_read_and_called_by_its_dash(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(gzip.compress(GMSH.encode()))))
    mesh = read("-")
    assert (mesh.path, mesh.counts) == ("-", {"tri": 1})
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"")))
    with pytest.raises(ReadError, match=r"^-: expected a mesh"):
        read("-")


def test_unknown_content_is_described(tmp_path: Path) -> None:
    (tmp_path / "mesh.vtu").write_text("hello")
    with pytest.raises(UnsupportedError, match=r"VTK XML unstructured grid by its name.*begins with b'hello'"):
        read(tmp_path / "mesh.vtu")
    (tmp_path / "mesh.vtu").write_bytes(bytes(range(200, 256)))
    with pytest.raises(UnsupportedError, match="bytes c8 c9"):
        read(tmp_path / "mesh.vtu")


def test_a_given_format_passes_over_the_recognition(tmp_path: Path) -> None:
    (tmp_path / "mesh.msh").write_text(GMSH)
    assert read(tmp_path / "mesh.msh", format="gmsh").n_cells == 1
    with pytest.raises(ReadError, match="vtk"):
        read(tmp_path / "mesh.msh", format="vtk")
    with pytest.raises(UsageError, match="unknown format 'nonsense'"):
        read(tmp_path / "mesh.msh", format="nonsense")


def test_what_is_not_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.msh").touch()
    (tmp_path / "loop.msh").symlink_to("loop.msh")
    for name in ("missing.msh", "empty.msh", "loop.msh", "nul\0.msh"):
        with pytest.raises(ReadError):
            read(tmp_path / name)
    with pytest.raises(ReadError):
        read(tmp_path)


def test_progress_names_the_format(tmp_path: Path) -> None:
    (tmp_path / "mesh.msh").write_text(GMSH)
    said: list[str] = []
    read(tmp_path / "mesh.msh", progress=said.append)
    assert len(said) == 1
    assert "Gmsh MSH" in said[0]


def test_importing_the_readers_loads_nothing_heavy() -> None:
    code = (
        "import sys, meshwright.audit.readers; print(*sorted({'numba', 'meshio', 'pandas', 'h5py'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_the_registry_is_sound() -> None:
    names = [row.name for row in FORMATS]
    assert len(set(names)) == len(names)
    for row in FORMATS:
        assert row.route in ("own", "meshio")
        assert (row.route == "meshio") == bool(row.meshio)
        assert all(suffix.startswith(".") or suffix == "/" for suffix in row.suffixes)
        assert ":" in row.reader


def test_two_readings_give_equal_meshes(tmp_path: Path) -> None:
    (tmp_path / "mesh.msh").write_text(GMSH)
    one, two = read(tmp_path / "mesh.msh"), read(str(tmp_path / "mesh.msh"))
    assert np.array_equal(one.points, two.points)
    assert one.path == two.path
