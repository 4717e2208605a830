"""Histograms: bins that belong to the metric, counts that lose nothing, and two meshes on one set of bins."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.histograms import aligned, count_into, histogram_for
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.metrics import METRICS
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
SIZES = [metric for metric in METRICS.values() if metric.unit.startswith("L")]
finite = st.floats(allow_nan=False)


def bars(size, seed=0, zones=False):
    """A row of five jittered cubes of that size, the first two and the last three in zones of their own."""
    move = np.random.default_rng(seed).uniform(-0.15, 0.15, (5, 8, 3))
    points = size * (CUBE + move + np.arange(5)[:, None, None] * (2, 0, 0)).reshape(-1, 3)
    named = (Zone("left", "part", "", "cell", [0, 1]), Zone("right", "part", "", "cell", [2, 3, 4]))
    return Mesh(points, (CellBlock("hex", np.arange(5), np.arange(40).reshape(5, 8)),), zones=named if zones else ())


@pytest.mark.parametrize("metric", METRICS.values(), ids=lambda metric: metric.id)
def test_bins_ascend_cover_the_range_of_the_metric_and_are_named(metric):
    low, high = (0.02, 30.0) if metric.unit.startswith("L") else (math.nan, math.nan)
    bins = histogram_for(metric, low, high)
    edges = bins.edges
    assert list(edges) == sorted(set(edges))
    if metric.unit.startswith("L"):
        assert edges[0] <= low
        assert high < edges[-1]
    else:
        assert edges[0] <= metric.low
        assert edges[-1] >= metric.high
    assert len(bins.labels) == len(edges) - 1 == len(set(bins.labels)) <= 25
    assert bins.mirrored is None or len(bins.mirrored) == len(bins.labels)


@settings(deadline=None)
@given(st.lists(finite | st.just(math.nan), max_size=60), st.lists(finite, min_size=3, max_size=12, unique=True))
def test_every_value_that_is_a_number_is_counted_once(values, edges):
    edges = sorted(edges)
    counts = count_into(tuple(edges), np.array(values, float))
    known = [v for v in values if not math.isnan(v)]
    expected = [0] * (len(edges) - 1)
    for v in known:
        inside = [k for k in range(len(edges) - 1) if edges[k] <= v < edges[k + 1]]
        expected[inside[0] if inside else (0 if v < edges[0] else -1)] += 1
    assert counts.tolist() == expected


def test_a_value_on_an_edge_lies_in_the_bin_above_and_the_last_bin_is_closed():
    assert count_into((0.0, 0.1, 0.2, 1.0), np.array([0.1, 0.2, 1.0])).tolist() == [0, 1, 2]


def test_histograms_of_the_articles_metrics_are_its_distributions():
    document = summarise(audit(bars(1.0)))
    for id_, key in (("gambit.equiangle_skew", "equiangle_skew"), ("gambit.aspect_ratio", "aspect_ratio")):
        table, bins = document["distributions"][key], document["histograms"][id_]
        assert bins["counts"] == table["counts"]
        assert bins["edges"] == table["fluent"]


def test_histograms_count_what_the_statistics_count():
    document = summarise(audit(bars(1.0), "all"))
    for id_, bins in document["histograms"].items():
        assert {key: sum(found) for key, found in bins["counts"].items()} == {
            key: figures["count"] for key, figures in document["metrics"][id_].items()
        }


@pytest.mark.parametrize("metric", SIZES, ids=lambda metric: metric.id)
@settings(deadline=None)
@given(st.floats(1e-300, 1e300), st.floats(1.0, 1e12))
def test_a_ladder_holds_all_sizes_between_its_ends(metric, low, spread):
    high = min(low * spread, 1e301)
    edges = histogram_for(metric, low, high).edges
    assert edges[0] <= low
    assert high < edges[-1]
    assert len(edges) <= 26


@pytest.mark.parametrize("sizes", [(1.0, 1.0), (1.0, 1000.0), (1e-6, 30.0), (1.0, 0.0)])
def test_two_meshes_of_different_size_lie_on_one_set_of_bins(sizes):
    a, b = (summarise(audit(bars(size, seed)))["histograms"]["volume"] for seed, size in enumerate(sizes))
    x, y = aligned(a, b)
    assert x["edges"] == y["edges"]
    assert len(x["labels"]) == len(x["edges"]) - 1
    for before, after in ((a, x), (b, y)):
        assert sum(after["counts"]["hex"]) == sum(before["counts"]["hex"]) == 5
        edges = [float(e) for e in before["edges"]]
        for k, n in enumerate(before["counts"]["hex"]):  # what a bin held lies in bins that overlap it
            inside = [m for lo, hi, m in zip(after["edges"], after["edges"][1:], after["counts"]["hex"], strict=False)
                      if float(hi) > edges[k] and float(lo) < edges[k + 1]]  # fmt: skip
            assert sum(inside) >= n


def test_equal_bins_are_left_as_they_are():
    bins = summarise(audit(bars(1.0)))["histograms"]["gambit.equiangle_skew"]
    assert aligned(bins, bins) == (bins, bins)


def test_zones_list_the_worst_and_the_mean_of_their_own_cells():
    mesh = bars(1.0, zones=True)
    found = audit(mesh, "all")
    document = summarise(found)
    for id_, rows in document["zone_metrics"].items():
        metric = METRICS[id_]
        if "hex" not in found.measured.values[id_]:
            assert rows == []
            continue
        values = np.clip(found.measured.values[id_]["hex"], metric.low, metric.high)
        assert [document["zones"][row["zone"]]["name"] for row in rows] == ["left", "right"]
        for row, cells in zip(rows, (slice(0, 2), slice(2, 5)), strict=True):
            here = values[cells]
            assert row["count"] == len(here)
            assert row["undefined"] == 0
            assert float(row["worst"]) == (here.max() if metric.worst_is_high else here.min())
            assert float(row["mean"]) == pytest.approx(here.mean(), rel=1e-12)


def test_cells_in_no_zone_and_cells_in_two_are_counted_where_they_are():
    mesh = dataclasses.replace(
        bars(1.0), zones=(Zone("a", "part", "", "cell", [0, 1]), Zone("b", "part", "", "cell", [1]))
    )
    rows = summarise(audit(mesh))["zone_metrics"]["volume"]
    assert [(row["zone"], row["count"]) for row in rows] == [(0, 2), (1, 1), (None, 3)]


def test_a_selection_of_zones_is_all_that_histograms_and_zones_count():
    document = summarise(audit(bars(1.0, zones=True)), zone="right")
    assert sum(document["histograms"]["volume"]["counts"]["hex"]) == 3
    assert [row["zone"] for row in document["zone_metrics"]["volume"]] == [1]


def test_a_mesh_without_zones_has_no_table_of_them():
    assert set(map(len, summarise(audit(bars(1.0)))["zone_metrics"].values())) == {0}


def test_of_very_many_zones_the_worst_are_listed():
    zones = tuple(Zone(f"z{k}", "part", "", "cell", [k % 5]) for k in range(300))
    document = summarise(audit(dataclasses.replace(bars(1.0), zones=zones)))
    rows = document["zone_metrics"]["gambit.equiangle_skew"]
    worst = max(float(f["max"]) for f in document["metrics"]["gambit.equiangle_skew"].values())
    assert len(rows) == 200
    assert max(row["worst"] for row in rows) == worst
