"""Histograms in a real browser: with its fonts, on a phone, no text is cut, none lies on another."""

from pathlib import Path

import pytest

from meshwright.audit import audit, read, summarise
from meshwright.reports.histogram_svg import HISTOGRAM_STYLE, Mark, histogram_svg

SAMPLE = Path(__file__).parents[2] / "samples" / "demo.msh.gz"

PROBLEMS = """() => {
  const found = [];
  for (const svg of document.querySelectorAll("svg.histogram")) {
    const frame = svg.getBoundingClientRect();
    // a turned label is as high as its letters across its direction; level boxes are compared as they are
    const texts = [...svg.querySelectorAll("text:not([transform])")];
    const level = texts.map((t) => [t.textContent, t.getBoundingClientRect()]);
    for (const text of svg.querySelectorAll("text")) {
      const box = text.getBoundingClientRect();
      const beside = box.left < frame.left - 1 || box.right > frame.right + 1;
      if (beside || box.top < frame.top - 1 || box.bottom > frame.bottom + 1)
        found.push(`${svg.getAttribute("aria-label")}: "${text.textContent}" is cut`);
      if (parseFloat(getComputedStyle(text).fontSize) * frame.width / svg.viewBox.baseVal.width < 9)
        found.push(`${svg.getAttribute("aria-label")}: "${text.textContent}" is too small`);
    }
    for (let i = 0; i < level.length; i++) for (let j = 0; j < i; j++) {
      const [a, b] = [level[i][1], level[j][1]];
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (across > 1 && down > 0.4 * Math.min(a.height, b.height))
        found.push(`${svg.getAttribute("aria-label")}: "${level[i][0]}" lies on "${level[j][0]}"`);
    }
  }
  return found;
}"""


@pytest.mark.parametrize(("screen", "drawn"), [(390, 360), (700, 640)])
def test_no_text_of_any_metric_is_cut_or_covered_or_too_small(screen, drawn, chromium, artefacts, tmp_path):
    document = summarise(audit(read(SAMPLE), "all"))
    pictures = []
    for id_, entry in document["histograms"].items():
        marks = [Mark(0.8, "warn"), Mark(0.95, "fail")] if id_ == "gambit.equiangle_skew" else []
        best = document["definitions"][id_]["best"]
        pictures.append(histogram_svg(entry, title=id_, baseline=entry, marks=marks, best=best, width=drawn))
    assert len(pictures) > 100
    style = f"{HISTOGRAM_STYLE} body{{margin:16px}} svg{{display:block;width:100%;margin-bottom:16px}}"
    page_file = tmp_path / "histograms.html"
    page_file.write_text(f"<!doctype html><meta charset=utf-8><style>{style}</style>{''.join(pictures)}", "utf-8")
    page = chromium.new_page(viewport={"width": screen, "height": 900})
    try:
        page.goto(page_file.as_uri())
        assert page.evaluate(PROBLEMS) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= screen
        page.screenshot(path=artefacts / f"histograms-{screen}.png")
    finally:
        page.close()
