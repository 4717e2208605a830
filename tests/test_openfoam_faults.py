"""OpenFOAM polyMesh: every contradiction, cut and directive is refused, with the file and the place."""

import re
import runpy
import struct
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.errors import ReadError
from meshwright.audit.readers.openfoam.reader import read_openfoam

_WRITER = runpy.run_path(str(Path(__file__).with_name("foam_writer.py")))
ENCODINGS, FILES, write_polymesh = _WRITER["ENCODINGS"], _WRITER["FILES"], _WRITER["write_polymesh"]

_TEXT_FAULTS = [
    ("points", r"\n27\n", "\n28\n", r"points: line 41: expected point '\(x y z\)'.*\(entry 27 of 28\), found '\)'"),
    ("points", r"\n27\n", "\n26\n", r"points: line 40: expected '\)' after 26 entries"),
    ("points", r"\n27\n", "\n1000000000\n", r"points: line 12: expected a count.*bytes left.*found 1000000000"),
    ("points", r"\n27\n", "\n-1\n", r"points: line 12: expected a count .* bytes left, found -1"),
    ("points", r"\n27\n", "\n", r"points: line 12: expected a count of entries \(point\), found '\('"),
    ("points", r"\(1\.5 0\.0", "(nan 0.0", r"points: line 15: .*finite numbers \(entry 1 of 27\), found 'nan"),
    ("points", r"\(1\.5 0\.0", "(1,5 0.0", r"points: line 15: .*found '1,5"),
    ("points", r"\(1\.5 0\.0", "($x 0.0", r"points: line 15: .*macros in mesh files are not followed.*found '\$x"),
    ("points", r"\n27\n\(.*\)\n", "\n27{(0 0 0)}\n", r"points: .*found one that all entries share"),
    ("points", r"vectorField", "labelList", r"points: line 7: expected class vectorField.*found labelList"),
    ("points", r"format ascii", "format text", r"points: line 5: expected format ascii or binary, found text"),
    ("points", r"class vectorField;", "", r"points: line 2: expected a FoamFile header that names the class"),
    ("faces", r"4\(\d+ ", "4(27 ", r"faces: line \d+: expected a point of a face from 0 to 26 \(entry \d+ of 36\)"),
    ("faces", r"4\(\d+ ", "4(-1 ", r"faces: line \d+: expected a point of a face from 0 to 26"),
    ("faces", r"4\(\d+ ", "4(1.5 ", r"faces: .*expected a point of a face.*found '1\.5"),
    ("faces", r"4\(\d+ ", "2(0 ", r"faces: .*number of points of a face, at least 3"),
    ("faces", r"4\(\d+ ", "99999999(0 ", r"faces: .*number of points of a face.*bytes left"),
    ("faces", r"4\(\d+ ", "5(0 ", r"faces: .*expected a point of a face.*found '\)'"),
    ("faces", r"\n4\(", '\n#include "/etc/passwd"\n4(', r"faces: line \d+: .*directives.*not followed.*'#include"),
    ("faces", r"\n36\n", "\n37\n", r"faces: .*\(entry 36 of 37\), found '\)'"),
    ("owner", r"\n36\n", "\n35\n", r"owner: .*expected '\)' after 35 entries"),
    ("owner", r"\n36\n\(\n0", "\n37\n(\n0\n0", r"owner: .*expected a count of at most 36 entries"),
    ("owner", r"\n36\n\(\n0", "\n35\n(", r"owner: .*expected an owner for each of 36 faces, found 35 owners"),
    ("owner", r"\n\(\n0", "\n(\n36", r"owner: line 16: expected owner of a face from 0 to 35.*found '36'"),
    ("owner", r"\n\(\n0", "\n(\n30", r"owner: line 8: expected nCells 31 as in the lists, found nCells 8 in the note"),
    ("owner", r"nCells:8", "nCells:9", r"owner: line 8: expected nCells 8 as in the lists, found nCells 9 in the note"),
    ("neighbour", r"nFaces:36", "nFaces:35", r"neighbour: line 8: expected nFaces 36"),
    ("neighbour", r"\n\(\n\d+", "\n(\n-1", r"neighbour: .*internal faces only, or of all 36 faces, found 12, some of"),
    ("neighbour", r"\n\(\n\d+", "\n(\n0", r"neighbour: .*two different cells at a face, found cell 0 twice at face 0"),
    ("neighbour", r"\)\n\n\n//", ")\n5 //", r"neighbour: .*nothing more after the list of neighbours, found '5"),
    (
        "boundary",
        r"nFaces 4; startFace 16",
        "nFaces 3; startFace 16",
        r"line 16: .*'sides' to start at face 19.*gap",
    ),
    (
        "boundary",
        r"startFace 16",
        "startFace 15",
        r"line 15: .*'outlet' to start at face 16.*\(overlap\)",
    ),
    ("boundary", r"nFaces 16", "nFaces 17", r"line 16: .*'sides' to end with the last of 36 faces"),
    (
        "boundary",
        r"nFaces 16",
        "nFaces 15",
        r"line 16: .*every boundary face in a patch, 12 to 35.*a gap at 35 after",
    ),
    ("boundary", r"nFaces 16", "nFaces many", r"expected nFaces of patch 'sides', found 'many;"),
    ("boundary", r"nFaces 16", "nFaces 37", r"expected nFaces of patch 'sides' from 0 to 36, found 37"),
    ("boundary", r"nFaces 16; ", "", r"line 16: expected nFaces of patch 'sides', found none"),
    ("boundary", r"type wall; ", "type wall; type wall; ", r"each entry of patch 'outlet' once, found 'type' again"),
    ("boundary", r"\noutlet", "\ninlet", r"line 15: expected each patch once, found 'inlet' again"),
    ("boundary", r"\n3\n", "\n4\n", r"expected 4 patch entries, as the count says, found 3"),
    (
        "boundary",
        r"type wall",
        "#calc #{ system(1); #}; type wall",
        r"directives and macros .*not followed",
    ),
    ("boundary", r"type wall", "type $kind", r"directives and macros in mesh files are not followed.*'\$kind"),
    ("boundary", r"\}\n\)\n", "}\n", r"expected the name of a patch or '\)', found end of file"),
    ("boundary", r"1\(wall\)", "1((wall)", r"expected brackets that match"),
    ("cellZones", r"\n0\n2", "\n0\n8", r"cellZones: .*expected cell of zone 'left' from 0 to 7.*found '8'"),
    ("cellZones", r"type cellZone", "type faceZone", r"expected type cellZone of zone 'left', found faceZone"),
    ("cellZones", r"cellLabels", "labels", r"expected cellLabels of zone 'left', found none"),
    ("faceZones", r"3\n\(\n0\n1\n0", "2\n(\n0\n1", r"expected a flipMap for the 3 faces of zone 'middle', found 2"),
    ("pointZones", r"26", "27", r"expected point of zone 'corners' from 0 to 26"),
]


@pytest.mark.parametrize(("name", "old", "new", "message"), _TEXT_FAULTS, ids=[row[0] for row in _TEXT_FAULTS])
def test_a_fault_is_named_with_its_file_and_line(name, old, new, message, tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh")
    text = (folder / name).read_text()
    changed = re.sub(old, new.replace("\\", r"\\"), text, count=1, flags=re.DOTALL)
    assert changed != text
    (folder / name).write_text(changed)
    with pytest.raises(ReadError, match=message) as caught:
        read_openfoam(folder)
    assert caught.value.path.startswith(str(folder))
    assert "\n" not in str(caught.value)


def _binary_list(data, skip=0):
    """(offset of the first raw byte, count) of the list after `skip` others in a binary file."""
    at = data.index(b"// * * * *")
    for _ in range(skip + 1):
        match = re.compile(rb"\n(\d+)\n\(").search(data, at)
        at = match.end()
    return match.end(), int(match[1])


@pytest.mark.parametrize(
    ("name", "skip", "entry", "raw", "message"),
    [
        (
            "points",
            0,
            4,
            struct.pack("<d", float("inf")),
            r"points: byte {}: .*\(entry 1 of 27\), found inf",
        ),
        ("points", 0, 80, struct.pack("<d", float("nan")), r"points: byte {}: .*\(entry 26 of 27\), found nan"),
        (
            "faces",
            0,
            2,
            struct.pack("<i", 3),
            r"faces: byte \d+: expected at least 3 points.* face 1 .*found -1",
        ),
        ("faces", 0, 36, struct.pack("<i", 145), r"faces: byte \d+: expected the 145 points.*found 144"),
        ("faces", 0, 0, struct.pack("<i", 1), r"faces: byte \d+: expected starts of faces, the first 0, found 1"),
        ("faces", 1, 143, struct.pack("<i", 27), r"faces: byte {}: expected a point of a face from 0 to 26.*found 27"),
        (
            "owner",
            0,
            5,
            struct.pack("<i", -2),
            r"owner: byte {}: expected owner of a face.*\(entry 5 of 36\)",
        ),
        ("cellZones", 1, 3, struct.pack("<i", 8), r"cellZones: byte {}: expected cell of zone 'left' from 0 to 7"),
    ],
    ids=lambda value: value if value in FILES else "",
)
def test_a_bad_number_in_a_binary_list_is_named_with_its_byte(name, skip, entry, raw, message, tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh", **ENCODINGS["binary"])
    data = (folder / name).read_bytes()
    place = _binary_list(data, skip)[0] + entry * len(raw)
    (folder / name).write_bytes(data[:place] + raw + data[place + len(raw) :])
    with pytest.raises(ReadError, match=message.replace("{}", str(place))):
        read_openfoam(folder)


@pytest.mark.parametrize("count", ["0", "one less", "one more", "-1", "4000000000", "99999999999999999999999999"])
@pytest.mark.parametrize("name", ["points", "faces", "owner", "neighbour"])
def test_a_wrong_count_of_a_binary_list_is_refused_before_anything_is_allocated(name, count, tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh", **ENCODINGS["binary"])
    data = (folder / name).read_bytes()
    first, true = _binary_list(data)
    start = first - 2 - len(str(true))
    written = {"one less": str(true - 1), "one more": str(true + 1)}.get(count, count)
    (folder / name).write_bytes(data[:start] + written.encode() + data[first - 2 :])
    with pytest.raises(ReadError, match=rf"{name}: byte \d+: expected"):
        read_openfoam(folder)


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_face_list", "binary_label64_scalar32_no_arch"])
@pytest.mark.parametrize("name", FILES)
def test_a_file_cut_anywhere_before_its_last_bracket_is_refused(name, encoding, tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh", **ENCODINGS[encoding])
    whole = (folder / name).read_bytes()
    end = whole.rindex(b")")
    for cut in sorted({*range(1, end, max(1, end // 40)), *range(end - 8, end)}):
        (folder / name).write_bytes(whole[:cut])
        with pytest.raises(ReadError, match=name):
            read_openfoam(folder)
    (folder / name).write_bytes(whole[: end + 1])
    assert read_openfoam(folder).n_cells == 8


@pytest.mark.parametrize("name", ["points", "faces", "owner", "neighbour", "boundary"])
def test_a_missing_file_is_named(name, tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh")
    (folder / name).unlink()
    with pytest.raises(ReadError, match=f"expected a file '{name}' or '{name}.gz', found only "):
        read_openfoam(folder)


def test_a_folder_that_was_never_meshed_says_so(tmp_path):
    (tmp_path / "case/constant/polyMesh").mkdir(parents=True)
    (tmp_path / "case/constant/polyMesh/blockMeshDict").touch()
    with pytest.raises(ReadError, match="meshing has not been run"):
        read_openfoam(tmp_path / "case")
    with pytest.raises(ReadError, match=r"expected an OpenFOAM case.*found nothing"):
        read_openfoam(tmp_path / "absent")


def test_a_doubled_file_and_another_files_content_are_refused(tmp_path):
    for name in FILES:
        folder = write_polymesh(tmp_path / name / "polyMesh")
        whole = (folder / name).read_bytes()
        (folder / name).write_bytes(whole + whole)
        with pytest.raises(ReadError, match=rf"{name}: line \d+: expected nothing more after .*found 'FoamFile'"):
            read_openfoam(folder)
    folder = write_polymesh(tmp_path / "swapped/polyMesh")
    (folder / "owner").rename(folder / "x")
    (folder / "neighbour").rename(folder / "owner")
    (folder / "x").rename(folder / "neighbour")
    with pytest.raises(ReadError, match="an owner for each of 36 faces, found 12"):
        read_openfoam(folder)


def test_a_cell_whose_faces_leave_it_open_is_named(tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh")
    text = (folder / "owner").read_text()
    head, tail = text.rsplit("\n7\n", 1)
    (folder / "owner").write_text(f"{head}\n6\n{tail}")
    with pytest.raises(ReadError, match=r"polyMesh: cell [67]: expected every edge in exactly 2 of its faces"):
        read_openfoam(folder)


def test_a_huge_hostile_dictionary_is_read_in_linear_time_and_quoted_briefly(tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh")
    text = (folder / "boundary").read_text()
    for hostile in (
        '"' + "\\a" * 300_000,
        "(" * 200_000,
        "a" * 300_000,
        "x(" * 100_000,
        "{a " * 100_000,
        "/*" * 200_000,
    ):
        (folder / "boundary").write_text(text.replace("type wall", f"type {hostile}"))
        with pytest.raises(ReadError) as caught:
            read_openfoam(folder)
        assert len(str(caught.value)) < 1000
    many = "".join(f"e{i} ((1 0) (0 1));" for i in range(20_000))
    (folder / "boundary").write_text(text.replace("type wall;", f"type wall; {many}"))
    assert read_openfoam(folder).n_cells == 8


def test_uniform_lists_cannot_claim_more_entries_than_the_mesh_has(tmp_path):
    folder = write_polymesh(tmp_path / "polyMesh")
    text = (folder / "faceZones").read_text()
    flips = re.compile(r"List<bool> .*;\n\}", re.DOTALL)
    (folder / "faceZones").write_text(flips.sub("List<bool> 3{1};\n}", text))
    assert np.array_equal(read_openfoam(folder).zones[-2].members, [0, 3, 5])
    (folder / "faceZones").write_text(flips.sub("List<bool> 4000000000{1};\n}", text))
    with pytest.raises(ReadError, match="a count of at most 36 entries"):
        read_openfoam(folder)
