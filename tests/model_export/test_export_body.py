from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from model_export import export_body
from model_export.bodyconfig import BodyConfig
from model_export.bodynet import BodyEncoder
from model_export.export import TOLERANCE, check_onnx
from model_export.meshnet import MeshNet
from model_export.realistic import find_shapes
from model_export.train_body import BodyTrainer
from service.encode.basemodel import file_digest
from service.encode.bodymodel import BodyModel
from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.meshencoder import MESH_SUFFIX
from service.encode.model import SHIPPED, load_model
from service.errors import ModelFault
from service.template.skinned import SkinnedTemplate

POINTS = 200


@pytest.fixture(scope="module")
def state(human: SkinnedTemplate) -> dict[str, Any]:
    """The checkpoint of a run of two steps."""
    config = BodyConfig(
        steps=4, batch=2, points=POINTS, width=16, depth=1, neighbours=6, precision="fp32"
    )
    trainer = BodyTrainer(config, human, None)
    for _ in range(2):
        trainer.train_step()
    trainer.seconds = 7200.0
    return trainer.state()


@pytest.fixture(scope="module")
def network(state: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("onnx") / "human.onnx"
    export_body.write_onnx(export_body.load_encoder(state), POINTS, path)
    return path


def test_the_exported_network_answers_like_the_trained_one(
    state: dict[str, Any], network: Path
) -> None:
    encoder = export_body.load_encoder(state)
    rng = np.random.default_rng(0)
    clouds = [0.3 * rng.standard_normal((POINTS, 3)) for _ in range(4)]
    assert check_onnx(encoder, network, clouds) < TOLERANCE
    with torch.no_grad():
        encoder.vote.bias.add_(0.01)
    with pytest.raises(ValueError, match="differs"):
        check_onnx(encoder, network, clouds)


def test_what_is_exported_can_be_served(
    human: SkinnedTemplate, state: dict[str, Any], network: Path, tmp_path: Path
) -> None:
    path = tmp_path / "human.onnx"
    shutil.copyfile(network, path)
    second = path.with_suffix(DISCRIMINATOR_SUFFIX)
    shutil.copyfile((SHIPPED / "human.onnx").with_suffix(DISCRIMINATOR_SUFFIX), second)
    card = export_body.build_card(human, state, path, "9.9.9")
    card["discriminator"] = {"digest": file_digest(second)}
    card["calibration"] = {"limit_distance": 0.01, "limit_odds": 0.0}
    path.with_suffix(".json").write_text(json.dumps(card))
    model = load_model(path.with_suffix(".json"))
    assert isinstance(model, BodyModel)
    model.verify()
    assert (model.name, model.version) == ("human", "9.9.9")
    assert not model.other_body
    assert card["training"]["hours"] == 2.0
    assert card["training"]["runs"][0]["place"] == state["place"]
    path.write_bytes((SHIPPED / "human.onnx").read_bytes())
    with pytest.raises(ModelFault, match="its card says"):
        load_model(path.with_suffix(".json")).verify()


def test_a_mesh_encoder_is_exported_with_its_body_only(
    human: SkinnedTemplate, tmp_path: Path
) -> None:
    middles = np.arange(0, 60, 20)
    network = MeshNet(human.faces, len(human.rest), middles)
    state = {
        "network": network.state_dict(), "middles": middles.tolist(), "template": human.digest,
        "step": 5, "batch": 2, "seconds": 360.0, "place": "CPU, 1 thread",
    }  # fmt: skip
    (tmp_path / "run").mkdir()
    torch.save(state, tmp_path / "run" / "checkpoint.pt")
    entry = export_body.export_mesh(tmp_path / "run", human, tmp_path / "human.onnx")
    assert entry["digest"] == file_digest(tmp_path / f"human{MESH_SUFFIX}")
    assert (entry["steps"], entry["hours"]) == (5, 0.1)
    with pytest.raises(ValueError, match="another body"):
        export_body.export_mesh(
            tmp_path / "run", replace(human, digest="sha256-0"), tmp_path / "human.onnx"
        )


def test_the_shipped_model_is_measured(human: SkinnedTemplate, tmp_path: Path) -> None:
    model = load_model(SHIPPED / "human.json")
    assert isinstance(model, BodyModel)
    (tmp_path / "rest.obj").write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in human.rest.tolist())
        + "".join(f"f {a} {b} {c}\n" for a, b, c in (human.faces + 1).tolist())
    )
    row = {
        "id": "a",
        "file": "rest.obj",
        "character": "kit_1",
        "joints_smpl24": human.joints.tolist(),
    }
    (tmp_path / "manifest.jsonl").write_text(json.dumps(row) + "\n")
    (shape,) = find_shapes(tmp_path)
    table = export_body.measure(model, [replace(shape, held_out=True)], count=3)
    assert table["synthetic"]["bodies"] == 3
    assert table["synthetic"]["refined_mm"] < table["synthetic"]["encoder_mm"] < 80
    assert set(table["characters"]) == {"all", "kit"}
    assert table["characters"]["kit"]["refined_mm"] < 15
    assert table["characters_turned_any_way"]["kit"]["facing_right_percent"] == 100.0


def test_encoders_are_of_the_size_that_they_were_trained_in(state: dict[str, Any]) -> None:
    encoder = export_body.load_encoder(state)
    assert isinstance(encoder, BodyEncoder)
    assert not encoder.training
    assert encoder.neighbours == 6
