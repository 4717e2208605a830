"""A real browser for tests of pages: Debian's Chromium, driven by Playwright, with graphics made by the processor."""

import os
import shutil
from pathlib import Path

import pytest

ARGS = (
    *("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)


@pytest.fixture(scope="session")
def artefacts():
    """Where screenshots are kept."""
    folder = Path(os.environ.get("MESHWRIGHT_ARTEFACTS") or Path(__file__).parent / "artefacts")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def launch():
    """Starts browsers; `launch("--flag")` adds flags."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    binary = shutil.which("chromium") or shutil.which("chromium-browser")
    if binary is None:
        pytest.skip("no Chromium here: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        browsers = []

        def start(*flags):
            browsers.append(playwright.chromium.launch(executable_path=binary, args=[*ARGS, *flags]))
            return browsers[-1]

        yield start
        for browser in browsers:
            browser.close()


@pytest.fixture(scope="session")
def chromium(launch):
    """One browser for all pages."""
    return launch()


class Watched:
    """A page with all that it says, asks for and opens."""

    def __init__(self, browser, path, *, width=1400, height=900, dark=False, javascript=True, ready=True):
        self.context = browser.new_context(
            viewport={"width": width, "height": height},
            color_scheme="dark" if dark else "light",
            java_script_enabled=javascript,
        )
        self.page = self.context.new_page()
        self.said, self.requests, self.dialogs = [], [], []
        self.page.on("console", lambda message: self.said.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda error: self.said.append(f"error: {error}"))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("dialog", lambda dialog: (self.dialogs.append(dialog.message), dialog.dismiss()))
        self.url = Path(path).as_uri()
        self.page.goto(self.url)
        if ready and javascript:
            self.page.wait_for_selector("html[data-ready]", timeout=30_000)

    def quiet(self):
        """Nothing was said, nothing asked for but the file, nothing opened."""
        assert self.said == []
        assert self.requests == [self.url]
        assert self.dialogs == []

    def close(self):
        self.context.close()


@pytest.fixture
def open_page(chromium):
    """Opens a file and waits until it is ready; closes it at the end."""
    pages = []

    def open_(path, browser=None, **options):
        pages.append(Watched(browser or chromium, path, **options))
        return pages[-1]

    yield open_
    for page in pages:
        page.close()
