"""Formats read through meshio in a child process: what is kept, what is refused, what cannot get out of hand."""

import os
import struct
import sys
import time
from pathlib import Path

import meshio
import numpy as np
import pytest

from meshwright.audit.errors import ReadError, UnsupportedError
from meshwright.audit.findings import run_checks
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers import read
from meshwright.audit.readers.foreign import reader as via_meshio

POINTS = np.array(
    [
        *[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
        *[[2, 0, 0], [2, 0, 1], [0.5, 0.5, 2], [2.5, 1.25, 0.5]],
    ],
    dtype=float,
)
CELLS = {
    "triangle": [[1, 8, 2], [5, 6, 9]],
    "quad": [[0, 3, 2, 1]],
    "tetra": [[8, 2, 6, 11], [8, 6, 9, 11]],
    "pyramid": [[4, 5, 6, 7, 10]],
    "wedge": [[1, 8, 2, 5, 9, 6]],
    "hexahedron": [[0, 1, 2, 3, 4, 5, 6, 7]],
}
NAMES = {
    "triangle": "tri",
    "quad": "quad",
    "tetra": "tet",
    "pyramid": "pyramid",
    "wedge": "wedge",
    "hexahedron": "hex",
}
SOLID = ("tetra", "pyramid", "wedge", "hexahedron")


def write(path: Path, kinds: tuple[str, ...], file_format: str, **options: object) -> None:
    cells = [(kind, np.array(CELLS[kind])) for kind in kinds]
    tags = options.pop("tags", None)
    data = {tags: [np.arange(len(CELLS[kind]), dtype=np.int32) + 1 for kind in kinds]} if tags else {}
    meshio.write(path, meshio.Mesh(POINTS, cells, cell_data=data), file_format=file_format, **options)


@pytest.mark.parametrize(
    ("name", "file_format", "kinds", "options"),
    [
        ("m.vtk", "vtk42", tuple(CELLS), {"binary": True}),
        ("m.vtk", "vtk51", tuple(CELLS), {"binary": False}),
        ("m.vtu", "vtu", tuple(CELLS), {"compression": "zlib"}),
        ("m.mesh", "medit", tuple(CELLS), {}),
        ("m.meshb", "medit", tuple(CELLS), {}),
        ("m.inp", "abaqus", ("triangle", "quad", "tetra", "wedge", "hexahedron"), {}),
        ("m.bdf", "nastran", tuple(CELLS), {}),
        ("m.su2", "su2", SOLID, {}),
        ("m.lb8.ugrid", "ugrid", tuple(CELLS), {}),
        ("m.avs", "avsucd", tuple(CELLS), {}),
        ("m.xdmf", "xdmf", tuple(CELLS), {"data_format": "HDF"}),
        ("m.med", "med", tuple(CELLS), {}),
    ],
)
def test_a_mesh_of_all_types_comes_back_as_it_was_written(
    tmp_path: Path, name: str, file_format: str, kinds: tuple[str, ...], options: dict[str, object]
) -> None:
    write(tmp_path / name, kinds, file_format, **options)
    mesh = read(tmp_path / name)
    found = {block.type: block.nodes.tolist() for block in (*mesh.blocks, *mesh.boundary)}
    assert found == {NAMES[kind]: CELLS[kind] for kind in kinds}
    assert np.allclose(mesh.points, POINTS, rtol=0, atol=1e-12)
    assert {block.type for block in mesh.blocks} == {NAMES[kind] for kind in kinds if kind in SOLID}


def test_references_of_medit_become_zones_of_cells_and_faces(tmp_path: Path) -> None:
    write(tmp_path / "m.mesh", ("triangle", "tetra"), "medit", tags="medit:ref")
    zones = [(z.name, z.kind, z.entity, z.members.tolist()) for z in read(tmp_path / "m.mesh").zones]
    assert zones == [
        ("reference 1", "reference", "cell", [0]),
        ("reference 1", "reference", "face", [0]),
        ("reference 2", "reference", "cell", [1]),
        ("reference 2", "reference", "face", [1]),
    ]


SU2 = """NDIME= 3
NELEM= 1
10 0 1 2 3 0
NPOIN= 4
0 0 0 0
1 0 0 1
0 1 0 2
0 0 1 3
NMARK= 2
MARKER_TAG= far field
MARKER_ELEMS= 1
5 0 1 2
MARKER_TAG= wall
MARKER_ELEMS= 2
5 0 1 3
5 1 2 3
"""


def test_su2_markers_keep_their_names(tmp_path: Path) -> None:
    (tmp_path / "m.su2").write_text(SU2)
    zones = {z.name: (z.kind, z.entity, z.members.tolist()) for z in read(tmp_path / "m.su2").zones}
    assert zones == {"far field": ("marker", "face", [0]), "wall": ("marker", "face", [1, 2])}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("NELEM= 1", "NELEM= 2"),
        ("NPOIN= 4", "NPOIN= 3"),
        ("MARKER_ELEMS= 2", "MARKER_ELEMS= 1"),
        ("NDIME= 3", "NDIME= 2"),
    ],
)
def test_su2_counts_are_held_against_the_lines(tmp_path: Path, old: str, new: str) -> None:
    (tmp_path / "m.su2").write_text(SU2.replace(old, new))
    with pytest.raises(ReadError, match=r"line |three coordinates"):
        read(tmp_path / "m.su2")


def test_a_second_su2_zone_is_refused_and_not_mixed_with_the_first(tmp_path: Path) -> None:
    (tmp_path / "m.su2").write_text(SU2 + SU2)
    with pytest.raises(UnsupportedError, match="one zone"):
        read(tmp_path / "m.su2")


ZONES = f"NZONE= 2\nIZONE= 1\n{SU2}IZONE= 2 % the other\n{SU2}"


def test_su2_zones_are_parts_with_points_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "one.su2").write_text(SU2)
    (tmp_path / "two.su2").write_text(ZONES)
    one, two = read(tmp_path / "one.su2"), read(tmp_path / "two.su2")
    n = len(one.points)
    assert np.array_equal(two.points, np.tile(one.points, (2, 1)))
    assert (two.n_cells, two.n_boundary) == (2 * one.n_cells, 2 * one.n_boundary)
    for block in one.blocks:
        again = two.block(block.type)
        assert np.array_equal(again.nodes, np.vstack([block.nodes, block.nodes + n]))
        assert np.array_equal(again.rows, np.concatenate([block.rows, block.rows + one.n_cells]))
    markers = [zone.name for zone in one.zones]
    assert markers
    names = [zone.name for zone in two.zones]
    assert names == ["zone 1", *markers, "zone 2", *[f"{name} (2)" for name in markers]]
    parts = {zone.name: zone.members.tolist() for zone in two.cell_zones}
    assert parts["zone 2"] == list(range(one.n_cells, 2 * one.n_cells))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("NZONE= 2", "NZONE= 3", "3 zones, as NZONE says"),
        ("NZONE= 2", "NZONE= 1", "1 zones, as NZONE says"),
        ("NZONE= 2", "NZONE= 0", "1 to 256 zones"),
        ("NZONE= 2", "NZONE= 99999999", "1 to 256 zones"),
        ("IZONE= 2", "IZONE= 4", "IZONE= 2"),
        ("NZONE= 2\n", "NZONE= 2\nNDIME= 3\n", "NZONE, then IZONE= 1"),
    ],
)
def test_su2_zones_that_do_not_count_up_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    (tmp_path / "m.su2").write_text(ZONES.replace(old, new, 1))
    with pytest.raises(ReadError, match=words):
        read(tmp_path / "m.su2")


def test_a_fault_in_a_later_su2_zone_is_named_by_its_line_in_the_file(tmp_path: Path) -> None:
    head, _, tail = ZONES.rpartition("NELEM= 1")
    (tmp_path / "m.su2").write_text(f"{head}NELEM= 2{tail}")
    line = head.count("\n") + 1
    with pytest.raises(ReadError, match=f"1 more lines for line {line}"):
        read(tmp_path / "m.su2")


def test_the_pipe_of_five_su2_zones_is_read_whole(shared: Path) -> None:
    """A reader that takes the last points for all zones finds 4,117 cells of the wrong hand; there are none."""
    mesh = read(shared / "meshes/su2/pipe.su2")
    assert mesh.counts == {"tet": 41_402}
    assert [len(zone.members) for zone in mesh.cell_zones] == [8250, 8288, 8288, 8288, 8288]
    a, b, c, d = (mesh.points[mesh.block("tet").nodes[:, k]] for k in range(4))
    volume = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6
    assert (volume > 0).all()
    assert 0.97 * np.pi * 2.5 < volume.sum() < np.pi * 2.5


def test_abaqus_sets_become_zones_and_the_lost_numbers_are_in_the_ledger(tmp_path: Path) -> None:
    text = "*NODE\n10,0,0,0\n20,1,0,0\n30,0,1,0\n40,0,0,1\n50,1,1,1\n*ELEMENT, TYPE=C3D4, ELSET=solid\n"
    (tmp_path / "m.inp").write_text(
        f"{text}7,10,20,30,40\n8,20,30,40,50\n*NSET, NSET=fixed\n10,30\n*ELSET, ELSET=one\n8\n"
    )
    mesh = read(tmp_path / "m.inp")
    zones = {(z.name, z.entity): z.members.tolist() for z in mesh.zones}
    assert zones == {("solid", "cell"): [0, 1], ("one", "cell"): [1], ("fixed", "point"): [0, 2]}
    assert any("own numbers" in note for note in mesh.notes)


def two_boxes(folder: Path) -> Mesh:
    points = [[x, y, z] for x in (0, 1, 2) for y in (0, 1) for z in (0, 1)]

    def box(a: int) -> list[list[int]]:
        b = a + 4
        return [
            *[[a, a + 1, a + 3, a + 2], [b, b + 2, b + 3, b + 1], [a, b, b + 1, a + 1]],
            *[[a + 2, a + 3, b + 3, b + 2], [a, a + 2, b + 2, b], [a + 1, b + 1, b + 3, a + 3]],
        ]

    cells = [("polyhedron8", [[np.array(face) for face in box(a)] for a in (0, 4)])]
    meshio.write(folder / "poly.vtu", meshio.Mesh(np.array(points, float), cells))
    return read(folder / "poly.vtu")


def test_polyhedra_share_a_face_with_owner_and_neighbour(tmp_path: Path) -> None:
    mesh = two_boxes(tmp_path)
    assert mesh.counts == {"polyhedron": 2}
    assert mesh.faces is not None
    assert len(mesh.faces) == 11
    inner = np.flatnonzero(mesh.faces.neighbour >= 0)
    assert len(inner) == 1
    start, stop = mesh.faces.offsets[inner[0]], mesh.faces.offsets[inner[0] + 1]
    assert sorted(mesh.faces.nodes[start:stop].tolist()) == [4, 5, 6, 7]
    assert (mesh.faces.owner[inner[0]], mesh.faces.neighbour[inner[0]]) == (0, 1)
    block = mesh.block("polyhedron")
    assert block.offsets is not None
    assert block.items is not None
    assert block.offsets.tolist() == [0, 6, 12]
    assert set(block.items[:6].tolist()) & set(block.items[6:].tolist()) == {int(inner[0])}


VTK = """# vtk DataFile Version 4.2
x
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0 1 0 0 0 1 0 0 0 1
CELLS 1 5
4 0 1 2 3
CELL_TYPES 1
10
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("4 0 1 2 3", "4 0 1 2 4", "node rows from 0 to 3, found 4"),
        ("4 0 1 2 3", "4 0 1 2 -1", "node rows from 0 to 3, found -1"),
        ("0 0 0 1 0 0", "0 0 0 nan 0 0", "point 1: expected finite"),
        ("POINTS 4", "POINTS 4000000000", "vtk"),
        ("CELL_TYPES 1\n10\n", "", "vtk"),
        ("CELL_TYPES 1\n10", "CELL_TYPES 1\n1000", "vtk"),
    ],
)
def test_what_meshio_lets_pass_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in VTK
    (tmp_path / "m.vtk").write_text(VTK.replace(old, new, 1))
    with pytest.raises(ReadError, match=r".") as caught:
        read(tmp_path / "m.vtk")
    assert words in str(caught.value)


def test_a_claim_of_a_trillion_points_costs_no_memory(tmp_path: Path) -> None:
    text = "MeshVersionFormatted 2\nDimension 3\nVertices\n100000000000\n0 0 0 0\n"
    (tmp_path / "m.mesh").write_text(text)
    with pytest.raises(ReadError, match="medit"):
        read(tmp_path / "m.mesh")


def test_a_reader_that_never_ends_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(via_meshio, "_CPU_SECONDS", 1)
    (tmp_path / "m.mdpa").write_text("Begin Nodes\n 1 0 0 0\n")
    start = time.monotonic()
    with pytest.raises(ReadError, match=r"without end|mdpa"):
        read(tmp_path / "m.mdpa")
    assert time.monotonic() - start < 20


def test_sys_exit_inside_the_library_is_a_read_error(tmp_path: Path) -> None:
    (tmp_path / "m.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2 0\n")
    with pytest.raises(ReadError, match="off"):
        read(tmp_path / "m.off")


def xdmf(reference: str, file_format: str) -> str:
    return f"""<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid Name="g">
<Topology TopologyType="Triangle" NumberOfElements="1">
<DataItem DataType="Int" Dimensions="1 3" Format="XML">0 1 2</DataItem></Topology>
<Geometry GeometryType="XYZ">
<DataItem DataType="Float" Dimensions="3 3" Precision="8" Format="{file_format}">{reference}
</DataItem></Geometry></Grid></Domain></Xdmf>"""


@pytest.mark.parametrize(("reference", "kind"), [("{0}", "Binary"), ("../secret", "Binary"), ("{0}:/x", "HDF")])
def test_xdmf_may_not_refer_to_files_elsewhere(tmp_path: Path, reference: str, kind: str) -> None:
    secret = tmp_path / "secret"
    secret.write_bytes(struct.pack("<9d", 0, 0, 0, 1, 0, 0, 0, 1, 0))
    (tmp_path / "upload").mkdir()
    path = tmp_path / "upload" / "m.xdmf"
    path.write_text(xdmf(reference.format(secret), kind))
    with pytest.raises(ReadError, match="file of the same folder"):
        read(path)


def test_xdmf_may_not_reach_elsewhere_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "secret").write_bytes(struct.pack("<9d", 0, 0, 0, 1, 0, 0, 0, 1, 0))
    (tmp_path / "upload").mkdir()
    (tmp_path / "upload" / "data.bin").symlink_to(tmp_path / "secret")
    path = tmp_path / "upload" / "m.xdmf"
    path.write_text(xdmf("data.bin", "Binary"))
    with pytest.raises(ReadError, match="same folder"):
        read(path)
    (tmp_path / "upload" / "data.bin").unlink()
    (tmp_path / "upload" / "data.bin").write_bytes((tmp_path / "secret").read_bytes())
    assert read(path).counts == {"tri": 1}


def test_hdf5_links_to_other_files_are_refused(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    write(tmp_path / "m.med", ("tetra",), "med")
    with h5py.File(tmp_path / "m.med", "r+") as file:
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "/x")
    with pytest.raises(ReadError, match="inside the file itself"):
        read(tmp_path / "m.med")


def test_document_type_definitions_are_refused(tmp_path: Path) -> None:
    write(tmp_path / "m.vtu", ("tetra",), "vtu")
    text = (tmp_path / "m.vtu").read_text()
    start = text.index("<VTKFile")
    (tmp_path / "m.vtu").write_text('<!DOCTYPE r [<!ENTITY a "b">]>' + text[start:])
    with pytest.raises(ReadError, match="document type definition"):
        read(tmp_path / "m.vtu")


def test_a_module_beside_the_mesh_is_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "m.vtk", ("tetra",), "vtk42")
    (tmp_path / "meshio.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    monkeypatch.chdir(tmp_path)
    assert read("m.vtk").counts == {"tet": 2}
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("number", ["1_000.5", "\u0661.\u0662", "1,5"])
def test_numbers_that_only_python_understands_are_refused(tmp_path: Path, number: str) -> None:
    (tmp_path / "m.obj").write_text(f"v 0 0 0\nv {number} 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
    with pytest.raises(ReadError, match=r"m\.obj"):
        read(tmp_path / "m.obj")


def test_grid_points_in_local_coordinates_are_refused(tmp_path: Path) -> None:
    text = (
        "BEGIN BULK\nCORD2R  1       0       0.      0.      0.      0.      0.      1.\n+       1.      0.      0.\n"
    )
    text += "GRID    1       1       0.      0.      0.\nENDDATA\n"
    (tmp_path / "m.bdf").write_text(text)
    with pytest.raises(UnsupportedError, match="coordinate system"):
        read(tmp_path / "m.bdf")


def test_a_cut_binary_stl_is_refused_and_a_whole_one_has_its_corners_merged(tmp_path: Path) -> None:
    facet = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    other = struct.pack("<12fH", 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0)
    whole = bytes(80) + struct.pack("<I", 2) + facet + other
    (tmp_path / "m.stl").write_bytes(whole)
    mesh = read(tmp_path / "m.stl")
    assert (len(mesh.points), mesh.counts) == (4, {"tri": 2})
    assert any("exactly equal" in note for note in mesh.notes)
    (tmp_path / "m.stl").write_bytes(whole[:-20])
    with pytest.raises(ReadError, match="2 facets"):
        read(tmp_path / "m.stl")


def test_nothing_is_left_in_the_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "m.vtk", ("tetra",), "vtk42")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    read(tmp_path / "m.vtk")
    (tmp_path / "m.vtk").write_text(VTK[:-30])
    with pytest.raises(ReadError):
        read(tmp_path / "m.vtk")
    assert list(scratch.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
def test_a_child_that_dies_is_a_read_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "m.vtk", ("tetra",), "vtk42")
    fake = tmp_path / "python"
    fake.write_text("#!/bin/sh\nkill -SEGV $$\n")
    os.chmod(fake, 0o700)  # noqa: PTH101
    monkeypatch.setattr(sys, "executable", str(fake))
    with pytest.raises(ReadError, match="SIGSEGV"):
        read(tmp_path / "m.vtk")


def test_nodes_that_a_cell_does_not_keep_are_not_called_unused(tmp_path: Path) -> None:
    """A prism of 18 nodes becomes one of 15; one more point belongs to nobody."""
    corners = np.array([(x, y, z) for z in (0.0, 1.0) for x, y in ((0, 0), (1, 0), (0, 1))])
    pairs = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
    sides = [(0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)]
    nodes = [*corners, *(corners[list(group)].mean(axis=0) for group in (*pairs, *sides)), (9.0, 9.0, 9.0)]
    meshio.write(tmp_path / "m.vtu", meshio.Mesh(np.array(nodes), [("wedge18", np.arange(18)[None])]))
    mesh = read(tmp_path / "m.vtu")
    assert mesh.block("wedge15").nodes.tolist() == [list(range(15))]
    assert mesh.spare_points is not None
    assert mesh.spare_points.tolist() == [15, 16, 17]
    faults = [f for f in run_checks(mesh) if f.severity != "info"]
    assert [(f.code, f.rows.tolist()) for f in faults] == [("unused-points", [18])]


@pytest.mark.parametrize(("name", "file_format"), [("m.mesh", "medit"), ("m.lb8.ugrid", "ugrid"), ("m.obj", "obj")])
def test_formats_that_count_from_one_say_that_our_numbers_do_not(tmp_path: Path, name: str, file_format: str) -> None:
    meshio.write(tmp_path / name, meshio.Mesh(POINTS[:3], [("triangle", np.array([[0, 1, 2]]))]), file_format)
    assert any("both count from 0" in note for note in read(tmp_path / name).notes)
