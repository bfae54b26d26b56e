from __future__ import annotations

from typing import Any

import httpx


def test_a_kept_mesh_comes_back_byte_for_byte(client: httpx.Client) -> None:
    data = bytes(range(256))
    mesh_id = client.post("/infer", files={"mesh": ("стул.stl", data)}).json()["mesh_id"]
    response = client.get(f"/meshes/{mesh_id}")
    assert response.content == data
    assert response.headers["content-type"] == "model/stl"
    assert response.headers["etag"] == f'"{mesh_id}"'
    assert "immutable" in response.headers["cache-control"]
    assert "filename*=UTF-8''" in response.headers["content-disposition"]

    again = client.get(f"/meshes/{mesh_id}", headers={"if-none-match": response.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert "immutable" in again.headers["cache-control"]


def test_an_id_that_is_not_kept(client: httpx.Client, problem: Any) -> None:
    document = problem(client.get("/meshes/sha256-0"), 404, "mesh_id_unknown")
    assert "again" in document.suggestion
    form = {"mesh_id": "sha256-0"}
    problem(client.post("/infer", data=form), 404, "mesh_id_unknown")
    problem(client.post("/edit", data={**form, "edits": "{}"}), 404, "mesh_id_unknown")
