from __future__ import annotations

from typing import Any

import httpx
import pytest

from service.api.safety import HEADERS

MESH = ("chair.obj", b"abc", "model/obj")


def calls(client: httpx.Client) -> dict[str, httpx.Response]:
    """Answers of every kind."""
    mesh_id = client.post("/edit", files={"mesh": MESH}, data={"edits": "{}"}).headers["etag"]
    kept = client.post("/infer", files={"mesh": MESH}).json()["mesh_id"]
    held = {"If-None-Match": mesh_id}
    return {
        "json": client.post("/infer", files={"mesh": MESH}),
        "file": client.post("/edit", files={"mesh": MESH}, data={"edits": "{}"}),
        "kept": client.get(f"/meshes/{kept}"),
        "held": client.post("/edit", files={"mesh": MESH}, data={"edits": "{}"}, headers=held),
        "probe": client.get("/livez"),
        "page": client.get("/"),
        "docs": client.get("/docs"),
        "script": client.get("/web/js/app.js"),
        "document": client.get("/openapi.json"),
        "bodiless": client.head("/categories"),
        "missing": client.get("/nowhere"),
        "method": client.delete("/infer"),
        "unread": client.post("/infer", content=b"{}", headers={"Content-Type": "text/plain"}),
        "invalid": client.post("/infer", data={"up": "north"}),
    }


def test_every_answer_has_them(client: httpx.Client) -> None:
    for kind, response in calls(client).items():
        for name, value in HEADERS.items():
            found = response.headers.get_list(name)
            assert len(found) == 1, (kind, name)
            if name != "Content-Security-Policy" or kind not in ("page", "docs"):
                assert found == [value], kind
        assert response.headers.get_list("cache-control"), kind


def test_nobody_may_frame_or_script_a_page(client: httpx.Client) -> None:
    for path in ("/", "/docs"):
        headers = client.get(path).headers
        policy = headers["content-security-policy"]
        assert "frame-ancestors 'none'" in policy
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "http" not in policy
        assert headers["cross-origin-opener-policy"] == "same-origin"
        assert "camera=()" in headers["permissions-policy"]


def test_errors_and_the_moments_answers_are_not_kept(client: httpx.Client) -> None:
    for kind, response in calls(client).items():
        keep = response.headers["cache-control"]
        if response.status_code >= 400:
            assert keep == "no-store", kind
        elif kind not in ("kept",):
            assert "no-cache" in keep, kind


def test_an_error_that_nothing_foresaw(client: httpx.Client, pretend: Any, problem: Any) -> None:
    def fail() -> None:
        raise ZeroDivisionError("a secret of the inside")

    pretend.work = fail
    response = client.post("/infer", files={"mesh": MESH})
    problem(response, 500, "internal_error")
    assert "secret" not in response.text
    assert "Traceback" not in response.text
    for name, value in {**HEADERS, "Cache-Control": "no-store"}.items():
        assert response.headers.get_list(name) == [value]


@pytest.mark.parametrize("name", ["x.html", "x.svg", "x.js", "x.xml"])
def test_an_upload_comes_back_as_nothing_that_a_browser_runs(
    client: httpx.Client, name: str
) -> None:
    files = {"mesh": (name, b"<script>alert(1)</script>", "text/html")}
    kept = client.post("/infer", files=files).json()["mesh_id"]
    response = client.get(f"/meshes/{kept}")
    assert response.headers["content-type"] == "application/octet-stream"
    assert response.headers["content-disposition"].startswith("attachment")
    assert response.headers["x-content-type-options"] == "nosniff"
