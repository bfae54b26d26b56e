"""The service, as a process of its own."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

PATIENCE_S = 60.0
"""For the models to load, in seconds."""

PAGE = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Service:
    """A running service; `log` is what it writes."""

    process: subprocess.Popen[bytes]
    port: int
    log: Path

    @property
    def rss(self) -> float:
        """Resident memory, in MiB."""
        pages = Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]
        return int(pages) * PAGE / 2**20


@contextmanager
def started(settings: Mapping[str, str]) -> Iterator[Service]:
    """The service with these settings, ready; it is stopped by SIGTERM in the end."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    environment = {**os.environ, "LOG_LEVEL": "warning", "DRAIN_SECONDS": "0", **settings}
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        with log.open("wb") as stream:
            process = subprocess.Popen(
                [sys.executable, "-m", "service", "--host", "127.0.0.1", "--port", str(port)],
                env=environment,
                stderr=stream,
            )
        service = Service(process, port, log)
        try:
            _await_ready(service)
            yield service
        finally:
            process.terminate()
            process.wait(60)
            if told := log.read_text():
                print(told[-4000:], file=sys.stderr)


def _await_ready(service: Service) -> None:
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end and service.process.poll() is None:
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{service.port}/readyz"):
                return
        except urllib.error.URLError:
            time.sleep(0.05)
    raise RuntimeError(f"the service did not get ready: {service.log.read_text()[-2000:]}")
