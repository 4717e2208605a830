"""The whole `meshwright audit --format json` of a binary OpenFOAM case against `checkMesh`, by turns: time, memory."""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

from timing import Run, command, machine, make_case, meshwright, openfoam_environment, table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--times", type=int, default=3, help="rounds; the fastest of each counts")
    options = parser.parse_args()
    if shutil.which("checkMesh") is None:
        raise SystemExit("checkMesh is not installed")
    side = round(options.cells ** (1 / 3))
    print(machine())
    with tempfile.TemporaryDirectory(prefix="meshwright-") as folder:
        case = Path(folder) / "case"
        make_case(case, side)
        audit = [meshwright(), "audit", str(case), "--format", "json"]
        check = ["checkMesh", "-case", str(case), "-allGeometry", "-allTopology"]
        foam = openfoam_environment()
        command(audit, (0, 1))  # compiles kernels the first time
        rounds = [(command(audit, (0, 1)), command(check, environment=foam)) for _ in range(options.times)]
    ours, theirs = (min(one[i] for one in rounds) for i in (0, 1))
    rows = [_row("meshwright audit", ours), _row("checkMesh", theirs)]
    rows.append(["checkMesh / meshwright", f"{theirs[0] / ours[0]:.2f}", f"{theirs[1] / ours[1]:.2f}"])
    print(f"\n{side**3} jittered hexahedra, binary polyMesh, fastest of {options.times}\n")
    print(table(["command", "wall time, s", "peak memory, MB"], rows))


def _row(name: str, result: Run) -> list[str]:
    return [name, f"{result[0]:.2f}", f"{result[1]:.0f}"]


if __name__ == "__main__":
    main()
