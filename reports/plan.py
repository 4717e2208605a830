"""What the options of a run come to: limits to judge by, metrics to measure, what the checks are told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from meshwright.audit.findings.options import Options
from meshwright.audit.gate.files import read_gate_file
from meshwright.audit.metrics import METRICS, select
from meshwright.audit.profiles.baseline import Baseline
from meshwright.audit.profiles.loading import PROFILES, load
from meshwright.audit.profiles.model import Profile
from meshwright.audit.profiles.rosetta import families
from meshwright.reports.baselines import baseline_of
from meshwright.reports.sizes import millimetres, read_sizes

if TYPE_CHECKING:
    from meshwright.reports.job import Job

__all__ = ["ALL", "Plan", "make_plan"]

ALL = "all"
"""Name in place of a profile: every one of them, side by side."""


@dataclass(frozen=True)
class Plan:
    """metrics: ids to measure and to show, with commas.  also: ids to measure beside them.  options: for the checks.

    profiles: whose limits the mesh has to keep.  compare: profiles set side by side.  baseline: None for none.
    """

    metrics: str
    also: tuple[str, ...]
    options: Options
    profiles: tuple[Profile, ...]
    compare: tuple[Profile, ...]
    baseline: Baseline | None = None


def make_plan(job: Job) -> Plan:
    """The plan of a job; UsageError for an unknown metric, profile or unit, and for a mistake in a file it names."""
    chosen = [metric.id for metric in select(job.metrics)]
    compare = tuple(load(name) for name in PROFILES) if job.profile == ALL else ()
    profiles = [] if job.profile is None or job.profile == ALL else [load(job.profile)]
    if job.gate is not None:
        profiles.append(read_gate_file(job.gate))
    needed = [id_ for profile in profiles for id_ in profile.metrics]
    also = [id_ for profile in compare for id_ in profile.metrics]
    also += [member.metric for family in families() for member in family.members] if compare else []
    discipline = job.discipline or next((p.discipline for p in profiles if p.discipline), "")
    options = Options(
        discipline=discipline,  # type: ignore[arg-type]
        axis=job.axis,  # type: ignore[arg-type]
        unit=millimetres(job.unit),
        feature_angle=job.feature_angle,
        sizes=read_sizes(job.sizes),
    )
    # what OpenFOAM's limits alone ask for is no metric and measured with its rule
    shown = dict.fromkeys(id_ for id_ in (*chosen, *needed) if id_ in METRICS)
    beside = dict.fromkeys(id_ for id_ in also if id_ in METRICS)
    reference = job.baseline or next((p.baseline for p in profiles if p.baseline), "")
    baseline = baseline_of(reference) if reference else None
    return Plan(",".join(shown), tuple(beside), options, tuple(profiles), compare, baseline)
