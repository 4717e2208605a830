"""Bad files through the command: one line that says what and where, status 3, no output, little memory."""

import gzip
import json
import os
import random
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from meshwright.reports.cli import cli

_BASES = runpy.run_path(str(Path(__file__).with_name("fuzz_bases.py")))
FAULTS = runpy.run_path(str(Path(__file__).with_name("faults.py")))["FAULTS"]
FORMATS = ("fluent", "gmsh", "openfoam")
# Of each format: the sound mesh, and the file of it that is damaged when the format does not matter.
SOUND = {"fluent": "solid.msh", "gmsh": "text22.msh", "openfoam": "case"}
PLACE = r"(line|byte|packed byte) \d+"


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A folder with a sound mesh of each format; the OpenFOAM case is the folder `case`."""
    folder = tmp_path_factory.mktemp("sound")
    for reader in FORMATS:
        _BASES["write_bases"](reader, folder / reader)
    return folder


class Bad:
    """A mesh of ours in a fresh folder, to be damaged."""

    def __init__(self, sound, folder, reader, name=None):
        self.folder = folder
        if reader == "openfoam":
            self.path, here = folder / "case", folder / "case" / "constant" / "polyMesh"
            here.mkdir(parents=True)
            for file in (sound / "openfoam" / "ascii" / "polyMesh").iterdir():
                (here / file.name).write_bytes(file.read_bytes())
            self.file = here / (name or "faces")
        else:
            self.path = self.file = folder / (name or SOUND[reader])
            self.file.write_bytes((sound / reader / self.file.name).read_bytes())

    def put(self, content):
        self.file.write_bytes(content)
        return self


@pytest.fixture
def bad(sound, tmp_path):
    return lambda reader, name=None: Bad(sound, tmp_path, reader, name)


def audit(*args):
    return CliRunner().invoke(cli, ["audit", *map(str, args), "--quiet"])


def refusal(path, *options):
    """The one line on stderr; everything else a refusal promises is checked here."""
    before = sorted(path.parent.rglob("*"))
    result = audit(path, *options)
    assert isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == 3
    assert result.stdout == ""
    assert result.stderr.endswith("\n")
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr
    assert sorted(path.parent.rglob("*")) == before
    return result.stderr


def assert_told(line, file, place=PLACE, expected=".+", found=".+"):
    assert re.fullmatch(rf"meshwright: {re.escape(str(file))}: {place}: expected {expected}, found {found}\n", line), (
        line
    )


# --- the mesh itself is damaged ---------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("reader", "name", "old", "new", "place", "expected", "found"),
    [pytest.param(*key, *row, id=f"{key[1]} {row[1].strip()}") for key, rows in FAULTS.items() for row in rows],
)
def test_a_fault_is_one_line_with_file_place_expectation_and_finding(
    reader, name, old, new, place, expected, found, bad
):
    mesh = bad(reader, name)
    text = mesh.file.read_text()
    assert old in text
    mesh.put(text.replace(old, new, 1).encode())
    assert_told(refusal(mesh.path), mesh.file, place, expected, found)


@pytest.mark.parametrize("reader", FORMATS)
def test_the_undamaged_mesh_is_read(reader, bad):
    result = audit(bad(reader).path)
    assert result.exit_code in (0, 1)
    assert result.stderr == ""


@pytest.mark.parametrize("part", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("reader", FORMATS)
def test_a_truncated_file_is_refused_with_its_line(reader, part, bad):
    mesh = bad(reader)
    whole = mesh.file.read_bytes()
    whole = whole[: whole.rindex(b"(45" if reader == "fluent" else b"$EndEl" if reader == "gmsh" else b")")]
    mesh.put(whole[: int(len(whole) * part)])
    assert_told(refusal(mesh.path), mesh.file)


# --- what is under the name is no mesh --------------------------------------------------------------------------
@pytest.mark.parametrize("name", ["mesh.msh", "mesh.cas", "mesh.foam.msh", "mesh", "mesh.msh.gz"])
def test_an_empty_file_is_refused(name, tmp_path):
    (tmp_path / name).touch()
    assert refusal(tmp_path / name).endswith("expected a mesh, found an empty file\n")


@pytest.mark.parametrize("name", ["mesh.msh", "mesh.foam", "mesh.stl", "no/such/folder.msh"])
def test_a_missing_file_is_refused(name, tmp_path):
    assert refusal(tmp_path / name).startswith(f"meshwright: {tmp_path / name}: expected ")


@pytest.mark.parametrize("name", ["folder", "folder.msh", "folder.foam"])
def test_a_folder_without_a_case_is_refused(name, tmp_path):
    (tmp_path / name).mkdir()
    line = refusal(tmp_path / name)
    assert re.fullmatch(rf"meshwright: {re.escape(str(tmp_path / name))}: expected .*OpenFOAM.*, found .+\n", line)


@pytest.mark.parametrize("name", ["pipe.msh", "pipe"])
@pytest.mark.parametrize("options", [(), ("--input-format", "gmsh")])
def test_a_fifo_is_refused_at_once(name, options, tmp_path):
    os.mkfifo(tmp_path / name)
    assert refusal(tmp_path / name, *options).endswith(f"{name}: expected a file, found a fifo\n")


@pytest.mark.parametrize("reader", FORMATS)
def test_a_file_without_permission_is_refused(reader, bad, monkeypatch):
    mesh = bad(reader)
    mesh.file.chmod(0)
    if os.access(mesh.file, os.R_OK):  # the superuser may read everything: let the system refuse in another way
        opened = os.open

        def refused(path, *args, **options):
            if os.fspath(path) == str(mesh.file):
                raise PermissionError(13, "Permission denied", path)
            return opened(path, *args, **options)

        monkeypatch.setattr(os, "open", refused)
    assert refusal(mesh.path) == f"meshwright: {mesh.file}: expected a readable file, found permission denied\n"


@pytest.mark.parametrize("reader", FORMATS)
def test_binary_junk_is_refused(reader, bad):
    mesh = bad(reader).put(random.Random(5).randbytes(5000))  # noqa: S311
    line = refusal(mesh.path)
    assert line.startswith(f"meshwright: {mesh.file}: ")
    assert_told(refusal(mesh.path, "--input-format", reader), mesh.file)


@pytest.mark.parametrize("reader", FORMATS)
@pytest.mark.parametrize("left", [0.2, 0.5, 0.98])
def test_a_truncated_gzip_file_is_refused_with_its_byte(reader, left, bad):
    mesh = bad(reader)
    packed = gzip.compress(mesh.file.read_bytes(), mtime=0)
    mesh.put(packed[: int(len(packed) * left)])
    assert_told(refusal(mesh.path), mesh.file, r"packed byte \d+", "more gzip data", "end of file")


@pytest.mark.parametrize("kind", ["missing", "empty", "folder", "fifo", "loop", "nowhere"])
@pytest.mark.parametrize("name", ["points", "faces", "owner", "neighbour", "boundary"])
def test_a_case_with_one_file_out_of_order_is_refused_by_its_name(name, kind, bad):
    mesh = bad("openfoam", name)
    mesh.file.unlink()
    if kind == "empty":
        mesh.file.touch()
    elif kind == "folder":
        mesh.file.mkdir()
    elif kind == "fifo":
        os.mkfifo(mesh.file)
    elif kind == "loop":
        mesh.file.symlink_to(mesh.file.name)
    elif kind == "nowhere":
        mesh.file.symlink_to("/no/such/file")
    line = refusal(mesh.path)
    assert re.fullmatch(rf"meshwright: {re.escape(str(mesh.path))}\S*: expected .+, found .+\n", line)
    assert str(mesh.file) in line or f"'{name}'" in line


@pytest.mark.parametrize(("reader", "title"), [("fluent", "fluent"), ("gmsh", "Gmsh MSH 2.2 (text)")], ids=["f", "g"])
@pytest.mark.parametrize("suffix", ["stl", "vtk", "inp", "cgns", "png", "gz"])
def test_the_content_of_a_file_counts_and_not_its_suffix(reader, title, suffix, bad, tmp_path):
    mesh = bad(reader)
    wrong = mesh.file.rename(tmp_path / f"mesh.{suffix}")
    result = audit(wrong, "--format", "json")
    assert result.exit_code in (0, 1), result.stderr
    assert json.loads(result.stdout)["mesh"]["format"] == title


@pytest.mark.parametrize("name", ["photo.msh", "photo.cas", "photo.foam.msh"])
def test_a_picture_under_the_name_of_a_mesh_is_refused(name, tmp_path):
    (tmp_path / name).write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    line = refusal(tmp_path / name)
    assert re.fullmatch(
        rf"meshwright: {re.escape(str(tmp_path / name))}: expected a mesh in a known.*, found .+\n", line
    )


# --- what is left behind ----------------------------------------------------------------------------------------
@pytest.mark.parametrize("reader", FORMATS)
def test_cells_of_a_mesh_that_cannot_be_read_are_not_written(reader, bad):
    mesh = bad(reader)
    mesh.put(mesh.file.read_bytes()[:300])
    for kind in ("csv", "parquet", "vtu"):
        refusal(mesh.path, "--cells", mesh.folder / f"cells.{kind}")
        kept = mesh.folder / f"kept.{kind}"
        kept.write_text("of old")
        refusal(mesh.path, "--cells", kept)
        assert kept.read_text() == "of old"


@pytest.mark.parametrize("options", [["-o"], ["--format", "json", "-o"], ["--format", "csv", "-o"]], ids=" ".join)
@pytest.mark.parametrize("reader", FORMATS)
def test_what_an_output_file_held_outlives_a_mesh_that_cannot_be_read(reader, options, bad):
    mesh = bad(reader)
    mesh.put(mesh.file.read_bytes()[:300])
    kept = mesh.folder / "report"
    kept.write_text("of old")
    result = audit(mesh.path, *options, kept)
    assert (result.exit_code, result.stdout, result.stderr.count("\n")) == (3, "", 1)
    assert kept.read_text() == "of old"
    assert {path.name for path in mesh.folder.iterdir()} == {mesh.path.name, kept.name}  # no half of it


@pytest.mark.parametrize("reader", FORMATS)
def test_a_mesh_that_cannot_be_read_leaves_no_output_file(reader, bad):
    mesh = bad(reader)
    mesh.put(mesh.file.read_bytes()[:300])
    refusal(mesh.path, "-o", mesh.folder / "new")
    assert not (mesh.folder / "new").exists()


# --- the real process -------------------------------------------------------------------------------------------
# The kernel's own peak of this process alone; what wait4 tells may be that of the parent before exec.
MEASURED = """
import atexit, pathlib, sys
status, sys.argv[1:] = sys.argv[1], sys.argv[2:]
atexit.register(lambda: pathlib.Path(status).write_text(pathlib.Path("/proc/self/status").read_text()))
from meshwright.reports.cli import main
main()
"""


@pytest.mark.skipif(not Path("/proc/self/status").is_file(), reason="the peak of memory is read from /proc")
@pytest.mark.parametrize(
    ("reader", "name", "old", "new"),
    [
        ("fluent", "solid.msh", b"(10 (1 1 c 1 3)", b"(10 (1 1 e8d4a51000 1 3)"),
        ("fluent", "solid8.msh", b"(3012 (2 1 4 1 0)", b"(3012 (2 1 7fffffff 1 0)"),
        ("gmsh", "text22.msh", b"$Elements\n18\n", b"$Elements\n1000000000000\n"),
        ("gmsh", "text41.msh", b"1 12 1 12", b"1 1000000000000 1 1000000000000"),
        ("openfoam", "points", b"\n27\n", b"\n1000000000000\n"),
        ("openfoam", "faces", b"", b""),
    ],
)
def test_the_process_ends_with_status_3_one_line_and_little_memory(reader, name, old, new, bad, tmp_path):
    mesh = bad(reader, name)
    content = mesh.file.read_bytes()
    assert old in content
    mesh.put(content.replace(old, new, 1) if old else gzip.compress(bytes(1 << 30), 1))  # a bomb: zeros, 200 to 1
    command = [sys.executable, "-c", MEASURED, tmp_path / "status", "audit", mesh.path, "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (3, "")
    assert_told(done.stderr, mesh.file)
    peak = int(re.search(r"VmHWM:\s+(\d+) kB", (tmp_path / "status").read_text())[1])
    assert peak < 600_000
