"""`once_per_mesh`: compute something of a mesh the first time it is asked for and keep it as long as the mesh."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from threading import Lock, RLock
from typing import TypeVar
from weakref import WeakKeyDictionary

from meshwright.audit.mesh import Mesh

__all__ = ["once_per_mesh"]

T = TypeVar("T")


def once_per_mesh(compute: Callable[[Mesh], T]) -> Callable[[Mesh], T]:
    """Decorate a function of a mesh alone. Meshes are frozen and compared by identity, so nothing goes stale.

    Threads that ask at once for the same of the same mesh wait for the first of them.
    """
    kept: WeakKeyDictionary[Mesh, T] = WeakKeyDictionary()
    busy: WeakKeyDictionary[Mesh, RLock] = WeakKeyDictionary()
    opening = Lock()

    @wraps(compute)
    def cached(mesh: Mesh) -> T:
        try:
            return kept[mesh]
        except KeyError:
            with opening:
                here = busy.setdefault(mesh, RLock())
            with here:
                if mesh not in kept:
                    kept[mesh] = compute(mesh)
                return kept[mesh]

    return cached
