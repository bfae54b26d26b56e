"""What only awaiting has: cancellation, and apps without a server."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import aclosing, asynccontextmanager, closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from client_app import Script, alive, job, refused, stream
from provoke import BOX

from service.client import AsyncShapeClient, Event, Mesh, MeshUnknown, ShapeClient, TooManyRequests
from service.main import create_app
from service.settings import Settings

BOXES = Settings(categories=("debug",), workers=1)


class Silent:
    """A server that sends what it is given to, and then nothing more.

    Attributes:
        asked, left: set when a request came, and when its connection is closed.
    """

    def __init__(self, begins: bytes) -> None:
        self.begins = begins
        self.asked, self.left = asyncio.Event(), asyncio.Event()

    async def __call__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(self.begins)
        self.asked.set()
        while await reader.read(1 << 16):
            pass
        self.left.set()
        writer.close()


@asynccontextmanager
async def silent(begins: bytes = b"") -> AsyncIterator[tuple[Silent, AsyncShapeClient]]:
    server = Silent(begins)
    listening = await asyncio.start_server(server, "127.0.0.1", 0)
    port = listening.sockets[0].getsockname()[1]
    async with listening, AsyncShapeClient(f"http://127.0.0.1:{port}") as client:
        yield server, client


async def cancelled(server: Silent, waiting: Awaitable[object]) -> None:
    """Cancel what waits; its connection is closed while its client is still open."""
    task = asyncio.ensure_future(waiting)
    await asyncio.wait_for(server.asked.wait(), 20)
    await asyncio.sleep(0.05)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    await asyncio.wait_for(server.left.wait(), 20)


HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: %s\r\nTransfer-Encoding: chunked\r\n\r\n"


def chunk(data: bytes) -> bytes:
    return b"%x\r\n%s\r\n" % (len(data), data)


def told(status: str) -> bytes:
    event = f"id: 1\nevent: status\ndata: {json.dumps(job(status))}\n\n"
    return HEAD % b"text/event-stream" + chunk(event.encode())


def test_a_cancelled_call_closes_its_connection() -> None:
    async def course() -> None:
        async with silent() as (server, client):
            await cancelled(server, client.infer(BOX))

    asyncio.run(course())


def test_a_cancelled_download_leaves_nothing(tmp_path: Path) -> None:
    async def course() -> None:
        async with silent(HEAD % b"model/gltf-binary" + chunk(b"glTF")) as (server, client):
            await cancelled(server, client.edit(BOX, {"width": 1.0}, to=tmp_path / "a.glb"))

    asyncio.run(course())
    assert list(tmp_path.iterdir()) == []


def test_cancelled_waiting_closes_its_connection() -> None:
    async def course() -> None:
        async with silent(told("running")) as (server, client):
            await cancelled(server, client.wait("job-1"))

    asyncio.run(course())


class Body(httpx.AsyncByteStream, httpx.SyncByteStream):
    """A job that goes on, and whether who hears of it has closed the answer."""

    closed = False

    def __iter__(self) -> Iterator[bytes]:
        yield stream((1, job("running"))).content
        yield b": so far\n\n"

    async def __aiter__(self) -> AsyncIterator[bytes]:
        for piece in self:
            yield piece

    def close(self) -> None:
        self.closed = True

    async def aclose(self) -> None:
        self.closed = True


def stop(*_: object) -> None:
    raise KeyError("enough")


def answering(body: Body) -> Script:
    return Script(httpx.Response(200, headers={"content-type": "text/event-stream"}, stream=body))


CALLS: dict[str, Callable[[Any], Any]] = {
    "waiting": lambda client: client.wait("job-1", stop),
    "downloading": lambda client: client.mesh("sha256-0", download_progress=stop),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_an_error_of_the_callers_closes_the_answer_at_once(call: Callable[[Any], Any]) -> None:
    async def course() -> bool:
        body = Body()
        async with answering(body).asynchronous() as client:
            with pytest.raises(KeyError):
                await call(client)
            return body.closed

    assert asyncio.run(course())
    body = Body()
    with answering(body).client() as client:
        with pytest.raises(KeyError) as caught:
            call(client)
        assert body.closed, caught.traceback  # whose frames hold on to all they had


def test_who_stops_listening_closes_the_connection() -> None:
    async def course() -> None:
        async with silent(told("running")) as (server, client):
            async with aclosing(client.events("job-1")) as events:
                async for event in events:
                    assert event.job.status == "running"
                    break
            await asyncio.wait_for(server.left.wait(), 20)

    asyncio.run(course())
    body = Body()
    with answering(body).client() as client:
        with closing(client.events("job-1")) as events:
            assert next(events).job.status == "running"
            assert not body.closed
        assert body.closed


def test_a_time_limit_of_asyncio_is_one() -> None:
    async def course() -> None:
        async with silent(told("running")) as (server, client):
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.2):
                    await client.wait("job-1")
            await asyncio.wait_for(server.left.wait(), 20)

    asyncio.run(course())


def test_calls_are_made_again_as_the_other_client_does() -> None:
    async def course(script: Script) -> str:
        async with script.asynchronous(base_s=1.0) as client:
            return (await client.alive()).status

    busy = refused(429, "overloaded", retry_after="3")
    script = Script(httpx.ConnectError("refused"), httpx.ReadTimeout("slow"), busy, alive())
    assert asyncio.run(course(script)) == "alive"
    assert script.slept == [0.5, 1.0, 3.5]


def test_a_dropped_mesh_is_sent_again_but_once() -> None:
    async def course(script: Script, mesh: Mesh) -> None:
        async with script.asynchronous() as client:
            await client.infer(mesh)

    script = Script(*[refused(404, "mesh_id_unknown")] * 2)
    mesh = Mesh(b"solid")
    mesh.remember("sha256-" + "0" * 64)
    with pytest.raises(MeshUnknown):
        asyncio.run(course(script, mesh))
    named, whole = (request.content for request in script.requests)
    assert b"solid" not in named
    assert b"solid" in whole


def test_events_go_on_where_they_broke_off() -> None:
    async def course(script: Script) -> list[Event]:
        async with script.asynchronous() as client:
            return [event async for event in client.events("job-1")]

    dropped = httpx.ReadError("dropped")
    full = refused(429, "streams_full", retry_after="1")
    polled = httpx.Response(200, json=job("running", 1), headers={"retry-after": "2"})
    begun, ended = stream((1, job("queued"))), stream((3, job("succeeded", 2)))
    script = Script(begun, dropped, full, polled, ended)
    events = asyncio.run(course(script))
    assert [(event.id, event.job.progress.done) for event in events] == [
        ("1", 0), (None, 1), ("3", 2)]  # fmt: skip
    assert script.requests[-1].headers["last-event-id"] == "1"
    with pytest.raises(TooManyRequests):
        asyncio.run(course(Script(*[refused(429, "overloaded")] * 5)))


Work = Callable[[AsyncShapeClient], Awaitable[None]]


def in_process(work: Work) -> None:
    """As the guide has it: the app's lifespan, and no server."""

    async def course() -> None:
        app = create_app(BOXES)
        async with app.router.lifespan_context(app):
            transport = httpx.ASGITransport(app)
            async with AsyncShapeClient("http://app", transport=transport) as client:
                await work(client)

    asyncio.run(course())


def test_an_app_in_this_process() -> None:
    async def work(client: AsyncShapeClient) -> None:
        await client.ready()
        mesh = Mesh(BOX, "box.glb")
        assert (await client.infer(mesh)).category == "debug"
        edited = await client.edit(mesh, {"width": {"scale": 1.2}})
        assert edited.parameters["width"] == pytest.approx(0.6, rel=1e-3)
        submitted = await client.submit_edit(mesh, [{"width": 0.7}])
        ended = await client.wait(submitted, timeout=20)
        assert (await client.result(ended)).manifest[0]["status"] == "ok"

    in_process(work)


@pytest.mark.filterwarnings("ignore:Using `httpx` with `starlette.testclient`")
def test_an_app_behind_a_testclient() -> None:
    from starlette.testclient import TestClient

    if not issubclass(TestClient, httpx.Client):
        pytest.skip("starlette's TestClient is not httpx's")
    with TestClient(create_app(BOXES)) as http:
        client = ShapeClient(http=http)
        mesh = Mesh(BOX, "box.glb")
        assert client.infer(mesh).category == "debug"
        assert client.edit(mesh, {"width": {"scale": 1.2}}).data[:4] == b"glTF"
        ended = client.wait(client.submit_augment(mesh, count=2), timeout=20)
        assert client.result(ended).data == client.augment(mesh, count=2).data
        client.close()
        assert not http.is_closed
