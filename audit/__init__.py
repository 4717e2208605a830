"""Read meshes and measure them. Public names load on first use, so that importing costs nothing."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from meshwright.audit.measure import Measured, measure
    from meshwright.audit.mesh import Mesh
    from meshwright.audit.metrics import METRICS
    from meshwright.audit.readers import read
    from meshwright.audit.run import Audit, audit
    from meshwright.audit.summary import summarise

__all__ = ["METRICS", "Audit", "Measured", "Mesh", "audit", "measure", "read", "summarise"]

_HOME = {
    "METRICS": "metrics",
    "Audit": "run",
    "Measured": "measure",
    "Mesh": "mesh",
    "audit": "run",
    "measure": "measure",
    "read": "readers",
    "summarise": "summary",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


class _Package(ModuleType):
    """Keeps a public name what it says although a submodule has the same name (`measure`).

    Importing a submodule sets it as an attribute of its package; here the object of that name takes its place.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _HOME and isinstance(value, ModuleType):
            value = getattr(value, name)
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
