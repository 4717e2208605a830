"""Histograms as SVG: what a bar says and how high it is, and that hostile names stay text."""

import math
import re
from itertools import pairwise
from pathlib import Path

import pytest
from lxml import etree

from meshwright.audit import audit, read, summarise
from meshwright.audit.errors import UsageError
from meshwright.reports.histogram_layout import short
from meshwright.reports.histogram_marks import marks_of
from meshwright.reports.histogram_svg import Mark, histogram_svg

SAMPLE = Path(__file__).parent.parent / "samples" / "demo.msh.gz"
SKEW = {
    "edges": [0.0, 0.25, 0.5, 0.75, 0.8, 0.9, 1.0],
    "labels": ["0-0.25", "0.25-0.5", "0.5-0.75", "0.75-0.8", "0.8-0.9", "0.9-1"],
    "mirrored": ["1-0.75", "0.75-0.5", "0.5-0.25", "0.25-0.2", "0.2-0.1", "0.1-0"],
    "scales": ["Fluent (0 best)", "ICEM (1 best)"],
    "counts": {"hex": [1_000_000, 1000, 0, 10, 1, 1], "tet": [0, 9000, 0, 90, 0, 0]},
}
TOTALS = [1_000_000, 10_000, 0, 100, 1, 1]


def drawn(histogram=SKEW, **options):
    return etree.fromstring(histogram_svg(histogram, title="skew", **options).encode())


def bars(root):
    return {int(g.get("data-bar")): g for g in root.iter("{*}g") if "bar" in g.get("class", "").split()}


def top_of(bar):
    """The least y of the coloured pieces of a bar."""
    pieces = [p.get("d") for p in bar.iter("{*}path") if p.get("class").startswith("t")]
    return min(float(re.search(r"V([\d.]+)", d)[1]) for d in pieces)


def texts(root):
    return [t.text for t in root.iter("{*}text")]


def test_a_bar_is_as_high_as_the_logarithm_of_its_count_and_an_empty_bin_has_none():
    found = bars(drawn(height=400))
    assert sorted(found) == [k for k, n in enumerate(TOTALS) if n]
    tops = {k: top_of(bar) for k, bar in found.items()}
    decade = (tops[4] - tops[0]) / 6  # 1 and 10^6 lie six decades apart
    for k, y in tops.items():
        assert (tops[4] - y) / decade == pytest.approx(math.log10(TOTALS[k]), abs=0.01)


def test_the_types_share_a_bar_as_they_share_its_count():
    bar = bars(drawn(height=400))[1]
    found = [p.get("d") for p in bar.iter("{*}path") if p.get("class") in ("t0", "t1")]
    ends = [tuple(float(x) for x in re.search(r" ([\d.]+)V([\d.]+)", d).groups()) for d in found]
    (floor, middle), (start, top) = ends
    assert start == middle
    assert (floor - middle) / (floor - top) == pytest.approx(0.1, abs=0.01)
    assert "hex 1,000; tet 9,000" in bar.find("{*}title").text


def test_every_bar_can_be_reached_by_keyboard_and_says_what_it_counts():
    for k, bar in bars(drawn()).items():
        assert (bar.get("tabindex"), bar.get("role")) == ("0", "button")
        noun = "cell" if TOTALS[k] == 1 else "cells"
        assert bar.get("aria-label") == f"{SKEW['labels'][k]}: {TOTALS[k]:,} {noun}"
        assert f"ICEM (1 best): {SKEW['mirrored'][k]}" in bar.find("{*}title").text


@pytest.mark.parametrize(("key", "noun"), [("face", "faces"), ("point", "points")])
def test_faces_and_points_are_called_so(key, noun):
    found = bars(drawn({**SKEW, "counts": {key: TOTALS}}))
    assert found[0].get("aria-label").endswith(f"1,000,000 {noun}")


def test_both_scales_stand_under_the_bars_and_are_named():
    shown = texts(drawn())
    for text in (*SKEW["labels"], *SKEW["mirrored"], *SKEW["scales"]):
        assert text in shown


def boxes(root, size):
    """(left, right, y) of every level text, by a width that no usual font exceeds."""
    for text in root.iter("{*}text"):
        if text.get("x") is None:
            continue
        anchor = next(a for e in (text, *text.iterancestors()) if (a := e.get("text-anchor")))
        x, wide = float(text.get("x")), 0.62 * size * len(text.text)
        left = x - {"start": 0, "middle": wide / 2, "end": wide}[anchor]
        yield left, left + wide, float(text.get("y"))


@pytest.mark.parametrize("width", [320, 360, 640, 900])
@pytest.mark.parametrize("most", [1, 999, 10**6, 10**9, 10**13])
def test_no_text_is_cut_off_and_no_two_lie_on_each_other(width, most):
    histogram = {**SKEW, "counts": {"hex": [most, 1, 0, most // 2, 0, 1], "tet": [0, 0, 5, 0, 0, 0]}}
    root = drawn(histogram, width=width)
    _, _, across, down = (float(x) for x in root.get("viewBox").split())
    size = float(root.get("font-size"))
    found = list(boxes(root, size))
    assert all(left >= 0 and right <= across and size * 0.7 <= y <= down for left, right, y in found)
    for i, (left, right, y) in enumerate(found):
        for other_left, other_right, other_y in found[i + 1 :]:
            assert right <= other_left or other_right <= left or abs(y - other_y) >= 0.8 * size


@pytest.mark.parametrize("width", [360, 640])
def test_turned_labels_lie_apart_and_inside(width):
    mesh = audit(read(SAMPLE), "all")
    for id_, histogram in summarise(mesh)["histograms"].items():
        root = drawn(histogram, width=width)
        size = float(root.get("font-size"))
        turned = [t for t in root.iter("{*}text") if t.get("transform")]
        spots = [
            tuple(float(x) for x in re.match(r"translate\(([\d.]+) ([\d.]+)\)", t.get("transform")).groups())
            for t in turned
        ]
        for (x, y), text in zip(spots, turned, strict=True):
            reach = 0.62 * size * len(text.text) / math.sqrt(2)
            assert x - reach >= -2, id_
            assert y + reach <= float(root.get("viewBox").split()[3]), id_
        for (x, y), (next_x, next_y) in pairwise(spots):
            if y == next_y:
                assert (next_x - x) / math.sqrt(2) >= 0.9 * size, id_


def test_what_a_phone_shows_is_at_least_nine_pixels_high():
    phone = 390 - 2 * 16  # with the margins of a page
    assert float(drawn(width=360).get("font-size")) * phone / 360 >= 9


def test_a_count_is_shortened_downwards():
    assert [short(n) for n in (0, 7, 999, 1000, 1999, 12_345, 999_999, 10**6, 10**9, 4 * 10**13)] == [
        "0", "7", "999", "1k", "1.99k", "12.3k", "999k", "1M", "1G", "40T"
    ]  # fmt: skip


def test_badness_is_the_distance_from_the_good_end_of_a_scale_of_one():
    low = {k: bar.get("class") for k, bar in bars(drawn(best="low")).items()}
    assert low == {0: "bar bar-ok", 1: "bar bar-ok", 3: "bar bar-ok", 4: "bar bar-warn", 5: "bar bar-bad"}
    high = bars(drawn({**SKEW, "edges": [0.0, 0.1, 0.2, 0.25, 0.5, 0.75, 1.0]}, best="high"))
    assert [high[k].get("class") for k in (0, 1, 3)] == ["bar bar-bad", "bar bar-warn", "bar bar-ok"]
    assert {bar.get("class") for bar in bars(drawn()).values()} == {"bar bar-plain"}


def test_limits_decide_where_there_are_some_and_a_bar_that_one_cuts_is_a_warning():
    classes = {k: bar.get("class") for k, bar in bars(drawn(best="low", marks=[(0.85, "fail")])).items()}
    assert classes == {0: "bar bar-ok", 1: "bar bar-ok", 3: "bar bar-ok", 4: "bar bar-warn", 5: "bar bar-bad"}
    below = bars(drawn(marks=[Mark(0.25, "fail", "too small", "below")]))
    assert [below[k].get("class") for k in (0, 1)] == ["bar bar-bad", "bar bar-ok"]
    shown = texts(drawn(marks=[Mark(0.25, "fail", "too small", "below"), (0.95, "warn")]))
    assert "too small" in shown
    assert "warn 0.95" in shown


def test_a_limit_stands_where_its_value_lies_between_the_edges():
    root = drawn(marks=[(0.25, "fail"), (0.375, "warn"), (0.5, "warn")])
    lines = [float(re.match(r"M([\d.]+)", p.get("d"))[1]) for p in root.iter("{*}path") if "mark" in p.get("class")]
    assert lines[1] - lines[0] == pytest.approx(lines[2] - lines[1], abs=0.11)
    assert lines[1] == pytest.approx((lines[0] + lines[2]) / 2, abs=0.11)


def test_a_baseline_is_a_tick_at_its_own_count_and_told():
    before = {**SKEW, "counts": {"hex": [1_000_000, 100, 0, 0, 5, 0]}}
    root = drawn(baseline=before)
    tick = next(p for p in root.iter("{*}path") if p.get("class") == "tick")
    heights = [float(y) for y in re.findall(r"M[\d.]+ ([\d.]+)h", tick.get("d"))]
    found = bars(root)
    assert len(heights) == 3
    assert heights[0] == pytest.approx(top_of(found[0]), abs=0.11)
    assert heights[1] == pytest.approx(top_of(found[3]), abs=0.11)  # 100 here, 100 there
    assert found[5].find("{*}title").text.endswith("baseline 0")


def test_a_baseline_over_other_bins_is_refused():
    other = {**SKEW, "edges": [0.0, 0.2, 0.5, 0.75, 0.8, 0.9, 1.0]}
    with pytest.raises(UsageError, match="other bins"):
        histogram_svg(SKEW, title="skew", baseline=other)


@pytest.mark.parametrize(
    "damage",
    [
        {"labels": ["a"]},
        {"counts": {"hex": [1, 2]}},
        {"counts": {"hex": [1, 2, 3, -4, 5, 6]}},
        {"edges": None},
        {"mirrored": ["a"]},
    ],
)
def test_an_entry_that_contradicts_itself_is_refused(damage):
    with pytest.raises(UsageError, match="a histogram needs"):
        histogram_svg({**SKEW, **damage}, title="skew")


def test_a_metric_without_values_is_an_empty_frame():
    root = drawn({**SKEW, "counts": {}})
    assert bars(root) == {}
    assert "Fluent (0 best)" in texts(root)


HOSTILE = ["</svg><script>alert(1)</script>", '" onload="alert(1)', "\x00\u202e\ud800", "x" * 1_000_000, "&lt;", "]]>"]


@pytest.mark.parametrize("name", HOSTILE, ids=range(len(HOSTILE)))
@pytest.mark.parametrize("alone", [False, True])
def test_hostile_names_stay_text(name, alone):
    histogram = {
        **SKEW,
        "labels": [name, *SKEW["labels"][1:]],
        "scales": [name, name],
        "counts": {name: TOTALS, "hex": TOTALS},
    }
    svg = histogram_svg(histogram, title=name, marks=[Mark(0.5, "fail", name)], alone=alone)
    root = etree.fromstring(svg.encode())
    assert len(svg) < 20_000
    assert {e.tag.split("}")[-1] for e in root.iter()} <= {"svg", "g", "path", "text", "title", "style", "rect"}
    assert not [a for e in root.iter() for a in e.attrib if a.startswith("on")]


def test_a_picture_of_its_own_brings_its_style_and_refers_to_nothing_outside():
    svg = histogram_svg(SKEW, title="Skewness of wing.msh", alone=True)
    assert svg.startswith('<svg xmlns="http://www.w3.org/2000/svg"')
    assert "Skewness of wing.msh" in texts(etree.fromstring(svg.encode()))
    assert not re.search(r"url\(|href|@import|<script", svg)


def test_a_histogram_takes_about_three_kilobytes():
    documents = summarise(audit(read(SAMPLE), "all"))["histograms"]
    sizes = [len(histogram_svg(h, title=id_)) for id_, h in documents.items()]
    assert sum(sizes) / len(sizes) < 4000
    assert max(sizes) < 10_000


def rule(**changes):
    base = {
        "metric": "gambit.equiangle_skew", "stat": "max", "sense": "above", "warn": None, "fail": 0.95,
        "value_beyond": None, "value_sense": "above", "scale": "", "severity": "error",
    }  # fmt: skip
    return {**base, **changes}


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (rule(), [(0.95, "fail", "fail > 0.95", "above")]),
        (rule(warn=0.8), [(0.95, "fail", "fail > 0.95", "above"), (0.8, "warn", "warn > 0.8", "above")]),
        (rule(stat="share", fail=0.01, value_beyond=0.8), [(0.8, "fail", "fail > 0.8", "above")]),
        (rule(stat="share", fail=None, warn=0.01, value_beyond=0.8), [(0.8, "warn", "warn > 0.8", "above")]),
        (rule(stat="min", sense="below", fail=0.25, scale="icem"), [(0.75, "fail", "fail < 0.25 (icem)", "above")]),
        (rule(metric="gambit.aspect_ratio", fail=20.0), []),
        (rule(stat="mean"), []),
        (rule(stat="p99"), []),
        (rule(severity="info"), []),
    ],
)
def test_limits_on_values_are_marked_on_the_stored_scale(found, expected):
    assert list(marks_of({"gate": {"rules": [found, found]}}, "gambit.equiangle_skew")) == expected


def test_a_limit_on_the_inverse_of_a_ratio_is_marked_at_the_ratio():
    found = rule(metric="gambit.aspect_ratio", stat="min", sense="below", fail=0.05, scale="icem")
    (mark,) = marks_of({"gate": {"rules": [found]}}, "gambit.aspect_ratio")
    assert (mark.value, mark.bad) == (20.0, "above")
