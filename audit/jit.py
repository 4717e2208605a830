"""How every kernel of the program is compiled, and where the compiled code is kept.

`error_model="numpy"`: division by zero gives inf or nan, never an exception. No fastmath: it hides NaN.
The cache lives in the user's cache folder, a folder for each file that holds kernels, under a key made of that file
and of all that it imports: numba looks only at the file of the outermost function and would keep stale code when a
function it calls changes.
"""

from __future__ import annotations

import gc
import hashlib
import os
import re
import shutil
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config, event
from numba.core.errors import NumbaExperimentalFeatureWarning

__all__ = ["inner", "kernel", "on_first_compilation"]

_KEPT = 3
"""Versions of a module whose compiled code is kept: branches and versions of the program in use side by side."""

# Metric kernels are called through numba's first-class function type, which numba still labels experimental.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

_HERE = Path(__file__).parent
_IMPORTS = re.compile(r"^\s*from meshwright\.((?:audit|repair|reports)[\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


@cache
def _source(file: Path) -> bytes:
    return file.read_bytes()


@cache
def _imported(file: Path) -> frozenset[Path]:
    """The program's own files that a file imports."""
    found = set()
    for path, names in _IMPORTS.findall(_source(file).decode()):
        folder = _HERE.parent.joinpath(*path.split("."))
        if folder.is_dir():
            found.add(folder / "__init__.py")
            found |= {folder / f"{name}.py" for name in re.findall(r"\w+", names)}
        else:
            found.add(folder.with_suffix(".py"))
    return frozenset(module for module in found if module.is_file())


@cache
def _digest(file: Path) -> bytes:
    return hashlib.sha256(_source(file)).digest()


@cache
def _closure(file: Path) -> tuple[Path, ...]:
    """The file and all it imports, directly or not."""
    seen = {file}
    todo = [file]
    while todo:
        new = _imported(todo.pop()) - seen
        seen |= new
        todo += new
    return tuple(sorted(seen, key=str))


@cache
def _cache_folder(file: Path) -> Path | None:
    """Where the compiled code of a file's kernels lives: under a key made of it and all that it imports."""
    root = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(root or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    base = base if root else base / "meshwright" / "kernels"
    digest = hashlib.sha256(numba.__version__.encode() + b"".join(map(_digest, _closure(file))))
    name = ".".join(file.relative_to(_HERE).with_suffix("").parts) if file.is_relative_to(_HERE) else file.stem
    folder = base / f"{name}-{digest.hexdigest()[:16]}"
    if not folder.exists():
        try:
            folder.mkdir(parents=True)
        except OSError:
            return None  # read-only home: numba falls back to its own choice of folder
        old = sorted((p for p in base.glob(f"{name}-*") if p.is_dir()), key=lambda p: p.stat().st_mtime)
        for stale in old[:-_KEPT]:
            shutil.rmtree(stale, ignore_errors=True)
    return folder


def kernel(*args: Any, **options: Any) -> Any:
    """`numba.njit` with the program's settings; use it bare or with options.

    Without the entry point from C, which takes long to compile and which only first-class functions need.
    """
    settings: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
    settings.update(options)

    def compiled(function: Callable[..., Any]) -> Any:
        before = config.CACHE_DIR  # type: ignore[attr-defined]
        folder = _cache_folder(Path(function.__code__.co_filename))
        config.CACHE_DIR = "" if folder is None else str(folder)  # type: ignore[attr-defined]
        try:  # numba looks at the folder when it decorates
            return numba.njit(**settings)(function)
        finally:
            config.CACHE_DIR = before  # type: ignore[attr-defined]

    return compiled(args[0]) if args else compiled


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
