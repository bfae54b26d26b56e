from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from cli_runs import Run

import service.__main__

PROGRAM = Path(sys.executable).with_name("shape-edit")


def test_options_are_those_of_the_service(shape_edit: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def main(arguments: list[str], program: str) -> int:
        calls.append((arguments, program))
        return 2

    monkeypatch.setattr(service.__main__, "main", main)
    assert shape_edit("serve", "--host", "::1", "--port", "9").exit_code == 2
    assert shape_edit("serve").exit_code == 2
    assert calls == [
        (["--host", "::1", "--port", "9"], "shape-edit serve"),
        ([], "shape-edit serve"),
    ]


def test_it_serves_until_it_is_told_to_end() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    environment = {**os.environ, "CATEGORIES": "debug", "DRAIN_SECONDS": "0"}
    line = [PROGRAM, "serve", "--port", str(port)]
    with subprocess.Popen(line, env=environment, stderr=subprocess.PIPE) as process:
        transport = httpx.HTTPTransport(retries=50)
        with httpx.Client(transport=transport, trust_env=False, timeout=60) as client:
            assert client.get(f"http://127.0.0.1:{port}/livez").json() == {"status": "alive"}
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
    assert process.returncode == 0
