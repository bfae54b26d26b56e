from __future__ import annotations

import asyncio
import socket
from pathlib import Path

import httpx
import pytest

from service.mesh.off import OffFile

from .storm import damaged, main, serving, through_client, through_readers


def test_files_are_the_same_again() -> None:
    one = list(damaged("off", 20, None, 3))
    assert one == list(damaged("off", 20, None, 3))
    assert one[:5] == list(damaged("off", 5, None, 3))
    assert one != list(damaged("off", 20, None, 4))
    assert len(set(one)) > 15


def test_a_small_storm_passes_on_every_way(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    numbers = ["--files", "100", "--requests", "12", "--live", "4", "--port", str(port)]
    assert main(["ply", "--keep", str(tmp_path / "failed"), *numbers]) == 0
    told = capsys.readouterr().out
    for line in ("ply, readers: 100 files", "ply, app: 12 files", "ply, live server: 4 files"):
        assert line in told
    assert "200 " in told
    assert not (tmp_path / "failed").exists()


def test_a_port_that_is_taken_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        with pytest.raises(RuntimeError, match=f"port {port} taken"), serving(port):
            pass


def test_what_fails_is_told_and_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def crash(*_: object) -> bytes:
        raise IndexError("seven")

    monkeypatch.setattr(OffFile, "write", crash)
    only = ["--requests", "0", "--live", "0", "--files", "60", "--keep", str(tmp_path)]
    assert main(["off", *only]) == 1
    assert "IndexError: seven" in capsys.readouterr().out
    assert list((tmp_path / "off" / "readers").iterdir())
    tally = through_readers("off", iter([b""]), tmp_path)
    assert (tally.answers, tally.failures) == ({"malformed_off": 1}, {})


@pytest.mark.parametrize(
    ("status", "kind", "fails"),
    [
        (200, "model/obj", False),
        (422, "application/problem+json", False),
        (422, "application/json", True),
        (500, "application/problem+json", True),
        (503, "text/plain", True),
    ],
)
def test_only_answers_and_problems_of_the_client_are_fine(
    tmp_path: Path, status: int, kind: str, fails: bool
) -> None:
    async def send() -> bool:
        def answer(request: httpx.Request) -> httpx.Response:
            return httpx.Response(status, headers={"content-type": kind}, text='{"code": "c"}')

        transport = httpx.MockTransport(answer)
        async with httpx.AsyncClient(transport=transport, base_url="http://x") as client:
            tally, memory = await through_client(client, "off", iter([b"", b""]), tmp_path)
        assert len(memory) == 2
        return bool(tally.failures)

    assert asyncio.run(send()) is fails
