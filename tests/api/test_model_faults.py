"""Damaged models under a real service: what the probes say, and what is served all the same."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import anyio
import httpx
import pytest
import trimesh

from model_export.debug_model import write_model
from service import main
from service.main import create_app
from service.settings import Settings
from service.shipped import SHIPPED

BOX = {"mesh": ("box.glb", bytes(trimesh.creation.box((0.5, 1.0, 2.0)).export(file_type="glb")))}


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda folder: flip(folder / "debug.onnx"), "debug.onnx is sha256-"),
        (lambda folder: (folder / "debug.onnx").write_bytes(b""), "debug.onnx is sha256-"),
        (lambda folder: (folder / "debug.discriminator.onnx").unlink(), "is missing"),
        (lambda folder: (folder / "debug.json").write_text("{"), "debug.json can't be loaded"),
    ],
)
def test_a_bad_shipped_model_is_told_by_readiness_and_the_process_lives(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    serve: Any,
    problem: Any,
    spoil: Callable[[Path], Any],
    told: str,
) -> None:
    shutil.copytree(SHIPPED, tmp_path / "shipped", ignore=shutil.ignore_patterns("[!d]*"))
    spoil(tmp_path / "shipped")
    monkeypatch.setattr(main, "SHIPPED", tmp_path / "shipped")
    client: httpx.Client = serve(create_app(Settings(categories=("debug",))))
    problem(client.post("/infer", files=BOX), 503, "model_fault")
    document = problem(client.get("/readyz"), 503, "model_fault")
    assert told in document.detail
    assert str(tmp_path) not in document.detail
    assert "Install the service again" in document.suggestion
    assert client.get("/livez").status_code == 200
    assert client.get("/").status_code == 200


def test_a_bad_own_model_is_listed_and_the_others_are_served(tmp_path: Path, serve: Any) -> None:
    for version in ("2.0.0", "3.0.0"):
        (tmp_path / version).mkdir()
        write_model(tmp_path / version, version)
    flip(tmp_path / "3.0.0" / "debug.onnx")
    settings = Settings(categories=("debug",), models_dir=tmp_path)
    client: httpx.Client = serve(create_app(settings))
    assert client.post("/infer", files=BOX).json()["model"]["version"] == "2.0.0"
    ready = client.get("/readyz")
    assert ready.status_code == 200
    (fault,) = ready.json()["faults"]
    assert fault["code"] == "model_digest"
    assert fault["detail"].startswith("in '3.0.0': debug.onnx is sha256-")


def test_a_reload_with_a_damaged_file_keeps_what_was_served(tmp_path: Path, serve: Any) -> None:
    write_model(tmp_path, "2.0.0")
    app = create_app(Settings(categories=("debug",), models_dir=tmp_path))
    client: httpx.Client = serve(app)
    assert client.post("/infer", files=BOX).json()["model"]["version"] == "2.0.0"
    write_model(tmp_path, "3.0.0")
    flip(tmp_path / "debug.onnx")
    anyio.run(app.state.context.readiness.reload)
    assert client.post("/infer", files=BOX).json()["model"]["version"] == "2.0.0"
    assert [fault["code"] for fault in client.get("/readyz").json()["faults"]] == ["model_digest"]
    flip(tmp_path / "debug.onnx")
    anyio.run(app.state.context.readiness.reload)
    assert client.post("/infer", files=BOX).json()["model"]["version"] == "3.0.0"
    assert client.get("/readyz").json()["faults"] == []
