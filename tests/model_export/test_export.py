from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch

from model_export import discriminate, export
from model_export.config import Config
from model_export.realistic import find_shapes
from model_export.train import Trainer
from service.encode.model import file_digest, golden_cloud, load_models
from service.encode.session import EncoderSession
from service.errors import ModelFault
from service.template.affine import AffineTemplate


@pytest.fixture(scope="module")
def state(small_config: Config) -> dict[str, Any]:
    """The checkpoint of a run of a few steps."""
    trainer = Trainer(small_config, None)
    for _ in range(10):
        trainer.train_step()
    trainer.seconds = 7200.0
    return trainer.state()


@pytest.fixture(scope="module")
def network(state: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("onnx") / "stand.onnx"
    export.write_onnx(export.load_encoder(state), 64, path)
    return path


def test_the_exported_network_answers_like_the_trained_one(
    state: dict[str, Any], network: Path, stand: AffineTemplate
) -> None:
    encoder = export.load_encoder(state)
    clouds = [*export.random_clouds(64, 5), golden_cloud(stand, 64)]
    gap = export.check_onnx(encoder, network, clouds)
    session = EncoderSession(network)
    with torch.no_grad():
        gaps = [
            np.abs(session.run(cloud) - encoder(torch.tensor(cloud)[None])[0].numpy()).max()
            for cloud in clouds
        ]
    assert gap == max(gaps)
    assert gap < export.TOLERANCE == 1e-4
    answers = [session.run(cloud) for cloud in clouds]
    assert np.ptp(answers, axis=0).max() > 100 * gap


def test_a_network_that_answers_otherwise_is_refused(state: dict[str, Any], network: Path) -> None:
    encoder = export.load_encoder(state)
    with torch.no_grad():
        encoder.head[-1].bias[2] += 0.1
    with pytest.raises(ValueError, match="differs from the trained one"):
        export.check_onnx(encoder, network, export.random_clouds(64, 1))


def test_the_file_is_whole_and_takes_one_cloud(network: Path) -> None:
    model = onnx.load(network, load_external_data=False)
    onnx.checker.check_model(model)
    (taken,), (given,) = model.graph.input, model.graph.output
    assert taken.name == "points"
    assert [d.dim_value for d in taken.type.tensor_type.shape.dim] == [1, 64, 3]
    assert given.name == "outputs"
    assert [d.dim_value for d in given.type.tensor_type.shape.dim] == [1, 6]
    assert [path.name for path in network.parent.iterdir()] == ["stand.onnx"]
    assert not any("BatchNorm" in node.op_type for node in model.graph.node)


def test_a_checkpoint_gives_back_its_encoder(state: dict[str, Any]) -> None:
    encoder = export.load_encoder(state)
    assert not encoder.training
    loaded = encoder.state_dict()
    assert loaded.keys() == state["encoder"].keys()
    assert all(torch.equal(loaded[name], value) for name, value in state["encoder"].items())


def test_random_clouds_lie_inside_the_sphere_and_repeat() -> None:
    clouds, again = export.random_clouds(50, 3), export.random_clouds(50, 3)
    assert len(clouds) == 3
    assert all(np.array_equal(a, b) for a, b in zip(clouds, again, strict=True))
    assert not np.array_equal(clouds[0], clouds[1])
    assert max(np.linalg.norm(cloud, axis=1).max() for cloud in clouds) < 0.61
    assert clouds[0].dtype == np.float32


def test_the_card_says_what_the_model_is(
    state: dict[str, Any], network: Path, stand: AffineTemplate, small_config: Config
) -> None:
    card = export.build_card(stand, state, network, "2.0.1")
    assert json.loads(json.dumps(card))["name"] == "stand"
    assert (card["label"], card["version"], card["licence"]) == ("Stand", "2.0.1", "Apache-2.0")
    assert card["digest"] == file_digest(network)
    assert "3DV 2020" in card["source"]
    assert card["input"]["points"] == 64
    assert [entry["name"] for entry in card["parameters"]] == list(stand.names)
    post = card["parameters"][2]
    assert (post["paper_name"], post["range"], post["unit"]) == ("post length", [0.3, 1.2], "m")
    assert card["training"]["hours"] == 2.0
    (training,) = card["training"]["runs"]
    assert (training["steps"], training["hours"]) == (10, 2.0)
    assert training["place"].startswith("CPU")
    assert training["config"]["seed"] == small_config.seed
    golden = EncoderSession(network).run(golden_cloud(stand, 64))
    np.testing.assert_allclose(card["golden"], golden, atol=1e-6)


def test_the_card_says_what_the_data_was(meshes: Path, tmp_path: Path) -> None:
    data = export.describe_data(find_shapes(meshes))
    assert data["realistic"]["train"] == 8
    assert data["realistic"]["test"] == 2
    assert data["realistic"]["labels"] == "none"
    assert data["realistic"]["licences"] == {"unknown": 10}
    rows = [{"file": f"{i}.obj", "licence": "MIT" if i < 2 else "CC0-1.0"} for i in range(5)]
    (tmp_path / "manifest.jsonl").write_text("\n".join(map(json.dumps, rows)), "utf-8")
    licences = export.describe_data(find_shapes(tmp_path))["realistic"]["licences"]
    assert list(licences.items()) == [("CC0-1.0", 3), ("MIT", 2)]


def run_export(folder: Path, meshes: Path, *more: object) -> None:
    """The command line on the run in the folder."""
    arguments = ["export", "stand", "--run", folder / "run", "--realistic", meshes,
                 "--out", folder / "models", "--cache", folder / "cache", "--count", "3",
                 "--refit", "200", *more]  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        heaps = discriminate.heaps
        patch.setattr(discriminate, "heaps", lambda count, *rest: heaps(10, *rest))
        patch.setattr("sys.argv", list(map(str, arguments)))
        export.main()


@pytest.fixture(scope="module")
def exported(state: dict[str, Any], meshes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A models folder that the command line wrote."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "run").mkdir()
    torch.save(state, folder / "run" / "checkpoint.pt")
    ablation = folder / "ablation.json"
    ablation.write_text('{"no editing": 1}', "utf-8")
    run_export(folder, meshes, "--version", "3.1.0", "--steps", "2", "--ablation", ablation)
    return folder / "models"


def test_the_command_line_writes_a_model_that_the_service_loads(exported: Path) -> None:
    model = load_models(exported)["stand"]
    model.verify()
    assert (model.version, model.points) == ("3.1.0", 64)
    card = model.card
    assert card["metrics"]["synthetic"]["shapes"] == 3
    assert card["metrics"]["realistic"]["all"]["shapes"] == 2
    assert card["metrics"]["ablation"] == {"no editing": 1}
    assert card["data"]["realistic"]["train"] == 8
    assert card["template_digest"] == file_digest(exported / "stand.yaml")
    assert card["discriminator"]["data"] == {"realistic": 8, "others": 10}


@pytest.mark.parametrize(
    ("change", "code"),
    [("weights", "model_digest"), ("golden", "model_golden"), ("digest", "model_digest")],
)
def test_an_altered_export_is_noticed(
    exported: Path, tmp_path: Path, change: str, code: str
) -> None:
    folder = shutil.copytree(exported, tmp_path / "models")
    if change == "weights":
        model = onnx.load(folder / "stand.onnx")
        bias = next(i for i in model.graph.initializer if list(i.dims) == [6])
        altered = onnx.numpy_helper.to_array(bias) + np.float32(0.01)
        bias.CopyFrom(onnx.numpy_helper.from_array(altered, bias.name))
        onnx.save(model, folder / "stand.onnx")
    else:
        card = json.loads((folder / "stand.json").read_text("utf-8"))
        if change == "golden":
            card["golden"][-1] += 0.002
        else:
            card["digest"] = "sha256-" + "0" * 64
        (folder / "stand.json").write_text(json.dumps(card), "utf-8")
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["stand"].verify()
    assert caught.value.code == code


def test_a_discriminator_can_be_kept(exported: Path, meshes: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(exported.parent, tmp_path / "copy")
    before = json.loads((folder / "models" / "stand.json").read_text("utf-8"))
    run_export(folder, meshes, "--version", "3.2.0", "--keep-discriminator")
    model = load_models(folder / "models")["stand"]
    model.verify()
    assert model.version == "3.2.0"
    assert model.card["discriminator"] == before["discriminator"]
    assert before["discriminator"]["steps"] == 2
