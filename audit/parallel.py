"""Work in threads: how many, and in which pieces. Kernels release the GIL, and so do numpy's sorts.

Pieces are fixed by the size of the work and never by the number of threads, so results do not depend on it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from typing import TypeVar

__all__ = ["in_parallel", "limited_to", "workers"]

_limit: ContextVar[int | None] = ContextVar("meshwright_threads", default=None)

Item = TypeVar("Item")
Result = TypeVar("Result")


def workers() -> int:
    """Threads to use here: the limit in force, or as many as this process may run on."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return _limit.get() or allowed


@contextmanager
def limited_to(threads: int | None) -> Iterator[None]:
    """Within this block use no more than so many threads; None changes nothing."""
    token = _limit.set(threads or _limit.get())
    try:
        yield
    finally:
        _limit.reset(token)


def in_parallel(function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """`function` of each item, in their order; the first error is raised, and what has not begun is dropped."""
    many = workers()
    if many == 1:
        yield from map(function, items)
        return
    with ThreadPoolExecutor(max_workers=many) as pool:
        jobs = [pool.submit(copy_context().run, function, item) for item in items]  # the limit holds in there too
        try:
            for job in jobs:
                yield job.result()
        finally:
            for job in jobs:
                job.cancel()
