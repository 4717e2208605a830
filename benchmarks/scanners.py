"""Text to numbers, MB per second: our scanners against numpy's, and whole files against meshio."""

from __future__ import annotations

import argparse
import io
import tempfile
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
from meshes import hex_block, split_to_tets, write_fluent, write_gmsh41
from timing import best_of, machine, table

from meshwright.audit.readers import read
from meshwright.audit.readers.scan import read_floats, read_ints
from meshwright.audit.readers.source import open_source


def _report(
    rows: list[list[str]], what: str, size: int, ways: list[tuple[str, Callable[[], object]]], times: int
) -> None:
    """Time each way on the same bytes; the first one is ours."""
    speed = [size / 1e6 / best_of(times, work) for _, work in ways]
    for (name, _), value in zip(ways, speed, strict=True):
        rows.append([what, name, f"{value:.0f}", f"{speed[0] / value:.1f}"])


def numbers(folder: Path, rows: list[list[str]], count: int, times: int) -> None:
    """Decimal integers, hexadecimal integers and floats, eight to a line."""
    rng = np.random.default_rng(1)
    integers = rng.integers(1, 3_000_000, count).tolist()
    floats = rng.random(count).tolist()
    lines = {
        "decimal integers": (" %d" * 8 + "\n") * (count // 8) % tuple(integers),
        "hexadecimal integers": (" %x" * 8 + "\n") * (count // 8) % tuple(integers),
        "floats, 17 digits": (" %.17g" * 8 + "\n") * (count // 8) % tuple(floats),
        "floats, 9 digits": (" %.9g" * 8 + "\n") * (count // 8) % tuple(floats),
    }
    for what, text in lines.items():
        path = folder / "numbers.txt"
        path.write_text(text)
        source = open_source(path)
        end = len(source)
        if what.startswith("floats"):
            ways: list[tuple[str, Callable[[], object]]] = [
                ("meshwright", lambda s=source, e=end: read_floats(s, 0, e, count, "values")),
                ("numpy.fromstring", lambda t=text: np.fromstring(t, sep=" ")),
                ("numpy.loadtxt", lambda t=text: np.loadtxt(io.StringIO(t))),
            ]
        elif what.startswith("hex"):
            ways = [
                ("meshwright", lambda s=source, e=end: read_ints(s, 0, e, count, "values", base=16)),
                ("list of int(word, 16)", lambda t=text: np.array([int(word, 16) for word in t.split()])),
            ]
        else:
            ways = [
                ("meshwright", lambda s=source, e=end: read_ints(s, 0, e, count, "values")),
                ("numpy.fromstring", lambda t=text: np.fromstring(t, dtype=np.int64, sep=" ")),
                ("numpy.loadtxt", lambda t=text: np.loadtxt(io.StringIO(t), dtype=np.int64)),
            ]
        _report(rows, what, len(text), ways, times)


def files(folder: Path, rows: list[list[str]], cells: int, times: int) -> None:
    """A whole ASCII Fluent file (meshio reads its faces only) and a whole ASCII Gmsh 4.1 file."""
    side = round(cells ** (1 / 3))
    fluent = folder / "block.msh"
    write_fluent(fluent, (side, side, side))
    _report(rows, f"Fluent ASCII, {side**3} hex", fluent.stat().st_size, [("meshwright", lambda: read(fluent))], times)
    side = round((cells / 6) ** (1 / 3))
    points, hexes = hex_block((side, side, side))
    gmsh = folder / "gmsh.msh"
    write_gmsh41(gmsh, points, split_to_tets(hexes))
    ways: list[tuple[str, Callable[[], object]]] = [
        ("meshwright", lambda: read(gmsh)),
        ("meshio", lambda: meshio.read(gmsh, file_format="gmsh")),
    ]
    _report(rows, f"Gmsh 4.1 ASCII, {6 * side**3} tet", gmsh.stat().st_size, ways, times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--numbers", type=int, default=4_000_000)
    parser.add_argument("--times", type=int, default=2, help="runs of which the fastest counts")
    options = parser.parse_args()
    print(machine() + f", meshio {meshio.__version__}")
    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory(prefix="meshwright-") as folder:
        numbers(Path(folder), rows, options.numbers // 8 * 8, options.times)
        files(Path(folder), rows, options.cells, options.times)
    print(table(["what", "with", "MB/s", "meshwright is faster by"], rows))


if __name__ == "__main__":
    main()
