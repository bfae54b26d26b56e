"""The real service in a process of its own, for tests of how it ends and of what outlives it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

Served = tuple[subprocess.Popen[bytes], httpx.Client]


@contextmanager
def running(log: Path, **environment: str) -> Iterator[Served]:
    """The service on a free port, and a client of it; killed at the end.

    Args:
        log: file for its log.
        environment: settings beside those of the tests; it does not drain.
    """
    command = [sys.executable, "-m", "service", "--host", "127.0.0.1", "--port", "0"]
    settings = {**os.environ, "DRAIN_SECONDS": "0", **environment}
    with log.open("wb") as errors:
        process = subprocess.Popen(command, env=settings, stderr=errors)
    try:
        until = time.monotonic() + 60
        while not (found := re.search(r"running on (http://[0-9.:]+)", log.read_text())):
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < until, log.read_text()
            time.sleep(0.05)
        with httpx.Client(base_url=found[1], timeout=60, trust_env=False) as client:
            yield process, client
    finally:
        process.kill()
        process.wait()
