"""What a user waits for: --help, a small audit with compiled kernels at hand, and the very first audit without them."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

from timing import command, machine, make_case, meshwright, table

SIDE = 22  # 10 648 cells


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=5, help="runs of which the fastest counts")
    options = parser.parse_args()
    print(machine())
    with tempfile.TemporaryDirectory(prefix="meshwright-") as folder:
        case = Path(folder) / "case"
        make_case(case, SIDE)
        audit = [meshwright(), "audit", str(case), "--format", "json"]
        fresh = {**os.environ, "NUMBA_CACHE_DIR": str(Path(folder) / "kernels")}
        first = command(audit, (0, 1), fresh)
        second = min(command(audit, (0, 1), fresh) for _ in range(options.times))
        empty = min(command([sys.executable, "-c", "pass"]) for _ in range(options.times))
        help_ = min(command([meshwright(), "--help"]) for _ in range(options.times))
    named = (
        ("python -c pass", empty),
        ("meshwright --help", help_),
        (f"audit of {SIDE**3} cells, kernels compiled before", second),
        (f"audit of {SIDE**3} cells, first of all (compiles)", first),
    )
    print(table(["command", "wall time, s", "peak memory, MB"], [[n, f"{r[0]:.2f}", f"{r[1]:.0f}"] for n, r in named]))


if __name__ == "__main__":
    main()
