"""`meshwright repair` on files: receipts, journals, undo, and inputs that nothing can be done with."""

import hashlib
import importlib
import json
import signal
import subprocess
import sys
import time
import zipfile

import meshio
import numpy as np
import pytest
from click.testing import CliRunner
from lxml import html
from repair_meshes import bounded, box, hybrid_layers, random_tets, solid, square, with_reversed

from meshwright.audit import read
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.repair import repair, write
from meshwright.repair.writers import WRITERS
from meshwright.reports.cli import cli


def run(*words):
    return CliRunner().invoke(cli, ["repair", *map(str, words)])


@pytest.fixture
def tangled(tmp_path):
    points, hexes = box(5, 0.75)
    path = tmp_path / "tangled.msh"
    write(bounded(solid(points, hex=with_reversed(hexes, "hex", [7, 40]))), path)
    return path


def test_a_repair_writes_the_mesh_and_says_what_it_did(tangled, tmp_path):
    out = tmp_path / "good.msh"
    result = run(tangled, "-o", out)
    assert result.exit_code == 0, result.output
    assert "cells reversed" in result.stdout
    assert result.stdout.endswith(f"written: {out}\n")
    mesh = read(out)
    assert [zone.name for zone in mesh.zones] == ["inlet", "wall"]
    assert not repair(mesh).changed


def test_the_receipt_is_the_whole_output_of_format_json(tangled, tmp_path):
    result = run(tangled, "-o", tmp_path / "good.vtu", "--format", "json", "--quiet")
    document = json.loads(result.stdout)
    assert document["schema"] == "meshwright.repair/1"
    assert document["before"]["inverted_or_degenerate"] > 0
    assert document["after"]["inverted_or_degenerate"] == 0
    assert [step["changed"] for step in document["steps"] if step["pass"] == "orient"]  # noqa: S105 == [2]
    assert set(document["metrics"]) == {"before", "after"}


def test_undo_restores_the_input_byte_for_byte(tangled, tmp_path):
    original = tangled.read_bytes()
    journal, back = tmp_path / "j.zip", tmp_path / "back.msh"
    assert run(tangled, "-o", tangled, "--journal", journal).exit_code == 0
    assert tangled.read_bytes() != original
    assert run(tangled, "--undo", journal, "-o", back).exit_code == 0
    assert back.read_bytes() == original


def test_the_journal_tells_every_point_that_moved_and_every_cell_that_changed(tangled, tmp_path):
    journal, out = tmp_path / "j.zip", tmp_path / "good.msh"
    run(tangled, "-o", out, "--journal", journal)
    before, after = read(tangled), read(out)
    points = np.array(before.points)
    nodes = np.array(before.block("hex").nodes)
    with zipfile.ZipFile(journal) as archive:
        for name in sorted(n for n in archive.namelist() if n.startswith("steps/")):
            with archive.open(name) as stream:
                step = np.load(stream)
                assert np.array_equal(points[step["moved_rows"]], step["moved_from"])
                points[step["moved_rows"]] = step["moved_to"]
                assert np.array_equal(nodes[step["removed_cells"]], step["removed_nodes"])
                nodes[step["added_cells"]] = step["added_nodes"]
    assert np.array_equal(points, after.points)
    assert np.array_equal(nodes, after.block("hex").nodes)


def test_undo_refuses_a_mesh_that_was_edited_since(tangled, tmp_path):
    journal, out = tmp_path / "j.zip", tmp_path / "good.msh"
    run(tangled, "-o", out, "--journal", journal)
    out.write_bytes(out.read_bytes() + b"\n")
    result = run(out, "--undo", journal, "-o", tmp_path / "back.msh")
    assert result.exit_code == 2
    assert "changed or replaced since. Nothing was written" in result.output
    assert not (tmp_path / "back.msh").exists()


@pytest.mark.parametrize("spoil", ["cut", "not a zip", "no receipt", "other input"])
def test_undo_refuses_a_damaged_journal_and_writes_nothing(tangled, tmp_path, spoil):
    journal, out, back = tmp_path / "j.zip", tmp_path / "good.msh", tmp_path / "back.msh"
    run(tangled, "-o", out, "--journal", journal)
    if spoil == "cut":
        journal.write_bytes(journal.read_bytes()[:-500])
    elif spoil == "not a zip":
        journal.write_bytes(b"hello")
    else:
        with zipfile.ZipFile(journal) as archive:
            parts = {name: archive.read(name) for name in archive.namelist()}
        parts["input"] += b"x"
        if spoil == "no receipt":
            del parts["receipt.json"]
        with zipfile.ZipFile(journal, "w") as archive:
            for name, data in parts.items():
                archive.writestr(name, data)
    result = run(out, "--undo", journal, "-o", back)
    assert result.exit_code == 3, result.output
    assert not back.exists()
    assert not list(tmp_path.glob(".*.part"))


def test_the_input_is_not_overwritten_without_a_journal(tangled):
    before = tangled.read_bytes()
    result = run(tangled, "-o", tangled)
    assert result.exit_code == 2
    assert "is the input" in result.output
    assert tangled.read_bytes() == before


def test_a_dry_run_writes_nothing(tangled, tmp_path):
    files = sorted(tmp_path.iterdir())
    result = run(tangled, "--dry-run")
    assert result.exit_code == 0
    assert "dry run: nothing was written" in result.stdout
    assert sorted(tmp_path.iterdir()) == files


def test_the_html_report_shows_before_and_after(tangled, tmp_path):
    page = tmp_path / "r.html"
    assert run(tangled, "-o", tmp_path / "good.msh", "--html", page).exit_code == 0
    digest = hashlib.sha256((tmp_path / "good.msh").read_bytes()).hexdigest()
    assert f"sha256 {digest}" in page.read_text(), "the page is of the mesh that was written, not of the one read"
    section = html.fromstring(page.read_text()).xpath("//section[h2[@id='h-repair']]")[0]
    before_after, passes = (
        [[cell.text_content().strip() for cell in row] for row in t.xpath(".//tbody/tr")]
        for t in section.xpath(".//table")
    )
    assert [row[0] for row in passes] == ["orient", "untangle"]
    assert passes[0][1] == "2"
    worst = next(row for row in before_after if row[:2] == ["Scaled Jacobian", "hex"])
    assert float(worst[2].replace("−", "-")) < 0.0 < float(worst[3])


def test_what_cannot_be_mended_exits_with_1_and_says_so(tmp_path):
    points, hexes = box(1)
    points[7] = points[0] + 0.01  # every corner is on the boundary: nothing may move
    path = tmp_path / "one.vtu"
    write(solid(points, hex=hexes), path)
    result = run(path, "-o", tmp_path / "out.vtu")
    assert result.exit_code == 1
    assert "1 inverted or degenerate cells are left" in result.stdout


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (["IN"], 2, "Name the repaired mesh with -o OUT"),
        (["IN", "-o", "x.docx"], 2, "its suffix must be one of .msh, .su2"),
        (["IN", "-o", "o.msh", "--passes", "polish"], 2, "unknown pass 'polish'"),
        (["IN", "-o", "o.msh", "--hold", "nobody"], 2, "no zone matches 'nobody'"),
        (["none.msh", "-o", "o.msh"], 3, "none.msh"),
        (["IN", "--undo", "none.zip", "-o", "o.msh"], 3, "a journal of meshwright repair"),
    ],
)
def test_a_mistake_gets_one_line_and_the_right_status(tangled, tmp_path, monkeypatch, words, status, text):
    monkeypatch.chdir(tmp_path)
    result = run(*[tangled if w == "IN" else w for w in words])
    assert result.exit_code == status
    assert text in result.output
    assert not (tmp_path / "o.msh").exists()


@pytest.mark.parametrize("seconds", [0.0, 0.5, 1.0, 2.0])
def test_a_kill_in_the_middle_leaves_the_input_or_the_whole_result(tmp_path, seconds):
    path, journal = tmp_path / "in.vtu", tmp_path / "j.zip"
    write(random_tets(3000), path)
    before = path.read_bytes()
    command = (
        "import sys; from meshwright.reports import repair_job; from meshwright.reports.cli import main; "
        "print('begun', flush=True); sys.exit(main())"
    )
    words = ["repair", str(path), "-o", str(path), "--journal", str(journal), "--quiet"]
    process = subprocess.Popen(
        [sys.executable, "-c", command, *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdout.readline() == b"begun\n"
    time.sleep(seconds)
    process.kill()
    process.communicate()
    if path.read_bytes() != before:  # it was through: then the result is whole, and the journal gives the input back
        assert not repair(read(path)).changed
        assert run(path, "--undo", journal, "-o", tmp_path / "back.vtu").exit_code == 0
        assert (tmp_path / "back.vtu").read_bytes() == before
    elif seconds == 0.0:
        assert process.returncode == -signal.SIGKILL


def test_every_pass_is_listed_with_what_it_does():
    result = run("--list-passes")
    assert result.exit_code == 0
    assert all(name in result.stdout for name in ("orient", "untangle", "improve", "weld"))


VOLUMES = {
    "tets": lambda: random_tets(40),
    "hexes": lambda: solid(box(3, 0.2)[0], hex=box(3)[1]),
    "quads": lambda: solid(square(4, 0.2)[0], quad=square(4)[1]),
}


@pytest.mark.parametrize("suffix", [".msh", ".su2", ".vtk", ".vtu"])
@pytest.mark.parametrize("kind", VOLUMES)
def test_what_is_written_reads_back_as_the_same_mesh(tmp_path, suffix, kind):
    mesh = bounded(VOLUMES[kind]())
    path = tmp_path / f"m{suffix}"
    lost = write(mesh, path)
    back = read(path)
    assert np.array_equal(back.points, mesh.points)
    assert [b.type for b in back.blocks] == [b.type for b in mesh.blocks]
    assert np.array_equal(back.blocks[0].nodes, mesh.blocks[0].nodes)
    if suffix in (".msh", ".su2"):
        assert not lost
        assert {z.name: len(z.members) for z in back.zones if z.entity == "face"} == {
            z.name: len(z.members) for z in mesh.zones
        }
    else:
        assert all(sum(repr(z.name) in text for text in lost) == 1 for z in mesh.zones), "what is not held is said once"


@pytest.mark.parametrize("suffix", [".msh", ".su2", ".vtk", ".vtu"])
def test_a_hybrid_mesh_reads_back_cell_by_cell(tmp_path, suffix):
    mesh = hybrid_layers()
    write(mesh, tmp_path / f"m{suffix}")
    back = read(tmp_path / f"m{suffix}")
    for block in mesh.blocks:
        assert np.array_equal(back.block(block.type).nodes, block.nodes), block.type
    assert not repair(back, "orient").changed


def test_vtk_and_meshio_files_of_one_wedge_are_read_as_the_same_wedge(tmp_path):
    """VTK 9 computes with the order in which wedges stand, meshio writes and reads them turned."""
    mesh = hybrid_layers()
    vtk_size = pytest.importorskip("vtk").vtkCellSizeFilter()
    write(mesh, tmp_path / "ours.vtu")
    meshio.Mesh(mesh.points, [("wedge", mesh.block("wedge").nodes)]).write(tmp_path / "meshio.vtu")
    meshio.Mesh(mesh.points, [("wedge", mesh.block("wedge").nodes)]).write(tmp_path / "meshio.vtk")
    for name in ("ours.vtu", "meshio.vtu", "meshio.vtk"):
        assert np.array_equal(read(tmp_path / name).block("wedge").nodes, mesh.block("wedge").nodes), name
    reader = importlib.import_module("vtk").vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "ours.vtu"))
    vtk_size.SetInputConnection(reader.GetOutputPort())
    vtk_size.Update()
    sizes = vtk_size.GetOutput().GetCellData().GetArray("Volume")
    assert min(sizes.GetValue(i) for i in range(sizes.GetNumberOfTuples())) > 0.0


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".off"])
def test_a_surface_reads_back_as_the_same_surface(tmp_path, suffix):
    points, quads = square(4, 0.2)
    points[:, 2] = points[:, 0] ** 2
    tris = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = Mesh(points, (CellBlock("tri", np.arange(len(tris)), tris),))
    write(mesh, tmp_path / f"s{suffix}")
    back = read(tmp_path / f"s{suffix}")
    a = mesh.points[mesh.block("tri").nodes]
    b = back.points[back.block("tri").nodes]
    assert np.allclose(a, b, rtol=1e-6 if suffix == ".stl" else 0.0, atol=1e-7 if suffix == ".stl" else 0.0)


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".off"])
def test_a_solid_mesh_is_not_written_as_a_surface(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    with pytest.raises(UsageError, match="alone"):
        write(VOLUMES["hexes"](), path)
    assert not path.exists()


def test_every_writer_is_tried():
    """OpenFOAM folders have tests of their own, in test_repair_foam."""
    assert set(WRITERS) == {".msh", ".su2", ".vtk", ".vtu", ".stl", ".obj", ".off", ".foam"}


@pytest.mark.parametrize("names", [("left", "right"), ("flüssig & <fest>", "0"), ("all of it",)])
def test_zones_of_cells_have_their_names_again_when_a_vtu_file_is_read(tmp_path, names):
    mesh = random_tets(40)
    half = np.array_split(np.arange(mesh.n_cells), len(names))
    zones = tuple(Zone(name, "zone", "", "cell", rows) for name, rows in zip(names, half, strict=True))
    lost = write(Mesh(mesh.points, mesh.blocks, zones=zones), tmp_path / "m.vtu")
    back = read(tmp_path / "m.vtu")
    assert not lost
    assert {z.name: z.members.tolist() for z in back.zones} == {z.name: z.members.tolist() for z in zones}


def test_texts_in_a_vtu_file_do_not_keep_it_from_being_read(tmp_path):
    mesh = random_tets(40)
    write(mesh, tmp_path / "m.vtu")
    text = (tmp_path / "m.vtu").read_bytes()
    words = b"<DataArray type='String' Name='title' NumberOfTuples='1' format='ascii'>\n72 105 0\n</DataArray>"
    field = b"<FieldData>\n" + words + b"\n</FieldData>\n"
    (tmp_path / "m.vtu").write_bytes(text.replace(b"<Piece", field + b"<Piece", 1))
    assert read(tmp_path / "m.vtu").counts == mesh.counts


def test_zones_that_a_format_has_no_place_for_are_told_in_one_line_with_the_format_that_has(tmp_path):
    points, hexes = box(2)
    sides = hexes[:, :4]
    zones = [Zone(f"wall {k}", "w", "wall", "face", np.array([k])) for k in range(6)]
    zones.append(Zone("probe", "set", "", "point", np.array([3])))
    block = CellBlock("quad", np.arange(len(sides)), sides)
    mesh = Mesh(points, solid(points, hex=hexes).blocks, boundary=(block,), zones=tuple(zones))
    told = [text for text in write(mesh, tmp_path / "a.vtu") if "no place" in text]
    assert told == [
        "no place in a file of cells (.msh and .su2 have it) for 6 zones of faces: "
        "'wall 0', 'wall 1', 'wall 2', 'wall 3' and 2 more",
        "no place in a file of cells for 1 zone of points: 'probe'",
    ]
