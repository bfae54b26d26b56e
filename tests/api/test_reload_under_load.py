"""SIGHUP swaps a model back and forth while clients ask for it: none of them notices."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import onnx
import pytest
import trimesh
from onnx import helper

from model_export.debug_model import write_model
from service.encode.model import file_digest

WIDTH = 0.5
MESH = bytes(trimesh.creation.box((WIDTH, 1.0, 2.0)).export(file_type="glb"))
TIMES_AS_LARGE = {"1.1.0": 1, "1.2.0": 2}
"""What each version answers of a width."""
SWAPS, CLIENTS = 12, 4


def write_double(folder: Path, version: str) -> None:
    """A debug model that answers everything twice as large."""
    write_model(folder, version)
    path = folder / "debug.onnx"
    network = onnx.load(path)
    concat = network.graph.node[-1]
    network.graph.node.insert(5, helper.make_node("Add", ["extents", "extents"], ["double"]))
    network.graph.node[-1].input[0] = "double"
    assert concat.op_type == "Concat"
    onnx.save(network, path)
    card = json.loads((folder / "debug.json").read_text("utf-8"))
    golden = [2 * value for value in card["golden"][:3]] + card["golden"][3:]
    card |= {"digest": file_digest(path), "golden": golden}
    (folder / "debug.json").write_text(json.dumps(card), "utf-8")


def point(link: Path, folder: Path) -> None:
    """Let a link lead to another folder, in one step."""
    new = link.with_name(".new")
    new.symlink_to(folder)
    new.replace(link)


@pytest.fixture
def versions(tmp_path: Path) -> dict[str, Path]:
    """Both versions, outside of the folder that is served."""
    folders = {version: tmp_path / version for version in TIMES_AS_LARGE}
    for folder in folders.values():
        folder.mkdir()
    write_model(folders["1.1.0"], "1.1.0")
    write_double(folders["1.2.0"], "1.2.0")
    return folders


@pytest.fixture
def service(
    tmp_path: Path, versions: dict[str, Path]
) -> Iterator[tuple[subprocess.Popen[bytes], httpx.Client]]:
    """A process that serves the first, and a client of it."""
    (tmp_path / "models").mkdir()
    point(tmp_path / "models" / "current", versions["1.1.0"])
    environment = {
        **os.environ,
        "CATEGORIES": "none",
        "MODELS_DIR": str(tmp_path / "models"),
        "QUEUE": "64",
        "DRAIN_SECONDS": "0",
        "LOG_FORMAT": "text",
    }
    log = tmp_path / "log"
    with log.open("w") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "service", "--host", "127.0.0.1", "--port", "0"],
            env=environment,
            stderr=file,
        )
    try:
        while not (match := re.search(r"running on (http://127\.0\.0\.1:\d+)", log.read_text())):
            assert process.poll() is None, log.read_text()
            time.sleep(0.02)
        with httpx.Client(base_url=match[1], timeout=30, trust_env=False) as client:
            yield process, client
    finally:
        process.terminate()
        process.wait(timeout=30)


def ask(client: httpx.Client, stop: threading.Event, seen: list[dict[str, Any]]) -> None:
    """Infer and edit in turn until told to stop; whatever is no 200 is noted as it is."""
    while not stop.is_set():
        for path, form in (("/infer", {}), ("/edit", {"edits": '{"height": {"scale": 2}}'})):
            response = client.post(
                path,
                data={"category": "debug", **form},
                files={"mesh": ("box.glb", MESH)},
                headers={"Accept": "application/json"},
            )
            good = response.status_code == 200
            seen.append(response.json() if good else {"failed": response.text})


def test_no_request_fails_and_every_answer_is_of_one_version(
    service: tuple[subprocess.Popen[bytes], httpx.Client], versions: dict[str, Path], tmp_path: Path
) -> None:
    process, client = service
    seen: list[dict[str, Any]] = []
    stop = threading.Event()
    clients = [threading.Thread(target=ask, args=(client, stop, seen)) for _ in range(CLIENTS)]
    for thread in clients:
        thread.start()
    try:
        for swap in range(SWAPS):
            version = list(versions)[(swap + 1) % 2]
            point(tmp_path / "models" / "current", versions[version])
            process.send_signal(signal.SIGHUP)
            until = time.monotonic() + 60
            while client.get("/readyz").json()["models"]["debug"]["version"] != version:
                assert time.monotonic() < until, "the models were not reloaded"
                time.sleep(0.01)
            answered = len(seen)
            while len(seen) < answered + 2 * CLIENTS:
                assert time.monotonic() < until, "nothing is answered any more"
                time.sleep(0.01)
    finally:
        stop.set()
        for thread in clients:
            thread.join()
    assert [answer for answer in seen if "failed" in answer] == []
    digests = {v: file_digest(folder / "debug.onnx") for v, folder in versions.items()}
    assert {answer["model"]["version"] for answer in seen} == set(versions)
    for answer in seen:
        model, width = answer["model"], answer["parameters"]["width"]
        assert model["digest"] == digests[model["version"]]
        value = width["value"] if "value" in width else width["before"]
        assert value == pytest.approx(WIDTH * TIMES_AS_LARGE[model["version"]], rel=1e-4)
