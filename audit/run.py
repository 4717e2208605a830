"""`audit`: measure a mesh and run the checks on it, in one call."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from dataclasses import dataclass, field
from functools import partial

from meshwright.audit.findings import Finding, Options, run_checks
from meshwright.audit.measurement import Measured, measure
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics import METRICS, select
from meshwright.audit.parallel import limited_to, workers
from meshwright.audit.surface import boundary_mesh
from meshwright.audit.tables import ASPECT, SKEW

__all__ = ["Audit", "audit"]


@dataclass(frozen=True, eq=False)
class Audit:
    """What was found out about a mesh.

    measured: raw values, always with the two metrics the article's tables need, chosen or not.
    chosen: ids of the metrics that were asked for.  findings: what the checks report.
    surface: values of the boundary elements (a shell mesh of its own), None unless asked for and there.
    seconds: wall time by stage; stages may run side by side.
    """

    mesh: Mesh
    measured: Measured
    findings: tuple[Finding, ...]
    chosen: tuple[str, ...]
    surface: Measured | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def cell_metrics(self) -> tuple[str, ...]:
        """The chosen metrics that are values of cells."""
        return tuple(id_ for id_ in self.chosen if METRICS[id_].entity == "cell")

    @property
    def point_metrics(self) -> tuple[str, ...]:
        """The chosen metrics that are values of points."""
        return tuple(id_ for id_ in self.chosen if METRICS[id_].entity == "point")


def audit(
    mesh: Mesh,
    metrics: str = "default",
    *,
    also: Iterable[str] = (),
    threads: int | None = None,
    surfaces: bool = False,
    options: Options | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Audit:
    """Measure `mesh` and check it.

    metrics: "default", "all" or ids with commas; UsageError for an unknown one.  also: ids that are measured without
    being chosen, so that reports do not list them.  threads: for the kernels, all
    cores when None.  surfaces: measure the boundary elements of a 3-D mesh too.  options: what the checks should know
    and cannot read off the mesh.  progress: told the stage
    ("metrics", "surfaces", "checks"), the cells done and the cells in all (0, 0 where that is not known).
    """
    chosen = tuple(metric.id for metric in select(metrics))
    wanted = tuple(dict.fromkeys((*chosen, *also, SKEW, ASPECT)))
    seconds: dict[str, float] = {}

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        if progress is not None and name != "checks":
            progress(name, 0, 0)
        start = time.perf_counter()
        yield
        seconds[name] = time.perf_counter() - start

    with limited_to(threads), ThreadPoolExecutor(1) as beside:
        # the checks read the mesh alone, and long stretches of them are sequential: they run beside the metrics
        def check() -> tuple[Finding, ...]:
            with stage("checks"):
                return run_checks(mesh, options)

        checks = beside.submit(copy_context().run, check) if workers() > 1 else None
        with stage("metrics"):
            tell = None if progress is None else partial(progress, "metrics")
            measured = measure(mesh, wanted, progress=tell)
        surface = None
        if surfaces:
            with stage("surfaces"):
                shell = boundary_mesh(mesh)
                surface = None if shell is None else measure(shell, wanted)
        if progress is not None:
            progress("checks", 0, 0)
        findings = check() if checks is None else checks.result()
    return Audit(mesh, measured, findings, chosen, surface, seconds)
