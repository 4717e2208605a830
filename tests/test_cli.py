"""The command as users meet it: arguments, streams, exit status, files."""

import csv
import gzip
import hashlib
import io
import json
import os
import pty
import selectors
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import jsonschema
import numpy as np
import pyarrow.parquet
import pytest
from click.testing import CliRunner

from meshwright.audit import files
from meshwright.audit.errors import UsageError
from meshwright.audit.files import replacing
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.metrics import METRICS
from meshwright.audit.run import audit
from meshwright.reports.cli import cli
from meshwright.reports.vtu import write_vtu

SCHEMA = json.loads((Path(__file__).parent.parent / "reports" / "schema" / "audit-1.schema.json").read_text())
COMMAND = [sys.executable, "-c", "from meshwright.reports.cli import main; main()"]
SKEW = "gambit.equiangle_skew"


def msh(n=3, inverted=False, names=("left", "right"), jitter=0.0):
    """A Gmsh 2.2 text file: a box of n**3 hexes in two named volumes, ids from 1."""
    rng = np.random.default_rng(0)
    grid = np.stack(np.meshgrid(*[np.arange(n + 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    points = grid + rng.uniform(-jitter, jitter, grid.shape)
    a, b, c = (axis.ravel() for axis in np.meshgrid(*[np.arange(n)] * 3, indexing="ij"))

    def at(i, j, k):
        return ((a + i) * (n + 1) + b + j) * (n + 1) + c + k + 1

    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    hexes = np.stack([at(*corner) for corner in corners], 1)
    if inverted:
        hexes[0] = hexes[0][[4, 5, 6, 7, 0, 1, 2, 3]]
    half = (len(hexes) + 1) // 2
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "2"]
    lines += [f'3 {k + 1} "{name}"' for k, name in enumerate(names)]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(points))]
    lines += [f"{i + 1} {x!r} {y!r} {z!r}" for i, (x, y, z) in enumerate(points.tolist())]
    lines += ["$EndNodes", "$Elements", str(len(hexes))]
    for i, nodes in enumerate(hexes.tolist()):
        zone = 1 if i < half else 2
        lines.append(f"{i + 1} 5 2 {zone} {zone} {' '.join(map(str, nodes))}")
    return "\n".join([*lines, "$EndElements", ""])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("meshes")
    (place / "box.msh").write_text(msh())
    (place / "bent.msh").write_text(msh(jitter=0.2))
    (place / "bad.msh").write_text(msh(inverted=True))
    (place / "broken.msh").write_text(msh()[:900])
    return place


@pytest.fixture
def at_home(folder, monkeypatch):
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "100")
    return folder


def run(*args, **options):
    return CliRunner().invoke(cli, [str(a) for a in args], **options)


def process(*args, **options):
    return subprocess.run([*COMMAND, *map(str, args)], capture_output=True, timeout=120, check=False, **options)


def audited(*args):
    """The document of `audit --format json`, checked against the published schema."""
    result = run("audit", *args, "--format", "json", "--quiet")
    assert result.exit_code in (0, 1, 3), result.output
    document = json.loads(result.stdout)
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    return document


def test_help_needs_no_more_than_click():
    code = (
        "import sys\nfrom meshwright.reports.cli import cli\n"
        "for args in ([], ['audit'], ['table'], ['explain'], ['formats']):\n"
        "    try: cli.main([*args, '--help'])\n"
        "    except SystemExit as end: assert not end.code\n"
        "heavy = {'numpy', 'numba', 'pandas', 'rich', 'meshio', 'pyarrow'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Measure meshes and check them." in done.stdout


def test_an_audit_needs_neither_pandas_nor_meshio_nor_pyarrow(at_home):
    code = (
        "import sys\nfrom meshwright.reports.cli import cli\n"
        "try: cli.main(['audit', 'box.msh', '--quiet'])\n"
        "except SystemExit as end: assert not end.code\n"
        "heavy = {'pandas', 'meshio', 'pyarrow', 'h5py'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_version_is_that_of_the_distribution():
    from importlib.metadata import version

    assert run("--version").stdout == f"meshwright {version('meshwright')}\n"


def test_a_sound_mesh_passes_with_status_0(at_home):
    result = run("audit", "box.msh")
    assert result.exit_code == 0
    assert result.stderr in ("", "meshwright: compiling kernels new to this machine; later runs find them ready\n")
    assert "PASS" in result.stdout.splitlines()[1]


def test_an_inverted_cell_fails_with_status_1_and_is_named(at_home):
    result = run("audit", "bad.msh")
    assert result.exit_code == 1
    document = audited("bad.msh")
    assert document["gate"]["verdict"] == "fail"
    found = {f["code"]: f for f in document["findings"]}
    assert found["inverted-cells"]["ids"] == [1]


def test_the_json_says_what_the_file_is(at_home):
    document = audited("box.msh")
    assert document["mesh"]["path"] == "box.msh"
    assert document["mesh"]["sha256"] == hashlib.sha256((at_home / "box.msh").read_bytes()).hexdigest()
    assert document["mesh"]["cells"] == {"hex": 27}
    assert document["quality"] == [
        {"type": "hex", "count": 27, "worst_equiangle_skew": 0.0, "share_over_0_8": 0.0, "over_0_8": 0}
    ]
    assert [z["name"] for z in document["zones"]] == ["left", "right"]
    assert document["metrics"]["volume"]["hex"]["mean"] == 1


def test_json_on_stdout_is_all_there_is_on_stdout(at_home):
    done = process("audit", "box.msh", "--format", "json")
    json.loads(done.stdout)
    assert done.returncode == 0


@pytest.mark.parametrize(
    ("args", "status", "words"),
    [
        (["audit", "missing.msh"], 3, "missing.msh"),
        (["audit", "broken.msh"], 3, "broken.msh"),
        (["audit", "box.msh", "--metrics", "skewnes"], 2, "unknown metric"),
        (["audit", "box.msh", "--zone", "nowhere*"], 2, "left, right"),
        (["audit", "box.msh", "--input-format", "doc"], 2, "unknown format"),
        (["audit", "box.msh", "--out", "pdf=a.pdf"], 2, "FORMAT=FILE"),
        (["audit", "box.msh", "--cells", "a.xlsx"], 2, ".parquet, .csv, .vtu"),
        (["audit", "box.msh", "bent.msh", "--cells", "a.csv"], 2, "one mesh"),
        (["audit", "box.msh", "-o", "no/such/folder/a.txt"], 2, "folder does not exist"),
        (["audit", "box.msh", "-o", "."], 2, "it is a folder"),
        (["audit", "box.msh", "-o", "box.msh"], 2, "also an input"),
        (["audit", "box.msh", "-o", "a", "--out", "json=./a"], 2, "another output"),
        (["explain", "gambit.equiangel_skew"], 2, "gambit.equiangle_skew"),
        (["table", "missing.msh"], 3, "missing.msh"),
    ],
)
def test_errors_are_one_line_on_stderr_and_a_status(at_home, args, status, words):
    before = sorted(p.name for p in at_home.iterdir())
    result = run(*args, "--quiet") if args[0] != "explain" else run(*args)
    assert result.exit_code == status
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("meshwright: ")
    assert words in result.stderr
    assert sorted(p.name for p in at_home.iterdir()) == before


@pytest.mark.parametrize(
    "args", [["audit"], ["table"], ["audit", "a", "--format", "pdf"], ["nonsense"], ["--nonsense"]]
)
def test_wrong_usage_is_status_2(args):
    result = run(*args)
    assert result.exit_code == 2
    assert result.stdout == ""


def test_several_meshes_give_a_line_each_and_the_worst_status(at_home):
    result = run("audit", "box.msh", "bad.msh", "broken.msh", "--quiet")
    assert result.exit_code == 3
    rows = {line.split()[0]: line.split()[-1] for line in result.stdout.splitlines() if ".msh" in line}
    assert rows == {"box.msh": "pass", "bad.msh": "fail"} | {"broken.msh": "read"}
    assert run("audit", "box.msh", "bad.msh", "--quiet").exit_code == 1
    assert run("audit", "box.msh", "bent.msh", "--quiet").exit_code == 0


def test_several_meshes_in_json_are_one_object(at_home):
    result = run("audit", "box.msh", "bad.msh", "broken.msh", "--format", "json", "--quiet")
    batch = json.loads(result.stdout)
    assert (batch["schema"], batch["verdict"]) == ("meshwright.audits/1", "incomplete")
    assert [d["mesh"]["path"] for d in batch["audits"]] == ["box.msh", "bad.msh"]
    assert [e["path"] for e in batch["errors"]] == ["broken.msh"]
    for document in batch["audits"]:
        jsonschema.Draft202012Validator(SCHEMA).validate(document)


def test_a_zone_missing_from_one_of_several_meshes_does_not_stop_the_others(at_home, tmp_path):
    (tmp_path / "other.msh").write_text(msh(names=("in", "out")))
    result = run("audit", "box.msh", tmp_path / "other.msh", "--zone", "left", "--format", "json", "--quiet")
    batch = json.loads(result.stdout)
    assert (len(batch["audits"]), len(batch["errors"]), result.exit_code) == (1, 1, 3)


def test_patterns_the_shell_left_alone_are_expanded_in_order(at_home):
    batch = json.loads(run("audit", "b[eo]*t.msh", "bo?.msh", "--format", "json", "--quiet").stdout)
    assert [d["mesh"]["path"] for d in batch["audits"]] == ["bent.msh", "box.msh"]
    assert run("audit", "*.nothing", "--quiet").exit_code == 3


def test_standard_input_is_a_mesh_too(at_home):
    data = (at_home / "box.msh").read_bytes()
    for sent in (data, gzip.compress(data)):
        done = process("audit", "-", "--format", "json", input=sent)
        document = json.loads(done.stdout)
        assert document["mesh"]["path"] == "-"
        assert document["mesh"]["sha256"] == hashlib.sha256(sent).hexdigest()
        assert document["mesh"]["cells"] == {"hex": 27}
    done = process("audit", "-", "--quiet", input=b"not a mesh")
    assert done.returncode == 3
    assert done.stderr.startswith(b"meshwright: -: ")


def test_a_zone_pattern_restricts_tables_and_cells(at_home, tmp_path):
    document = audited("box.msh", "--zone", "l*", "--cells", tmp_path / "c.csv")
    assert document["selection"] == {"zone": "l*", "cells": 14}
    assert document["quality"][0]["count"] == 14
    assert len((tmp_path / "c.csv").read_text().splitlines()) == 15


def test_the_choice_of_metrics_is_what_is_reported(at_home):
    assert list(audited("box.msh", "--metrics", "volume,gambit.taper")["metrics"]) == ["volume", "gambit.taper"]
    assert list(audited("box.msh", "--metrics", "all")["metrics"]) == list(METRICS)


def test_threads_and_runs_give_the_same_bytes(at_home):
    one = run("audit", "bent.msh", "--format", "json", "--threads", "1", "--quiet").stdout
    assert one == run("audit", "bent.msh", "--format", "json", "--threads", "2", "--quiet").stdout


def test_worst_sets_the_length_of_the_lists(at_home):
    assert len(audited("bent.msh", "--worst", "9")["metrics"][SKEW]["hex"]["worst"]) == 9
    assert audited("bent.msh", "--worst", "0")["metrics"][SKEW]["hex"]["worst"] == []


def test_every_output_is_written_at_once(at_home, tmp_path):
    outs = [f"{name}={tmp_path / name}" for name in ("json", "md", "csv", "text")]
    flags = [part for out in outs for part in ("--out", out)]
    result = run("audit", "bent.msh", *flags, "-o", tmp_path / "main.txt", "--quiet")
    assert (result.stdout, result.exit_code) == ("", 0)
    assert json.loads((tmp_path / "json").read_text())["schema"] == "meshwright.audit/1"
    assert (tmp_path / "md").read_text().startswith("<!-- meshwright -->\n\n## bent")
    assert (tmp_path / "text").read_text() == (tmp_path / "main.txt").read_text()
    assert "\x1b" not in (tmp_path / "text").read_text()
    rows = list(csv.DictReader(io.StringIO((tmp_path / "csv").read_text())))
    assert sum(int(r["value"]) for r in rows if r["table"] == "gambit_class" and not r["zone"]) == 27
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]


def test_a_surface_is_measured_on_request(tmp_path):
    text = msh(2).replace("$Elements\n8\n", "$Elements\n9\n").replace("$EndElements", "9 3 2 1 1 1 2 5 4\n$EndElements")
    (tmp_path / "a.msh").write_text(text)
    assert "surface" not in audited(tmp_path / "a.msh")
    document = audited(tmp_path / "a.msh", "--surfaces")
    assert document["surface"]["cells"] == {"quad": 1}
    assert "Boundary surface" in run("audit", tmp_path / "a.msh", "--surfaces").stdout


def cells_mesh():
    """A hex, a tet and a polyhedron, ids 11 to 13; only some in a zone, one flat."""
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    points = np.concatenate([cube, cube + (3, 0, 0), [(9, 0, 0), (10, 0, 0), (9, 1, 0), (9.25, 0.5, 0)]])
    quads = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
    faces = Faces(np.arange(0, 25, 4), (quads + 8).reshape(-1), [1] * 6, [-1] * 6)
    blocks = (
        CellBlock("tet", [0], [[16, 17, 18, 19]]),
        CellBlock("polyhedron", [1], offsets=[0, 6], items=np.arange(6)),
        CellBlock("hex", [2], [np.arange(8)]),
    )
    zone = Zone("=evil", "part", "", "cell", [2])
    return Mesh(points, blocks, faces=faces, cell_ids=[11, 12, 13], zones=(zone,))


@pytest.fixture
def cell_files(tmp_path):
    from meshwright.reports.cells import write_cells

    mesh = cells_mesh()
    # No checks: a polyhedron among faces that belong to nobody else is not what they are made for.
    from meshwright.audit.measurement import measure
    from meshwright.audit.run import Audit

    chosen = ("gambit.aspect_ratio", "gambit.stretch", "angle.min")
    found = Audit(mesh, measure(mesh, chosen), (), chosen)
    for suffix in ("csv", "parquet", "vtu"):
        write_cells(found, None, str(tmp_path / f"c.{suffix}"))
    return tmp_path, found


def test_cells_as_csv_keep_file_order_and_tell_nan_from_not_defined(cell_files):
    rows = list(csv.reader(io.StringIO((cell_files[0] / "c.csv").read_text())))
    assert rows[0] == ["cell", "type", "zone", "gambit.aspect_ratio", "gambit.stretch", "angle.min"]
    assert [row[:3] for row in rows[1:]] == [["11", "tet", ""], ["12", "polyhedron", ""], ["13", "hex", "'=evil"]]
    assert rows[1][3] == "inf"
    assert rows[1][4] == ""
    assert rows[2][3:] == ["", "", "90"]
    assert float(rows[3][3]) == 1
    assert float(rows[3][5]) == 90


def test_a_nan_is_spelled_in_csv(tmp_path, cell_files):
    from dataclasses import replace

    from meshwright.reports.cells import write_cells

    found = cell_files[1]
    values = {key: dict(of_type) for key, of_type in found.measured.values.items()}
    values["angle.min"]["hex"] = np.array([np.nan])
    write_cells(replace(found, measured=replace(found.measured, values=values)), None, str(tmp_path / "n.csv"))
    assert (tmp_path / "n.csv").read_text().splitlines()[3].split(",")[5] == "nan"


def test_cells_as_parquet_are_the_same_table(cell_files):
    table = pyarrow.parquet.read_table(cell_files[0] / "c.parquet")
    assert table.column_names == ["cell", "type", "zone", "gambit.aspect_ratio", "gambit.stretch", "angle.min"]
    assert table["cell"].to_pylist() == [11, 12, 13]
    assert table["gambit.aspect_ratio"].to_pylist() == [np.inf, None, pytest.approx(1)]
    assert table["zone"].to_pylist() == [None, None, "=evil"]


def test_cells_as_vtu_are_what_vtk_reads_polyhedra_included(cell_files):
    pytest.importorskip("vtk")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(cell_files[0] / "c.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    assert [grid.GetCellType(i) for i in range(3)] == [10, 42, 12]
    assert grid.GetCell(1).GetNumberOfFaces() == 6
    assert sorted(grid.GetCell(1).GetPointIds().GetId(i) for i in range(8)) == list(range(8, 16))
    data = grid.GetCellData()
    assert vtk_to_numpy(data.GetArray("cell")).tolist() == [11, 12, 13]
    assert vtk_to_numpy(data.GetArray("zone")).tolist() == [-1, -1, 0]
    np.testing.assert_allclose(vtk_to_numpy(data.GetArray("gambit.aspect_ratio")), [np.inf, np.nan, 1])
    assert grid.GetFieldData().GetAbstractArray("zone_names").GetValue(0) == "=evil"


def test_a_choice_of_cells_is_what_the_vtu_holds(tmp_path):
    pytest.importorskip("vtk")
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    from meshwright.audit.measurement import measure
    from meshwright.audit.run import Audit

    mesh = cells_mesh()
    with (tmp_path / "c.vtu").open("wb") as stream:
        write_vtu(Audit(mesh, measure(mesh, ["angle.min"]), (), ("angle.min",)), np.array([0, 1, 1], bool), stream)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "c.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    assert [grid.GetCellType(i) for i in range(grid.GetNumberOfCells())] == [42, 12]
    assert [grid.GetCell(1).GetPointId(i) for i in range(8)] == list(range(8))


def test_table_prints_the_articles_tables_and_judges_nothing(at_home):
    result = run("table", "bad.msh")
    assert result.exit_code == 0
    assert "% with skewness > 0.8 | ICEM < 0.2" in result.stdout
    assert "AR (>=1)" in result.stdout
    assert "FAIL" not in result.stdout
    assert "Findings" not in result.stdout
    document = json.loads(run("table", "bad.msh", "--format", "json").stdout)
    assert document["schema"] == "meshwright.tables/1"
    assert "Zone left" in run("table", "box.msh", "--by-zone").stdout


def test_the_applicability_table_is_the_articles(at_home):
    stated = {
        "Area": "tri quad",
        "Aspect Ratio": "tri quad tet pyramid wedge hex",
        "Diagonal Ratio": "quad hex",
        "Edge Ratio": "tri quad tet pyramid wedge hex",
        "Equi-Angle Skew": "tri quad tet pyramid wedge hex",
        "Equi-Size Skew": "tri tet",
        "Mid-Angle Skew": "quad hex",
        "Stretch": "quad hex",
        "Taper": "quad hex",
        "Volume": "tet pyramid wedge hex",
        "Warpage": "quad hex",
    }
    rows = list(csv.DictReader(io.StringIO(run("table", "--applicability", "--format", "csv").stdout)))
    assert {row["Parameter"]: " ".join(k for k, v in row.items() if v == "y") for row in rows} == stated
    assert json.loads(run("table", "--applicability", "--format", "json").stdout)["volume"]["defined"]["tri"] is False
    assert run("table", "--applicability", "box.msh").exit_code == 2


@pytest.mark.parametrize("key", METRICS)
def test_explain_tells_formula_range_and_source_of_every_metric(key):
    text = run("explain", key).stdout
    words = " ".join(text.split())
    assert " ".join(METRICS[key].formula.split())[:20] in words
    assert all(word in text for word in ("range", "best", "source", "defined on"))


def test_explain_alone_lists_all_and_names_both_scales():
    text = run("explain").stdout
    assert all(key in text for key in METRICS)
    assert "1 - value" in run("explain", SKEW).stdout


def test_formats_lists_what_input_format_takes():
    from meshwright.audit.readers import FORMATS

    names = [line.split()[0] for line in run("formats").stdout.splitlines()[1:] if line[:1].strip()]
    assert {row.name for row in FORMATS} <= set(names)


def test_an_interrupted_write_leaves_the_old_file(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("old")

    def interrupted():
        with replacing(target) as stream:
            stream.write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert target.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_writing_keeps_permissions_and_follows_links(tmp_path):
    target, link = tmp_path / "real", tmp_path / "link"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    with replacing(link) as stream:
        stream.write(b"new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


def test_a_new_file_gets_the_permissions_of_the_umask(tmp_path):
    old = os.umask(0o027)
    try:
        with replacing(tmp_path / "new") as stream:
            stream.write(b"x")
    finally:
        os.umask(old)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640


def test_a_full_disk_is_one_error_and_leaves_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "a.txt"
    target.write_text("old")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full)
    with pytest.raises(UsageError, match="No space left"), replacing(target) as stream:
        stream.write(b"new")
    assert target.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_device_can_be_written_to(at_home):
    assert run("audit", "box.msh", "-o", "/dev/null", "--quiet").exit_code == 0
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def on_a_terminal(args, **environment):
    """stdout and stderr of a command that believes it writes to a terminal, and its status."""
    readers, writers = zip(*(pty.openpty() for _ in range(2)), strict=True)
    env = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "100", **environment}
    env.pop("NO_COLOR", None) if "NO_COLOR" not in environment else None
    child = subprocess.Popen([*COMMAND, *args], stdout=writers[0], stderr=writers[1], env=env)
    for writer in writers:
        os.close(writer)
    got = dict.fromkeys(readers, b"")
    with selectors.DefaultSelector() as both:  # together: a full terminal would stop the child
        for reader in readers:
            both.register(reader, selectors.EVENT_READ)
        while both.get_map():
            for key, _ in both.select():
                try:
                    chunk = os.read(key.fd, 65536)
                except OSError:  # Linux: the other end is closed
                    chunk = b""
                if chunk:
                    got[key.fd] += chunk
                else:
                    both.unregister(key.fd)
                    os.close(key.fd)
    out, err = (text.decode() for text in got.values())
    return out, err, child.wait(timeout=120)


def test_a_terminal_gets_colour_and_progress_unless_told_otherwise(at_home):
    out, err, status = on_a_terminal(["audit", "box.msh"])
    assert status == 0
    assert "\x1b[" in out
    assert "box.msh" in err
    out, _, _ = on_a_terminal(["audit", "box.msh"], NO_COLOR="1")
    assert "\x1b[" not in out
    _, err, _ = on_a_terminal(["audit", "box.msh", "--quiet"])
    assert err == ""


def test_a_pipe_gets_no_colour_and_no_progress(at_home):
    done = process("audit", "box.msh", env={**os.environ, "TERM": "xterm-256color"})
    assert b"\x1b" not in done.stdout + done.stderr


def test_an_ascii_terminal_gets_ascii(at_home):
    done = process("audit", "box.msh", env={**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"})
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii()
    assert b"####" in done.stdout


def test_a_closed_pipe_ends_quietly(at_home):
    child = subprocess.Popen(
        [*COMMAND, "audit", "bent.msh", "--format", "csv", "--quiet"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    child.stdout.close()
    errors = child.stderr.read()
    child.stderr.close()
    assert child.wait(timeout=120) == 141
    assert errors == b""


def test_an_interrupt_ends_quietly_with_130(tmp_path):
    fifo = tmp_path / "input"
    os.mkfifo(fifo)
    with os.fdopen(os.open(fifo, os.O_RDWR), "rb", buffering=0) as feed:  # standard input stays open, empty
        child = subprocess.Popen([*COMMAND, "audit", "-", "--quiet"], stdin=feed, stderr=subprocess.PIPE)
        time.sleep(3)
        child.send_signal(signal.SIGINT)
        errors = child.stderr.read()
        child.stderr.close()
        assert child.wait(timeout=30) == 130
    assert errors == b""


def test_the_python_api_and_the_command_agree(at_home):
    from meshwright.audit import read
    from meshwright.audit.summary import summarise

    document = json.loads(json.dumps(summarise(audit(read("bent.msh")), worst=5)))
    assert document == audited("bent.msh")
