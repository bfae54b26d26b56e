from __future__ import annotations

import logging
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI, Request
from wire import until

from service import __main__
from service.api.auth import OPEN_PATHS
from service.api.keys import Entry, digest_of, new_key
from service.settings import Settings

MESH = ("chair.obj", b"abc", "model/obj")
ANN, BOB = new_key(), new_key()
ENTRIES = f"{Entry('ann', digest_of(ANN))},{Entry('bob', digest_of(BOB))}"


@pytest.fixture
def app(pretend_app: Callable[..., FastAPI]) -> FastAPI:
    """The service with two keys, and a call that tells whose it was."""
    app = pretend_app(api_keys=ENTRIES)

    @app.get("/whose")
    async def whose(request: Request) -> str:
        return request.state.owner

    return app


@pytest.fixture
def locked(app: FastAPI, serve: Any) -> httpx.Client:
    return serve(app)


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


@pytest.mark.parametrize(
    ("headers", "owner"),
    [
        (bearer(ANN), "ann"),
        (bearer(BOB), "bob"),
        ({"Authorization": f"bearer  {ANN}"}, "ann"),
        ({"X-API-Key": BOB}, "bob"),
        ({"Authorization": "Basic YTpi", "X-API-Key": BOB}, "bob"),
        ({"Authorization": f"Bearer {ANN}", "X-API-Key": BOB}, "ann"),
    ],
)
def test_a_key_names_its_owner(locked: httpx.Client, headers: dict[str, str], owner: str) -> None:
    assert locked.get("/whose", headers=headers).json() == owner


@pytest.mark.parametrize(
    ("headers", "code"),
    [
        ({}, "key_missing"),
        ({"Authorization": "Bearer"}, "key_missing"),
        ({"Authorization": "Basic YTpi"}, "key_missing"),
        ({"Authorization": ANN}, "key_missing"),
        ({"X-API-Key": ""}, "key_missing"),
        (bearer(ANN[:-1]), "key_unknown"),
        (bearer(digest_of(ANN)), "key_unknown"),
        (bearer("ann"), "key_unknown"),
        (bearer("x" * 20_000), "key_unknown"),
        ({"Authorization": b"Bearer \xff\xfe"}, "key_unknown"),
        ({"Authorization": "Bearer nobody's", "X-API-Key": ANN}, "key_unknown"),
    ],
)
def test_without_a_known_key_nothing_is_answered(
    locked: httpx.Client, pretend: Any, problem: Any, headers: dict[str, str], code: str
) -> None:
    for method, path in [("GET", "/whose"), ("GET", "/nowhere"), ("PUT", "/edit")]:
        problem(locked.request(method, path, headers=headers), 401, code)
    response = locked.post("/infer", headers=headers, files={"mesh": MESH})
    problem(response, 401, code)
    challenge = response.headers["www-authenticate"]
    assert challenge.startswith('Bearer realm="')
    assert ("invalid_token" in challenge) is (code == "key_unknown")
    assert not pretend.calls


def test_probes_and_pages_need_no_key(locked: httpx.Client) -> None:
    for path in [*sorted(OPEN_PATHS), "/web/js/app.js"]:
        for method in ("GET", "HEAD"):
            assert locked.request(method, path).status_code == 200, path


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/web", 401),
        ("/Livez", 401),
        ("/livez/", 401),
        ("//livez", 401),
        ("/livez%2f..", 401),
        ("/web%00/", 401),
        ("/docs/../whose", 401),
        # The way out of an open folder leads nowhere.
        ("/web/../whose", 404),
        ("/web/%2e%2e/whose", 404),
        ("/web/..%2fwhose", 404),
    ],
)
def test_a_path_that_only_looks_open(locked: httpx.Client, path: str, status: int) -> None:
    """Sent as it stands: clients tidy paths up."""
    address = (locked.base_url.host, locked.base_url.port)
    with socket.create_connection(address, timeout=10) as connection:
        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        assert connection.recv(12) == f"HTTP/1.1 {status}".encode()


def test_the_refusal_comes_before_the_body(locked: httpx.Client) -> None:
    address = (locked.base_url.host, locked.base_url.port)
    with socket.create_connection(address, timeout=10) as connection:
        connection.sendall(
            b"POST /infer HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000\r\n"
            b"Content-Type: multipart/form-data; boundary=x\r\n\r\n"
        )
        assert connection.recv(12) == b"HTTP/1.1 401"


def test_without_keys_everyone_is_served(client: httpx.Client) -> None:
    for headers in ({}, bearer("anything")):
        response = client.post("/infer", headers=headers, files={"mesh": MESH})
        assert response.status_code == 200


def test_keys_are_not_logged(locked: httpx.Client, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    locked.get("/whose", headers=bearer(ANN))
    locked.get("/whose", headers={"X-API-Key": "sp_unknown"})
    ours = [record for record in caplog.records if not record.name.startswith("httpcore")]
    text = "".join(record.getMessage() for record in ours)
    assert ANN not in text
    assert "sp_unknown" not in text
    assert digest_of(ANN) not in text


def test_settings_that_make_no_sense_end_the_command(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    slip = tmp_path / "keys"
    slip.write_text("sp_a-key-in-plain\n")
    monkeypatch.setenv("API_KEYS_FILE", str(slip))
    assert __main__.main([]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert f"API_KEYS_FILE {slip}, line 1: is not NAME:SHA256" in told
    assert "sp_" not in told


def test_the_settings_do_not_show_their_keys() -> None:
    assert digest_of(ANN) not in repr(Settings(api_keys=ENTRIES))


def test_a_hangup_changes_who_is_served(tmp_path: Path) -> None:
    """In a process of its own: a hangup goes to the whole of it."""
    file, log = tmp_path / "keys", tmp_path / "log"
    file.write_text(f"{Entry('ann', digest_of(ANN))}\n")
    environment = {
        **os.environ,
        "API_KEYS_FILE": str(file),
        "CATEGORIES": "debug",
        "HOST": "127.0.0.1",
        "PORT": "0",
    }
    with log.open("wb") as written:
        process = subprocess.Popen(
            [sys.executable, "-m", "service"], env=environment, stderr=written
        )
    try:
        running = re.compile(r"running on (http://[\d.:]+)")
        until(lambda: running.search(log.read_text()) is not None)
        url = running.search(log.read_text())[1]  # type: ignore[index]
        with httpx.Client(base_url=url, trust_env=False, timeout=30) as client:

            def status(key: str) -> int:
                return client.get("/nowhere", headers=bearer(key)).status_code

            assert (status(ANN), status(BOB)) == (404, 401)
            file.write_text(f"{Entry('bob', digest_of(BOB))}\n")
            process.send_signal(signal.SIGHUP)
            until(lambda: status(BOB) == 404)
            assert status(ANN) == 401
    finally:
        process.terminate()
        process.wait(timeout=30)
    assert "sp_" not in log.read_text()
