"""The real service in a process of its own: jobs that outlive it, and that several share."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import pytest
from own_process import Served, running

Start = Callable[[], Served]

MANY = [{"seat_width": {"scale": 1 + index / 1000}} for index in range(300)]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    with ExitStack() as stack:
        yield lambda: stack.enter_context(
            running(tmp_path / f"{time.monotonic_ns()}.log", JOBS_DIR=str(tmp_path / "jobs"))
        )


def submit(client: httpx.Client, mesh: bytes, variants: Any = MANY) -> dict[str, Any]:
    answer = client.post(
        "/edit",
        files={"mesh": ("chair.glb", mesh)},
        data={"variants": json.dumps(variants), "category": "chair"},
        headers={"Prefer": "respond-async"},
    )
    assert answer.status_code == 202, answer.text
    job: dict[str, Any] = answer.json()
    return job


def until(client: httpx.Client, job: dict[str, Any], status: str, done: int = 0) -> dict[str, Any]:
    end = time.monotonic() + 90
    while job["status"] != status or job["progress"]["done"] < done:
        assert time.monotonic() < end, job
        time.sleep(0.02)
        job = client.get(f"/jobs/{job['id']}").json()
    return job


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_a_job_goes_on_where_it_was(start: Start, chair_glb: bytes, end: int) -> None:
    process, client = start()
    job = until(client, submit(client, chair_glb), "running", done=5)
    assert job["durable"] is True
    os.kill(process.pid, end)
    process.wait(30)
    _, client = start()
    again = client.get(f"/jobs/{job['id']}").json()
    assert again["status"] == "running"
    assert again["progress"]["done"] >= job["progress"]["done"]
    until(client, again, "succeeded", done=len(MANY))
    at_once = client.post(
        "/edit",
        files={"mesh": ("chair.glb", chair_glb)},
        data={"variants": json.dumps(MANY), "category": "chair"},
    )
    assert client.get(f"/jobs/{job['id']}/result").content == at_once.content


def test_two_services_share_the_work(start: Start, chair_glb: bytes) -> None:
    (one, first), (_, second) = start(), start()
    jobs = [submit(first, chair_glb, MANY[index:100]) for index in range(2)]
    for job in jobs:
        until(second, job, "running", done=1)
    assert {job["id"] for job in second.get("/jobs").json()["jobs"]} == {j["id"] for j in jobs}
    with second.stream("GET", f"/jobs/{jobs[0]['id']}/events") as events:
        told = [line for line in events.iter_lines() if line.startswith("data: ")]
    assert json.loads(told[-1].removeprefix("data: "))["status"] == "succeeded"
    one.terminate()
    one.wait(30)
    for job in jobs:
        until(second, job, "succeeded")
        assert second.get(f"/jobs/{job['id']}/result").status_code == 200


def test_a_stream_holds_up_no_end(start: Start, chair_glb: bytes) -> None:
    process, client = start()
    job = submit(client, chair_glb)
    with client.stream("GET", f"/jobs/{job['id']}/events") as answer:
        lines = answer.iter_lines()
        assert next(line for line in lines if line.startswith("data: "))
        process.terminate()
        for _ in lines:
            pass
    assert process.wait(10) == 0
