"""OpenFOAM polyMesh: every encoding gives the same mesh, which is the one checkMesh sees."""

import os
import re
import runpy
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.errors import ReadError
from meshwright.audit.geometry import cell_geometry
from meshwright.audit.readers.openfoam.reader import find_polymesh, read_openfoam

_WRITER = runpy.run_path(str(Path(__file__).with_name("foam_writer.py")))
ENCODINGS, box_mesh, write_polymesh = _WRITER["ENCODINGS"], _WRITER["box_mesh"], _WRITER["write_polymesh"]

_CONTROL = """FoamFile {{ version 2.0; format ascii; class dictionary; object controlDict; }}
application none; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1; writeControl timeStep;
writeInterval 1; writeFormat {}; writePrecision 17; writeCompression {}; timeFormat general; timePrecision 6;
"""
_SCHEMES = """FoamFile { version 2.0; format ascii; class dictionary; object fvSchemes; }
ddtSchemes {} gradSchemes {} divSchemes {} laplacianSchemes {} interpolationSchemes {} snGradSchemes {}
"""
_TYPES_OF_CHECKMESH = {
    "hexahedra": "hex",
    "prisms": "wedge",
    "pyramids": "pyramid",
    "tetrahedra": "tet",
    "wedges": None,
    "tet wedges": None,
    "polyhedra": "polyhedron",
}
_WEDGE = """FoamFile { version 2.0; format ascii; class dictionary; object blockMeshDict; }
scale 1; vertices ((0 0 0) (1 0 0) (1 1 -0.05) (0 1 -0.05) (0 1 0.05) (1 1 0.05));
blocks (hex (0 1 2 3 0 1 5 4) (5 4 1) simpleGrading (1 1 1)); edges (); boundary (
front { type wedge; faces ((0 1 5 4)); } back { type wedge; faces ((0 3 2 1)); } tank { type wall; faces ((3 4 5 2)); }
inlet { type patch; faces ((0 4 3 0)); } outlet { type patch; faces ((1 2 5 1)); }
axis { type empty; faces ((0 1 1 0)); });
"""
_BOX = """FoamFile { version 2.0; format ascii; class dictionary; object blockMeshDict; }
scale 1; vertices ((0 0 0) (1 0 0) (1 1 0) (0 1 0) (0 0 1) (1 0 1) (1 1 1) (0 1 1));
blocks (hex (0 1 2 3 4 5 6 7) core (4 4 4) simpleGrading (1 1 1)); edges (); boundary (
walls { type wall; faces ((0 1 5 4) (3 7 6 2) (0 3 2 1) (4 5 6 7)); }
ends { type patch; faces ((0 4 7 3) (1 2 6 5)); });
"""


def _foam(tool, case, *options):
    if shutil.which(tool) is None:
        pytest.skip(f"{tool} of OpenFOAM is not installed")
    home = os.environ.get("WM_PROJECT_DIR", "/usr/share/openfoam")
    command = [tool, "-case", str(case), *options]
    env = {**os.environ, "WM_PROJECT_DIR": home}
    # Some tools drop files where they run.
    run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, env=env, cwd=case)
    assert run.returncode == 0, run.stdout[-2000:] + run.stderr[-2000:]
    return run.stdout


def _case(folder, block_mesh="", form="ascii", compression="off"):
    (folder / "system").mkdir(parents=True, exist_ok=True)
    (folder / "system/controlDict").write_text(_CONTROL.format(form, compression))
    for name in ("fvSchemes", "fvSolution"):
        (folder / "system" / name).write_text(_SCHEMES)
    if block_mesh:
        (folder / "system/blockMeshDict").write_text(block_mesh)
        _foam("blockMesh", folder)
    return folder


def _equal(a, b):
    assert a.counts == b.counts
    np.testing.assert_array_equal(a.points, b.points)
    for name in ("offsets", "nodes", "owner", "neighbour"):
        np.testing.assert_array_equal(getattr(a.faces, name), getattr(b.faces, name))
    for one, other in zip(a.blocks, b.blocks, strict=True):
        np.testing.assert_array_equal(one.nodes, other.nodes)
        np.testing.assert_array_equal(one.rows, other.rows)
    assert [(z.name, z.kind, z.role, z.entity, z.members.tolist()) for z in a.zones] == [
        (z.name, z.kind, z.role, z.entity, z.members.tolist()) for z in b.zones
    ]


def _agrees_with_checkmesh(mesh, case, *options):
    report = _foam("checkMesh", case, "-constant", *options)

    def stated(name):
        return int(re.search(rf"^\s+{name}:\s+(\d+)", report, re.MULTILINE)[1])

    assert stated("points") == len(mesh.points)
    assert stated("faces") == len(mesh.faces)
    assert stated("internal faces") == np.count_nonzero(mesh.faces.neighbour >= 0)
    assert stated("cells") == mesh.n_cells
    for title, kind in (("boundary patches", "patch"), ("cell zones", "cellZone"), ("face zones", "faceZone")):
        assert stated(title) == sum(zone.kind == kind for zone in mesh.zones), title
    for title, name in _TYPES_OF_CHECKMESH.items():
        assert stated(title) == (mesh.counts.get(name, 0) if name else 0), title
    volumes = re.search(r"Min volume = (\S+)\. Max volume = (\S+)\.\s+Total volume = (\S+)\.", report)
    volume = cell_geometry(mesh).volume
    assert volume.min() > 0
    wanted = [float(text) for text in volumes.groups()]
    np.testing.assert_allclose([volume.min(), volume.max(), volume.sum()], wanted, rtol=1e-9)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_encoding_gives_the_mesh_that_was_written(encoding, tmp_path):
    points, faces, owner, neighbour, patches = box_mesh()
    mesh = read_openfoam(write_polymesh(tmp_path / "constant/polyMesh", **ENCODINGS[encoding]))
    np.testing.assert_array_equal(mesh.points, points)
    assert mesh.points.flags.aligned
    assert mesh.faces.nodes.flags.aligned
    assert np.split(mesh.faces.nodes, mesh.faces.offsets[1:-1])[7].tolist() == faces[7]
    assert mesh.faces.nodes.tolist() == [node for face in faces for node in face]
    assert mesh.faces.offsets.tolist() == list(range(0, 4 * len(faces) + 1, 4))
    assert mesh.faces.owner.tolist() == owner
    assert mesh.faces.neighbour.tolist() == neighbour + [-1] * (len(owner) - len(neighbour))
    assert mesh.counts == {"hex": 8}
    assert (mesh.format, mesh.dimension, mesh.faces.ids) == ("openfoam", 3, None)
    zones = [(z.name, z.kind, z.role, z.entity, z.members.tolist()) for z in mesh.zones]
    assert zones == [
        *((name, "patch", kind, "face", list(range(first, first + n))) for name, kind, n, first in patches),
        ("left", "cellZone", "", "cell", [0, 2, 4, 6]),
        ("none", "cellZone", "", "cell", []),
        ("middle", "faceZone", "", "face", [0, 3, 5]),
        ("corners", "pointZone", "", "point", [0, 26]),
    ]
    assert any("flipMap" in note for note in mesh.notes)


def test_hexes_come_out_in_vtk_order_with_positive_volume(tmp_path):
    mesh = read_openfoam(write_polymesh(tmp_path / "polyMesh"))
    corners = mesh.points[mesh.block("hex").nodes]
    edges = corners[:, [1, 3, 4]] - corners[:, [0]]
    assert np.all(np.linalg.det(edges) > 0)
    assert np.all(np.linalg.norm(corners[:, 6] - corners[:, 0], axis=1) > 2.5)  # 6 is opposite 0
    np.testing.assert_allclose(cell_geometry(mesh).volume.sum(), 3.0 * 2.5 * 3.5, rtol=1e-14)


def test_a_neighbour_list_with_minus_one_for_boundary_faces_is_the_old_spelling_of_the_short_one(tmp_path):
    *_, owner, neighbour, _ = box_mesh()
    for binary in (False, True):
        folder = write_polymesh(tmp_path / str(binary) / "polyMesh", binary=binary, compact=binary)
        new = read_openfoam(folder)
        old = np.array(neighbour + [-1] * (len(owner) - len(neighbour)), "<i4")
        path = folder / "neighbour"
        head = path.read_bytes().split(b"\n\n")[0] + b"\n\n%d\n(" % len(old)
        path.write_bytes(head + (old.tobytes() if binary else " ".join(map(str, old)).encode()) + b")\n")
        _equal(read_openfoam(folder), new)


def test_patches_may_stand_in_any_order_among_comments_and_nested_entries(tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh", zones=False)
    rows = {name: (size, start) for name, _, size, start in box_mesh()[-1]}
    header = (folder / "boundary").read_text().split("3\n(")[0]
    (folder / "boundary").write_text(
        header
        + f"""// the count of patches
4 /* four ( {"{"} */ (
  "top and sides" {{ nFaces {rows["sides"][0]}; // ) }}
     type symmetryPlane; startFace {rows["sides"][1]}; matrix ((1 0) (0 1)); inGroups 2(cold symmetryPlane); }}
  inlet(a) {{ type cyclicAMI; coeffs {{ deep {{ text "a ; }} b"; }} values 3(1 2 3); }}
     nFaces {rows["inlet"][0]}; startFace {rows["inlet"][1]}; neighbourPatch outlet; }}
  nothing {{ type empty; nFaces 0; startFace 0; }}
  outlet {{ type mappedWall; nFaces {rows["outlet"][0]}; startFace {rows["outlet"][1]}; }} )
"""
    )
    mesh = read_openfoam(folder)
    assert [(z.name, z.role, len(z.members), z.id) for z in mesh.zones] == [
        ("top and sides", "symmetryPlane", 16, 0),
        ("inlet(a)", "cyclicAMI", 4, 1),
        ("nothing", "empty", 0, 2),
        ("outlet", "mappedWall", 4, 3),
    ]
    assert sorted(np.concatenate([z.members for z in mesh.zones])) == list(range(12, 36))
    assert mesh.notes == ("settings of patches are not kept: coeffs, inGroups, matrix, neighbourPatch",)


def test_comments_between_numbers_and_windows_line_ends_change_nothing(tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh")
    plain = read_openfoam(folder)
    for name in ("points", "faces", "owner", "boundary", "cellZones"):
        text = (folder / name).read_text()
        first = text.rindex("\n(\n") + 3
        text = text[:first] + "/* 7 ( */ // 8 )\n" + text[first:].replace("\n", " // 9\n\n")
        (folder / name).write_bytes(text.replace("\n", "\r\n").encode())
    _equal(read_openfoam(folder), plain)


def test_every_way_to_name_a_case_leads_to_its_polymesh(tmp_path, monkeypatch):
    polymesh = write_polymesh(tmp_path / "case/constant/polyMesh", gz=True)
    write_polymesh(tmp_path / "case/constant/gas/polyMesh")
    case = tmp_path / "case"
    for marker in ("case.foam", "case.OpenFOAM", "case{gas}.foam"):
        (case / marker).touch()
    for given in ("", "case.foam", "case.OpenFOAM", "constant", "constant/polyMesh", "constant/polyMesh/owner.gz"):
        assert find_polymesh(case / given) == polymesh, given
    gas = case / "constant/gas/polyMesh"
    for given in ("case{gas}.foam", "constant/gas", "constant/gas/polyMesh", "constant/gas/polyMesh/faces"):
        assert find_polymesh(case / given) == gas, given
    monkeypatch.chdir(polymesh)
    mesh = read_openfoam(".")
    assert mesh.path == "."
    assert "other regions of the case are not read: gas" in mesh.notes
    assert find_polymesh(tmp_path) is None
    (tmp_path / "points").write_text("1 2 3")
    assert find_polymesh(tmp_path / "points") is None
    assert find_polymesh(tmp_path / "absent") is None


def test_other_meshes_of_a_case_are_named_in_notes_or_in_the_error(tmp_path):
    case = tmp_path / "case"
    write_polymesh(case / "constant/polyMesh")
    write_polymesh(case / "0.5/polyMesh")
    write_polymesh(case / "processor0/constant/polyMesh")
    (case / "constant/polyMesh/sets").mkdir()
    (case / "constant/polyMesh/sets/bad").touch()
    notes = " | ".join(read_openfoam(case).notes)
    assert "other times hold another: 0.5" in notes
    assert "1 processor folders" in notes
    assert "sets are not read: bad" in notes
    assert "one part of a decomposed case" in " ".join(read_openfoam(case / "processor0").notes)
    for name in ("faces", "owner", "neighbour", "boundary"):
        (case / "0.5/polyMesh" / name).unlink()
    for name in ("cellZones", "faceZones", "pointZones"):
        (case / "0.5/polyMesh" / name).unlink()
    with pytest.raises(ReadError, match=r"'faces'.*name the case"):
        read_openfoam(case / "0.5")
    (case / "constant/polyMesh").rename(case / "constant/fluid")
    (case / "constant/solid/polyMesh").mkdir(parents=True)
    with pytest.raises(ReadError, match=r"regions only.*solid"):
        read_openfoam(case)
    shutil.rmtree(case / "constant")
    with pytest.raises(ReadError, match=r"decomposed case.*processor0"):
        read_openfoam(case)


def test_the_real_cases_read_as_checkmesh_reads_them(shared, tmp_path):
    zipfile.ZipFile(shared / "meshes/openfoam/OpenFOAM.zip").extractall(tmp_path)
    cavity = tmp_path / "OpenFOAM/cavity"
    mesh = read_openfoam(cavity / "case.foam")
    assert [(z.name, z.role, len(z.members)) for z in mesh.zones] == [
        ("movingWall", "wall", 20),
        ("fixedWalls", "wall", 60),
        ("frontAndBack", "empty", 800),
    ]
    # Its boundary file announces two patches and holds one; OpenFOAM refuses it as well.
    binary = tmp_path / "OpenFOAM/64BitFloats"
    with pytest.raises(ReadError, match=r"boundary: line 19: expected 2 patch entries.*found 1"):
        read_openfoam(binary / "case.foam")
    boundary = binary / "constant/polyMesh/boundary"
    boundary.write_text(boundary.read_text().replace("\n2\n(", "\n1\n("))
    raw = read_openfoam(binary)
    assert (raw.counts, len(raw.points), len(raw.faces)) == ({"hex": 2}, 12, 11)
    assert cell_geometry(raw).volume.min() > 0
    for case, read in ((cavity, mesh), (binary, raw)):
        _agrees_with_checkmesh(read, _case(case))


def test_wedges_polyhedra_and_zones_that_openfoam_makes_are_what_checkmesh_counts(tmp_path):
    wedge = read_openfoam(_case(tmp_path / "wedge", _WEDGE))
    assert wedge.counts == {"wedge": 5, "hex": 15}
    _agrees_with_checkmesh(wedge, tmp_path / "wedge")
    corners = wedge.points[wedge.block("wedge").nodes]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.einsum("ij,ij->i", normal, corners[:, 3] - corners[:, 0]) > 0)
    _case(tmp_path / "dual", _BOX)
    _foam("polyDualMesh", tmp_path / "dual", "-overwrite", "60")
    dual = read_openfoam(tmp_path / "dual")
    assert dual.counts["polyhedron"] > 50
    _agrees_with_checkmesh(dual, tmp_path / "dual")


def test_what_openfoam_writes_in_any_encoding_is_the_same_mesh(tmp_path):
    first = read_openfoam(_case(tmp_path / "first", _BOX))
    assert [(z.name, z.members.tolist()) for z in first.cell_zones] == [("core", list(range(64)))]
    for form, compression in (("binary", "off"), ("ascii", "on")):
        case = _case(tmp_path / f"{form}_{compression}", _BOX, form, compression)
        names = {path.name for path in (case / "constant/polyMesh").iterdir()}
        assert ("faces.gz" in names, "faces" in names) == (compression == "on", compression == "off")
        _equal(read_openfoam(case), first)
    _foam("foamFormatConvert", _case(tmp_path / "first", form="binary"), "-constant")
    assert b"faceCompactList" in (tmp_path / "first/constant/polyMesh/faces").read_bytes()
    _equal(read_openfoam(tmp_path / "first"), first)


def test_our_encodings_are_read_by_openfoam_itself(tmp_path):
    for name in ("ascii", "binary", "binary_face_list"):
        write_polymesh(tmp_path / name / "constant/polyMesh", **ENCODINGS[name])
        _agrees_with_checkmesh(read_openfoam(tmp_path / name), _case(tmp_path / name))
