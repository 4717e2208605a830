"""What the 3-D view of a report gets: coded and decoded again, complete where it has to be, the same in every run."""

import base64
import json
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from report_meshes import MESHES, block_of_hexes, not_finite

from meshwright.audit.metrics import METRICS
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.html.items import NOT_DEFINED, UNDEFINED, levels, levels_of_bin
from meshwright.reports.html.pack import Packer, renumbered
from meshwright.reports.html.payload import view_payload
from meshwright.reports.html.shell import shell_of


def unpack(text):
    """(header, {name: array}) of a container, written from its description alone."""
    data = zlib.decompress(base64.b64decode(text))
    length = int.from_bytes(data[:4], "little")
    header, body = json.loads(data[4 : 4 + length]), data[4 + length :]
    arrays = {}
    for entry in header["arrays"]:
        n, width, at = entry["n"], entry["width"], entry["at"]
        planes = np.frombuffer(body[at : at + n * width], np.uint8).reshape(width, n).astype(object)
        values = np.array([sum(int(planes[k, i]) << 8 * k for k in range(width)) for i in range(n)], object)
        if entry["delta"]:
            values = np.array([x % 256**width for x in np.cumsum(values)], object) if n else values
        arrays[entry["name"]] = values.astype(np.int64)
    return header, arrays


def indices(codes):
    out, following = [], 0
    for code in codes:
        out.append(following - code)
        following += code == 0
    return np.array(out, np.int64)


def audited(mesh, metrics="default"):
    found = audit(mesh, metrics)
    return found, summarise(found)


@settings(deadline=None)
@given(st.lists(st.integers(0, 2**32 - 1), max_size=40), st.booleans(), st.sampled_from([1, 2, 3, 4]))
def test_packed_integers_come_back(values, delta, width):
    values = [v % 256**width for v in values]
    packer = Packer()
    packer.add("a", np.array(values, np.int64), width=width, delta=delta)
    assert unpack(packer.text({}))[1]["a"].tolist() == values


@settings(deadline=None)
@given(st.lists(st.integers(0, 30), max_size=60))
def test_renumbered_nodes_come_back(nodes):
    distinct, codes = renumbered(np.array(nodes, np.int64))
    assert distinct[indices(codes)].tolist() == nodes if nodes else len(distinct) == 0
    assert len(set(distinct.tolist())) == len(distinct)


@settings(deadline=None)
@given(st.lists(st.floats(-0.5, 1.5), min_size=1, max_size=50))
def test_a_level_tells_the_bin_exactly_and_the_value_nearly(values):
    edges = [k / 10 for k in range(11)]
    values = np.clip(np.array(values), 0, 1)
    found = levels(values, edges).astype(int)
    within = levels_of_bin(10)
    bins = found // within
    for value, at, level in zip(values, bins, found, strict=True):
        assert edges[at] <= value
        assert value < edges[at + 1] or at == 9
        middle = edges[at] + 0.1 * (level - at * within + 0.5) / within
        assert abs(middle - value) <= 0.5 * 0.1 / within + 1e-12
    assert levels(np.array([np.nan]), edges).tolist() == [UNDEFINED]


@pytest.mark.parametrize("name", MESHES)
def test_the_payload_of_every_kind_of_mesh_is_what_was_put_in(name):
    mesh = MESHES[name]()
    found, document = audited(mesh, "all")
    header, arrays = unpack(view_payload(found, document).text)
    nodes, sizes = indices(arrays["shell.nodes"]), arrays["shell.sizes"]
    shell = shell_of(mesh, 300_000)
    assert sizes.tolist() == np.diff(shell.offsets).tolist()
    low, size = np.array(header["low"]), np.array(header["size"])
    places = np.column_stack([arrays[f"shell.{axis}"] for axis in "xyz"]) / 65535 * size + low
    if len(nodes):
        away = np.abs(places[nodes] - shell.points[shell.nodes])
        assert (away <= size / 65535 * 0.51 + 1e-12 * (np.abs(low) + size)).all()
    ids = arrays["item.low"] + (arrays["item.high"] << 32)
    n_cells = header["counts"]["cell"]
    numbers = np.arange(mesh.n_cells) if mesh.cell_ids is None else mesh.cell_ids
    assert set(ids[:n_cells].tolist()) <= set(np.asarray(numbers).tolist())
    for entry in header["metrics"]:
        levels_ = arrays[f"m.{entry['id']}"]
        assert len(levels_) == header["counts"][entry["entity"]]
        within = levels_of_bin(len(entry["labels"]))
        if entry["entity"] != "cell" or mesh.n_nonfinite:
            continue
        for k, number in enumerate(ids[:n_cells].tolist()):  # the bin of every cell is that of its value
            row = int(np.flatnonzero(np.asarray(numbers) == number)[0])
            value = value_of(found, entry["id"], row)
            if value is None:
                assert levels_[k] == NOT_DEFINED
            elif np.isnan(value):
                assert levels_[k] == UNDEFINED
            else:
                edges = [float(e) for e in entry["edges"]]
                at = int(levels_[k]) // within
                assert edges[at] <= value or at == 0
                assert value < edges[at + 1] or at == len(edges) - 2


def value_of(found, id_, row):
    metric = METRICS[id_]
    for block in found.mesh.blocks:
        at = np.flatnonzero(block.rows == row)
        if len(at) and block.type in found.measured.values[id_]:
            return float(np.clip(found.measured.values[id_][block.type][at[0]], metric.low, metric.high))
    return None


def test_every_bar_has_cells_to_show_and_every_bad_cell_is_there():
    mesh = block_of_hexes(12)
    found, document = audited(mesh, "all")
    header, arrays = unpack(view_payload(found, document).text)
    for entry in header["metrics"]:
        within = levels_of_bin(len(entry["labels"]))
        levels_ = arrays[f"m.{entry['id']}"]
        shown = np.bincount(levels_[levels_ < NOT_DEFINED] // within, minlength=len(entry["labels"]))
        counts = np.sum(list(document["histograms"][entry["id"]]["counts"].values()), axis=0)
        assert ((shown > 0) == (counts > 0)).all(), entry["id"]
        assert (shown <= counts).all()
    ids = set((arrays["item.low"] + (arrays["item.high"] << 32))[: header["counts"]["cell"]].tolist())
    for finding in document["findings"]:
        if finding["severity"] == "error" and finding["entity"] == "cell":
            assert set(finding["ids"]) <= ids
    for figures in document["metrics"].values():
        for of_type in figures.values():
            assert {w["cell"] for w in of_type["worst"] if "cell" in w} <= ids


def test_the_same_audit_gives_the_same_bytes():
    texts = {view_payload(*audited(block_of_hexes(6))).text for _ in range(2)}
    assert len(texts) == 1


def test_far_from_the_origin_the_view_is_the_same():
    near, far = (unpack(view_payload(*audited(block_of_hexes(5, offset=offset))).text) for offset in (0.0, 2.0**30))
    for axis in "xyz":
        difference = near[1][f"shell.{axis}"] - far[1][f"shell.{axis}"]
        assert np.abs(difference).max() <= 1


def test_what_has_no_place_is_not_shown():
    found, document = audited(not_finite())
    header, arrays = unpack(view_payload(found, document).text)
    assert all(np.isfinite(header["low"] + header["size"]))
    ids = arrays["item.low"][: header["counts"]["cell"]]
    bad = {int(row) for row in np.flatnonzero((not_finite().blocks[0].nodes == 20).any(axis=1))}
    assert not bad & set(ids.tolist())


def test_a_large_boundary_is_thinned_and_its_shape_stays():
    mesh = block_of_hexes(20, jitter=0.1)
    whole, thin = shell_of(mesh, 10_000), shell_of(mesh, 600)
    assert not whole.thinned
    assert thin.thinned
    assert thin.of == len(whole.offsets) - 1 == 2400
    assert 100 < len(thin.offsets) - 1 <= 600
    assert np.diff(thin.offsets).min() >= 3
    low, high = thin.points[thin.nodes].min(axis=0), thin.points[thin.nodes].max(axis=0)
    assert (np.abs(low) <= 2).all()
    assert (np.abs(high - 20) <= 2).all()
    header, arrays = unpack(view_payload(*audited(mesh), most_faces=600).text)
    assert len(arrays["shell.sizes"]) == len(thin.offsets) - 1
    assert header["counts"]["cell"]


def test_of_a_selection_of_zones_only_its_cells_are_shown():
    mesh = block_of_hexes(6)
    found = audit(mesh, "all")
    document = summarise(found, zone="upper")
    header, arrays = unpack(view_payload(found, document).text)
    ids = arrays["item.low"][: header["counts"]["cell"]]
    assert set(ids.tolist()) == {1001 + int(row) for row in mesh.zones[1].members}
    for entry in header["metrics"]:
        within = levels_of_bin(len(entry["labels"]))
        levels_ = arrays[f"m.{entry['id']}"]
        shown = np.bincount(levels_[levels_ < NOT_DEFINED] // within, minlength=len(entry["labels"]))
        counts = np.sum(list(document["histograms"][entry["id"]]["counts"].values()), axis=0)
        assert (shown <= counts).all(), entry["id"]
        assert ((shown > 0) == (counts > 0)).all(), entry["id"]
