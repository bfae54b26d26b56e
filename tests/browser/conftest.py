"""A real browser on the real page; without a Chromium these tests are skipped, and say so."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from chromium import ARGUMENTS, chromium
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright
from viewing import DESKTOP, PATIENCE, Shoot, Viewer, Visit, drawn, upload

SAMPLES = Path(__file__).parents[2] / "service" / "web" / "samples"
PICTURES = Path(os.environ.get("SCREENSHOTS", Path(__file__).parents[2] / "artifacts/screenshots"))

expect.set_options(timeout=PATIENCE)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium; it is closed after each module, since an event loop runs as long as it is open."""
    path = chromium()
    if path is None:
        pytest.skip("no Chromium is installed: apt-get install chromium, or name one by CHROMIUM")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def url(service_client: httpx.Client) -> str:
    return str(service_client.base_url)


@pytest.fixture(scope="module")
def contexts(browser: Browser) -> Callable[..., BrowserContext]:
    """Contexts by their settings: pages of one share what they hold of the service's files."""
    made: dict[str, BrowserContext] = {}

    def context(**settings: Any) -> BrowserContext:
        key = repr(sorted(settings.items()))
        if key not in made:
            made[key] = browser.new_context(
                accept_downloads=True, reduced_motion="reduce", **settings
            )
        return made[key]

    return context


class Watch:
    """Notes what goes wrong in pages."""

    def __init__(self) -> None:
        self.faults: list[str] = []

    def __call__(self, page: Page) -> Page:
        page.set_default_timeout(PATIENCE)
        page.on("console", self._note)
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        return page

    def _note(self, message: Any) -> None:
        # A request that the service refuses is logged by the browser, and is no fault of the page.
        if message.type == "error" and "Failed to load resource" not in message.text:
            self.faults.append(message.text)

    def check(self) -> None:
        faults, self.faults = self.faults, []
        assert faults == []


@pytest.fixture
def visit(contexts: Callable[..., BrowserContext], url: str) -> Iterator[Visit]:
    """Opens the page; at the end of the test nothing may have gone wrong in it unnoticed."""
    pages, watch = [], Watch()

    def open_page(address: str = url, prepare: str | None = None, **settings: Any) -> Page:
        page = watch(contexts(**{"viewport": DESKTOP, **settings}).new_page())
        pages.append(page)
        if prepare is not None:
            page.add_init_script(prepare)
        page.goto(address)
        return page

    yield open_page
    for page in pages:
        page.close()
    watch.check()


@pytest.fixture(scope="module")
def _kept(contexts: Callable[..., BrowserContext], url: str) -> tuple[Page, Watch]:
    """One page for many tests: software takes seconds to get WebGL going."""
    watch = Watch()
    page = watch(contexts(viewport={"width": 1024, "height": 700}).new_page())
    page.goto(url)
    return page, watch


@pytest.fixture
def viewer(_kept: tuple[Page, Watch]) -> Iterator[Viewer]:
    """Opens samples in the page that is kept; each is a fresh start."""
    page, watch = _kept

    def open_sample(name: str) -> Page:
        for tool in ("wire", "template"):
            button = page.locator(f"[data-tool={tool}][aria-pressed=true]")
            if button.count():
                button.click()
        upload(page, name, (SAMPLES / f"{name}.glb").read_bytes())
        metres = page.get_by_role("radio", name="m", exact=True)
        metres.check()
        drawn(page)
        return page

    yield open_sample
    page.keyboard.press("Escape")
    watch.check()


@pytest.fixture
def chair_page(viewer: Viewer) -> Page:
    """The page with the sample chair freshly open."""
    return viewer("chair")


@pytest.fixture
def shoot() -> Shoot:
    """Keeps a picture of the page among the artefacts of the build."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    return lambda page, name: page.screenshot(path=PICTURES / f"{name}.png") and None


@pytest.fixture(scope="session")
def sample() -> Callable[[str], bytes]:
    return lambda name: (SAMPLES / f"{name}.glb").read_bytes()
