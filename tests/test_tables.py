"""The article's tables: bin edges, the mirrored scale, types, zones, undefined values."""

import json
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.frames import cell_frame, class_frame, distribution_frame, quality_frame
from meshwright.audit.measurement import Measured
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.metrics import METRICS
from meshwright.audit.statistics import statistics, worst_first
from meshwright.audit.tables import ASPECT, BINNINGS, GAMBIT_CLASSES, MEAN_HINTS, SKEW, tabulate

SKEW_BINS, ASPECT_BINS = BINNINGS
WIDTHS = {"tet": 4, "hex": 8, "wedge": 6, "pyramid": 5, "tri": 3, "quad": 4}


def measured(skews, aspects=None, zones=(), **others):
    """A mesh whose cells have these values: type -> values, rows in the order given; geometry is beside the point."""
    blocks, row = [], 0
    counts = {name: len(values) for name, values in skews.items()} | others
    for name, n in counts.items():
        rows = np.arange(row, row + n)
        row += n
        if name == "polyhedron":
            continue
        blocks.append(CellBlock(name, rows, np.zeros((n, WIDTHS[name]), int)))
    mesh = Mesh(np.zeros((1, 3)), tuple(blocks), zones=zones)
    values = {
        SKEW: {name: np.asarray(v, float) for name, v in skews.items()},
        ASPECT: {name: np.asarray(v, float) for name, v in (aspects or {}).items()},
    }
    return Measured(mesh, (METRICS[SKEW], METRICS[ASPECT]), values)


def skew_counts(values):
    return tabulate(measured({"hex": values})).distributions["equiangle_skew"].counts[0, 0]


@pytest.mark.parametrize("k", range(10))
def test_every_exact_tenth_opens_the_bin_of_its_name(k):
    counts = skew_counts([k / 10])
    assert counts.tolist() == [int(i == k) for i in range(10)]


@pytest.mark.parametrize("k", range(1, 10))
def test_the_number_just_below_a_tenth_stays_in_the_bin_before(k):
    assert skew_counts([math.nextafter(k / 10, 0)]).argmax() == k - 1


def test_the_last_bin_is_closed_at_one():
    assert skew_counts([1.0, math.nextafter(1, 0), 0.9]).tolist() == [0] * 9 + [3]


def test_values_on_the_edges_fall_as_in_rational_arithmetic_where_floor_of_a_quotient_does_not():
    values = [k / 10 for k in range(11)]
    assert [int(v / 0.1) for v in values] != [*range(10), 10]  # the trap: 0.3 / 0.1 is below 3
    # Each double stands for the tenth it prints as.
    exact = [min(9, int(Fraction(str(v)) * 10)) for v in values]
    assert skew_counts(values).tolist() == np.bincount(exact, minlength=10).tolist()


def test_binning_the_mirrored_value_would_have_given_another_table():
    values = np.array([0.1, 0.2, 0.3, 0.4, 0.7, 0.8, 0.9])
    mirrored = np.histogram(1 - values, bins=np.array(SKEW_BINS.edges))[0]
    assert mirrored[::-1].tolist() != skew_counts(values).tolist()
    tally = tabulate(measured({"hex": values}))
    frame = distribution_frame(tally, "equiangle_skew")
    assert frame.loc[frame["ICEM (1 best)"] == "0.2-0.1", "hex"].item() == 1  # 0.8, and only 0.8
    assert frame.loc[frame["Fluent (0 best)"] == "0.8-0.9", "hex"].item() == 1


def test_the_limit_of_the_article_is_strict():
    tables = tabulate(measured({"hex": [0.8, math.nextafter(0.8, 1), 0.79, 0.95]}))
    assert tables.over[0, 0] == 2
    assert tables.share_over(0, 0) == 0.5
    assert 1 - 0.8 < 0.2  # a limit on the mirrored value would have counted 0.8 too


def test_the_edges_are_those_of_the_reference(shared):
    bins = json.loads((shared / "reference" / "golden.json").read_text())["bins"]
    assert list(SKEW_BINS.edges) == bins["eas_edges"]
    assert list(ASPECT_BINS.edges) == pytest.approx([float(edge) for edge in bins["ar_edges"]], rel=1e-15)


def test_a_box_of_exactly_five_to_one_begins_the_bin_from_5():
    counts = tabulate(measured({"hex": [0.0] * 4}, {"hex": [5.0, 10.0, 2.5, 2.0]})).distributions["aspect_ratio"].counts
    assert counts[0, 0].tolist() == [0, 0, 0, 0, 0, 1, 1, 0, 1, 1]


def test_aspect_ratio_bins_carry_reciprocal_labels():
    for k in range(10):
        low, high = ASPECT_BINS.labels[k].split("-")
        icem_high, icem_low = map(float, ASPECT_BINS.mirrored_labels[k].split("-"))
        assert math.isclose(1 / float(low), icem_high, abs_tol=0.005)
        assert math.isclose(1 / float(high), icem_low, abs_tol=0.005)
        assert math.isclose(ASPECT_BINS.edges[k], 1 / ASPECT_BINS.mirrored[k], rel_tol=1e-15)
    assert ASPECT_BINS.edges[-1] == math.inf
    assert ASPECT_BINS.columns == ("AR (>=1)", "1/AR")


def test_an_aspect_ratio_on_an_edge_belongs_to_the_bin_that_begins_there():
    edges = list(ASPECT_BINS.edges[:-1])
    below = [math.nextafter(edge, 0) for edge in edges[1:]]
    values = [*edges, *below, math.inf]
    tables = tabulate(measured({"hex": [0.0] * len(values)}, {"hex": values}))
    assert tables.distributions["aspect_ratio"].counts[0, 0].tolist() == [2] * 10
    assert ASPECT_BINS.index(np.array([10 / 9]))[0] == 1


def test_raw_values_beyond_the_range_are_clamped_into_the_end_bins():
    tables = tabulate(measured({"hex": [-0.1, 1.7]}, {"hex": [0.9999999, 1.0]}))
    assert tables.skew.counts[0, 0].tolist() == [1] + [0] * 8 + [1]
    assert tables.distributions["aspect_ratio"].counts[0, 0].tolist() == [2] + [0] * 9
    assert tables.worst[0, 0] == 1.0


def test_undefined_values_are_counted_apart_and_never_averaged_in():
    tables = tabulate(measured({"hex": [math.nan, 0.9, 0.5, math.nan]}))
    assert tables.skew.undefined[0, 0] == 2
    assert tables.skew.counts[0, 0].sum() == 2
    assert tables.classes[0, 0].sum() == 2
    assert tables.share_over(0, 0) == 0.5
    assert tables.mean(0) == 0.7
    assert tables.worst[0, 0] == 0.9


def test_a_type_whose_values_are_all_undefined_has_no_worst_and_no_share():
    tables = tabulate(measured({"hex": [math.nan], "tet": [0.5]}))
    hexes = tables.types.index("hex")
    assert math.isnan(tables.worst[0, hexes])
    assert math.isnan(tables.share_over(0, hexes))
    assert tables.mean(0) == 0.5


def test_a_type_for_which_the_metric_is_not_defined_has_no_counts_but_is_listed():
    tables = tabulate(measured({"hex": [0.5]}, tet=3))
    tets = tables.types.index("tet")
    assert tables.cells[0, tets] == 3
    assert not tables.skew.defined[tets]
    assert tables.skew.counts[0, tets].sum() == tables.skew.undefined[0, tets] == 0
    assert quality_frame(tables)["Worst equi-angle skewness"].isna().tolist() == [False, True]


@pytest.mark.parametrize(
    ("value", "name"),
    [
        (0.0, "perfect"),
        (1e-12, "perfect"),  # the rounding of coordinates
        (2e-9, "excellent"),
        (0.25, "excellent"),
        (math.nextafter(0.25, 1), "good"),
        (0.5, "good"),
        (math.nextafter(0.5, 1), "fair"),
        (0.75, "fair"),
        (math.nextafter(0.75, 1), "poor"),
        (0.9, "poor"),
        (math.nextafter(0.9, 1), "very poor (sliver)"),
        (math.nextafter(1, 0), "very poor (sliver)"),
        (1.0, "degenerate"),
    ],
)
def test_gambit_classes_are_closed_at_their_upper_bound(value, name):
    counts = tabulate(measured({"tet": [value]})).classes[0, 0]
    assert GAMBIT_CLASSES[counts.argmax()].name == name
    assert counts.sum() == 1


def test_the_mean_hints_are_gambits():
    assert MEAN_HINTS == {2: 0.1, 3: 0.4}


def test_types_stand_in_the_articles_order():
    values = {"pyramid": [0.1], "tet": [0.1], "wedge": [0.1], "hex": [0.1]}
    frame = quality_frame(tabulate(measured(values)))
    assert frame["Type"].tolist() == ["hexahedron", "tetrahedron", "prism/wedge", "pyramid"]


def test_the_first_table_of_a_hand_made_mesh():
    frame = quality_frame(tabulate(measured({"hex": [0.1, 0.85, 0.2, 0.3], "tet": [0.9, 0.81]})))
    assert frame.columns.tolist() == [
        "Type",
        "No. of elements",
        "Worst equi-angle skewness",
        "% with skewness > 0.8 | ICEM < 0.2",
    ]
    assert frame.iloc[0].tolist() == ["hexahedron", 4, 0.85, 25.0]
    assert frame.iloc[1].tolist() == ["tetrahedron", 2, 0.9, 100.0]


def zoned(overlap):
    zones = (
        Zone("a", "zone", "fluid", "cell", [0, 1, 2] if overlap else [0, 1]),
        Zone("wall", "patch", "wall", "point", [0]),
        Zone("b", "zone", "solid", "cell", [2, 4]),
    )
    return measured({"hex": [0.05, 0.95, 0.5], "tet": [0.15, 0.85, 0.85]}, zones=zones)


def test_zones_are_tabulated_each_by_type_and_homeless_cells_apart():
    tables = tabulate(zoned(overlap=False))
    assert [group.zone for group in tables.groups] == [None, 0, 1, -1]
    assert tables.types == ("hex", "tet")
    assert tables.cells.tolist() == [[3, 3], [2, 0], [1, 1], [0, 2]]
    assert tables.over.tolist() == [[1, 2], [1, 0], [0, 1], [0, 1]]
    np.testing.assert_array_equal(tables.worst[:, 0], [0.95, 0.95, 0.5, math.nan])
    assert tables.skew.counts[1:].sum(axis=0).tolist() == tables.skew.counts[0].tolist()


def test_a_cell_of_two_zones_counts_in_both_but_once_in_the_whole():
    tables = tabulate(zoned(overlap=True))
    assert tables.cells[0].sum() == 6
    assert tables.cells[1].tolist() == [3, 0]
    assert tables.cells[2].tolist() == [1, 1]


def test_a_choice_of_cells_restricts_every_table():
    chosen = np.array([0, 1, 0, 0, 0, 1], bool)
    tables = tabulate(zoned(overlap=False), chosen)
    assert tables.cells[0].tolist() == [1, 1]
    assert [group.zone for group in tables.groups] == [None, 0, -1]
    assert tables.worst[0].tolist() == [0.95, 0.85]


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-0.5, 1.5) | st.just(math.nan) | st.sampled_from([k / 20 for k in range(21)]), max_size=60))
def test_counts_agree_with_a_plain_loop(values):
    counts, classes, undefined, over = [0] * 10, [0] * 7, 0, 0
    for raw in values:
        if math.isnan(raw):
            undefined += 1
            continue
        v = min(max(raw, 0.0), 1.0)
        counts[next(k for k in range(9, -1, -1) if v >= k / 10)] += 1
        bounds = [v <= 1e-9, v <= 0.25, v <= 0.5, v <= 0.75, v <= 0.9, v < 1, True]
        classes[bounds.index(True)] += 1
        over += v > 0.8
    tables = tabulate(measured({"hex": values, "tet": [0.5]}))
    assert tables.skew.counts[0, 0].tolist() == counts
    assert tables.classes[0, 0].tolist() == classes
    assert (tables.skew.undefined[0, 0], tables.over[0, 0]) == (undefined, over)


def test_two_million_cells_in_five_hundred_zones_are_all_counted():
    n = 1_000_000
    rng = np.random.default_rng(1)
    members = np.array_split(rng.permutation(2 * n), 500)
    zones = tuple(Zone(str(i), "part", "", "cell", np.sort(rows)) for i, rows in enumerate(members))
    mesh = measured({"hex": rng.random(n), "tet": rng.random(n)}, {"hex": 1 + rng.random(n)}, zones=zones)
    tables = tabulate(mesh)
    assert tables.cells[1:].sum() == 2 * n
    assert tables.skew.counts[1:].sum(axis=0).tolist() == tables.skew.counts[0].tolist()


def test_frames_put_both_scales_side_by_side():
    tables = tabulate(measured({"hex": [0.05, 0.95], "tet": [0.95]}, {"hex": [1.0, 20.0], "tet": [2.0]}))
    skew = distribution_frame(tables, "equiangle_skew")
    assert skew.columns.tolist() == ["Fluent (0 best)", "ICEM (1 best)", "hex", "tet", "all"]
    assert skew.iloc[0].tolist() == ["0.0-0.1", "1.0-0.9", 1, 0, 1]
    assert skew.iloc[9].tolist() == ["0.9-1.0", "0.1-0.0", 1, 1, 2]
    aspect = distribution_frame(tables, "aspect_ratio")
    assert aspect.iloc[5].tolist() == ["2.00-2.50", "0.5-0.4", 0, 1, 1]
    assert aspect.iloc[9].tolist() == ["10.0-inf", "0.1-0.0", 1, 0, 1]
    assert class_frame(tables)["all"].tolist() == [0, 1, 0, 0, 0, 2, 0]


def test_the_cell_frame_keeps_file_order_and_raw_values():
    frame = cell_frame(zoned(overlap=False))
    assert frame.columns.tolist() == ["cell", "type", "zone", SKEW, ASPECT]
    assert frame["zone"].astype(object).where(frame["zone"].notna(), None).tolist() == ["a", "a", "b", None, "b", None]
    assert frame["type"].tolist() == ["hex"] * 3 + ["tet"] * 3
    assert frame[SKEW].tolist() == [0.05, 0.95, 0.5, 0.15, 0.85, 0.85]


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=200))
def test_percentiles_are_numpys(values):
    found = statistics(np.array(values))
    np.testing.assert_allclose(found.percentiles, np.percentile(values, [50, 95, 99]), rtol=1e-12, atol=1e-9)
    assert (found.min, found.max, found.count) == (min(values), max(values), len(values))


def test_percentiles_among_infinities_are_infinite_not_undefined():
    found = statistics(np.array([1.0, 2.0, math.inf, math.inf, math.nan]))
    assert found.percentiles == (math.inf, math.inf, math.inf)
    assert (found.count, found.undefined, found.mean) == (4, 1, math.inf)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from([0.0, 0.5, 0.5, 1.0, math.inf, math.nan]), max_size=40), st.integers(0, 12))
def test_the_worst_cells_are_those_of_a_stable_sort(values, n):
    array = np.array(values, float)
    known = [i for i, v in enumerate(values) if not math.isnan(v)]
    assert worst_first(array, n, high_is_worse=True).tolist() == sorted(known, key=lambda i: -values[i])[:n]
    assert worst_first(array, n, high_is_worse=False).tolist() == sorted(known, key=lambda i: values[i])[:n]
