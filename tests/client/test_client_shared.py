"""Large meshes, and those that many calls share."""

from __future__ import annotations

import asyncio
import io
import threading
import tracemalloc
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest
from client_app import URL, Script, refused

from service.client import AsyncShapeClient, Mesh, Retry, ShapeClient
from service.client.multipart import Multipart

LARGE = 64 << 20
PLENTY = 4 << 20
KNOWN = "sha256-" + "0" * 64


class Answer(httpx.SyncByteStream, httpx.AsyncByteStream):
    """A large body, a piece at a time."""

    def __iter__(self) -> Iterator[bytes]:
        for _ in range(LARGE >> 16):
            yield bytes(1 << 16)

    async def __aiter__(self) -> AsyncIterator[bytes]:
        for piece in self:
            yield piece


class Swallow(httpx.BaseTransport, httpx.AsyncBaseTransport):
    """Takes a body as it comes, holds nothing of it, and answers a large file."""

    taken = 0

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        assert isinstance(request.stream, httpx.SyncByteStream)
        for chunk in request.stream:
            self.taken += len(chunk)
        return httpx.Response(200, stream=Answer())

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        assert isinstance(request.stream, httpx.AsyncByteStream)
        async for chunk in request.stream:
            self.taken += len(chunk)
        return httpx.Response(200, stream=Answer())


def blocking(transport: Swallow, source: Path, to: Path) -> None:
    with ShapeClient(URL, transport=transport) as client:
        client.edit(source, {"seat_width": 0.5}, to=to)


def awaiting(transport: Swallow, source: Path, to: Path) -> None:
    async def edit() -> None:
        async with AsyncShapeClient(URL, transport=transport) as client:
            await client.edit(source, {"seat_width": 0.5}, to=to)

    asyncio.run(edit())


@pytest.mark.parametrize("edit", [blocking, awaiting])
def test_a_large_file_passes_in_bounded_memory(
    edit: Callable[[Swallow, Path, Path], None], tmp_path: Path
) -> None:
    source = tmp_path / "large.obj"
    with source.open("wb") as file:
        file.truncate(LARGE)
    transport = Swallow()
    tracemalloc.start()
    try:
        edit(transport, source, tmp_path / "edited.obj")
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert transport.taken > LARGE
    assert (tmp_path / "edited.obj").stat().st_size == LARGE
    assert peak < PLENTY


@pytest.mark.parametrize("of", ["path", "bytes", "file"])
def test_two_calls_may_send_a_mesh_at_the_same_time(of: str, tmp_path: Path) -> None:
    data = bytes(range(256)) * 2048
    path = tmp_path / "a.obj"
    path.write_bytes(data)
    with path.open("rb") as file:
        source: dict[str, Any] = {"path": path, "bytes": data, "file": file}
        mesh = Mesh(source[of])
        bodies = [b"", b""]
        forms = [Multipart([], [("mesh", mesh)]) for _ in bodies]
        for chunks in zip(*forms, strict=True):  # by turns
            bodies = [body + chunk for body, chunk in zip(bodies, chunks, strict=True)]
    for form, body in zip(forms, bodies, strict=True):
        assert len(body) == form.length
        assert body.split(b"\r\n\r\n", 1)[1].startswith(data)


def test_threads_that_share_a_dropped_mesh_all_send_it_again() -> None:
    threads = 4
    together = threading.Barrier(threads)
    wholes: list[bytes] = []

    def answer(request: httpx.Request) -> httpx.Response:
        body = request.read()
        if KNOWN.encode() in body:
            together.wait(20)  # all have named it before one hears that it is gone
            return refused(404, "mesh_id_unknown")
        wholes.append(body)
        return httpx.Response(200, content=b"edited")

    mesh = Mesh(io.BytesIO(b"solid"), "a.stl")
    transport = httpx.MockTransport(answer)
    with ShapeClient(URL, transport=transport, retries=Retry(attempts=1)) as client:
        for _ in range(2):
            mesh.remember(KNOWN)
            with ThreadPoolExecutor(threads) as pool:
                running = [pool.submit(client.edit, mesh, {"width": 1.0}) for _ in range(threads)]
            assert [run.result().data for run in running] == [b"edited"] * threads
    assert len(wholes) == 2 * threads
    assert all(b"\r\n\r\nsolid\r\n" in body for body in wholes)
    # Dropped twice, not eight times: it is still worth naming.
    mesh.remember(KNOWN)
    assert mesh.mesh_id == KNOWN


def test_a_service_that_keeps_nothing_is_sent_all(tmp_path: Path) -> None:
    mesh = Mesh(b"solid")
    for _ in range(3):
        mesh.remember(KNOWN)
        mesh.forget(KNOWN)
    mesh.remember(KNOWN)
    assert mesh.mesh_id is None


def test_a_file_that_changes_while_it_is_read_is_not_named(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0")
    mesh = Mesh(path)

    def answer(request: httpx.Request) -> httpx.Response:
        path.write_text("v 0 0 0 and more")
        return refused(422, "empty_mesh")

    with pytest.raises(Exception, match="empty_mesh"):
        Script(answer).client().infer(mesh)
    mesh.remember(KNOWN)  # what was sent has this id, not what now lies there
    assert mesh.mesh_id is None


def test_a_file_is_named_by_what_was_sent_last(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0")
    mesh = Mesh(path)
    path.write_text("v 0 0 0 and more")
    with pytest.raises(Exception, match="empty_mesh"):
        Script(refused(422, "empty_mesh")).client().infer(mesh)
    mesh.remember(KNOWN)
    assert mesh.mesh_id == KNOWN


def test_a_file_that_shrinks_is_an_error_of_files(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_bytes(bytes(1 << 20))
    mesh = Mesh(path)
    form = iter(Multipart([], [("mesh", mesh)]))
    next(form)
    path.write_bytes(b"")
    with pytest.raises(OSError, match=r"'a\.obj' has become shorter"):
        list(form)
