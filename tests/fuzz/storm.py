"""Thousands of damaged files: through the readers, through the app, and through a live server."""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import httpx

from service.main import create_app
from service.settings import Settings

from .corpus import formats, gathered
from .mutations import mutate
from .oracle import Broken, examine
from .tally import Tally, resident

PARAMETERS = ("seat_width", "leg_height", "back_height", "total_height", "leg_width")
START_S = 60
"""Seconds that a service may take to start."""
WARMING = 50
"""Requests before memory is first measured: caches fill."""
GROWTH = 300.0
"""MiB that a process may grow by after it is warm: its cache of meshes, and room to breathe."""


def damaged(format: str, count: int, folder: Path | None, seed: int) -> Iterator[bytes]:
    """`count` files, each the same for the same arguments and place."""
    sound = gathered(format, folder)
    for number in range(count):
        random = Random(f"{seed} {format} {number}")
        yield mutate(random.choice(sound), random, random.choice(sound))


def through_readers(format: str, files: Iterator[bytes], keep: Path) -> Tally:
    """What `oracle.examine` says of each."""
    tally = Tally()
    for number, data in enumerate(files):
        try:
            verdict = examine(data, format)
        except Exception as error:
            what = "" if isinstance(error, Broken) else f"{type(error).__name__}: "
            tally.fail(number, what + str(error)[:200], data, keep, format)
        else:
            tally.add(number, verdict.code or "read", verdict.seconds)
    return tally


async def through_client(
    client: httpx.AsyncClient,
    format: str,
    files: Iterator[bytes],
    keep: Path,
    pid: int | str = "self",
) -> tuple[Tally, list[float]]:
    """Infer and edit by turns; also memory of the process when warm, after 500 and at the end."""
    tally, memory = Tally(), [resident(pid)]
    for number, data in enumerate(files):
        if number in (WARMING, 500):
            memory.append(resident(pid))
        start = time.perf_counter()
        response = await _post(client, format, number, data)
        seconds = time.perf_counter() - start
        answer = str(response.status_code)
        if response.is_error:
            problem = response.headers["content-type"] == "application/problem+json"
            answer += " " + response.json()["code"] if problem else " no problem document"
        fine = response.is_success or (400 <= response.status_code < 500 and "no " not in answer)
        if fine:
            tally.add(number, answer, seconds)
        else:
            tally.fail(number, answer, data, keep, format)
    memory.append(resident(pid))
    if memory[-1] - memory[min(1, len(memory) - 1)] > GROWTH:
        tally.failures[-1] = f"memory grew: {memory}"
    return tally, memory


async def _post(client: httpx.AsyncClient, format: str, number: int, data: bytes) -> httpx.Response:
    """Every other file is edited, and for every other pair the service finds what is up."""
    fields = {"up": "+y", "front": "+z"} if number // 2 % 2 else {}
    files = {"mesh": (f"x.{format}", data)}
    if number % 2 == 0:
        return await client.post("/infer", files=files, data=fields)
    name = PARAMETERS[number // 4 % len(PARAMETERS)]
    fields["edits"] = f'{{"{name}": {{"scale": 1.2}}}}'
    return await client.post("/edit", files=files, data=fields)


@contextmanager
def serving(port: int) -> Iterator[int]:
    """The service as a process of its own on loopback, ready to answer: its number."""
    environment = os.environ | {"HOST": "127.0.0.1", "PORT": str(port), "LOG_LEVEL": "error"}
    process = subprocess.Popen([sys.executable, "-m", "service"], env=environment)
    try:
        with httpx.Client(trust_env=False) as client:
            for _ in range(START_S * 10):
                time.sleep(0.1)
                if process.poll() is not None:
                    raise RuntimeError(f"the service ended; is port {port} taken?")
                try:
                    if client.get(f"http://127.0.0.1:{port}/readyz").is_success:
                        break
                except httpx.TransportError:
                    continue
            else:
                raise RuntimeError(f"the service did not start on port {port}")
        yield process.pid
    finally:
        process.terminate()
        process.wait()


def storm(format: str, options: argparse.Namespace) -> bool:
    """Send one format's files all ways and tell of it; False if anything failed."""

    def files(count: int) -> Iterator[bytes]:
        return damaged(format, count, options.folder, options.seed)

    keep: Path = options.keep / format
    tallies = [through_readers(format, files(options.files), keep / "readers")]
    _tell(f"{format}, readers", tallies[0])
    if options.requests:
        tally, memory = asyncio.run(_app(format, files(options.requests), keep / "app"))
        tallies.append(tally)
        _tell(f"{format}, app", tally, memory)
    if options.live:
        tally, memory = asyncio.run(_live(format, files(options.live), keep / "live", options.port))
        tallies.append(tally)
        _tell(f"{format}, live server", tally, memory)
    return not any(tally.failures for tally in tallies)


async def _app(format: str, files: Iterator[bytes], keep: Path) -> tuple[Tally, list[float]]:
    app = httpx.ASGITransport(create_app(Settings(workers=1)), raise_app_exceptions=False)
    async with httpx.AsyncClient(transport=app, base_url="http://app") as client:
        return await through_client(client, format, files, keep)


async def _live(
    format: str, files: Iterator[bytes], keep: Path, port: int
) -> tuple[Tally, list[float]]:
    address = f"http://127.0.0.1:{port}"
    with serving(port) as pid:
        async with httpx.AsyncClient(base_url=address, timeout=120, trust_env=False) as client:
            return await through_client(client, format, files, keep, pid)


def _tell(what: str, tally: Tally, memory: list[float] | None = None) -> None:
    print(f"{what}: " + "\n  ".join(tally.lines()))
    if memory:
        print("  memory: " + ", ".join(f"{size:.0f}" for size in memory) + " MiB")
    sys.stdout.flush()


def main(arguments: list[str] | None = None) -> int:
    """The command line; 1 if anything failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.storm", description=__doc__)
    parser.add_argument("formats", nargs="*", metavar="FORMAT", help="by default all")
    parser.add_argument("--files", type=int, default=10_000, help="through the readers")
    parser.add_argument("--requests", type=int, default=1_000, help="through the app")
    parser.add_argument("--live", type=int, default=200, help="through a server on loopback")
    parser.add_argument("--folder", type=Path, help="of sound files; by default generated ones")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--port", type=int, default=8132, help="of the server on loopback")
    parser.add_argument("--keep", type=Path, default=Path("failed"), help="for files that fail")
    options = parser.parse_args(arguments)
    fine = [storm(format, options) for format in options.formats or formats()]
    return 0 if all(fine) else 1


if __name__ == "__main__":
    sys.exit(main())
