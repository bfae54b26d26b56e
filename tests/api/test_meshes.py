from __future__ import annotations

import errno
import os
import threading
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from service.api.keys import digest_of
from service.store.disk import Disk
from service.store.shared import Shared

MESH = ("a.obj", b"abc", "model/obj")
REPORT = {"accept": "application/json"}
EDITS = {"edits": '{"seat_width": 0.5}'}

MakeApp = Callable[..., FastAPI]
Serve = Callable[[FastAPI], httpx.Client]


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


@pytest.mark.parametrize("mesh_id", ["sha256-0", "sha256-" + "0" * 64, "x" * 3000, "...", "%2e%2e"])
def test_an_id_that_is_not_kept(client: httpx.Client, problem: Any, mesh_id: str) -> None:
    document = problem(client.get(f"/meshes/x{mesh_id}"), 404, "mesh_id_unknown")
    assert "again" in document.suggestion
    form = {"mesh_id": mesh_id}
    problem(client.post("/infer", data=form), 404, "mesh_id_unknown")
    problem(client.post("/edit", data={**form, **EDITS}), 404, "mesh_id_unknown")


@pytest.mark.parametrize("path", ["../../etc/passwd", "..%2f..%2fetc%2fpasswd", "a/b"])
def test_a_path_is_no_id(
    pretend_app: MakeApp, serve: Serve, problem: Any, tmp_path: Path, path: str
) -> None:
    client = serve(pretend_app(store_dir=tmp_path / "store"))
    answer = client.get(f"/meshes/{path}")
    problem(answer, 404, answer.json()["code"])
    problem(client.post("/infer", data={"mesh_id": path}), 404, "mesh_id_unknown")


def test_each_owner_knows_their_own_meshes_alone(
    pretend_app: MakeApp, serve: Serve, problem: Any, tmp_path: Path
) -> None:
    keys = ",".join(f"{name}:{digest_of(name + ' key')}" for name in ("ann", "bob"))
    # No memory: the disk tells them apart as well.
    for settings in ({"store_dir": tmp_path, "mesh_cache_bytes": 0}, {}):
        client = serve(pretend_app(api_keys=keys, **settings))
        ann, bob = ({"x-api-key": f"{name} key"} for name in ("ann", "bob"))
        mesh_id = client.post("/infer", files={"mesh": MESH}, headers=ann).json()["mesh_id"]
        assert client.get(f"/meshes/{mesh_id}", headers=ann).content == b"abc"
        problem(client.get(f"/meshes/{mesh_id}", headers=bob), 404, "mesh_id_unknown")
        held = {**bob, "if-none-match": f'"{mesh_id}"'}
        problem(client.get(f"/meshes/{mesh_id}", headers=held), 404, "mesh_id_unknown")
        form = {"mesh_id": mesh_id}
        problem(client.post("/infer", data=form, headers=bob), 404, "mesh_id_unknown")
        assert client.post("/infer", data=form, headers=ann).status_code == 200
        client.post("/infer", files={"mesh": ("b.stl", b"abc")}, headers=bob)
        assert (
            "b.stl" in client.get(f"/meshes/{mesh_id}", headers=bob).headers["content-disposition"]
        )
        assert (
            "a.obj" in client.get(f"/meshes/{mesh_id}", headers=ann).headers["content-disposition"]
        )


@pytest.mark.parametrize("kind", ["memory", "file"])
def test_replicas_share_what_they_keep(
    pretend_app: MakeApp, serve: Serve, problem: Any, tmp_path: Path, kind: str
) -> None:
    url = tmp_path.as_uri() if kind == "file" else f"memory://{uuid.uuid4().hex}"
    one, two = (serve(pretend_app(store_url=url)) for _ in range(2))
    alone = serve(pretend_app())
    report = one.post("/edit", files={"mesh": MESH}, data=EDITS, headers=REPORT).json()
    assert report["warnings"] == ["a warning"]
    assert two.get(f"/meshes/{report['mesh_id']}").content == b"abc edited"
    form = {"mesh_id": report["source_mesh_id"]}
    assert two.post("/infer", data=form).status_code == 200
    problem(alone.post("/infer", data=form), 404, "mesh_id_unknown")


def test_what_is_kept_is_there_after_a_restart(
    pretend_app: MakeApp, serving: Any, tmp_path: Path
) -> None:
    with serving(pretend_app(store_dir=tmp_path)) as client:
        answer = client.post("/infer", files={"mesh": MESH}).json()
    assert "warnings" not in answer
    with serving(pretend_app(store_dir=tmp_path)) as client:
        assert client.get(f"/meshes/{answer['mesh_id']}").content == b"abc"


def test_a_full_disk_fails_no_request_and_is_told_of(
    pretend_app: MakeApp, serve: Serve, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    app = pretend_app(store_dir=tmp_path)
    client = serve(app)

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        answer = client.post("/infer", files={"mesh": MESH})
        (warning,) = answer.json()["warnings"]
        assert "not be kept durably" in warning
        assert "etag" not in answer.headers
        report = client.post("/edit", files={"mesh": MESH}, data=EDITS, headers=REPORT).json()
        assert len(report["warnings"]) == 3
        assert client.get(f"/meshes/{report['mesh_id']}").content == b"abc edited"
        assert client.post("/edit", files={"mesh": MESH}, data=EDITS).status_code == 200
    assert app.state.context.store.disk.tally.write_failures == 3
    assert list(tmp_path.glob("*.*")) == [tmp_path / ".lock"]
    again = client.post("/infer", files={"mesh": MESH})
    assert "warnings" not in again.json()


def test_an_outage_of_the_shared_store_is_told_of(
    pretend_app: MakeApp, serve: Serve, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = serve(pretend_app(store_dir=tmp_path, store_url=f"memory://{uuid.uuid4().hex}"))
    monkeypatch.setattr(Shared, "put", lambda *_: False)
    monkeypatch.setattr(Shared, "get", lambda *_: None)
    (warning,) = client.post("/infer", files={"mesh": MESH}).json()["warnings"]
    assert "one server alone" in warning


def test_it_is_alive_while_a_disk_hangs(
    pretend_app: MakeApp, serve: Serve, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = serve(pretend_app(store_dir=tmp_path, mesh_cache_bytes=0))
    entered, release = threading.Event(), threading.Event()

    def hang(*_: Any) -> None:
        entered.set()
        release.wait(30)

    monkeypatch.setattr(Disk, "get", hang)
    answers = []
    url = "/meshes/sha256-" + "0" * 64
    reader = threading.Thread(target=lambda: answers.append(client.get(url).status_code))
    reader.start()
    try:
        assert entered.wait(20)
        assert client.get("/livez").status_code == 200
        assert answers == []
    finally:
        release.set()
        reader.join()
    assert answers == [404]


def test_nothing_is_kept_where_nothing_is_to_be(
    pretend_app: MakeApp, serve: Serve, problem: Any
) -> None:
    client = serve(pretend_app(mesh_cache_bytes=0))
    answer = client.post("/infer", files={"mesh": MESH})
    assert "warnings" not in answer.json()
    assert answer.headers["etag"]
    problem(client.get(f"/meshes/{answer.json()['mesh_id']}"), 404, "mesh_id_unknown")
    report = client.post("/edit", files={"mesh": MESH}, data=EDITS, headers=REPORT).json()
    assert "not kept here" in report["warnings"][-1]
