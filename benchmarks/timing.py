"""What the benchmarks share: best-of-n timing, a command's wall time and peak memory, and plain tables."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

__all__ = [
    "CLOCKS",
    "Clock",
    "Run",
    "best_of",
    "command",
    "machine",
    "make_case",
    "meshwright",
    "openfoam_environment",
    "run",
    "table",
]

Run = tuple[float, float, int]
"""Wall seconds, peak resident megabytes, exit status."""


Clock = Callable[[], float]
CLOCKS: dict[str, Clock] = {"wall": time.perf_counter, "cpu": time.process_time}


def best_of(times: int, work: Callable[[], object], clock: Clock = time.perf_counter) -> float:
    """Seconds of the fastest of several runs, after one run that does not count."""
    work()
    best = float("inf")
    for _ in range(times):
        start = clock()
        work()
        best = min(best, clock() - start)
    return best


def run(arguments: Sequence[str], environment: Mapping[str, str] | None = None) -> Run:
    """Run a command with its output thrown away.

    Linux counts the peak memory of the process that starts another one as the other one's: keep the caller small.
    """
    start = time.perf_counter()
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    return seconds, usage.ru_maxrss / 1024, process.returncode


def make_case(case: Path, side: int) -> None:
    """A binary OpenFOAM case of side ** 3 hexahedra, made in a process of its own (see `run`)."""
    command([sys.executable, str(Path(__file__).with_name("meshes.py")), str(case), str(side)])


def command(
    arguments: Sequence[str], expected: Sequence[int] = (0,), environment: Mapping[str, str] | None = None
) -> Run:
    """`run`, but SystemExit when the command ends with a status it should not end with."""
    result = run(arguments, environment)
    if result[2] not in expected:
        raise SystemExit(f"{' '.join(arguments)} ended with status {result[2]}")
    return result


def meshwright() -> str:
    """The meshwright command that belongs to this Python."""
    return str(Path(sys.executable).with_name("meshwright"))


def openfoam_environment() -> dict[str, str]:
    """The environment, with WM_PROJECT_DIR set where Debian's package leaves that to the user."""
    debian = Path("/usr/share/openfoam")
    extra = {"WM_PROJECT_DIR": str(debian)} if "WM_PROJECT_DIR" not in os.environ and debian.is_dir() else {}
    return {**os.environ, **extra}


def machine() -> str:
    """One line that says what the figures below were measured on."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        names = [
            line.partition(":")[2].strip() for line in info.read_text().splitlines() if line.startswith("model name")
        ]
        model = names[0] if names else model
    load = os.getloadavg()[0]
    return (
        f"{model}, {os.cpu_count()} processors, load {load:.1f}; Python {platform.python_version()}, "
        f"numpy {version('numpy')}, numba {version('numba')}"
    )


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table with its columns aligned."""
    width = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    lines = [head, ["-" * w for w in width], *rows]
    return "\n".join(
        "| " + " | ".join(word.ljust(w) for word, w in zip(row, width, strict=True)) + " |" for row in lines
    )
