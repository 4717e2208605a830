"""Wall time and memory of a whole audit at 1, 2, 4 and 8 million cells: is the cost of a cell constant?"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from timing import command, machine, make_case, meshwright, table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--millions", type=float, nargs="+", default=[1, 2, 4, 8])
    parser.add_argument("--times", type=int, default=2, help="runs of which the fastest counts")
    options = parser.parse_args()
    print(machine())
    rows: list[list[str]] = []
    base = 0.0
    with tempfile.TemporaryDirectory(prefix="meshwright-") as folder:
        case = Path(folder) / "case"
        make_case(case, 20)
        command([meshwright(), "audit", str(case), "--format", "json"], (0, 1))  # compiles kernels the first time
    for millions in options.millions:
        side = round((millions * 1e6) ** (1 / 3))
        with tempfile.TemporaryDirectory(prefix="meshwright-") as folder:
            case = Path(folder) / "case"
            make_case(case, side)
            audit = [meshwright(), "audit", str(case), "--format", "json"]
            seconds, megabytes, _ = min(command(audit, (0, 1)) for _ in range(options.times))
        cells = side**3
        base = base or seconds / cells
        micro = seconds / cells * 1e6
        ratio = seconds / cells / base
        rows.append(
            [
                str(cells),
                f"{seconds:.2f}",
                f"{micro:.2f}",
                f"{ratio:.2f}",
                f"{megabytes:.0f}",
                f"{megabytes * 2**20 / cells:.0f}",
            ]
        )
    head = ["cells", "wall time, s", "us per cell", "per cell v first row", "peak memory, MB", "bytes per cell"]
    print(table(head, rows))


if __name__ == "__main__":
    main()
