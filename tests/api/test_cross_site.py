from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

MESH = {"mesh": ("chair.obj", b"abc", "model/obj")}
PAGE = "https://shapes.example"


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
@pytest.mark.parametrize("origin", [PAGE, "null", ""])
def test_another_page_can_not_have_the_service_work(
    client: httpx.Client, pretend: Any, problem: Any, site: str, origin: str
) -> None:
    headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": "no-cors"}
    if origin:
        headers["Origin"] = origin
    problem(client.post("/infer", files=MESH, headers=headers), 403, "cross_site")
    assert not pretend.calls


@pytest.mark.parametrize("site", ["same-origin", "none", None])
def test_its_own_pages_and_other_clients_can(client: httpx.Client, site: str | None) -> None:
    headers = {"Origin": str(client.base_url)}
    if site is not None:
        headers["Sec-Fetch-Site"] = site
    assert client.post("/infer", files=MESH, headers=headers).status_code == 200


def test_links_from_elsewhere_can_be_followed(client: httpx.Client) -> None:
    headers = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    for path in ("/", "/docs", "/categories"):
        assert client.get(path, headers=headers).status_code == 200


@pytest.mark.parametrize("origins", [PAGE, "*"])
def test_pages_that_are_let_in_can(
    pretend_app: Callable[..., FastAPI], serve: Any, origins: str
) -> None:
    client = serve(pretend_app(cors_origins=origins))
    headers = {"Sec-Fetch-Site": "cross-site", "Origin": PAGE}
    response = client.post("/infer", files=MESH, headers=headers)
    assert response.status_code == 200
    assert response.headers["access-control-allow-origin"] in (PAGE, "*")
