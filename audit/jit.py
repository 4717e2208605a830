"""How every kernel of the program is compiled, and where the compiled code is kept.

`error_model="numpy"`: division by zero gives inf or nan, never an exception. No fastmath: it hides NaN.
The cache lives in the user's cache folder under a key made of the source files that hold kernels, because numba
looks only at the file of the outermost function and would keep stale code when a function it calls changes.
"""

from __future__ import annotations

import gc
import hashlib
import os
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import config, event
from numba.core.errors import NumbaExperimentalFeatureWarning

__all__ = ["inner", "kernel", "on_first_compilation"]

_KEPT_CACHES = 4

# Metric kernels are called through numba's first-class function type, which numba still labels experimental.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)


def _cache_folder() -> Path:
    root = os.environ.get("NUMBA_CACHE_DIR")
    if root:
        base = Path(root)
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "meshwright" / "kernels"
    digest = hashlib.sha256(numba.__version__.encode())
    here = Path(__file__).parent
    for path in sorted(here.rglob("*.py")):
        source = path.read_bytes()
        if b"kernel" in source:
            digest.update(source)
    return base / digest.hexdigest()[:16]


def _use_cache_folder() -> None:
    folder = _cache_folder()
    if not folder.exists():
        try:
            folder.mkdir(parents=True)
        except OSError:
            return  # read-only home: numba falls back to its own choice of folder
        old = sorted((p for p in folder.parent.iterdir() if p.is_dir()), key=lambda p: p.stat().st_mtime)
        for stale in old[:-_KEPT_CACHES]:
            shutil.rmtree(stale, ignore_errors=True)
    config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]


_use_cache_folder()


def kernel(*args: Any, **options: Any) -> Any:
    """`numba.njit` with the program's settings; use it bare, with a signature, or with options.

    Without the entry point from C, which takes long to compile and which only first-class functions need.
    """
    settings: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
    settings.update(options)
    if len(args) == 1 and callable(args[0]) and not hasattr(args[0], "return_type"):
        return numba.njit(**settings)(args[0])
    return numba.njit(*args, **settings)


def inner(function: Callable[..., Any]) -> Any:
    """A function that only kernels call: compiled without the entry point from Python too, in half the time."""
    return kernel(no_cpython_wrapper=True)(function)


class _Unhurried(event.Listener):
    """Holds back the garbage collector while numba compiles.

    The compiler's objects live until it is done, and going over all of them again and again for nothing takes a fifth
    of the time of a first run.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._was_on = False

    def on_start(self, event: event.Event) -> None:
        if self._depth == 0:
            self._was_on = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: event.Event) -> None:
        self._depth -= 1
        if self._depth == 0 and self._was_on:
            gc.enable()


event.register("numba:compile", _Unhurried())


class _FirstCompilation(event.Listener):
    def __init__(self, tell: Callable[[], None]) -> None:
        self._tell: Callable[[], None] | None = tell

    def on_start(self, event: event.Event) -> None:
        if self._tell is not None:
            tell, self._tell = self._tell, None
            tell()

    def on_end(self, event: event.Event) -> None:
        pass


def on_first_compilation(tell: Callable[[], None]) -> None:
    """Call `tell` once, when a kernel is about to be compiled because no cached code serves it."""
    event.register("numba:compile", _FirstCompilation(tell))
