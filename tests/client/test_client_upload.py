from __future__ import annotations

import io
from pathlib import Path

import httpx
import pytest
from client_app import Script, refused

from service.client import AnswerMalformed, Mesh, MeshUnknown, ShapeClient

UNKNOWN = "sha256-" + "0" * 64


@pytest.fixture
def client(service_client: httpx.Client) -> ShapeClient:
    return ShapeClient(http=service_client)


@pytest.mark.parametrize("form", ["path", "bytes", "file", "stream"])
def test_whatever_holds_a_mesh_is_sent(
    form: str, client: ShapeClient, chair_glb: bytes, tmp_path: Path
) -> None:
    path = tmp_path / 'a "chair" é.glb'
    path.write_bytes(chair_glb)
    stream = io.BytesIO(chair_glb)
    stream.seekable = lambda: False  # type: ignore[method-assign]
    given = {"path": path, "bytes": chair_glb, "file": io.BytesIO(chair_glb), "stream": stream}
    done: list[tuple[int, int | None]] = []
    client.infer(given[form], category="chair", progress=lambda *at: done.append(at))  # type: ignore[arg-type]
    assert done[-1][0] == done[-1][1]
    assert done == sorted(done)


def test_a_dropped_mesh_is_sent_again(client: ShapeClient, chair_glb: bytes) -> None:
    mesh = Mesh(chair_glb)
    mesh.remember(UNKNOWN)
    assert client.infer(mesh, category="chair").mesh_id == mesh.mesh_id != UNKNOWN


def test_it_is_sent_again_but_once() -> None:
    script = Script(*[refused(404, "mesh_id_unknown")] * 2)
    mesh = Mesh(b"solid")
    mesh.remember(UNKNOWN)
    with pytest.raises(MeshUnknown):
        script.client().infer(mesh)
    named, whole = (request.content for request in script.requests)
    assert UNKNOWN.encode() in named
    assert b"solid" not in named
    assert b"solid" in whole


def test_an_id_alone_can_not_be(client: ShapeClient) -> None:
    with pytest.raises(MeshUnknown):
        client.infer(UNKNOWN)


def test_a_retry_sends_all_of_it_again() -> None:
    report = refused(422, "mesh_empty")
    script = Script(httpx.ReadError("dropped"), report)
    file = io.BytesIO(b"xxsolid")
    file.seek(2)
    with pytest.raises(Exception, match="mesh_empty"):
        script.client().infer(file)
    first, second = script.requests
    for request in (first, second):
        assert b"\r\n\r\nsolid\r\n" in request.content
        assert int(request.headers["content-length"]) == len(request.content)


def test_a_file_that_changed_is_not_named_by_its_old_id(tmp_path: Path) -> None:
    path = tmp_path / "chair.obj"
    path.write_text("v 0 0 0")
    mesh = Mesh(path)
    mesh.remember(UNKNOWN)
    path.write_text("v 0 0 0 and more")
    assert mesh.mesh_id is None


def test_a_download_appears_whole_or_not_at_all(
    client: ShapeClient, chair_glb: bytes, tmp_path: Path
) -> None:
    mesh_id = client.infer(chair_glb, category="chair").mesh_id
    done: list[tuple[int, int | None]] = []
    place = tmp_path / "chair.glb"
    file = client.mesh(mesh_id, to=place, download_progress=lambda *at: done.append(at))
    assert place.read_bytes() == file.data == chair_glb
    assert done[-1] == (len(chair_glb), len(chair_glb))

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(AnswerMalformed, match=r"with status 200 .* 'Log in first'"):
        Script(httpx.Response(200, html="Log in first")).client().mesh(mesh_id, to=tmp_path / "p")
    with pytest.raises(KeyboardInterrupt):
        client.mesh(mesh_id, to=tmp_path / "other.glb", download_progress=stop)
    assert list(tmp_path.iterdir()) == [place]
