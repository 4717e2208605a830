"""Profiles: what each system demands of a mesh, evaluated on measured values; files of limits of other programs."""

from __future__ import annotations

from meshwright.audit.profiles.evaluate import evaluate
from meshwright.audit.profiles.loading import PROFILES, load, read_profile
from meshwright.audit.profiles.model import Limit, Profile
from meshwright.audit.profiles.rule import Judgement, Rule

__all__ = ["PROFILES", "Judgement", "Limit", "Profile", "Rule", "evaluate", "load", "read_profile"]
