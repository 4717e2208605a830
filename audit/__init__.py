"""Read meshes and measure them. Public names load on first use, so that importing costs nothing."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from meshwright.audit.measurement import Measured, measure
    from meshwright.audit.mesh import Mesh
    from meshwright.audit.metrics import METRICS
    from meshwright.audit.readers import read
    from meshwright.audit.run import Audit, audit
    from meshwright.audit.summary import summarise

__all__ = ["METRICS", "Audit", "Measured", "Mesh", "audit", "measure", "read", "summarise"]

_HOME = {
    "METRICS": "metrics",
    "Audit": "run",
    "Measured": "measurement",
    "Mesh": "mesh",
    "audit": "run",
    "measure": "measurement",
    "read": "readers",
    "summarise": "summary",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
