"""A plugin for pytest: `mesh_audit("wing.msh").assert_gate("fluent")`, and one test a rule with `mesh_rules`.

It costs a test run nothing until a test asks for the fixture.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from meshwright.audit.profiles.model import Profile
    from meshwright.audit.run import Audit
    from meshwright.audit.summary import Summary

__all__ = ["GateResult", "MeshAudit", "mesh_audit", "mesh_rules"]


@dataclass(frozen=True)
class GateResult:
    """What a gate says of a mesh.  document: as `audit --format json` prints it."""

    document: Summary

    @property
    def verdict(self) -> str:
        """pass, warn, fail or incomplete; an error that a check reports fails whatever the rules say."""
        return str(self.document["gate"]["verdict"])

    @property
    def rules(self) -> list[dict[str, Any]]:
        """The rules as the document holds them."""
        return list(self.document["gate"]["rules"])

    def report(self) -> str:
        """What is not as it should be, a line each."""
        from meshwright.reports.outputs import Batch  # noqa: PLC0415
        from meshwright.reports.results import results  # noqa: PLC0415

        lines = [f"{self.document['mesh']['path'] or 'mesh'}: {self.verdict}"]
        lines += [f"  {r.state:<10} {r.rule}: {r.message}" for r in results(Batch([self.document])) if r.broken]
        return "\n".join(lines)


@dataclass(eq=False)
class MeshAudit:
    """A mesh to be judged; it is read and measured once for every set of metrics."""

    path: Path
    format: str | None = None
    _audits: dict[str, Audit] = field(default_factory=dict)

    @cached_property
    def _mesh(self) -> Any:
        from meshwright.audit.readers import read  # noqa: PLC0415

        return read(self.path, format=self.format)

    def gate(self, gate: str | Path | Profile, *, baseline: str | None = None, metrics: str = "default") -> GateResult:
        """Judge the mesh.

        gate: name of a preset ("fluent"), path of a gate file, or a `Profile`.  baseline: a saved audit or a name.
        UsageError for a mistake in the gate, ReadError for a mesh that cannot be read.
        """
        from meshwright.audit.gate.files import read_gate_file  # noqa: PLC0415
        from meshwright.audit.metrics import METRICS, select  # noqa: PLC0415
        from meshwright.audit.profiles.loading import PROFILES  # noqa: PLC0415
        from meshwright.audit.profiles.model import Profile as ProfileType  # noqa: PLC0415
        from meshwright.audit.run import audit  # noqa: PLC0415
        from meshwright.audit.summary import summarise  # noqa: PLC0415
        from meshwright.reports.baselines import baseline_of  # noqa: PLC0415

        if isinstance(gate, ProfileType):
            profile = gate
        else:
            profile = read_gate_file(f"preset:{gate}" if str(gate) in PROFILES else gate)
        needed = [id_ for id_ in profile.metrics if id_ in METRICS]
        wanted = ",".join(dict.fromkeys([*(metric.id for metric in select(metrics)), *needed]))
        if wanted not in self._audits:
            self._audits[wanted] = audit(self._mesh, wanted)
        reference = baseline or profile.baseline
        earlier = baseline_of(reference) if reference else None
        return GateResult(summarise(self._audits[wanted], profiles=[profile], baseline=earlier))

    def assert_gate(
        self, gate: str | Path | Profile, *, baseline: str | None = None, warnings: bool = True
    ) -> GateResult:
        """AssertionError with a line for each broken rule, unless the mesh passes.

        warnings: whether warnings are allowed. What could not be checked is a failure.
        """
        __tracebackhide__ = True
        result = self.gate(gate, baseline=baseline)
        if result.verdict not in (("pass", "warn") if warnings else ("pass",)):
            pytest.fail(result.report(), pytrace=False)
        return result


_AUDITS: dict[tuple[Path, str | None, float], MeshAudit] = {}


def _audit_of(path: str | Path, format: str | None = None) -> MeshAudit:  # noqa: A002 - as in `read`
    where = Path(path).resolve()
    changed = where.stat().st_mtime if where.exists() else 0.0
    return _AUDITS.setdefault((where, format, changed), MeshAudit(Path(path), format))


@pytest.fixture(scope="session")
def mesh_audit() -> Callable[..., MeshAudit]:
    """`mesh_audit(path, format=None)` makes the audit of a mesh, once a session for each mesh."""
    return _audit_of


def mesh_rules(path: str | Path, gate: str | Path | Profile, **options: Any) -> list[Any]:
    """Parameters for `pytest.mark.parametrize("rule", mesh_rules(...))`: one test a rule, its id the rule's.

    Each is a rule of the document; `assert rule["state"] in ("pass", "warn")` says what a test wants of it.
    """
    result = _audit_of(path).gate(gate, **options)
    return [pytest.param(rule, id=rule["id"]) for rule in result.rules]
