"""Repair meshes and prove that nothing got worse. Public names load on first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from meshwright.repair.passes import PASSES
    from meshwright.repair.run import Repair, Step, repair
    from meshwright.repair.writers import write

__all__ = ["PASSES", "Repair", "Step", "repair", "write"]

_HOME = {"PASSES": "passes", "Repair": "run", "Step": "run", "repair": "run", "write": "writers"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
