"""Work in threads: how many, and in which pieces. Kernels release the GIL, and so do numpy's sorts.

Pieces are fixed by the size of the work and never by the number of threads, so results do not depend on it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from functools import cache
from typing import TypeVar

__all__ = ["in_parallel", "limited_to", "workers"]

_limit: ContextVar[int | None] = ContextVar("meshwright_threads", default=None)
_inside: ContextVar[bool] = ContextVar("meshwright_inside", default=False)

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
    with _threads(many) as pool:
        jobs = [pool.submit(copy_context().run, _one, function, item) for item in items]  # the limit holds in there too
        try:
            for job in jobs:
                yield job.result()
        finally:
            for job in jobs:
                job.cancel()
            wait(jobs)  # nothing may go on behind the back of who called


def _one(function: Callable[[Item], Result], item: Item) -> Result:
    _inside.set(True)
    return function(item)


@contextmanager
def _threads(many: int) -> Iterator[ThreadPoolExecutor]:
    """The threads that are kept, for passes that hand out thousands of small pieces; inside of one of these new ones,
    since waiting there for their own kind they might wait for ever."""
    if not _inside.get():
        yield _kept(many)
        return
    with ThreadPoolExecutor(max_workers=many) as pool:
        yield pool


@cache
def _kept(many: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max_workers=many, thread_name_prefix="meshwright")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_kept.cache_clear)  # a forked process has no threads but its own
