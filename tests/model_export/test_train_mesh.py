from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from model_export.meshnet import MeshNet
from model_export.train_mesh import MeshBodies, loss_of, median_error, train, turns_of, write_onnx
from service.encode.meshencoder import MeshEncoder
from service.errors import ModelFault
from service.template.skinned import SkinnedTemplate, body_of


@pytest.fixture(scope="module")
def network(human: SkinnedTemplate) -> MeshNet:
    torch.manual_seed(0)
    return MeshNet(human.faces, len(human.rest), heads=2).eval()


@pytest.fixture(scope="module")
def served(
    human: SkinnedTemplate, network: MeshNet, tmp_path_factory: pytest.TempPathFactory
) -> MeshEncoder:
    path = tmp_path_factory.mktemp("mesh") / "human.mesh.onnx"
    write_onnx(network, len(human.rest), path)
    return MeshEncoder(path, human)


def test_bodies_are_drawn_with_their_torso_upright(human: SkinnedTemplate) -> None:
    vertices, turned, shape = MeshBodies(human, 0).batch(3)
    assert vertices.shape == (3, len(human.rest), 3)
    assert torch.allclose(vertices.norm(dim=2).amax(dim=1), torch.full((3,), 0.6), atol=1e-5)
    assert (turned[:, 3, 1, 1] > 0.7).all()
    assert shape.shape == (3, 3)
    again = MeshBodies(human, 0).batch(3)
    assert torch.equal(vertices, again[0])


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
    train(small, tmp_path / "run", steps=2, batch=1, resume=False)
    state = train(small, tmp_path / "run", steps=3, batch=1, resume=True)
    assert state["step"] == 3
    assert len((tmp_path / "run" / "log.jsonl").read_text().splitlines()) == 2


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
