"""Figures for notebooks and papers, and `meshwright plot`: what they show is what the document says."""

import copy
import json
import re
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.image
import matplotlib.pyplot as plt
import numpy as np
import pytest
from lxml import etree

from meshwright.audit import audit, read, summarise
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.reports import plot
from meshwright.reports.bad_entities import UNDEFINED, colours_of, range_of, shown_of
from meshwright.reports.cli import cli
from meshwright.reports.view_svg import view_svg

mpl.use("Agg")

SAMPLES = Path(__file__).parent.parent / "samples"
SKEW, ASPECT = "gambit.equiangle_skew", "gambit.aspect_ratio"
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)


def row_of_hexes(names=("left", "right")):
    """Five hexes apart, the k-th sheared by k tenths, in two zones."""
    points = np.concatenate([CUBE + (2 * k, 0, 0) + CUBE[:, 2:] * (0.1 * k, 0, 0) for k in range(5)])
    zones = (Zone(names[0], "part", "", "cell", [0, 1]), Zone(names[1], "part", "", "cell", [2, 3, 4]))
    return Mesh(points, (CellBlock("hex", np.arange(5), np.arange(40).reshape(5, 8)),), zones=zones)


@pytest.fixture(scope="module")
def found():
    return audit(row_of_hexes())


@pytest.fixture(scope="module")
def hybrid():
    return audit(read(SAMPLES / "hybrid" / "hybrid.msh.gz"))


@pytest.fixture(autouse=True)
def close():
    yield
    plt.close("all")


def heights(ax, kind):
    container = next(c for c in ax.containers if c.get_label() == kind)
    return [int(bar.get_height()) for bar in container]


def test_bars_are_the_counts_of_the_document_and_both_scales_are_named(hybrid):
    ax = plot.histogram(hybrid, SKEW)
    entry = summarise(hybrid)["histograms"][SKEW]
    for kind, counts in entry["counts"].items():
        assert heights(ax, kind) == counts
    assert ax.get_yscale() == "log"
    assert ax.get_xlabel() == "Fluent (0 best)"
    assert [t.get_text() for t in ax.get_xticklabels()] == entry["labels"]
    (other,) = ax.child_axes
    assert other.get_xlabel() == "ICEM (1 best)"
    assert [t.get_text() for t in other.get_xticklabels()] == entry["mirrored"]


def test_a_document_read_back_draws_the_same_as_its_audit(hybrid):
    document = json.loads(json.dumps(summarise(hybrid)))
    for kind in document["histograms"][SKEW]["counts"]:
        assert heights(plot.histogram(document, SKEW), kind) == heights(plot.histogram(hybrid, SKEW), kind)


def test_the_scale_asked_for_is_the_lower_one(hybrid):
    ax = plot.histogram(hybrid, SKEW, scale="icem")
    assert ax.get_xlabel() == "ICEM (1 best)"
    assert ax.child_axes[0].get_xlabel() == "Fluent (0 best)"


def test_one_type_alone_can_be_drawn(hybrid):
    ax = plot.histogram(hybrid, SKEW, types=["tet"])
    assert [c.get_label() for c in ax.containers] == ["tet"]


def test_a_baseline_is_a_tick_at_its_count(found):
    before = copy.deepcopy(summarise(found))
    before["histograms"][SKEW]["counts"]["hex"] = [7, 0, 0, 3, 0, 0, 0, 0, 0, 0]
    ax = plot.histogram(found, SKEW, baseline=before)
    (lines,) = [c for c in ax.collections if c.get_label() == "baseline"]
    seen = [segment[0][1] for segment in lines.get_segments() if len(segment)]
    assert seen == [7, 3]


@pytest.mark.parametrize("metric", ["no.such", "volume"])
def test_what_is_not_there_is_refused_with_what_is(found, metric):
    document = copy.deepcopy(summarise(found))
    document["histograms"].pop("volume", None)
    with pytest.raises(UsageError, match="no histogram of"):
        plot.histogram(document, metric)


def test_types_and_scales_that_are_not_there_are_refused(found):
    with pytest.raises(UsageError, match="no type tet here"):
        plot.histogram(found, SKEW, types=["tet"])
    with pytest.raises(UsageError, match="has no icem scale"):
        plot.histogram(audit(row_of_hexes(), "volume"), "volume", scale="icem")


def test_the_cumulative_share_of_an_audit_is_exact(found):
    (line,) = plot.cumulative(found, SKEW).lines
    values = np.sort(found.measured.values[SKEW]["hex"])
    x, y = line.get_data()
    for k, value in enumerate(values):
        assert y[np.flatnonzero(x == value)[-1]] == pytest.approx((k + 1) / 5)
    assert y[0] == 0.0
    assert y[-1] == 1.0


def test_the_cumulative_share_of_a_document_agrees_at_the_edges_of_bins(hybrid):
    exact, binned = plot.cumulative(hybrid, SKEW), plot.cumulative(summarise(hybrid), SKEW)
    for one, other in zip(exact.lines, binned.lines, strict=True):
        x, y = one.get_data()
        for edge, share in zip(*other.get_data(), strict=True):
            below = y[x < edge]  # bins are closed below, so a value on the edge counts above it
            if edge < 1.0:
                assert share == pytest.approx(below[-1] if len(below) else 0.0)


def test_ratios_that_span_more_than_a_decade_have_a_logarithmic_axis(hybrid):
    demo = audit(read(SAMPLES / "demo.msh.gz"))
    assert plot.cumulative(demo, ASPECT).get_xscale() == "log"
    assert plot.cumulative(hybrid, SKEW).get_xscale() == "linear"


def test_the_distributions_are_those_of_the_article(hybrid):
    first, second = plot.distributions(hybrid)
    table = summarise(hybrid)["distributions"]
    assert heights(first, "tet") == table["equiangle_skew"]["counts"]["tet"]
    assert heights(second, "tet") == table["aspect_ratio"]["counts"]["tet"]


def test_zones_are_dark_where_they_are_bad(found):
    ax = plot.zones_heat(found, metrics=[SKEW])
    assert [t.get_text() for t in ax.get_yticklabels()] == ["left", "right"]
    values = found.measured.values[SKEW]["hex"]
    image = ax.images[0].get_array()
    assert np.allclose(np.ravel(image), [values[:2].max(), values[2:].max()])
    with pytest.raises(UsageError, match="no zone of cells"):
        plot.zones_heat(audit(Mesh(CUBE, (CellBlock("hex", [0], [np.arange(8)]),))))


def test_the_worst_cells_are_listed_first_and_undefined_ones_before_them(found):
    shown = shown_of(found, SKEW, worst=3)
    assert shown.rows.tolist() == [4, 3, 2]
    assert shown.of == 5
    points = found.mesh.points.copy()
    points[0] = np.nan
    broken = audit(Mesh(points, found.mesh.blocks))
    shown = shown_of(broken, SKEW, worst=2)
    assert shown.rows.tolist() == [0, 4]
    assert shown.undefined == 1
    assert colours_of(shown, *range_of(shown.values, high_is_worse=True))[0].tolist() == list(UNDEFINED)


def test_beyond_is_strict_and_zones_restrict(found):
    values = found.measured.values[SKEW]["hex"]
    assert shown_of(found, SKEW, beyond=float(values[3])).rows.tolist() == [4]
    assert shown_of(found, SKEW, zone="left").rows.tolist() == [1, 0]
    least = audit(row_of_hexes(), "icem.equiangle_skewness")
    assert shown_of(least, "icem.equiangle_skewness", worst=1).rows.tolist() == [4]  # 1 is best: the smallest is worst


def test_a_size_has_no_bad_end():
    with pytest.raises(UsageError, match="no bad end"):
        shown_of(audit(row_of_hexes(), "volume"), "volume", beyond=1.0)


def test_bad_cells_are_drawn_with_a_bar_from_the_best_to_the_worst_shown(found):
    ax = plot.bad_cells(found, SKEW, worst=3, size=(300, 200))
    values = np.sort(found.measured.values[SKEW]["hex"])
    bar = ax.figure.axes[1]
    assert bar.get_ylim() == (pytest.approx(values[2]), pytest.approx(values[4]))
    assert ax.images[0].get_array().shape == (200, 300, 3)
    assert ax.get_title().startswith("3 of 5 cells")


@pytest.mark.parametrize("name", ["$x^{$", "</svg><script>", "\x00\u202e", "=1+1", "x" * 1_000_000, r"\frac{1}{0}"])
def test_names_of_zones_stay_text_in_figures(name, tmp_path):
    drawn = plot.zones_heat(audit(row_of_hexes((name, "other"))), metrics=[SKEW])
    drawn.figure.savefig(tmp_path / "zones.svg")
    root = etree.parse(tmp_path / "zones.svg", etree.XMLParser(huge_tree=False)).getroot()
    assert not list(root.iter("{*}script"))


def plotted(tmp_path, *arguments, name="x.svg", status=0):
    file = tmp_path / name
    with pytest.raises(SystemExit) as stop:
        cli.main(["plot", *map(str, arguments), "-o", str(file), "--quiet"])
    assert stop.value.code == status
    return file


def test_the_command_draws_a_histogram_without_matplotlib(tmp_path):
    script = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from meshwright.reports.cli import main; sys.argv = ['meshwright', *sys.argv[1:]]; main()"
    )
    mesh, svg, png = SAMPLES / "cells" / "hex.v41.msh", tmp_path / "x.svg", tmp_path / "x.png"
    drawn = subprocess.run([sys.executable, "-c", script, "plot", mesh, "-o", svg], check=False)
    assert drawn.returncode == 0
    assert etree.parse(svg).getroot().tag.endswith("svg")
    command = [sys.executable, "-c", script, "plot", mesh, "-o", png]
    refused = subprocess.run(command, check=False, capture_output=True, text=True)
    assert refused.returncode == 2
    assert "pip install 'meshwright[plot]'" in refused.stderr
    assert not png.exists()


@pytest.mark.parametrize("kind", ["histogram", "cumulative", "zones", "view"])
@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_every_kind_is_written_in_every_format_or_refused(kind, suffix, tmp_path):
    refused = (kind, suffix) == ("view", "pdf")
    file = plotted(tmp_path, SAMPLES / "demo.msh.gz", "--kind", kind, name=f"x.{suffix}", status=2 if refused else 0)
    if refused:
        assert not file.exists()
        return
    head = {"svg": b"<", "png": b"\x89PNG", "pdf": b"%PDF"}[suffix]
    assert file.read_bytes().startswith(head)
    if suffix == "png":
        assert matplotlib.image.imread(file).std() > 0.05
    if suffix == "svg":
        assert len(list(etree.parse(file).getroot().iter())) > 10


def test_the_same_mesh_gives_the_same_bytes(tmp_path):
    for suffix in ("svg", "pdf", "png"):
        one, two = (
            plotted(tmp_path, SAMPLES / "demo.msh.gz", "--kind", "cumulative", name=f"{k}.{suffix}") for k in "ab"
        )
        assert one.read_bytes() == two.read_bytes()


def test_saved_audits_are_drawn_with_a_baseline_and_views_refuse_them(tmp_path, hybrid, capsys):
    saved = tmp_path / "audit.json"
    saved.write_text(json.dumps(summarise(hybrid)))
    root = etree.parse(plotted(tmp_path, saved, "--baseline", saved)).getroot()
    assert [p for p in root.iter("{*}path") if p.get("class") == "tick"]
    plotted(tmp_path, saved, "--kind", "view", status=2)
    assert "a view needs the mesh" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (["--metric", "no.such"], 2, "unknown metric"),
        (["--metric", f"{SKEW},{ASPECT}"], 2, "draws one metric"),
        (["--beyond", "0.5"], 2, "--beyond is for --kind view"),
        (["--kind", "view", "--baseline", "x"], 2, "--baseline is for --kind histogram"),
        (["--size", "0x0"], 2, "--size 0x0: expected WxH"),
        (["--size", "huge"], 2, "--size huge: expected WxH"),
        (["--zone", "nowhere*"], 2, "no cell zone matches"),
        (["--dark"], 2, "--dark"),
        (["--baseline", "nowhere.json"], 3, "nowhere.json"),
    ],
)
def test_mistakes_are_told_and_leave_no_file(arguments, status, said, tmp_path, capsys):
    file = plotted(tmp_path, SAMPLES / "hybrid" / "hybrid.msh.gz", *arguments, status=status)
    assert said in capsys.readouterr().err
    assert not file.exists()


def test_a_mesh_that_cannot_be_read_is_status_3(tmp_path):
    bad = tmp_path / "bad.msh"
    bad.write_bytes(b"nothing")
    assert not plotted(tmp_path, bad, status=3).exists()


def test_a_name_without_a_known_ending_is_refused(tmp_path, capsys):
    plotted(tmp_path, SAMPLES / "demo.msh.gz", name="x.gif", status=2)
    assert ".svg, .png, .pdf" in capsys.readouterr().err


def test_a_drawing_of_a_cube_has_nine_edges_in_sight_and_three_behind():
    cube = Mesh(CUBE, (CellBlock("hex", [0], [np.arange(8)]),))
    root = etree.fromstring(view_svg(cube, [], title="cube", view="iso").encode())
    length = {}
    for path in root.iter("{*}path"):
        ends = np.array(re.findall(r"M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)", path.get("d")), float)
        length[path.get("class")] = np.hypot(*(ends[:, :2] - ends[:, 2:]).T).sum()
    # parallel edges are equally long, and of each direction three are seen and one is not
    assert length["hidden"] / (length["hidden"] + length["crease"]) == pytest.approx(3 / 12, abs=0.01)


def test_a_drawing_shows_far_cells_first_and_every_side_of_them():
    root = etree.fromstring(
        view_svg(row_of_hexes(), [0, 4], [(200, 0, 0), (0, 0, 200)], title="row", view="x").encode()
    )
    fills = [p.get("fill") for p in root.iter("{*}polygon")]
    assert len(fills) == 12
    blue = [k for k, fill in enumerate(fills) if fill.endswith("00") is False]
    assert min(blue) > max(set(range(12)) - set(blue))  # x = 8 lies nearer to an eye on +x than x = 0


def test_a_drawing_that_would_stall_an_editor_is_refused():
    with pytest.raises(UsageError, match=r"write a \.png"):
        view_svg(row_of_hexes(), np.zeros(20_000, int), title="row")


def test_a_drawing_escapes_its_title_and_dots_what_is_tiny():
    tiny = Mesh(np.concatenate([CUBE, 1e6 + CUBE]), (CellBlock("hex", [0, 1], np.arange(16).reshape(2, 8)),))
    root = etree.fromstring(view_svg(tiny, [1], title="</svg><script>\x00", view="z").encode())
    assert len(list(root.iter("{*}circle"))) == 1
    assert not list(root.iter("{*}script"))
