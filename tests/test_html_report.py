"""The report without a browser: its sections, its files, its promises about the command line."""

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from lxml import html
from report_meshes import block_of_hexes

from meshwright.audit.gate.files import read_gate_file
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.loading import PROFILES, load
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports import html_file
from meshwright.reports.cli import cli
from meshwright.reports.html import report as report_module
from meshwright.reports.html.report import report_html
from meshwright.reports.saved import read_saved

SAMPLES = Path(__file__).parent.parent / "samples"
DEMO = str(SAMPLES / "demo.msh.gz")
SKEW = "gambit.equiangle_skew"
GATE = f"""
[[rule]]
id = "skew"
metric = "{SKEW}"
stat = "max"
warn_le = 0.2
le = 0.3
no_worse = {{ abs = 0.01 }}
[[rule]]
id = "known"
metric = "volume"
stat = "max"
le = 0.1
[[rule]]
id = "icem"
metric = "{SKEW}"
scale = "icem"
stat = "min"
ge = 0.2
where = {{ zone = "lower" }}
[[waiver]]
rule = "known"
reason = "big cells are meant to be"
until = 2999-01-01
"""


@pytest.fixture(scope="module")
def gate(tmp_path_factory):
    path = tmp_path_factory.mktemp("gate") / "meshgate.toml"
    path.write_text(GATE)
    return read_gate_file(path)


def tree_of(text):
    return html.fromstring(text)


def words(tree, section):
    return " ".join(tree.xpath(f"//section[@aria-labelledby='{section}']")[0].text_content().split())


@pytest.fixture(scope="module")
def judged(gate):
    from meshwright.audit.profiles.baseline import Baseline

    before = summarise(audit(block_of_hexes(4, jitter=0.1)), profiles=[gate])
    found = audit(block_of_hexes(4))
    document = summarise(found, profiles=[gate], baseline=Baseline(before, "main.json", "", "0" * 64),
                         compare=[load(name) for name in PROFILES])  # fmt: skip
    return tree_of(report_html(found, document, baseline=before)), document


def test_the_gate_shows_figure_limit_baseline_source_and_waiver(judged):
    tree, document = judged
    text = words(tree, "h-gate")
    rules = {rule["id"]: rule for rule in document["gate"]["rules"]}
    assert rules["gate.skew"]["state"] == "fail"
    assert f"{rules['gate.skew']['measured']:.3f}" in text
    assert f"{rules['gate.skew']['baseline']:.3f}" in text
    assert "≤ 0.3, at most 0.01 worse" in text
    assert "waived until 2999-01-01" in text
    assert "big cells are meant to be" in text
    assert "zone lower" in text
    assert "icem scale" in text
    assert "line 2" in text  # where the limit stands
    assert tree.xpath("//td/span/button[@data-go='cell']")


def test_a_baseline_is_a_tick_in_the_histogram(judged):
    tree, _ = judged
    assert "baseline" in words(tree, "h-metric")


def test_every_section_is_there_and_says_something(judged):
    tree, document = judged
    for section in ("gate", "view", "metric", "quality", "dist", "findings", "heat", "rosetta", "missing", "def"):
        assert len(words(tree, f"h-{section}")) > 20, section
    assert "inverted-cells" in words(tree, "h-findings")
    assert all(zone in words(tree, "h-heat") for zone in ("lower", "upper"))
    for system in document["rosetta"]["systems"]:
        assert system["profile"] in words(tree, "h-rosetta")


def test_counts_stand_in_both_tables_as_in_the_document(judged):
    tree, document = judged
    rows = tree.xpath("//section[@aria-labelledby='h-dist']//table")[0].xpath(".//tbody/tr")
    counts = document["distributions"]["equiangle_skew"]["counts"]["hex"]
    found = [int(row.xpath("td")[1].text.replace(",", "")) for row in rows]
    assert found == counts


def test_a_repair_has_a_section_of_its_own():
    found = audit(block_of_hexes(3))
    after = summarise(found)
    before = summarise(audit(block_of_hexes(3, jitter=0.4)))
    repair = {
        "before": before, "after": after, "passes": [{"name": "smooth", "changed": 12, "note": "<b>done</b>"}],
        "moved_points": 8, "max_deviation": 0.25, "zones_kept": True, "refused": ["cell 7 is held by its wall"],
    }  # fmt: skip
    tree = tree_of(report_html(found, after, repair=repair))
    text = words(tree, "h-repair")
    assert "8 points moved, by at most 0.25" in text
    assert "<b>done</b>" in text
    assert "cell 7 is held by its wall" in text
    assert METRICS[SKEW].title in text
    assert not tree.xpath("//section[@aria-labelledby='h-repair']//b")


def test_the_page_refers_to_nothing_outside_itself(judged):
    tree, _ = judged
    for attribute in ("src", "href", "action", "data", "srcset", "poster"):
        for value in tree.xpath(f"//@{attribute}"):
            assert value.startswith(("data:", "#")), value
    assert "url(" not in "".join(tree.xpath("//style/text()"))


def test_the_same_audit_makes_the_same_page():
    pages = set()
    for _ in range(2):
        found = audit(block_of_hexes(4))
        pages.add(report_html(found, summarise(found)))
    assert len(pages) == 1


def test_the_template_names_are_all_ids_of_the_page(judged):
    tree, _ = judged
    ids = tree.xpath("//@id")
    assert len(ids) == len(set(ids))
    for target in tree.xpath("//a/@href"):
        assert target[1:] in ids


# ------------------------------------------------------------------------------------------------ the command line


def run(*args):
    return CliRunner().invoke(cli, [str(arg) for arg in args])


def test_audit_writes_a_report_beside_its_other_outputs(tmp_path):
    page, data = tmp_path / "r.html", tmp_path / "r.json"
    result = run("audit", DEMO, "--quiet", "--html", page, "--out", f"json={data}", "--profile", "cfd")
    assert result.exit_code == 0
    assert read_saved(page)[0] == json.loads(data.read_text())


def test_an_unread_mesh_has_a_report_that_says_so(tmp_path):
    page = tmp_path / "r.html"
    page.write_text("all is well")
    mesh = tmp_path / "x.msh"
    mesh.write_text("<script>no mesh</script>")
    assert run("audit", mesh, "--quiet", "--html", page).exit_code == 3
    text = page.read_text()
    assert "INCOMPLETE" in text
    assert "all is well" not in text
    assert "<script>" not in text


def test_a_report_is_of_one_mesh_and_replaces_no_input(tmp_path):
    assert run("audit", DEMO, DEMO, "--html", tmp_path / "r.html").exit_code == 2
    assert run("audit", DEMO, "--html", DEMO).exit_code == 2
    result = run("audit", DEMO, "--quiet", "--html", tmp_path / "no" / "such" / "folder" / "r.html")
    assert result.exit_code == 2
    assert "r.html" in result.stderr


def test_a_report_that_is_too_large_to_send_is_warned_about(tmp_path, monkeypatch):
    monkeypatch.setattr(report_module, "WARN_BYTES", 1000)
    result = run("audit", DEMO, "--quiet", "--html", tmp_path / "r.html")
    assert result.exit_code == 0
    assert re.search(r"has \d+ MB, which browsers and mail bear badly", result.stderr)


def test_a_failure_while_writing_leaves_the_old_report(tmp_path, monkeypatch):
    page = tmp_path / "r.html"
    page.write_text("an earlier report")

    def broken(*_args, **_options):
        raise MemoryError

    monkeypatch.setattr(report_module, "report_html", broken)
    assert html_file.write_report.__module__ == "meshwright.reports.html_file"
    assert run("audit", DEMO, "--quiet", "--html", page).exit_code == 3
    assert page.read_text() == "an earlier report"
