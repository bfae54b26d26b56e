"""A page of another origin calls the service, as far as its browser lets it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from playwright.sync_api import BrowserContext, Page

from service.api.keys import Entry, digest_of, new_key
from service.main import create_app
from service.settings import Settings

KEY = new_key()

# An edit of a tetrahedron: the answer's status and what a page can read of it, or the refusal.
CALL = """async ([url, headers]) => {
  const form = new FormData();
  form.append("mesh", new File(["v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nv 0 0 1\\nf 1 3 2\\nf 1 2 4\\nf 1 4 3\\nf 2 3 4\\n"], "a.obj"));
  form.append("edits", '{"width": {"scale": 2}}');
  try {
    const answer = await fetch(`${url}/edit`, { method: "POST", body: form, headers });
    const text = await answer.text();
    const read = Object.fromEntries([...answer.headers.keys()].map((name) => [name, answer.headers.get(name)]));
    return { status: answer.status, text, headers: read };
  } catch (error) {
    return { refused: String(error) };
  }
}"""  # noqa: E501


@pytest.fixture
def page(contexts: Callable[..., BrowserContext], url: str) -> Iterator[Page]:
    """A page whose own policy does not keep it from calling others."""
    page = contexts(bypass_csp=True).new_page()
    page.goto(f"{url}/docs")
    yield page
    page.close()


@pytest.fixture
def make(serve: Callable[..., httpx.Client]) -> Callable[..., str]:
    """Addresses of services with a key, each on a port, and so an origin, of its own."""
    common = {"workers": 1, "categories": "debug", "api_keys": str(Entry("ann", digest_of(KEY)))}
    return lambda **settings: str(serve(create_app(Settings(**common, **settings))).base_url)


def call(page: Page, url: str, **headers: str) -> dict[str, Any]:
    return page.evaluate(CALL, [url, headers])


def test_a_page_that_is_let_in_reads_answers_and_errors(
    page: Page, url: str, make: Callable[..., str]
) -> None:
    service = make(cors_origins=url)
    answer = call(page, service, Authorization=f"Bearer {KEY}")
    assert answer["status"] == 200
    assert answer["text"].startswith("v ")
    assert {"etag", "shape-parameters", "content-disposition", "trace-id"} <= set(answer["headers"])
    refused = call(page, service)
    assert (refused["status"], '"key_missing"' in refused["text"]) == (401, True)
    unknown = call(page, service, **{"X-API-Key": "sp_unknown"})
    assert (unknown["status"], '"key_unknown"' in unknown["text"]) == (401, True)


@pytest.mark.parametrize("origins", ["", "https://else.example"])
def test_another_page_reads_nothing(page: Page, make: Callable[..., str], origins: str) -> None:
    service = make(cors_origins=origins)
    for headers in ({}, {"Authorization": f"Bearer {KEY}"}):
        assert "refused" in call(page, service, **headers)


def test_another_page_has_nothing_done(page: Page, serve: Callable[..., httpx.Client]) -> None:
    """Without a key, by a form that no preflight goes before."""
    client = serve(create_app(Settings(workers=1, categories="debug")))
    blind = """async (url) => {
      const form = new FormData();
      form.append("mesh", new File(["v 0 0 0"], "a.obj"));
      // What comes is kept from the page either way.
      const sent = fetch(`${url}/infer`, { method: "POST", mode: "no-cors", body: form });
      await sent.catch(() => null);
    }"""
    page.evaluate(blind, str(client.base_url))
    metrics = client.get("/metrics").text
    assert 'code="cross_site"' in metrics
    assert 'status="422"' not in metrics
