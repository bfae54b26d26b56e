"""The real service in a process of its own: what it writes, and what outlives it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
import trimesh
from own_process import Served, running

Start = Callable[[Path], Served]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    with ExitStack() as stack:
        yield lambda store: stack.enter_context(
            running(tmp_path / f"{time.monotonic_ns()}.log", STORE_DIR=str(store), QUEUE="9")
        )


@pytest.fixture(scope="module")
def chairs(box_chair: trimesh.Trimesh) -> list[bytes]:
    """Chairs of four sizes, as GLB files."""
    files = []
    for scale in (0.8, 0.9, 1.1, 1.2):
        chair = box_chair.copy()
        chair.apply_scale(scale)
        files.append(bytes(chair.export(file_type="glb")))
    return files


def test_what_was_acknowledged_outlives_a_kill(
    start: Start, chairs: list[bytes], tmp_path: Path
) -> None:
    store = tmp_path / "store"
    process, client = start(store)

    def infer(data: bytes) -> httpx.Response:
        return client.post("/infer", files={"mesh": ("chair.glb", data)})

    report = client.post(
        "/edit",
        files={"mesh": ("wide.glb", chairs[0])},
        data={"edits": '{"seat_width": {"scale": 1.1}}'},
        headers={"accept": "application/json"},
    ).json()
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(infer, chairs))
    os.kill(process.pid, signal.SIGKILL)
    kept = {answer.json()["mesh_id"]: data for answer, data in zip(answers, chairs, strict=True)}
    assert not any(answer.json()["warnings"] for answer in answers)
    process.wait()

    leftover = store / f"{'0' * 64}.{'1' * 16}.partial"
    leftover.write_bytes(b"half")
    _, client = start(store)
    for mesh_id, data in kept.items():
        answer = client.get(f"/meshes/{mesh_id}")
        assert answer.content == data
        assert "chair.glb" in answer.headers["content-disposition"]
    assert client.get(f"/meshes/{report['mesh_id']}").status_code == 200
    assert not leftover.exists()
    again = client.post("/infer", data={"mesh_id": answers[1].json()["mesh_id"]})
    assert again.json() == answers[1].json()
    # A tag that was given out before is good after.
    held = {"if-none-match": answers[1].headers["etag"]}
    same = client.post("/infer", files={"mesh": ("chair.glb", chairs[1])}, headers=held)
    assert same.status_code == 304


PROGRAM = """
import json, os, sys, threading, time

writes = []
CHANGES = ("os.mkdir", "os.remove", "os.rename", "os.link", "os.symlink", "os.truncate")


def note(event, arguments):
    if event == "open":
        path, mode, flags = arguments
        # What is opened by a descriptor has been noted as that was opened.
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) and not isinstance(path, int):
            writes.append(os.fsdecode(path))
    elif event in CHANGES:
        paths = [path for path in arguments[:2] if isinstance(path, (str, bytes, os.PathLike))]
        writes.extend(map(os.fsdecode, paths))


sys.dont_write_bytecode = True
import httpx, uvicorn
from service.main import create_app
from service.settings import Settings

chair = sys.stdin.buffer.read()
broken = b"glTF" + bytes(3_000_000)
sys.addaudithook(note)
server = uvicorn.Server(uvicorn.Config(create_app(Settings(workers=1)), port=0, log_config=None))
thread = threading.Thread(target=server.run)
thread.start()
while not server.started:
    time.sleep(0.01)
port = server.servers[0].sockets[0].getsockname()[1]
with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60, trust_env=False) as client:
    statuses = [
        client.post(
            path,
            files={"mesh": ("../../chair.glb", data)},
            data=fields,
            headers={"accept": "application/json"},
        ).status_code
        for path, data, fields in (
            ("/infer", chair, {}),
            ("/edit", chair, {"edits": '{"seat_width": {"scale": 1.1}}'}),
            ("/sliders", chair, {}),
            ("/infer", broken, {}),
        )
    ]
server.should_exit = True
thread.join()
print(json.dumps({"statuses": statuses, "writes": writes}))
"""


@pytest.mark.parametrize("kept", [True, False])
def test_nothing_is_written_but_to_the_store(
    tmp_path: Path, chairs: list[bytes], kept: bool
) -> None:
    store = tmp_path / "store"
    environment = {name: value for name, value in os.environ.items() if name != "STORE_DIR"}
    if kept:
        environment["STORE_DIR"] = str(store)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=chairs[0],
        env=environment,
        capture_output=True,
        timeout=120,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr.decode()
    told = json.loads(done.stdout)
    assert told["statuses"] == [200, 200, 200, 415]
    outside = [path for path in told["writes"] if not Path(path).is_relative_to(store)]
    assert outside == []
    assert (told["writes"] != []) is kept
    assert [path.name for path in tmp_path.iterdir()] == (["store"] if kept else [])
