from __future__ import annotations

import httpx
import pytest


@pytest.mark.parametrize("path", ["/livez", "/readyz", "/categories", "/nowhere"])
def test_head_answers_what_get_would_but_for_the_body(client: httpx.Client, path: str) -> None:
    get, head = client.get(path), client.head(path)
    assert (head.status_code, head.content) == (get.status_code, b"")
    assert head.headers["content-type"] == get.headers["content-type"]
    assert head.headers["content-length"] == str(len(get.content))


def test_a_mesh_can_be_asked_after(client: httpx.Client) -> None:
    mesh_id = client.post("/infer", files={"mesh": ("a.obj", b"abc")}).json()["mesh_id"]
    head = client.head(f"/meshes/{mesh_id}")
    assert head.headers["etag"] == f'"{mesh_id}"'
    assert (head.headers["content-length"], head.content) == ("3", b"")
