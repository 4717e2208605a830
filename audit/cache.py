"""`once_per_mesh`: compute something of a mesh the first time it is asked for and keep it as long as the mesh."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from threading import Lock, RLock
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from meshwright.audit.mesh import Mesh

__all__ = ["forget", "once_per_mesh"]

T = TypeVar("T")

_NOTHING: Any = object()
_everything: list[WeakKeyDictionary[Mesh, Any]] = []


def once_per_mesh(compute: Callable[[Mesh], T]) -> Callable[[Mesh], T]:
    """Decorate a function of a mesh alone. Meshes are frozen and compared by identity, so nothing goes stale.

    Threads that ask at once for the same of the same mesh wait for the first of them.
    """
    kept: WeakKeyDictionary[Mesh, T] = WeakKeyDictionary()
    _everything.append(kept)
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
                found = kept.get(mesh, _NOTHING)
                if found is _NOTHING:
                    found = kept[mesh] = compute(mesh)
                return found

    return cached


def forget(mesh: Mesh) -> None:
    """Let go of all that is kept of a mesh, for who needs the room more than the time; it is computed anew if needed.

    Its faces alone take more than twice the memory of a mesh of tets.
    """
    for kept in _everything:
        kept.pop(mesh, None)
