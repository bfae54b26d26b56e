"""The documentation of the API, drawn by Swagger UI without anything from elsewhere."""

from __future__ import annotations

from urllib.parse import urlsplit

from playwright.sync_api import Page, expect
from viewing import Shoot, Visit


def watched(page: Page) -> list[str]:
    """Requests that the page makes from now on, by their hosts."""
    hosts: list[str] = []
    page.on("request", lambda request: hosts.append(urlsplit(request.url).netloc))
    return hosts


def test_every_operation_is_shown_with_nothing_from_elsewhere(
    visit: Visit, url: str, shoot: Shoot
) -> None:
    page = visit("about:blank")
    hosts = watched(page)
    page.goto(f"{url}/docs")
    expect(page.locator("h1, h2").first).to_contain_text("Shape parameters")
    paths = page.request.get(f"{url}/openapi.json").json()["paths"]
    expect(page.locator(".opblock")).to_have_count(sum(map(len, paths.values())))
    page.locator(".opblock", has_text="/edit").locator("button").first.click()
    expect(page.get_by_text("seat_top_height").first).to_be_visible()
    expect(page.locator(".errors-wrapper")).to_have_count(0)
    shoot(page, "docs")
    assert set(hosts) <= {urlsplit(url).netloc, ""}


def test_a_call_can_be_tried_out(visit: Visit, url: str) -> None:
    page = visit(f"{url}/docs")
    page.locator(".opblock", has_text="/livez").locator("button").first.click()
    page.get_by_role("button", name="Try it out").click()
    page.get_by_role("button", name="Execute").click()
    expect(page.locator(".live-responses-table .microlight").first).to_contain_text("alive")
