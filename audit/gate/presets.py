"""Presets: profiles of the program under the name `preset:NAME`; and what tells a gate file from other TOML."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from meshwright.audit.profiles.loading import load
from meshwright.audit.profiles.model import Preset, Profile

__all__ = ["PRESET", "is_gate", "preset"]

PRESET = "preset:"


def is_gate(data: dict[str, Any]) -> bool:
    """Whether a TOML document is a gate file rather than a profile."""
    return "limit" not in data and bool({"rule", "schema_version", "extends", "waiver", "baseline"} & data.keys())


def preset(name: str) -> Profile:
    """A profile that comes with the program, as a gate; UsageError for an unknown name."""
    profile = load(name)
    return replace(profile, presets=(Preset(profile.name, profile.version, profile.sha256),))
