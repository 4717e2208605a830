"""Saved audits are read as if they were hostile: they are what the schema says, or refused in one line."""

import copy
import gzip
import json

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from report_meshes import block_of_hexes

from meshwright.audit.errors import ReadError
from meshwright.audit.profiles.baseline import Baseline
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.compare_html import render_html
from meshwright.reports.compare_text import render_markdown, render_text
from meshwright.reports.comparison import compare_documents
from meshwright.reports.html.report import report_html
from meshwright.reports.saved import embedded, is_saved, read_saved

SKEWED = audit(block_of_hexes(2, jitter=0.1))
DOCUMENT = json.loads(json.dumps(summarise(SKEWED)))
ODD = (None, True, -1, 0, 1e308, "", "nan", "x" * 2000, [], {}, [None], {"a": 1}, "<script>")


def places(node, path=()):
    """Paths of everything in a document."""
    yield path
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield from places(value, (*path, key))


PLACES = [path for path in places(DOCUMENT) if path]


def spoiled(path, value, *, remove):
    document = copy.deepcopy(DOCUMENT)
    node = document
    for key in path[:-1]:
        node = node[key]
    if remove:
        del node[path[-1]]
    else:
        node[path[-1]] = value
    return document


@settings(
    deadline=None, max_examples=250, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
)
@given(st.sampled_from(PLACES), st.sampled_from(ODD), st.booleans())
@example(("histograms", "angle.max", "edges", 13), 1e308, False)
def test_a_spoiled_document_is_refused_or_harmless(tmp_path, path, value, remove):
    file = tmp_path / "a.json"
    file.write_text(json.dumps(spoiled(path, value, remove=remove)))
    refused, document = "", None
    try:
        document, _ = read_saved(file)
    except ReadError as error:
        refused = str(error)
    assert "\n" not in refused
    if document is None:
        return
    for pair in ((document, DOCUMENT), (DOCUMENT, document)):
        found = compare_documents(*pair)
        assert render_text(found, width=100, colour=False)
        assert render_markdown(found)
        assert "<script>" not in render_html(found)
    assert report_html(SKEWED, DOCUMENT, baseline=document)
    assert Baseline(document)


@pytest.mark.parametrize(
    "pack", [str, lambda text: f'<!doctype html><script type="application/json" id="meshwright-audit">{text}</script>']
)
@pytest.mark.parametrize("zipped", [False, True])
def test_what_was_saved_comes_back(tmp_path, pack, zipped):
    file = tmp_path / "a"
    data = pack(embedded(DOCUMENT)).encode()
    file.write_bytes(gzip.compress(data) if zipped else data)
    assert is_saved(file)
    assert read_saved(file)[0] == DOCUMENT


@pytest.mark.parametrize(
    "text", ["NaN", "Infinity", '{"schema": NaN}', "[" * 100_000, '{"schema":"meshwright.audits/1","audits":[]}']
)
def test_what_is_no_document_is_refused(tmp_path, text):
    file = tmp_path / "a.json"
    file.write_text(text)
    with pytest.raises(ReadError):
        read_saved(file)


def test_a_mesh_is_no_saved_audit(tmp_path):
    for name, text in (("a.msh", "$MeshFormat\n"), ("b", '{"meshes": []}'), ("c", "")):
        (tmp_path / name).write_text(text)
        assert not is_saved(tmp_path / name)
    assert not is_saved(tmp_path / "absent")
    assert not is_saved(tmp_path)
