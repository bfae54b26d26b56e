"""The page of a service that serves those with a key alone."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Page, expect
from test_viewer_access import FAULTS
from viewing import Shoot, Visit, opened, typed

from service.api.keys import Entry, digest_of, new_key
from service.main import create_app
from service.settings import Settings

KEY = new_key()


@pytest.fixture(scope="module")
def locked(serving: Callable[..., object]) -> object:
    """A client, with a key, of the installed service behind one."""
    entry = str(Entry("ann", digest_of(KEY)))
    with serving(create_app(Settings(workers=1, categories="chair", api_keys=entry))) as client:  # type: ignore[attr-defined]
        client.headers["X-API-Key"] = KEY
        yield client


@pytest.fixture
def page(visit: Visit, locked: httpx.Client) -> Page:
    return visit(str(locked.base_url))


def given(page: Page, key: str) -> None:
    page.get_by_label("API key", exact=True).fill(key)
    page.keyboard.press("Enter")


def test_the_page_asks_once_and_goes_on(page: Page, shoot: Shoot) -> None:
    dialog = page.get_by_role("dialog", name="This service wants an API key")
    expect(dialog).to_be_hidden()
    # Without a key the list of categories is not to be had, and nothing else is amiss.
    expect(page.locator("#option-category option")).to_have_count(1)
    page.click("[data-sample=chair]")
    expect(dialog).to_be_visible()
    expect(page.get_by_label("API key", exact=True)).to_be_focused()
    assert page.evaluate(FAULTS) == []
    shoot(page, "key")
    given(page, "sp_wrong")
    expect(dialog.get_by_role("alert")).to_have_text("The service does not know this key.")
    given(page, KEY)
    expect(page.locator("#panel h2")).to_be_visible()
    expect(dialog).to_be_hidden()
    expect(page.locator("#option-category option")).to_have_count(2)
    # It is kept for the tab, and sent with each call.
    page.reload()
    expect(page.locator("#option-category option")).to_have_count(2)
    opened(page, "chair")
    typed(page, "p-seat_width-number", "0.6")
    with page.expect_download():
        page.click("#download")
    page.get_by_role("button", name="Template").click()
    expect(page.locator("[data-tool=template]")).to_have_attribute("aria-pressed", "true")
    expect(dialog).to_be_hidden()
    assert page.evaluate("() => Object.keys(localStorage).filter((k) => /key/.test(k))") == []


def test_who_has_none_can_go_back(page: Page) -> None:
    page.evaluate("() => sessionStorage.clear()")
    page.reload()
    dialog = page.get_by_role("dialog")
    for leave in (
        lambda: page.keyboard.press("Escape"),
        lambda: page.get_by_role("button", name="Cancel").last.click(),
    ):
        page.click("[data-sample=chair]")
        expect(dialog).to_be_visible()
        leave()
        expect(dialog).to_be_hidden()
        expect(page.get_by_role("alert").get_by_role("heading")).to_have_text(
            "The service wants an API key"
        )
        expect(page.locator("#progress")).to_be_hidden()


def test_the_code_takes_the_key_from_the_environment(
    page: Page, locked: httpx.Client, sample: Callable[[str], bytes], tmp_path: Path
) -> None:
    page.evaluate("(key) => sessionStorage.setItem('api-key', key)", KEY)
    page.reload()
    opened(page, "chair")
    typed(page, "p-seat_width-number", "0.6")
    page.locator(".code").evaluate("(details) => { details.open = true; }")
    (tmp_path / "chair.glb").write_bytes(sample("chair"))
    files = {"mesh": ("chair.glb", sample("chair"))}
    edited = locked.post("/edit", files=files, data={"edits": '{"seat_width": 0.6}'})
    programs = {
        "curl": ("sh", "edit.sh"),
        "Python": (sys.executable, "edit.py"),
        "JavaScript": ("node", "edit.mjs"),
    }
    for language, (program, script) in programs.items():
        page.get_by_role("tab", name=language).click()
        code = page.locator("#snippet").inner_text()
        assert "Authorization" in code
        assert "API_KEY" in code
        assert KEY not in page.content()
        if shutil.which(program) is None or shutil.which("curl") is None:
            continue
        (tmp_path / script).write_text(code)
        subprocess.run(
            [program, script], cwd=tmp_path, env={**os.environ, "API_KEY": KEY},
            check=True, timeout=120, capture_output=True,
        )  # fmt: skip
        made = tmp_path / "chair-edited.glb"
        assert made.read_bytes() == edited.content, language
        made.unlink()
