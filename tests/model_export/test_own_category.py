"""A category of one's own from its first command to its first edit, in miniature."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
import trimesh

from model_export import check, discriminate, export, new, train

NAME = "night_stand"


def call(main: Any, *arguments: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["command", *arguments])
        main()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder that was empty before the documented commands ran in it, with next to no steps."""
    folder = tmp_path_factory.mktemp("own")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        file = f"{NAME}.yaml"
        call(new.main, NAME)
        assert check.main([file, "--mesh", "mine.glb"]) == 0
        text = Path(file).read_text("utf-8")
        Path(file).write_text(text.replace("points: 2048", "points: 512"), "utf-8")
        # Few shapes for the discriminator to learn and be measured on.
        heaps, samples = discriminate.heaps, discriminate.synthetic_samples
        patch.setattr(discriminate, "heaps", lambda count, *rest: heaps(10, *rest))
        patch.setattr(discriminate, "synthetic_samples", lambda model, count: samples(model, 3))
        call(train.main, file, "--quick", "--steps", "1", "--device", "cpu")
        sizes = ["--refit", "100", "--count", "2", "--steps", "2"]
        call(export.main, NAME, "--out", "models", "--quick", *sizes)
        yield folder


def test_a_model_is_its_card_its_networks_and_its_template(folder: Path) -> None:
    names = {path.name for path in (folder / "models").iterdir()}
    suffixes = (".json", ".onnx", ".discriminator.onnx", ".yaml")
    assert names == {NAME + suffix for suffix in suffixes}
    card = json.loads((folder / "models" / f"{NAME}.json").read_text("utf-8"))
    assert card["training"]["runs"][0]["config"]["template"] == f"{NAME}.yaml"
    assert card["data"]["realistic"]["train"] == 0
    assert str(folder) not in json.dumps(card)


def test_the_run_has_its_report(folder: Path) -> None:
    run = folder / "runs" / NAME
    assert "| encoder alone |" in (run / "report.md").read_text("utf-8")
    assert (run / "report.png").stat().st_size > 10_000


@pytest.fixture(scope="module")
def served(folder: Path) -> Iterator[tuple[httpx.Client, Path, subprocess.Popen[str]]]:
    """The service over a models folder that begins empty."""
    models = folder / "served"
    models.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-m", "service", "--port", "0"],
        env={**os.environ, "MODELS_DIR": str(models), "LOG_LEVEL": "info"},
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        line = next(line for line in process.stderr if "running on http" in line)
        address = line.split("running on ")[1].split()[0]
        with httpx.Client(base_url=address, timeout=60, trust_env=False) as client:
            yield client, models, process
    finally:
        process.terminate()
        process.communicate(timeout=30)


def reloaded(client: httpx.Client, process: subprocess.Popen[str], done: Any) -> None:
    """Hang up and wait for the outcome."""
    process.send_signal(signal.SIGHUP)
    for _ in range(200):
        if done(client.get("/readyz").json()):
            return
        time.sleep(0.05)
    pytest.fail("the models were not reloaded")


def test_it_is_served_edited_and_replaced_without_a_restart(folder: Path, served: Any) -> None:
    client, models, process = served
    names = [entry["name"] for entry in client.get("/categories").json()["categories"]]
    assert NAME not in names
    shutil.copytree(folder / "models", models, dirs_exist_ok=True)
    reloaded(client, process, lambda ready: NAME in ready["models"])
    entries = client.get("/categories").json()["categories"]
    assert sorted([*names, NAME]) == [entry["name"] for entry in entries]
    schemas = client.get("/openapi.json").json()["components"]["schemas"]
    assert NAME in schemas["EditForm"]["properties"]["category"]["enum"]

    mesh = (folder / "mine.glb").read_bytes()
    fields = {"category": NAME, "up": "+y", "front": "+z"}
    answer = client.post("/infer", data=fields, files={"mesh": ("mine.glb", mesh)})
    assert answer.status_code == 200, answer.text
    top = answer.json()["parameters"]["top_width"]
    assert top["value"] > 0
    assert top["unit"] == "m"
    edits = json.dumps({"total_width": {"scale": 1.25}})
    edited = client.post(
        "/edit", data={**fields, "edits": edits}, files={"mesh": ("mine.glb", mesh)}
    )
    assert edited.status_code == 200, edited.text
    before, after = (
        trimesh.load_mesh(trimesh.util.wrap_as_stream(data), file_type="glb")
        for data in (mesh, edited.content)
    )
    assert len(before.vertices) == len(after.vertices)
    # All but exact: so little training may take the table for a leaning one.
    assert after.extents[0] == pytest.approx(1.25 * before.extents[0], rel=0.02)

    # One that is spoilt is named, and what was there is served on.
    card = models / f"{NAME}.json"
    card.write_text(card.read_text("utf-8").replace('"sha256-', '"sha256-0'), "utf-8")
    reloaded(client, process, lambda ready: ready["faults"])
    (fault,) = client.get("/readyz").json()["faults"]
    assert fault["code"] == "template_digest"
    assert client.get(f"/categories/{NAME}").status_code == 200
    card.unlink()
    reloaded(client, process, lambda ready: NAME not in ready["models"])
    assert client.get(f"/categories/{NAME}").status_code == 404
