"""Run every benchmark one after the other and print what each printed: `make bench`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCRIPTS = (
    "kernels",
    "all_metrics",
    "audit_vs_checkmesh",
    "scanners",
    "scaling",
    "startup",
    "html_report",
    "compare",
    "repair",
)


def main() -> None:
    for name in SCRIPTS:
        print(f"\n## {name}\n", flush=True)
        script = Path(__file__).parent / f"{name}.py"
        if subprocess.run([sys.executable, "-B", str(script), *sys.argv[1:]], check=False).returncode:
            print(f"{name} did not finish", flush=True)


if __name__ == "__main__":
    main()
