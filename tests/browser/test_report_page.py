"""The report in a browser: what a person does with it, and what nobody may do to it."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent.parent))  # helpers of the tests beside

from hostile_names import NAMES
from report_meshes import MESHES, block_of_hexes

from meshwright.audit.gate.files import read_gate_file
from meshwright.audit.mesh import Mesh, Zone
from meshwright.audit.profiles.loading import PROFILES, load
from meshwright.audit.readers import read
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.html.report import incomplete_html, report_html
from meshwright.reports.saved import read_saved

SKEW, ASPECT = "gambit.equiangle_skew", "gambit.aspect_ratio"
DEMO = Path(__file__).parent.parent.parent / "samples" / "demo.msh.gz"
GATE = f"""
[[rule]]
id = "skew"
metric = "{SKEW}"
stat = "max"
warn_le = 0.3
le = 0.5
[[rule]]
id = "aspect"
metric = "{ASPECT}"
stat = "p99"
le = 20
"""


def made(path, mesh, gate=None, metrics="default", **options):
    found = audit(mesh, metrics)
    document = summarise(found, profiles=[gate] if gate else [], sha256="0" * 64, **options)
    path.write_text(report_html(found, document), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def gate(tmp_path_factory):
    path = tmp_path_factory.mktemp("gate") / "meshgate.toml"
    path.write_text(GATE)
    return read_gate_file(path)


@pytest.fixture(scope="session")
def demo(tmp_path_factory, gate):
    """The report of a wind tunnel around a car."""
    return made(tmp_path_factory.mktemp("demo") / "report.html", read(DEMO), gate)


@pytest.fixture(scope="session")
def block(tmp_path_factory, gate):
    """The report of a block of hexahedra in two zones, one of them inverted."""
    path = tmp_path_factory.mktemp("block") / "report.html"
    return made(path, block_of_hexes(6), gate, "all", compare=[load(name) for name in PROFILES])


def shown(page):
    return page.evaluate("meshwrightView.shown()")


def camera(page):
    return page.evaluate("meshwrightView.camera.position.toArray()")


def test_it_opens_from_disk_asks_for_nothing_and_says_nothing(open_page, demo):
    watched = open_page(demo)
    assert watched.page.evaluate("document.documentElement.dataset.ready") == "view"
    assert "PASS" in watched.page.inner_text(".verdict") or "FAIL" in watched.page.inner_text(".verdict")
    watched.quiet()


def test_dragging_turns_the_view(open_page, demo):
    watched = open_page(demo)
    page = watched.page
    before, picture = camera(page), page.evaluate("meshwrightView.snapshot()")
    box = page.locator("#view-box canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 120, y + 40, steps=5)
    page.mouse.up()
    assert not np.allclose(camera(page), before)
    assert page.evaluate("meshwrightView.snapshot()") != picture
    assert page.is_hidden("#pick")  # a drag picks nothing
    watched.quiet()


def test_a_click_on_a_cell_opens_its_card(open_page, block):
    watched = open_page(block)
    page = watched.page
    page.click("#fit-worst")  # the worst cell is in the middle now
    page.keyboard.press("Escape")
    page.locator("#view-box canvas").press("Escape")
    assert page.is_hidden("#pick")
    box = page.locator("#view-box canvas").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    card = page.inner_text("#pick")
    picked = page.evaluate("meshwrightView.chosen.id")
    assert str(picked) in card
    assert 1001 <= picked <= 1000 + 6**3
    assert "centroid" in card
    watched.quiet()


def test_a_row_goes_to_its_cell_by_mouse_and_by_keyboard(open_page, block):
    page = open_page(block).page
    row = page.locator("table.worst tr[data-go]").first
    wanted = int(row.get_attribute("data-id"))
    row.locator("td").nth(1).click()
    assert page.evaluate("meshwrightView.chosen.id") == wanted
    assert str(wanted) in page.inner_text("#pick")
    other = page.locator("table.worst tr[data-go] button").nth(1)
    other.focus()
    page.keyboard.press("Enter")
    assert page.evaluate("meshwrightView.chosen.id") == int(other.get_attribute("data-id"))


def test_a_click_on_a_bar_shows_its_cells_alone_and_another_click_all(open_page, demo):
    watched = open_page(demo)
    page = watched.page
    document, _ = read_saved(demo)
    counts = np.sum(list(document["histograms"][SKEW]["counts"].values()), axis=0)
    bar = page.locator("#panel svg .bar").last
    k = int(bar.get_attribute("data-bar"))
    everything = shown(page)["cells"]
    bar.click()
    assert bar.get_attribute("aria-pressed") == "true"
    assert 0 < shown(page)["cells"] <= counts[k]
    bins = page.evaluate("meshwrightView.seen.map((item) => meshwrightView.bin(meshwrightView.level(item)))")
    assert set(bins) == {k}
    assert f"{counts[k]:,}" in page.inner_text(".bar-said")
    bar.focus()
    page.keyboard.press("Enter")
    assert bar.get_attribute("aria-pressed") == "false"
    assert shown(page)["cells"] == everything
    watched.quiet()


def test_another_metric_brings_its_panel_its_legend_and_its_cells(open_page, demo):
    watched = open_page(demo)
    page = watched.page
    legend = page.inner_text("#legend")
    page.select_option("#metric", ASPECT)
    assert page.get_attribute("#panel .panel", "data-metric") == ASPECT
    assert page.inner_text("#legend") != legend
    assert page.evaluate("meshwrightView.metric.id") == ASPECT
    page.locator(f"#chips button[data-metric='{SKEW}']").click()
    assert page.get_attribute("#panel .panel", "data-metric") == SKEW
    watched.quiet()


def test_every_metric_can_be_chosen(open_page, block):
    watched = open_page(block)
    page = watched.page
    ids = page.evaluate("[...document.querySelectorAll('#metric option')].map((option) => option.value)")
    assert len(ids) > 80
    for id_ in ids:
        page.select_option("#metric", id_)
        assert page.get_attribute("#panel .panel", "data-metric") == id_
    watched.quiet()


def test_a_zone_and_a_type_filter_the_cells(open_page, block):
    watched = open_page(block)
    page = watched.page
    page.click("#everything")
    whole = shown(page)["cells"]
    page.select_option("#zone", label="lower")
    lower = shown(page)["cells"]
    page.select_option("#zone", label="upper")
    upper = shown(page)["cells"]
    assert 0 < lower < whole
    assert lower + upper == whole
    assert page.evaluate("meshwrightView.seen.every((item) => meshwrightView.header.cellZones[item.zone] === 'upper')")
    page.select_option("#zone", label="floor")
    assert shown(page)["cells"] == whole
    assert page.evaluate("meshwrightView.parts.shell.geometry.attributes.position.count") == 6 * 36
    page.select_option("#zone", value="")
    page.select_option("#type", label="hex")
    assert shown(page)["cells"] == whole
    watched.quiet()


def test_a_plane_cuts_the_view(open_page, block):
    watched = open_page(block)
    page = watched.page
    whole = page.evaluate("meshwrightView.snapshot()")
    page.select_option("#clip", "z")
    cut = page.evaluate("meshwrightView.snapshot()")
    assert cut != whole
    page.locator("#clip-at").fill("200")
    assert page.evaluate("meshwrightView.snapshot()") != cut
    page.select_option("#clip", "")
    assert page.evaluate("meshwrightView.snapshot()") == whole
    watched.quiet()


def test_the_view_turns_zooms_and_fits_by_keyboard(open_page, block):
    page = open_page(block).page
    canvas = page.locator("#view-box canvas")
    canvas.focus()
    places = [camera(page)]
    for key in ("ArrowLeft", "ArrowUp", "+", "-", "-"):
        page.keyboard.press(key)
        places.append(camera(page))
        assert not np.allclose(places[-1], places[-2]), key
    page.keyboard.press("f")
    distance = np.linalg.norm(camera(page))
    assert distance != np.linalg.norm(places[-1])


def test_selections_hold_the_numbers_and_can_be_copied(open_page, block):
    page = open_page(block).page
    ids = [int(row.get_attribute("data-id")) for row in page.locator("table.worst tr[data-go]").all()]
    for kind, text in (
        ("ids", " ".join(map(str, ids))),
        ("hypermesh", f"*createmark elems 1 {' '.join(map(str, ids))}"),
        ("paraview", f"(cell == {ids[0]})"),
        ("openfoam", f"value   ({' '.join(map(str, ids))})"),
        ("abaqus", "*ELSET, ELSET=BAD"),
        ("nastran", f"SET 1 = {ids[0]}"),
    ):
        page.select_option("#copy-as", kind)
        assert text in page.inner_text("#copy-text")
    page.click("#copy-now")
    page.wait_for_selector("#copied:not(:empty)")
    assert page.inner_text("#copied") in ("copied", "press Ctrl+C")


@pytest.mark.parametrize("width", [390, 1400])
@pytest.mark.parametrize("dark", [False, True])
def test_no_page_scrolls_sideways_and_all_pass_the_accessibility_check(open_page, demo, artefacts, width, dark):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    watched = open_page(demo, width=width, height=900, dark=dark)
    page = watched.page
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for details in page.locator("details").all():
        details.evaluate("(element) => { element.open = true; }")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.screenshot(path=artefacts / f"report-{width}-{'dark' if dark else 'light'}.png", full_page=True)
    results = axe.run(page)
    found = [(v["id"], [n["target"] for n in v["nodes"]][:3]) for v in results.response["violations"]]
    assert found == []
    watched.quiet()


def test_print_shows_every_section(open_page, demo, artefacts):
    page = open_page(demo).page
    pdf = page.pdf(path=artefacts / "report.pdf", print_background=True)
    assert len(pdf) > 50_000
    page.set_viewport_size({"width": 794, "height": 1123})  # A4
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.wait_for_timeout(100)
    assert page.evaluate("document.documentElement.scrollWidth") <= 794
    assert page.locator("details:not([open])").count() == 0
    page.screenshot(path=artefacts / "report-print.png", full_page=True)
    assert page.is_hidden("#view-controls")
    assert page.is_visible("#h-gate")


def test_without_javascript_all_can_be_read_and_a_picture_is_there(open_page, demo, artefacts):
    watched = open_page(demo, javascript=False)
    page = watched.page
    assert page.locator("#view-box img").evaluate("(image) => image.naturalWidth") > 300
    assert page.is_visible("#panel svg")
    assert page.is_hidden("#view-controls")
    page.screenshot(path=artefacts / "report-no-javascript.png", full_page=True)
    assert watched.requests == [watched.url]


def test_without_webgl_the_picture_is_shown_and_the_reason(launch, open_page, demo, artefacts):
    browser = launch("--disable-3d-apis", "--disable-gpu")
    watched = open_page(demo, browser=browser)
    page = watched.page
    assert page.evaluate("document.documentElement.dataset.ready") == "picture"
    assert page.locator("#view-box img").evaluate("(image) => image.naturalWidth") > 300
    assert "No 3-D view" in page.inner_text("#view-said")
    assert page.is_hidden("#view-controls")
    page.locator(f"#chips button[data-metric='{ASPECT}']").click()
    assert page.get_attribute("#panel .panel", "data-metric") == ASPECT
    page.screenshot(path=artefacts / "report-no-webgl.png")
    assert watched.requests == [watched.url]


@pytest.mark.parametrize("name", MESHES)
def test_every_kind_of_mesh_has_a_report(open_page, tmp_path, name, artefacts):
    watched = open_page(made(tmp_path / "report.html", MESHES[name](), metrics="all"))
    page = watched.page
    assert page.evaluate("document.documentElement.dataset.ready") == "view"
    assert page.locator("#panel .panel").count() == 1
    page.screenshot(path=artefacts / f"report-{name.replace(' ', '-')}.png")
    if name == "not finite":
        assert "INCOMPLETE" in page.inner_text(".verdict")
    watched.quiet()


def hostile_mesh():
    """A block whose zones and file bear every hostile name."""
    mesh = block_of_hexes(4, zones=False)
    names = list(NAMES.values())
    zones = [Zone(name, "part", "wall", "cell", [k]) for k, name in enumerate(names)]
    zones += [Zone(name, "patch", name[:20], "face", [k % 16]) for k, name in enumerate(names)]
    path = NAMES["script end"] + NAMES["attribute"] + NAMES["template"]
    return Mesh(mesh.points, mesh.blocks, boundary=mesh.boundary, zones=tuple(zones), path=path, format=NAMES["image"],
                notes=tuple(names))  # fmt: skip


def test_no_name_runs_or_breaks_anything(open_page, tmp_path, gate, artefacts):
    path = made(tmp_path / "report.html", hostile_mesh(), gate, metrics="all")
    watched = open_page(path)
    page = watched.page
    assert page.evaluate("document.documentElement.dataset.ready") == "view"
    assert page.evaluate("globalThis.hacked") is None
    assert page.locator("script").count() == 5
    assert page.locator("#view-box iframe, main iframe, main object, main embed, main link, main svg svg").count() == 0
    assert page.evaluate("[...document.images].every((image) => image.src.startsWith('data:'))")
    assert page.evaluate(
        "[...document.querySelectorAll('*')].every((e) => [...e.attributes].every((a) => !a.name.startsWith('on')))"
    )
    assert page.evaluate("[...document.links].every((link) => link.getAttribute('href').startsWith('#'))")
    body = page.inner_text("main")
    assert "<script>globalThis.hacked=1</script>" in body
    assert "{{7*7}}" in body
    assert "\u202e" not in body
    for k in range(len(NAMES)):
        page.evaluate(
            "(k) => { const s = document.getElementById('zone'); s.value = `cell ${k}`;"
            " s.dispatchEvent(new Event('change')); }",
            k,
        )
    page.evaluate("meshwrightView.goTo({ entity: 'cell', id: 1 })")
    assert "script" in page.inner_text("#pick")
    assert page.evaluate("document.documentElement.scrollWidth") <= 1400
    page.screenshot(path=artefacts / "report-hostile.png", full_page=True)
    watched.quiet()
    document, _ = read_saved(path)
    names = [zone["name"] for zone in document["zones"]]
    assert names[: len(NAMES)] == [name.encode("utf-8", "replace").decode() for name in NAMES.values()]


def test_what_could_not_be_read_has_a_page_that_says_so(open_page, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(incomplete_html("<b>x</b>.msh", "expected <i>a mesh</i>, found nothing"), encoding="utf-8")
    watched = open_page(path, ready=False)
    assert "INCOMPLETE" in watched.page.inner_text(".verdict")
    assert "<i>a mesh</i>" in watched.page.inner_text("main")
    watched.quiet()


def test_the_data_in_the_page_is_the_document(block):
    found = audit(block_of_hexes(6), "all")
    document, digest = read_saved(block)
    assert len(digest) == 64
    assert document["metrics"] == json.loads(json.dumps(summarise(found)["metrics"]))


def test_javascript_and_python_unpack_the_same(open_page, block):
    page = open_page(block).page
    inner = page.evaluate(
        "MeshwrightViewer.unpackForTests(document.getElementById('mw-view').textContent).then((u) => ({"
        "ids: u.items.map((i) => i.id), kinds: u.items.map((i) => i.kind), loops: u.items.map((i) => i.loops),"
        f"points: [...u.points], level: [...u.level('{SKEW}')], header: u.header }}))"
    )
    mesh = block_of_hexes(6)
    low, size = np.array(inner["header"]["low"]), np.array(inner["header"]["size"])
    points = np.array(inner["points"]).reshape(-1, 3) * size.max() + low + size / 2
    for number, kind, loops in zip(inner["ids"], inner["kinds"], inner["loops"], strict=True):
        if kind != "hex":
            continue
        nodes = mesh.blocks[0].nodes[number - 1001]
        here = points[[p for loop in loops for p in loop]]
        there = mesh.points[nodes]
        distance = np.linalg.norm(here[:, None] - there[None], axis=2).min(axis=1)
        assert distance.max() < 1e-3


def test_the_view_stays_beside_the_gate_and_never_lies_over_other_sections(open_page, block):
    page = open_page(block, height=800).page
    for section in ("h-quality", "h-findings", "h-rosetta", "h-def"):
        page.evaluate(f"document.getElementById('{section}').scrollIntoView({{ behavior: 'instant' }})")
        boxes = page.evaluate(
            "[...document.querySelectorAll('main section')].map((s) => { const r = s.getBoundingClientRect();"
            " return [r.left, r.top, r.right, r.bottom]; })"
        )
        for k, a in enumerate(boxes):
            for b in boxes[k + 1 :]:
                assert min(a[2], b[2]) - max(a[0], b[0]) <= 1 or min(a[3], b[3]) - max(a[1], b[1]) <= 1
