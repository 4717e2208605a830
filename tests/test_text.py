"""The text page, and how numbers and hostile names are spelled in every output."""

import csv
import io
import re

import numpy as np
import pytest
from rich.cells import cell_len

from meshwright.audit.findings import Finding
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.metrics import METRICS
from meshwright.audit.run import Audit, audit
from meshwright.audit.summary import summarise
from meshwright.reports.outputs import OUTPUTS, Batch, Page, Unread, render
from meshwright.reports.wording import csv_cell, figure, markdown, name, percent, plural

HOSTILE = "=cmd|'/c calc'!A1\x1b[31m[red]\u202e\n|`<script>"


def jittered(n=6, zone_names=("air", "steel"), path="a.msh"):
    """A jittered box of hexes, one half split into wedges, in two zones; ids count from 1."""
    rng = np.random.default_rng(3)
    grid = np.stack(np.meshgrid(*[np.arange(n + 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    points = grid + rng.uniform(-0.25, 0.25, grid.shape)
    a, b, c = (axis.ravel() for axis in np.meshgrid(*[np.arange(n)] * 3, indexing="ij"))

    def at(i, j, k):
        return ((a + i) * (n + 1) + b + j) * (n + 1) + c + k

    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    hexes = np.stack([at(*corner) for corner in corners], 1)
    half = len(hexes) // 2
    wedges = np.concatenate([hexes[half:][:, [0, 1, 2, 4, 5, 6]], hexes[half:][:, [0, 2, 3, 4, 6, 7]]])
    blocks = (
        CellBlock("hex", np.arange(half), hexes[:half]),
        CellBlock("wedge", np.arange(half, half + len(wedges)), wedges),
    )
    zones = (
        Zone(zone_names[0], "zone", "fluid", "cell", np.arange(half)),
        Zone(zone_names[1], "zone", "solid", "cell", np.arange(half, half + len(wedges) - 2)),
        Zone("wall", "patch", "wall", "point", np.arange(4)),
    )
    ids = np.arange(1, half + len(wedges) + 1)
    return Mesh(points, blocks, zones=zones, cell_ids=ids, path=path, format="made up", notes=("2 beams were dropped",))


@pytest.fixture(scope="module")
def document():
    return summarise(audit(jittered(), "all"))


@pytest.fixture(scope="module")
def hostile():
    mesh = jittered(3, (HOSTILE, "x" * 300), path=f"{HOSTILE}.msh")
    finding = Finding("inverted-cells", "error", "cell", np.array([0]), f"cell of {HOSTILE} is wrong")
    return summarise(Audit(mesh, measure(mesh, METRICS), (finding,), tuple(METRICS)))


@pytest.mark.parametrize("width", [60, 80, 100, 160])
def test_no_number_is_cut_at_any_width(document, width):
    text = render("text", Batch([document]), Page(width=width))
    assert not re.search(r"(?<![\w.])[-\d.]+…", text)  # the name icem.determinant_3… is no number


@pytest.mark.parametrize("width", [80, 100])
def test_the_page_keeps_within_its_width(document, hostile, width):
    for page in (document, hostile):
        text = render("text", Batch([page]), Page(width=width))
        assert max(map(cell_len, text.splitlines())) <= width


def test_the_page_shows_every_section(document):
    text = render("text", Batch([document]), Page())
    headings = [
        "Quality by type",
        "Equi-angle skewness distribution",
        "Aspect ratio distribution",
        "GAMBIT classes of equi-angle skew",
        "Metrics",
        "Worst cells by gambit.equiangle_skew",
        "Zones",
        "Notes",
    ]
    places = [text.index(f"\n{heading}") for heading in headings]
    assert places == sorted(places)
    assert "2 beams were dropped" in text


def test_the_page_prints_the_counts_of_the_document(document):
    text = render("text", Batch([document]), Page())
    counts = document["distributions"]["equiangle_skew"]["counts"]
    for k in range(10):
        row = next(line for line in text.splitlines() if line.startswith(f"  {k / 10:.1f}-{(k + 1) / 10:.1f} "))
        hexes, wedges = counts["hex"][k], counts["wedge"][k]
        assert row.split()[1:5] == [
            f"{1 - k / 10:.1f}-{0.9 - k / 10:.1f}",
            str(hexes),
            str(wedges),
            str(hexes + wedges),
        ]


def test_the_worst_cell_is_named_by_the_files_own_number(document):
    listed = document["metrics"]["gambit.equiangle_skew"]
    kind, worst = max(((k, f["worst"][0]) for k, f in listed.items()), key=lambda pair: pair[1]["value"])
    text = render("text", Batch([document]), Page())
    row = text.split("Worst cells by")[1].splitlines()[2].split()
    assert row[:2] == [str(worst["cell"]), kind]


def test_without_colour_there_is_no_escape_and_with_it_there_is(document):
    assert "\x1b" not in render("text", Batch([document]), Page())
    assert "\x1b[" in render("text", Batch([document]), Page(colour=True))


def test_colour_changes_nothing_but_the_colour(document):
    coloured = render("text", Batch([document]), Page(colour=True))
    plain = re.sub(r"\x1b\[[0-9;]*m", "", coloured)
    assert [line.rstrip() for line in plain.splitlines()] == render("text", Batch([document]), Page()).splitlines()


@pytest.mark.parametrize("output", OUTPUTS)
def test_hostile_names_reach_no_output_raw(hostile, output):
    text = render(output, Batch([hostile], [Unread(HOSTILE, HOSTILE)]), Page(zones=True))
    assert "\x1b" not in text
    assert "\u202e" not in text or output == "json"  # JSON is data; readers of it escape for their own page
    if output == "text":
        assert "[red]" in text  # shown, not obeyed


def test_hostile_names_do_not_break_markdown_tables(hostile):
    text = render("md", Batch([hostile]), Page(zones=True))
    for block in re.split(r"\n\n", text):
        rows = [line for line in block.splitlines() if line.startswith("|")]
        widths = {len(re.findall(r"(?<!\\)\|", row)) for row in rows}
        assert len(widths) <= 1
    assert "<script>" not in text.replace("\\<script\\>", "")


def test_no_csv_field_from_a_file_begins_a_formula(hostile):
    rows = list(csv.reader(io.StringIO(render("csv", Batch([hostile]), Page()))))
    assert {len(row) for row in rows} == {8}
    assert not [field for row in rows for field in row[:3] if field.startswith(("=", "+", "@", "-"))]
    assert any(row[0].startswith("'=cmd") for row in rows)


def test_csv_holds_the_tables_unrounded(document):
    rows = list(csv.DictReader(io.StringIO(render("csv", Batch([document]), Page()))))
    whole = [r for r in rows if r["table"] == "equiangle_skew" and r["zone"] == "" and r["item"] == "count"]
    counts = document["distributions"]["equiangle_skew"]["counts"]
    assert [int(r["value"]) for r in whole if r["type"] == "hex"] == counts["hex"]
    assert (whole[8]["fluent"], whole[8]["icem"]) == ("0.8-0.9", "0.2-0.1")
    worst = next(r for r in rows if r["item"] == "worst_equiangle_skew" and r["type"] == "hex")
    assert float(worst["value"]) == document["quality"][0]["worst_equiangle_skew"]


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0.000"),
        (1.0, "1.000"),
        (0.99999, ">0.999"),
        (0.00001, "<0.001"),
        (-0.00001, ">-0.001"),
        (1.00001, "<1.001"),
        (-0.99999, "<-0.999"),
        (0.9994, "0.999"),
        (1e-15, "0.000"),
        (0.8, "0.800"),
        (1.2071, "1.207"),
        (59.99999, "60.00"),
        (123.456, "123.5"),
        (2.5e5, "2.5e+05"),
        (float("inf"), "inf"),
        ("inf", "inf"),
        ("nan", "nan"),
        (None, "-"),
    ],
)
def test_figures_are_never_rounded_onto_perfect_or_degenerate(value, shown):
    assert figure(value) == shown


def test_sizes_keep_their_magnitude():
    assert figure(-1.25e-12, "L3") == "-1.25e-12"


@pytest.mark.parametrize(
    ("part", "whole", "shown"),
    [
        (0, 10, "0 %"),
        (10, 10, "100 %"),
        (1, 1_000_000, "<0.1 %"),
        (999_999, 1_000_000, ">99.9 %"),
        (1, 3, "33.3 %"),
        (0, 0, "-"),
    ],
)
def test_only_nothing_is_zero_percent_and_only_everything_is_all(part, whole, shown):
    assert percent(part, whole) == shown


def test_counts_have_their_plural():
    assert [plural(n, "entry") for n in (0, 1, 1234)] == ["0 entries", "1 entry", "1,234 entries"]
    assert plural(1, "cell") == "1 cell"


def test_names_are_one_printable_line_of_bounded_length():
    shown = name("a\nb\x07" + "é" * 100, 20)
    assert shown.startswith("a\\nb\\x07é")
    assert len(shown) == 20
    assert shown.endswith("…")


def test_markdown_and_csv_spell_names_literally():
    assert markdown("a|b*c") == "a\\|b\\*c"
    assert [csv_cell(t) for t in ("=1", "+1", "-1", "@x", "\tx", "\rx", "ok", None)] == [
        "'=1",
        "'+1",
        "'-1",
        "'@x",
        "'\\tx",
        "'\\rx",
        "ok",
        "",
    ]


def boxes(names, leaning=()):
    """A hex in a zone of its own for each name; those that lean are skewed."""
    unit = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    points = np.concatenate(
        [unit + (10 * i, 0, 0) + unit[:, [2]] * (3 * (i in leaning), 0, 0) for i in range(len(names))]
    )
    nodes = np.arange(len(points)).reshape(-1, 8)
    zones = tuple(Zone(label, "part", "", "cell", np.array([i])) for i, label in enumerate(names))
    return Mesh(points, (CellBlock("hex", np.arange(len(nodes)), nodes),), zones=zones)


def zone_lines(mesh):
    text = render("text", Batch([summarise(audit(mesh))]), Page())
    return text[text.index("\nZones\n") :].splitlines()[3:]


def test_two_zones_of_one_name_keep_their_own_figures_and_one_without_a_name_is_called_so():
    lines = [" ".join(line.split()) for line in zone_lines(boxes(["air", "air", ""], leaning={1}))]
    assert lines == ["air part 1 cell 0.000 0 %", "air part 1 cell 0.795 0 %", "(unnamed) part 1 cell 0.000 0 %"]


def test_of_many_zones_the_worst_are_shown_and_the_rest_counted():
    lines = zone_lines(boxes([f"part {i}" for i in range(40)], leaning={35, 39}))
    assert [line.split()[1] for line in lines[:3]] == ["35", "39", "0"]
    assert lines[-1] == "  … and 10 more zones; the worst stand first"
    assert len(lines) == 31


def test_a_table_that_leaves_out_a_type_says_how_many_cells_that_are():
    unit = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    faces = Faces(
        np.arange(0, 25, 4),
        np.array([0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7]) + 8,
        np.ones(6, dtype=int),
        np.full(6, -1),
    )
    blocks = (
        CellBlock("hex", [0], [range(8)]),
        CellBlock("polyhedron", [1], offsets=np.array([0, 6]), items=np.arange(6)),
    )
    document = summarise(audit(Mesh(np.concatenate([unit, unit + 5]), blocks, faces=faces)))
    for output in ("text", "md"):
        text = render(output, Batch([document]), Page())
        after = text[text.index("Aspect ratio distribution") : text.index("GAMBIT classes")]
        assert "not defined for 1 polyhedron cell" in after
        assert "not defined" not in text[text.index("Equi-angle skewness dist") : text.index("Aspect ratio dist")]


def test_perfect_values_are_not_listed_as_the_worst():
    text = render("text", Batch([summarise(audit(boxes(["a", "b"], leaning={1})))]), Page())
    listed = text[text.index("Worst of every other metric") : text.index("\nZones")]
    assert "gambit.midangle_skew" in listed
    assert "gambit.taper" not in listed  # both boxes have parallel faces


def test_long_paths_keep_the_end_that_tells_them_apart(document):
    folder = "/a/very/long/way/down/to/the/folder/of/meshes/that/are/many"
    documents = [{**document, "mesh": {**document["mesh"], "path": f"{folder}/mesh-{i}.msh"}} for i in range(2)]
    text = render("text", Batch(documents), Page(width=80))
    assert "mesh-0.msh " in text
    assert "mesh-1.msh " in text
    assert max(map(cell_len, text.splitlines())) <= 80


def test_the_ids_of_a_finding_stay_on_its_line(document):
    rows = list(range(10**12, 10**12 + 6))
    long = {"code": "nonconformal-interface", "severity": "warning", "count": 10**9, "entity": "face"}
    page = {**document, "findings": [{**long, "ids": rows, "places": [], "message": "m"}]}
    for width in (60, 80, 100):
        line = next(line for line in render("text", Batch([page]), Page(width=width)).splitlines() if "nonconf" in line)
        assert cell_len(line) <= width
    assert f"{rows[0]}, {rows[1]}, …" in line
