"""Gate files: what their rules mean, what is wrong in them, and what no mesh passes unseen."""

import datetime as dt
import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.errors import UsageError
from meshwright.audit.gate.files import read_gate_file, write_toml
from meshwright.audit.gate.lines import Lines
from meshwright.audit.gate.loading import gate_schema
from meshwright.audit.gate.problems import GateError
from meshwright.audit.measurement import Measured
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.baseline import Baseline
from meshwright.audit.profiles.evaluate import evaluate
from meshwright.audit.profiles.loading import PROFILES, read_profile
from meshwright.audit.profiles.rule import worse_than
from meshwright.audit.run import Audit, audit
from meshwright.audit.summary import summarise
from meshwright.reports.cli import cli
from meshwright.reports.saved import embedded

SCHEMA = json.loads((Path(__file__).parent.parent / "reports" / "schema" / "audit-1.schema.json").read_text())
SKEW, ASPECT = "gambit.equiangle_skew", "gambit.aspect_ratio"
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
UP, DOWN = math.nextafter(0.8, 1), math.nextafter(0.8, 0)


@pytest.fixture
def gate(tmp_path):
    """Writes a gate file and reads it."""

    def write(text, name="meshgate.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return read_gate_file(path)

    return write


def rows_of_cubes(values, metric=SKEW, zones=(), gap=2.0):
    """Unit cubes in a row, `gap` apart, whose metric has these values."""
    n = len(values)
    points = np.concatenate([CUBE + ((1 + gap) * k, 0, 0) for k in range(n)])
    mesh = Mesh(points, (CellBlock("hex", np.arange(n), np.arange(8 * n).reshape(n, 8)),), zones=zones)
    return Measured(mesh, (METRICS[metric],), {metric: {"hex": np.array(values, float)}})


def states(profile, found, **options):
    return {rule.limit.id: rule.state for rule in evaluate(found, profile, **options).rules}


def state(profile, values, metric=SKEW, **options):
    (only,) = evaluate(rows_of_cubes(values, metric), profile, **options).rules
    return only.state


def rule(text):
    return f'[[rule]]\nid = "it"\nmetric = "{SKEW}"\n{text}\n'


NAN = math.nan


@pytest.mark.parametrize(
    ("text", "values", "expected"),
    [
        ('stat = "max"\nle = 0.8', [0.1, 0.8], "pass"),
        ('stat = "max"\nle = 0.8', [0.1, UP], "fail"),
        ('stat = "max"\nlt = 0.8', [0.1, DOWN], "pass"),
        ('stat = "max"\nlt = 0.8', [0.1, 0.8], "fail"),
        ('stat = "max"\nwarn_le = 0.5\nle = 0.8', [0.5], "pass"),
        ('stat = "max"\nwarn_le = 0.5\nle = 0.8', [0.51], "warn"),
        ('stat = "max"\nle = 0.8', [0.1, NAN], "incomplete"),
        ('stat = "max"\nle = 0.8', [0.9, NAN], "fail"),
        ('stat = "max"\nle = 0.8\non_missing = "warn"', [0.1, NAN], "warn"),
        ('stat = "max"\nle = 0.8\non_missing = "ignore"', [0.1, NAN], "pass"),
        ('stat = "max"\nle = 0.8\non_missing = "ignore"', [0.9, NAN], "fail"),
        ('stat = "max"\nle = 0.8\nseverity = "warn"', [0.9], "warn"),
        ('stat = "max"\nle = 0.8\nseverity = "info"', [0.9], "info"),
        ('stat = "max"\nle = 0.8\nseverity = "info"', [0.1], "pass"),
        ('stat = "mean"\nle = 0.5', [0.4, 0.6], "pass"),
        ('stat = "mean"\nle = 0.49', [0.4, 0.6], "fail"),
        ('stat = "mean"\nle = 0.5', [0.0, NAN], "incomplete"),
        ('stat = "p50"\nle = 0.5', [0.1, 0.5, 0.9], "pass"),
        ('stat = "p50"\nle = 0.5', [0.1, 0.51, 0.9], "fail"),
        ('stat = "p99.9"\nle = 0.5', [0.1, 0.1, 0.9], "fail"),
        ('stat = "p50"\nle = 0.5', [0.1, 0.1, NAN], "pass"),  # the middle one is 0.1 whatever the third is
        ('stat = "p50"\nle = 0.5', [0.1, 0.9, NAN], "incomplete"),
        ('stat = "p100"\nle = 0.5', [0.1, 0.1, NAN], "incomplete"),
        ('stat = "count"\nbeyond = 0.8\nle = 1', [0.8, 0.9], "pass"),
        ('stat = "count"\nbeyond = 0.8\nle = 1', [UP, 0.9], "fail"),
        ('stat = "count"\nbeyond = 0.8\nle = 1', [0.1, 0.9, NAN], "incomplete"),
        ('stat = "count"\nbeyond = 0.8\nlt = 2', [0.9], "pass"),
        ('stat = "count"\nbeyond = 0.8\nlt = 2', [0.9, 0.9], "fail"),
        ('stat = "share"\nbeyond = 0.8\nle = 0.5', [0.1, 0.9], "pass"),
        ('stat = "share"\nbeyond = 0.8\nle = 0.49', [0.1, 0.9], "fail"),
        ('stat = "share"\nbeyond = 0.8\nwarn_le = 0.1\nle = 0.9', [0.1, 0.9], "warn"),
        ('stat = "share"\nbeyond = 0.8\nside = "below"\nge = 0.5', [0.1, 0.9], "pass"),
        ('stat = "share"\nbeyond = 0.8\nside = "below"\nge = 0.6', [0.1, 0.9], "fail"),
        ('stat = "undefined"\nle = 0', [0.1, 0.2], "pass"),
        ('stat = "undefined"\nle = 0', [0.1, NAN], "fail"),
        ('scale = "icem"\nstat = "min"\nge = 0.2', [0.8], "pass"),
        ('scale = "icem"\nstat = "min"\nge = 0.2', [UP], "fail"),
        ('scale = "icem"\nstat = "min"\ngt = 0.2', [0.8], "fail"),
        ('scale = "icem"\nstat = "share"\nbeyond = 0.2\nle = 0', [0.8], "pass"),
        ('scale = "icem"\nstat = "share"\nbeyond = 0.2\nle = 0', [UP], "fail"),
        ('scale = "icem"\nstat = "p1"\nge = 0.2', [0.8, 0.8], "pass"),
        ('scale = "icem"\nstat = "p1"\nge = 0.2', [0.1, 0.95], "fail"),
        ('scale = "fluent"\nstat = "max"\nle = 0.8', [0.8], "pass"),
        ('stat = "max"\nno_worse = true', [0.1], "incomplete"),
    ],
)
def test_the_truth_table_of_rules(gate, text, values, expected):
    assert state(gate(rule(text)), values) == expected


def test_a_ratio_on_the_icem_scale_is_one_over_it(gate):
    profile = gate(rule('scale = "icem"\nstat = "min"\nge = 0.3').replace(SKEW, ASPECT))
    assert state(profile, [10 / 3], ASPECT) == "pass"
    assert state(profile, [math.nextafter(10 / 3, 4)], ASPECT) == "fail"
    assert state(profile, [math.inf], ASPECT) == "fail"


@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=12),
    st.integers(0, 10),
    st.sampled_from(["max", "mean", "p90", "count"]),
)
def test_a_limit_says_the_same_on_both_scales(values, tenths, stat):
    limit, mirror = tenths / 10, (10 - tenths) / 10
    found = rows_of_cubes(values)
    other = {"max": "min", "p90": "p10"}.get(stat, stat)
    if stat == "count":
        texts = (
            f'scale = "fluent"\nstat = "count"\nbeyond = {limit}\nle = 2',
            f'scale = "icem"\nstat = "count"\nbeyond = {mirror}\nle = 2',
        )
    else:
        texts = (f'scale = "fluent"\nstat = "{stat}"\nle = {limit}', f'scale = "icem"\nstat = "{other}"\nge = {mirror}')
    fluent, icem = (evaluate(found, of_text(rule(text))).rules[0] for text in texts)
    assert fluent.state == icem.state
    if stat != "count":
        assert icem.measured == pytest.approx(1 - fluent.measured, abs=1e-15)


def of_text(text, folder=[]):  # noqa: B006 - one folder for all examples of a property
    import tempfile

    if not folder:
        folder.append(tempfile.mkdtemp())
    path = Path(folder[0]) / "g.toml"
    path.write_text(text)
    return read_gate_file(path)


@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=12),
    st.floats(0, 1),
    st.floats(0, 1),
    st.sampled_from(["max", "mean", "p75"]),
)
def test_a_tighter_limit_never_makes_a_failure_pass(values, a, b, stat):
    loose, tight = max(a, b), min(a, b)
    found = rows_of_cubes(values)
    at = {x: evaluate(found, of_text(rule(f'stat = "{stat}"\nle = {x!r}'))).rules[0].state for x in (loose, tight)}
    assert not (at[loose] == "fail" and at[tight] == "pass")


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=12), st.sampled_from(["max", "mean", "p75", "share", "count"]))
def test_one_more_bad_cell_never_helps(values, stat):
    text = (
        f'stat = "{stat}"\nle = 0.4' if stat not in ("share", "count") else f'stat = "{stat}"\nbeyond = 0.6\nle = 0.3'
    )
    profile = of_text(rule(text))
    before, after = (evaluate(rows_of_cubes(v), profile).rules[0].state for v in (values, [*values, 1.0]))
    assert not (before == "fail" and after == "pass")


# ----------------------------------------------------------------------------------------------------- which entities

ZONES = (
    Zone("fluid-a", "zone", "fluid", "cell", [0, 1]),
    Zone("fluid-b", "zone", "fluid", "cell", [2]),
    Zone("steel", "zone", "solid", "cell", [3]),
)
VALUES = [0.1, 0.2, 0.3, 0.9]


def judged(gate, text, values=VALUES, zones=ZONES, **options):
    return evaluate(rows_of_cubes(values, zones=zones), gate(text), **options)


@pytest.mark.parametrize(
    ("where", "measured"),
    [
        ("", 0.9),
        ('where = { zone = "fluid*" }', 0.3),
        ('where = { zone = ["fluid-a", "steel"] }', 0.9),
        ('where = { role = "fluid" }', 0.3),
        ('where = { role = "fluid", zone = "*-a" }', 0.2),
        ('where = { type = "hex" }', 0.9),
        ('where = { distance = { to = "fluid-a", at_most = 0 } }', 0.2),
        ('where = { distance = { to = "fluid-a", at_most = 2 } }', 0.3),
        ('where = { distance = { to = "fluid-a", at_least = 2.5 } }', 0.9),
    ],
)
def test_a_rule_is_on_what_its_conditions_leave(gate, where, measured):
    (only,) = judged(gate, rule(f'stat = "max"\nle = 1\n{where}')).rules
    assert only.measured == measured


def test_layers_are_counted_from_the_wall():
    n = 6
    points = np.array([(x, y, z) for x in range(n + 1) for y in (0, 1) for z in (0, 1)], float)
    first = 4 * np.arange(n)[:, None]
    hexes = first + np.array([0, 4, 6, 2, 1, 5, 7, 3])
    wall = CellBlock("quad", [0], [[0, 1, 3, 2]])
    mesh = Mesh(
        points,
        (CellBlock("hex", np.arange(n), hexes),),
        boundary=(wall,),
        zones=(Zone("wing", "patch", "wall", "face", [0]),),
    )
    found = Measured(mesh, (METRICS[SKEW],), {SKEW: {"hex": np.arange(n) / 10}})
    for layers in (1, 2, 4, 50):
        profile = of_text(
            rule(f'stat = "max"\nle = 1\nwhere = {{ wall_layer = {{ of = "wi*", at_most = {layers} }} }}')
        )
        (only,) = evaluate(found, profile).rules
        assert only.count == min(layers, n)
        assert only.measured == (min(layers, n) - 1) / 10


def test_a_rule_for_each_zone_is_a_rule_a_zone(gate):
    found = judged(gate, rule('stat = "max"\nle = 0.5\neach = "zone"')).rules
    assert [(r.zone, r.state, r.measured) for r in found] == [
        ("fluid-a", "pass", 0.2), ("fluid-b", "pass", 0.3), ("steel", "fail", 0.9),
    ]  # fmt: skip
    assert len({r.id for r in found}) == 3


def test_a_broken_rule_says_which_zones_hold_what_is_beyond(gate):
    (only,) = judged(gate, rule('stat = "max"\nle = 0.15')).rules
    assert [(z["zone"], z["beyond"], z["worst"]["value"]) for z in only.zones] == [
        ("steel", 1, 0.9), ("fluid-b", 1, 0.3), ("fluid-a", 1, 0.2),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "state", "words"),
    [
        ('where = { zone = "fuid*" }', "incomplete", "no zone is called 'fuid*'; zones of this mesh: fluid-a, fluid-b"),
        ('where = { role = "inlet" }', "incomplete", "no zone has the role 'inlet'; roles here: fluid, solid"),
        ('where = { distance = { to = "nose", at_most = 1 } }', "incomplete", "no zone is called 'nose'"),
        ('where = { wall_layer = { of = "nose" } }', "incomplete", "no zone of faces is called 'nose'"),
        ('where = { type = "tet" }', "warn", "the mesh has no tet cells"),
        ('where = { zone = "steel", distance = { to = "fluid-a", at_most = 1 } }', "warn", "no cell matches"),
        ('where = { zone = "fuid*" }\non_no_match = "warn"', "warn", "no zone is called"),
        ('where = { type = "tet" }\non_no_match = "error"', "incomplete", "no tet cells"),
    ],
)
def test_a_rule_that_matches_nothing_is_reported(gate, text, state, words):
    (only,) = judged(gate, rule(f'stat = "max"\nle = 1\n{text}')).rules
    assert only.state == state
    assert words in only.reason


def test_a_rule_that_matches_nothing_may_be_left_aside(gate):
    found = judged(gate, rule('stat = "max"\nle = 1\nwhere = { type = "tet" }\non_no_match = "ignore"'))
    assert found.rules == ()
    assert found.not_applicable[0].reason == "the mesh has no tet cells"


# ------------------------------------------------------------------------------------------------- waivers, baselines

DAY = dt.date(2027, 3, 1)
WAIVER = '[[waiver]]\nrule = "it"\nreason = "reviewed"\nuntil = 2027-03-01\n'


@pytest.mark.parametrize(
    ("waiver", "today", "expected"),
    [
        (WAIVER, DAY, "waived"),
        (WAIVER, DAY + dt.timedelta(1), "fail"),
        (WAIVER.replace('"it"', '"i*"'), DAY, "waived"),
        (WAIVER.replace("2027-03-01", '"2027-03-01"'), DAY, "waived"),
        (WAIVER + 'zone = "steel"\n', DAY, "waived"),
        (WAIVER + 'zone = "fluid-a"\n', DAY, "fail"),
    ],
)
def test_a_waiver_accepts_a_failure_until_its_last_day_and_in_its_zone(gate, waiver, today, expected):
    (only,) = judged(gate, rule('stat = "max"\nle = 0.5') + waiver, today=today).rules
    assert only.state == expected
    assert only.measured == 0.9


def test_an_expired_waiver_says_so(gate):
    (only,) = judged(gate, rule('stat = "max"\nle = 0.5') + WAIVER, today=DAY + dt.timedelta(1)).rules
    assert "the waiver has expired on 2027-03-01: reviewed" in only.reason
    assert only.waiver["expired"]


def test_a_waiver_does_not_excuse_what_cannot_be_checked(gate):
    (only,) = judged(gate, rule('stat = "max"\nle = 0.5') + WAIVER, values=[0.1, NAN, 0.1, 0.1], today=DAY).rules
    assert only.state == "incomplete"


def document(values, text, folder, zones=()):
    found = rows_of_cubes(values, zones=zones)
    path = folder / "of-baseline.toml"
    path.write_text(text)
    return summarise(Audit(found.mesh, found, (), (SKEW,)), profiles=[read_gate_file(path)])


@pytest.mark.parametrize(
    ("allowed", "before", "after", "expected"),
    [
        ("true", [0.5], [0.5], "pass"),
        ("true", [0.5], [0.4], "pass"),
        ("true", [0.5], [math.nextafter(0.5, 1)], "fail"),
        ("{ abs = 0.1 }", [0.5], [0.6], "pass"),
        ("{ abs = 0.1 }", [0.5], [0.61], "fail"),
        ("{ rel = 0.5 }", [0.4], [0.6], "pass"),
        ("{ rel = 0.5 }", [0.4], [0.61], "fail"),
    ],
)
def test_no_worse_is_judged_against_the_baseline(gate, tmp_path, allowed, before, after, expected):
    text = rule(f'stat = "max"\nno_worse = {allowed}')
    baseline = Baseline(document(before, text, tmp_path))
    (only,) = judged(gate, text, values=after, zones=(), baseline=baseline).rules
    assert only.state == expected
    assert only.baseline == before[0]


def test_a_baseline_without_the_rule_serves_where_its_figures_do(gate, tmp_path):
    baseline = Baseline(document([0.5], rule('stat = "max"\nle = 1').replace('"it"', '"other"'), tmp_path))
    (only,) = judged(gate, rule('stat = "max"\nno_worse = true'), values=[0.6], zones=(), baseline=baseline).rules
    assert (only.state, only.baseline) == ("fail", 0.5)
    (only,) = judged(gate, rule('stat = "p90"\nno_worse = true'), values=[0.6], zones=(), baseline=baseline).rules
    assert only.state == "incomplete"
    assert "save the baseline again" in only.reason


def test_figures_of_other_zones_are_no_baseline(gate, tmp_path):
    text = rule('stat = "max"\nno_worse = true\nwhere = { zone = "steel" }')
    baseline = Baseline(document(VALUES, rule('stat = "max"\nle = 1'), tmp_path, zones=ZONES))
    (only,) = judged(gate, text, baseline=baseline).rules
    assert only.state == "incomplete"


@pytest.mark.parametrize("sense", ["above", "below"])
def test_nothing_is_no_worse_than_a_number_that_is_none(sense):
    allowed = of_text(rule('stat = "max"\nno_worse = true')).limits[0].no_worse
    assert worse_than(NAN, 0.5, sense, allowed)
    assert not worse_than(0.5, 0.5, sense, allowed)


# -------------------------------------------------------------------------------------------------------- the file


def test_the_last_definition_of_an_id_wins(gate, tmp_path):
    (tmp_path / "common.toml").write_text(
        rule('stat = "max"\nle = 0.5') + '[[rule]]\nid = "b"\nfinding = "open-edges"\nle = 0\n'
    )
    profile = gate('extends = ["common.toml"]\n' + rule('stat = "max"\nle = 0.7'))
    assert {limit.id: limit.fail for limit in profile.limits} == {"b": 0.0, "it": 0.7}


def test_a_rule_may_change_an_inherited_one_or_drop_it(gate):
    text = 'extends = "preset:fluent"\n[[rule]]\nid = "{}"\n{}\n'
    first = read_profile("fluent").limits[0]
    changed = gate(text.format(first.id, 'severity = "info"'))
    (found,) = [limit for limit in changed.limits if limit.id == first.id]
    assert (found.severity, found.metric, found.fail, found.warn) == ("info", first.metric, first.fail, first.warn)
    dropped = gate(text.format(first.id, 'severity = "off"'))
    assert first.id not in {limit.id for limit in dropped.limits}
    assert len(dropped.limits) == len(read_profile("fluent").limits) - 1


@pytest.mark.parametrize("name", PROFILES)
def test_every_preset_is_a_gate_and_is_told_with_its_edition(gate, name):
    profile = gate(f'extends = ["preset:{name}"]')
    assert [limit.id for limit in profile.limits] == [limit.id for limit in read_profile(name).limits]
    (preset,) = profile.presets
    assert (preset.name, preset.version) == (name, read_profile(name).version)
    assert preset.version
    assert len(preset.sha256) == 64


def test_a_gate_extends_other_files_of_limits(gate, tmp_path):
    (tmp_path / "limits.toml").write_text(write_toml(read_profile("icem"))[0])
    assert len(gate('extends = "limits.toml"').limits) == len(read_profile("icem").limits)


BAD = [
    ('[[rule]]\nid = "it"\nmetrik = "x"', 3, "rule 1, metrik", "one of id, name, metric,", "did you mean 'metric'"),
    (rule('stat = "maxx"\nle = 1'), 4, "rule 1, stat", "one of max, min, mean, count, share, undefined", "'maxx'"),
    (rule('stat = "max"\nle = "1"'), 5, "rule 1, le", "a number", "'1'"),
    (rule('stat = "max"\nle = nan'), 5, "rule 1, le", "a finite number", "nan"),
    (rule('stat = "max"\nge = 0.5'), 5, "rule 1, ge", "le or lt for the max", "'ge'"),
    (rule('stat = "min"\nge = 0.5'), 4, "rule 1, stat", "max, the bad end of", "'min'"),
    (rule('stat = "max"\nle = 2'), 5, "rule 1, le", "from 0 to 1", "2"),
    (rule('stat = "max"\nle = 0.5\nlt = 0.4'), 6, "rule 1, lt", "le and warn_le alone", "'lt'"),
    (rule('stat = "max"\nle = 0.5\nwarn_le = 0.6'), 6, "rule 1, warn_le", "a warning before the failure at 0.5", "0.6"),
    (rule('stat = "max"'), 1, "rule 1, le", "one of le, lt, ge, gt", "none"),
    (rule("le = 0.5"), 1, "rule 1, stat", "one of max, min", "nothing"),
    (rule('stat = "share"\nle = 0.5'), 1, "rule 1, beyond", "a value for the share", "nothing"),
    (rule('stat = "share"\nbeyond = 0.8\nle = 50'), 6, "rule 1, le", "a share from 0 to 1", "50"),
    (rule('stat = "max"\nbeyond = 0.8\nle = 1'), 5, "rule 1, beyond", "no such key but for count and share", "0.8"),
    (rule('stat = "max"\nle = 1\nscale = "flunt"'), 6, "rule 1, scale", "'fluent' or 'icem'", "'flunt'"),
    (rule('stat = "max"\nle = 1\nwhere = { typ = "tet" }'), 6, "rule 1, where.typ", "one of type, zone, role", "'typ'"),
    (rule('stat = "max"\nle = 1\nwhere = { type = "tett" }'), 6, "rule 1, where.type", "one of ", "did you mean 'tet'"),
    (rule('stat = "max"\nle = 1\nwhere = { distance = { to = "x" } }'), 6, "rule 1, where.distance", "at_most or at_least", ""),
    (rule('stat = "max"\nle = 1\nwhere = { wall_layer = { at_most = 0 } }'), 6, "rule 1, where.wall_layer.at_most", "at least 1", "0"),
    ('[[rule]]\nid = "a"\nfinding = "open-edges"\nstat = "max"\nle = 0', 4, "rule 1, stat", "count", "'max'"),
    ('[[rule]]\nid = "a b"\nfinding = "open-edges"\nle = 0', 2, "rule 1, id", "letters, digits", "'a b'"),
    ('[[rule]]\nid = "a"\nle = 0', 1, "rule 1", "metric = ... or finding = ...", "neither"),
    (rule('stat = "max"\nle = 1') * 2, 7, "rule 2, id", "ids that differ", "twice"),
    ('extends = "preset:fluentt"', 1, "extends", "one of preset:fluent,", "did you mean 'fluent'"),
    ('extends = "fluent"', 1, "extends", "preset:fluent, or the path of a file", "'fluent'"),
    ('extends = "nowhere.toml"', 1, "extends", "a file of limits", "nowhere.toml"),
    ('extends = "meshgate.toml"', 1, "extends", "in a circle", "'meshgate.toml'"),
    ("schema_version = 2\n" + rule('stat = "max"\nle = 1'), 1, "schema_version", "one of 1", "2"),
    ("schema_version = 1", None, "", "at least one rule", "none"),
    (rule('stat = "max"\nle = 1') + WAIVER.replace('"it"', '"its"'), 7, "waiver 1, rule", "the id of a rule", "did you mean 'it'"),
    (rule('stat = "max"\nle = 1') + WAIVER.replace("2027-03-01", '"soon"'), 9, "waiver 1, until", "", "soon"),
    (rule('stat = "max"\nle = 1') + WAIVER.replace('reason = "reviewed"\n', ""), 6, "waiver 1, reason", "a value", "nothing"),
    (rule('stat = "max"\nle = 1\nno_worse = { abs = -1 }'), 6, "rule 1, no_worse.abs", "at least 0", "-1"),
    (rule('stat = "max"\nle = 1\non_missing = "skip"'), 6, "rule 1, on_missing", "'error', 'warn' or 'ignore'", "'skip'"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "line", "key", "expected", "found"), BAD, ids=[f"{k}-{bad[2]}" for k, bad in enumerate(BAD)]
)
def test_a_mistake_is_told_with_its_line_its_key_and_what_may_stand_there(gate, text, line, key, expected, found):
    with pytest.raises(GateError) as caught:
        gate(text)
    problem = caught.value.problems[0]
    message = str(problem)
    assert problem.line == line
    assert f"{key}: " in message or not key or key == "rule 1"
    assert expected in message.split(", found ", maxsplit=1)[0]
    assert found in message
    assert "\n" not in message


def test_broken_toml_is_told_with_its_line(gate):
    with pytest.raises(UsageError, match="line 2"):
        gate("schema_version = 1\nrule = ]\n")


def test_all_mistakes_are_listed_by_the_command(tmp_path):
    path = tmp_path / "g.toml"
    path.write_text('[[rule]]\nid = "a"\nfinding = "open-edges"\nle = -1\nwhat = 1\n[[rule]]\nid = "b"\nstatt = 3\n')
    result = CliRunner().invoke(cli, ["gate", "check", str(path)])
    assert result.exit_code == 2
    assert [line.split(": ")[2] for line in result.stderr.splitlines()] == ["line 5", "line 8"]


def test_lines_are_found_beneath_arrays_strings_and_tables():
    text = 'a = """\n[[rule]]\nid = 1\n"""\nb = [\n  "[[rule]]",\n]\n[[rule]]\nid = "x" # id\nwhere.zone = "y"\n[rule.where]\nz = 1\n[[rule]]\n"id" = 2\n'
    lines = Lines(text)
    assert lines.line(("rule", 0, "id")) == 9
    assert lines.line(("rule", 0, "where", "zone")) == 10
    assert lines.line(("rule", 0, "where", "z")) == 12
    assert lines.line(("rule", 1, "id")) == 14
    assert lines.line(("rule", 1, "absent")) == 13
    assert lines.line(("nothing",)) is None


def test_the_published_schema_is_that_of_the_models():
    path = Path(__file__).parent.parent / "reports" / "schema" / "meshgate-1.schema.json"
    assert json.loads(path.read_text()) == json.loads(json.dumps(gate_schema()))


def test_the_schema_takes_a_good_file_and_refuses_a_wrong_key(tmp_path):
    import tomllib

    result = CliRunner().invoke(cli, ["gate", "init", "-o", str(tmp_path / "g.toml"), "--preset", "fluent"])
    assert result.exit_code == 0
    data = tomllib.loads((tmp_path / "g.toml").read_text())
    validator = jsonschema.Draft202012Validator(gate_schema())
    validator.validate(data)
    data["rule"][0]["lee"] = 1
    assert not validator.is_valid(data)


def test_a_starter_is_a_gate_and_never_replaces_a_file(tmp_path):
    path = tmp_path / "g.toml"
    run = lambda *args: CliRunner().invoke(cli, ["gate", *args])  # noqa: E731
    assert run("init", "-o", str(path)).exit_code == 0
    before = path.read_bytes()
    assert run("check", str(path)).exit_code == 0
    again = run("init", "-o", str(path))
    assert again.exit_code == 2
    assert "found one that is there already" in again.stderr
    assert path.read_bytes() == before


# --------------------------------------------------------------------------------------------- the command line

MSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
8
{nodes}
$EndNodes
$Elements
1
1 5 2 1 1 1 2 3 4 5 6 7 8
$EndElements
"""


def cube_file(folder, name="cube.msh", corner="1 0 0 0"):
    nodes = [corner, "2 1 0 0", "3 1 1 0", "4 0 1 0", "5 0 0 1", "6 1 0 1", "7 1 1 1", "8 0 1 1"]
    path = folder / name
    path.write_text(MSH.format(nodes="\n".join(nodes)))
    return str(path)


def run(*args):
    return CliRunner().invoke(cli, ["audit", *args, "--quiet"])


GOOD = rule('stat = "max"\nle = 0.5')


def gate_file(folder, text):
    (folder / "meshgate.toml").write_text(text)
    return str(folder / "meshgate.toml")


def test_a_good_mesh_passes_and_a_bad_one_fails(tmp_path):
    gate = gate_file(tmp_path, GOOD)
    assert run(cube_file(tmp_path), "--gate", gate).exit_code == 0
    bent = cube_file(tmp_path, "bent.msh", "1 0.9 0.9 -0.5")
    assert run(bent, "--gate", gate).exit_code == 1
    assert run(bent, "--gate", gate, "--exit-zero").exit_code == 0
    warns = gate_file(tmp_path, GOOD.replace("le =", "warn_le ="))
    assert run(bent, "--gate", warns).exit_code in (0, 1)  # 1 where a check finds the cell inverted


def test_warnings_may_fail(tmp_path):
    mesh = cube_file(tmp_path, "bent.msh", "1 0.2 0.2 0.1")
    gate = gate_file(tmp_path, rule('stat = "max"\nwarn_le = 0.01'))
    assert run(mesh, "--gate", gate).exit_code == 0
    assert run(mesh, "--gate", gate, "--fail-on", "warn").exit_code == 1


@pytest.mark.parametrize(
    ("corner", "text", "options", "words"),
    [
        ("1 nan 0 0", GOOD, [], "not a finite number"),
        ("1 0 0 0", GOOD.replace(SKEW, "gambit.equiangle_skw"), [], "did you mean 'gambit.equiangle_skew'"),
        ("1 0 0 0", '[[rule]]\nid = "a"\nfinding = "inverted-cell"\nle = 0', [], "did you mean 'inverted-cells'"),
        ("1 0 0 0", rule('stat = "max"\nno_worse = true'), [], "there is no baseline"),
        ("1 0 0 0", rule('stat = "max"\nno_worse = true'), ["--baseline", "nowhere.json"], "could not be read"),
        ("1 0 0 0", rule('stat = "max"\nno_worse = true\non_missing = "ignore"'), ["--baseline", "nowhere.json"], "could not be read"),
        ("1 0 0 0", rule('stat = "max"\nle = 1\nwhere = { zone = "wng*" }'), [], "no zone is called"),
        ("1 0 0 0", GOOD, ["--baseline", "nowhere.json"], "could not be read"),
        ("1 0 0 0", 'baseline = "file:nowhere.json"\n' + GOOD, [], "could not be read"),
    ],
)  # fmt: skip
def test_what_could_not_be_checked_is_incomplete_and_status_3(tmp_path, corner, text, options, words):
    gate = gate_file(tmp_path, text)
    mesh = cube_file(tmp_path, corner=corner)
    result = run(mesh, "--gate", gate, "--format", "json", *options)
    if result.stdout:
        found = json.loads(result.stdout)
        jsonschema.Draft202012Validator(SCHEMA).validate(found)
        assert found["gate"]["verdict"] == "incomplete"
        assert words in " ".join(found["gate"]["reasons"])
    else:
        assert words in result.stderr or "finite" in result.stderr or "NaN" in result.stderr or "nan" in result.stderr
    assert result.exit_code == 3
    assert run(mesh, "--gate", gate, "--exit-zero", *options).exit_code == 3


def test_a_mesh_without_cells_is_status_3(tmp_path):
    (tmp_path / "empty.msh").write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n0\n$EndElements\n"
    )
    assert run(str(tmp_path / "empty.msh"), "--gate", gate_file(tmp_path, GOOD)).exit_code == 3


def test_a_wrong_gate_file_is_status_2_before_the_mesh_is_read(tmp_path):
    result = run(str(tmp_path / "no-such-mesh.msh"), "--gate", gate_file(tmp_path, GOOD + "colour = 1\n"))
    assert result.exit_code == 2
    assert "line 6: rule 1, colour: expected one of id," in result.stderr


@pytest.mark.parametrize("page", [False, True])
def test_a_baseline_is_a_saved_document_or_a_report(tmp_path, page):
    gate = gate_file(tmp_path, rule('stat = "max"\nle = 1\nno_worse = true'))
    mesh, bent = cube_file(tmp_path), cube_file(tmp_path, "bent.msh", "1 0.2 0.2 0.1")
    saved = run(mesh, "--gate", gate, "--format", "json").stdout
    path = tmp_path / ("base.html" if page else "base.json")
    path.write_text(
        f'<!doctype html><script type="application/json" id="meshwright-audit">{embedded(json.loads(saved))}</script>'
        if page
        else saved
    )
    good, bad = (
        json.loads(run(m, "--gate", gate, "--baseline", str(path), "--format", "json").stdout) for m in (mesh, bent)
    )
    assert good["gate"]["rules"][0]["state"] == "pass"
    assert bad["gate"]["rules"][0]["state"] == "fail"
    assert bad["gate"]["rules"][0]["baseline"] == good["gate"]["rules"][0]["measured"]
    jsonschema.Draft202012Validator(SCHEMA).validate(bad)
    text = run(bent, "--gate", gate, "--baseline", str(path)).stdout
    assert "worse than the baseline" in text


def test_a_document_with_everything_meets_the_schema(tmp_path):
    text = (
        GOOD.replace("0.5", "0.0")
        + WAIVER.replace("2027", "2999")
        + '[[rule]]\nid = "z"\nmetric = "volume"\nstat = "p5"\nge = 0\neach = "zone"\n'
    )
    gate = gate_file(tmp_path, 'extends = "preset:fluent"\n' + text)
    found = json.loads(run(cube_file(tmp_path, "bent.msh", "1 0.2 0.2 0.1"), "--gate", gate, "--format", "json").stdout)
    jsonschema.Draft202012Validator(SCHEMA).validate(found)
    by_id = {r["id"]: r for r in found["gate"]["rules"]}
    assert by_id["gate.it"]["state"] == "waived"
    assert found["gate"]["verdict"] != "fail"
    assert found["gate"]["presets"][0]["name"] == "fluent"


def test_audit_of_a_real_mesh_by_a_preset_is_that_of_the_profile(tmp_path):
    mesh = cube_file(tmp_path)
    gate, profile = (json.loads(run(mesh, *args, "--format", "json").stdout) for args in
                     (("--gate", "preset:fluent"), ("--profile", "fluent")))  # fmt: skip
    strip = lambda rules: [{**r, "id": r["id"].partition(".")[2]} for r in rules]  # noqa: E731
    assert strip(gate["gate"]["rules"]) == strip(profile["gate"]["rules"])


def test_the_summary_is_a_pure_function_of_its_arguments(gate):
    found = rows_of_cubes(VALUES, zones=ZONES)
    profile = gate(GOOD + WAIVER)
    made = [summarise(audit(found.mesh), profiles=[profile], today=DAY) for _ in range(2)]
    assert made[0] == made[1]
