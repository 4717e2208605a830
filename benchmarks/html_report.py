"""The HTML report of a million hexahedra with all metrics: size, time to make, time until it is ready in Chromium.

`--side 215` makes ten million (12 GB of memory). Goals: 1 M at most 1.5 MB, 2 s and 3 s; 10 M at most 6 MB.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path

from meshes import as_mesh, hex_block

from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.html.report import report_html

_ARGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking")


def ready(path: Path) -> float | None:
    """Seconds from opening the file until the view is drawn, in software graphics; None without a browser."""
    binary = shutil.which("chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    if binary is None:
        return None
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=binary, args=list(_ARGS))
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.goto(path.as_uri())
        page.wait_for_selector("html[data-ready=view]", timeout=120_000)
        found = page.evaluate("performance.getEntriesByName('meshwright-ready')[0].startTime") / 1000
        browser.close()
    return float(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side", type=int, default=100, help="cells along an edge of the block")
    parser.add_argument("--metrics", default="all")
    options = parser.parse_args()
    mesh = as_mesh("hex", *hex_block((options.side,) * 3))
    start = time.perf_counter()
    found = audit(mesh, options.metrics)
    document = summarise(found, worst=5)
    audited = time.perf_counter() - start
    times = []
    for _ in range(3 if options.side <= 120 else 1):
        start = time.perf_counter()
        text = report_html(found, document)
        times.append(time.perf_counter() - start)
    data = text.encode()
    print(f"cells             {mesh.n_cells:,}, {len(found.chosen)} metrics; audit and summary {audited:.1f} s")
    print(f"report            {len(data) / 1e6:.2f} MB, made in {min(times):.2f} s (first {times[0]:.2f} s)")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "report.html"
        path.write_bytes(data)
        waits = [ready(path) for _ in range(3)]
        if waits[0] is not None:
            print(f"ready in Chromium {', '.join(f'{w:.2f}' for w in waits if w is not None)} s")


if __name__ == "__main__":
    main()
