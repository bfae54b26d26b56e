from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from model_export.meshbodies import MeshBodies
from model_export.meshnet import MeshNet
from model_export.runs import load_checkpoint
from model_export.train_mesh import (
    MeshTrainer,
    fit_last,
    loss_of,
    median_error,
    network_of,
    run,
    turns_of,
    write_onnx,
)
from service.encode.meshencoder import MeshEncoder
from service.errors import ModelFault
from service.template.skinned import SkinnedTemplate, body_of


@pytest.fixture(scope="module")
def network(human: SkinnedTemplate) -> MeshNet:
    torch.manual_seed(0)
    network = MeshNet(human.faces, len(human.rest), np.arange(0, 6000, 500), heads=2).eval()
    torch.nn.init.normal_(network.last.weight, std=0.02)
    return network


@pytest.fixture(scope="module")
def served(
    human: SkinnedTemplate, network: MeshNet, tmp_path_factory: pytest.TempPathFactory
) -> MeshEncoder:
    path = tmp_path_factory.mktemp("mesh") / "human.mesh.onnx"
    write_onnx(network, len(human.rest), path)
    return MeshEncoder(path, human)


def test_the_loss_is_least_at_the_truth() -> None:
    turned = torch.as_tensor(Rotation.random(48, random_state=0).as_matrix()).float()
    turned = turned.reshape(2, 24, 3, 3)
    shape = torch.ones(2, 3)
    columns = turned[..., :2].transpose(2, 3).flatten(1)
    right = torch.cat([columns, shape], dim=1)
    assert torch.allclose(turns_of(right), turned, atol=1e-5)
    assert loss_of(right, turned, shape) < 1e-6
    assert loss_of(right + 0.2, turned, shape) > 0.01


def test_a_run_goes_on_where_it_stopped(human: SkinnedTemplate, tmp_path: Path) -> None:
    small = small_template(human)
    run(MeshTrainer(small, 3, 1), tmp_path, every=2, fitted=32, until=2)
    trainer = MeshTrainer(small, 3, 1)
    trainer.restore(load_checkpoint(tmp_path / "checkpoint.pt"))
    assert trainer.step == 2
    run(trainer, tmp_path, every=2, fitted=32)
    assert len((tmp_path / "log.jsonl").read_text().splitlines()) == 2
    state = load_checkpoint(tmp_path / "checkpoint.pt")
    assert state["step"] == 3
    # With its last layer fitted once more.
    vertices, _, _ = trainer.bodies.batch(1)
    with torch.no_grad():
        assert torch.equal(network_of(state, small)(vertices), trainer.network(vertices))


def test_a_step_is_the_same_whenever_it_is_taken(human: SkinnedTemplate) -> None:
    small = small_template(human)
    whole, half = MeshTrainer(small, 4, 2), MeshTrainer(small, 4, 2)
    losses = [whole.train_step()["loss"].item() for _ in range(2)]
    state = copy.deepcopy(whole.state())
    losses.append(whole.train_step()["loss"].item())
    half.restore(state)
    assert half.train_step()["loss"].item() == losses[2]


def test_a_fitted_last_layer_answers_better(human: SkinnedTemplate) -> None:
    small = small_template(human)
    trainer = MeshTrainer(small, 1, 1)
    before = median_error(trainer.network, small, 10)
    fit_last(trainer.network, trainer.bodies, 64, 32)
    assert median_error(trainer.network, small, 10) < 0.8 * before


def small_template(human: SkinnedTemplate) -> SkinnedTemplate:
    """The body with a few hundred of its vertices."""
    count = 300
    ball = trimesh.creation.icosphere(subdivisions=3)
    faces = ball.faces[(ball.faces < count).all(axis=1)]
    chosen = np.linspace(0, len(human.rest) - 1, count).astype(int)
    return replace(
        human,
        rest=human.rest[chosen],
        shapedirs=human.shapedirs[chosen],
        weights=human.weights[chosen],
        posedirs=human.posedirs[chosen],
        faces=np.asarray(faces, dtype=np.int64),
    )


def test_errors_are_in_degrees(human: SkinnedTemplate, network: MeshNet) -> None:
    assert 1 < median_error(network, human, 2) < 120


def test_what_is_written_is_what_was_trained(
    human: SkinnedTemplate, network: MeshNet, served: MeshEncoder
) -> None:
    vertices, _, _ = MeshBodies(human, 1).batch(1)
    with torch.no_grad():
        expected = network(vertices)
    (outputs,) = served._session.run(None, {"vertices": vertices.numpy()})
    assert np.abs(outputs - expected.numpy()).max() < 1e-4


def test_a_body_turned_any_way_is_answered_alike(
    human: SkinnedTemplate, served: MeshEncoder
) -> None:
    vectors = np.zeros((24, 3))
    vectors[18] = (0.0, -1.0, 0.0)
    body = body_of(vectors, np.array([0.5, 0.0, 0.0]), 0.6, np.array([0.1, 0.2, 0.3]))
    turn = Rotation.from_euler("xyz", (1.0, 2.0, -0.5)).as_matrix()
    there = body.turned(turn, human.joints[0])
    first, second = (served.encode(human.decode(own)) for own in (body, there))
    assert np.allclose(turn @ first.rotations[0], second.rotations[0], atol=1e-4)
    assert np.allclose(first.rotations[1:], second.rotations[1:], atol=1e-4)
    assert second.scale == pytest.approx(first.scale, rel=1e-5)


def test_only_the_templates_own_faces_match(human: SkinnedTemplate, served: MeshEncoder) -> None:
    order = np.random.default_rng(0).permutation(len(human.faces))
    assert served.matches(human.faces)
    assert served.matches(np.roll(human.faces[order], 1, axis=1))
    assert not served.matches(human.faces[:, ::-1])
    assert not served.matches(human.faces[:-1])
    assert not served.matches(np.where(human.faces == 5, 6, human.faces))


def test_a_network_for_another_body_is_refused(
    human: SkinnedTemplate, network: MeshNet, tmp_path: Path
) -> None:
    write_onnx(network, len(human.rest), tmp_path / "human.mesh.onnx")
    with pytest.raises(ModelFault, match="takes"):
        MeshEncoder(tmp_path / "human.mesh.onnx", small_template(human))
