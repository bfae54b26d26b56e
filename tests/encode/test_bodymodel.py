from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pretend_body import POINTS, VIEW, answer, write_mesh_encoder
from six_boxes import rewrite

import service.template
from service.encode.basemodel import file_digest
from service.encode.bodyestimate import DOUBT
from service.encode.bodymodel import BodyModel, golden_cloud, stature
from service.encode.bodyoutputs import ANCHORS, spread_first
from service.encode.model import load_model, load_models
from service.errors import ModelFault
from service.mesh.frame import orientations
from service.mesh.surface import Normalization, Samples, Surface, sample_surface
from service.template.anatomy import limits
from service.template.skinned import NAMES, Body, SkinnedTemplate


@pytest.fixture
def model(body_folder: Path) -> BodyModel:
    loaded = load_model(body_folder / "human.json")
    assert isinstance(loaded, BodyModel)
    return loaded


@pytest.fixture(scope="module")
def samples(human: SkinnedTemplate, strider: Body) -> Samples:
    """Of the body that the model knows, in metres."""
    vertices = human.decode(strider)
    return sample_surface(vertices, human.faces, POINTS, np.random.default_rng(0))


def test_the_card_says_that_it_is_a_body(body_folder: Path, model: BodyModel) -> None:
    model.verify()
    assert (model.name, model.label) == ("human", "Human body")
    # More than the encoder sees are looked at by the refinement.
    assert model.points == model.template.points > POINTS
    assert model.stands
    assert not model.other_body


@pytest.mark.parametrize("change", [{"kind": "liquid"}, {"kind": 3}, {"kind": "affine"}])
def test_a_card_of_another_kind_is_refused(
    body_folder: Path, tmp_path: Path, change: dict[str, Any]
) -> None:
    folder = shutil.copytree(body_folder, tmp_path / "models")
    rewrite(folder, "human", **change)
    with pytest.raises(ModelFault) as caught:
        load_models(folder)
    assert caught.value.code == "model_unreadable"


def test_another_body_can_be_worked_with(
    human: SkinnedTemplate, body_folder: Path, tmp_path: Path
) -> None:
    mine = tmp_path / "mine.npz"
    fields = dict(np.load(Path(service.template.__file__).parent / "human.npz"))
    np.savez(mine, **{**fields, "v_template": 1.1 * fields["v_template"]})
    model = load_models(body_folder, body=mine)["human"]
    assert isinstance(model, BodyModel)
    model.verify()
    assert model.other_body
    tall = stature(human, np.zeros(3))
    assert stature(model.template, np.zeros(3)) == pytest.approx(1.1 * tall)


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04 not an archive", b"\x80\x04."])
def test_a_body_that_can_not_be_read_is_a_fault(
    body_folder: Path, tmp_path: Path, content: bytes | None
) -> None:
    mine = tmp_path / "mine.npz"
    if content is not None:
        mine.write_bytes(content)
    with pytest.raises(ModelFault) as caught:
        load_models(body_folder, body=mine)
    assert caught.value.code == "body_model"
    assert "BODY_MODEL" in caught.value.detail
    assert "mine.npz" in caught.value.detail


def test_the_encoder_sees_points_that_are_far_apart_first(
    model: BodyModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    cloud = np.random.default_rng(0).normal(size=(POINTS, 3))
    seen: list[np.ndarray] = []
    run = model._session.run
    monkeypatch.setattr(model._session, "run", lambda points: run(seen.append(points) or points))
    model.encode(cloud)
    np.testing.assert_array_equal(seen[0], cloud[spread_first(cloud, ANCHORS)])
    # Of more points it takes some of each.
    model.encode(np.repeat(cloud, 2, axis=0))
    assert sorted(map(tuple, seen[1])) == sorted(map(tuple, cloud))


def test_encoding_takes_the_answer_apart(
    model: BodyModel, human: SkinnedTemplate, strider: Body
) -> None:
    encoding = model.encode(np.zeros((POINTS, 3)))
    np.testing.assert_allclose(encoding.rotations, strider.rotations, atol=1e-5)
    np.testing.assert_allclose(encoding.shape, strider.shape, atol=1e-5)
    expected = answer(human, strider)
    np.testing.assert_allclose(encoding.joints.ravel(), expected[:72], atol=1e-6)
    assert np.log(encoding.scale) == pytest.approx(expected[-1], abs=1e-6)


def test_an_estimate_is_of_the_body(
    model: BodyModel, human: SkinnedTemplate, strider: Body, samples: Samples
) -> None:
    surface = Surface(human.decode(strider), human.faces, 1.0)
    for refined in (False, True):
        fit = model.estimate(samples, refined, surface=surface)
        joints = fit.normalization.invert(human.posed_joints(fit.body))
        np.testing.assert_allclose(joints, human.posed_joints(strider), atol=0.03)
        assert (fit.distance < fit.encoder_distance) == refined


@pytest.fixture
def with_mesh_encoder(
    body_folder: Path, tmp_path: Path, human: SkinnedTemplate, strider: Body
) -> Path:
    """The card of a model that has a mesh encoder."""
    folder = shutil.copytree(body_folder, tmp_path / "models")
    network = write_mesh_encoder(folder / "human.mesh.onnx", human, strider)
    rewrite(folder, "human", mesh_encoder={"digest": file_digest(network)})
    return folder / "human.json"


def test_a_mesh_with_the_templates_faces_is_read_whole(
    with_mesh_encoder: Path, human: SkinnedTemplate, strider: Body, samples: Samples
) -> None:
    model = load_model(with_mesh_encoder)
    assert isinstance(model, BodyModel)
    model.verify()
    assert model.reader(human.faces) == "mesh"
    assert model.reader(human.faces[1:]) == "point"
    vertices = human.decode(strider)
    fit = model.estimate(samples, True, surface=Surface(vertices, human.faces, 1.0))
    decoded = fit.normalization.invert(human.decode(fit.body))
    np.testing.assert_allclose(decoded, vertices, atol=0.002)
    other = model.estimate(samples, True, surface=Surface(vertices, human.faces[1:], 1.0))
    decoded = other.normalization.invert(human.decode(other.body))
    assert np.abs(decoded - vertices).max() > 0.005, "samples do not tell so well"


def test_a_mesh_encoder_is_that_of_the_card(with_mesh_encoder: Path) -> None:
    rewrite(with_mesh_encoder.parent, "human", mesh_encoder={"digest": "sha256-00"})
    with pytest.raises(ModelFault) as caught:
        load_model(with_mesh_encoder).verify()
    assert caught.value.code == "model_digest"
    assert "human.mesh.onnx" in caught.value.detail


def test_a_mesh_encoder_knows_no_other_body(
    with_mesh_encoder: Path, human: SkinnedTemplate
) -> None:
    rewrite(with_mesh_encoder.parent, "human", template_digest="sha256-00")
    model = load_model(with_mesh_encoder)
    assert isinstance(model, BodyModel)
    assert model.reader(human.faces) == "point"


def test_the_golden_cloud_is_normalised_and_always_the_same() -> None:
    cloud = golden_cloud(300)
    assert (cloud.shape, cloud.dtype) == ((300, 3), np.float32)
    np.testing.assert_allclose(Normalization.of(cloud).apply(cloud), cloud, atol=1e-6)
    assert np.array_equal(cloud, golden_cloud(300))


def test_the_description_names_every_angle_and_coefficient(model: BodyModel) -> None:
    text = model.describe()
    assert json.loads(json.dumps(text)) == text
    assert text["keep"] == ["floor", "pelvis"]
    entries = {entry["name"]: entry for entry in text["parameters"]}
    assert list(entries) == [*NAMES, "stature"]
    elbow = entries["left_elbow_y"]
    assert (elbow["label"], elbow["group"]) == ("Left elbow, about y", "left arm")
    assert (elbow["unit"], elbow["kind"], elbow["step"]) == ("rad", "angle", 0.01)
    low, high = (end[NAMES.index("left_elbow_y") // 3, 1] for end in limits())
    assert elbow["range"] == [low, high]
    assert low < elbow["typical"][0] < 0.0 < elbow["typical"][1] < high
    assert entries["spine1_x"]["label"] == "Spine 1, about x"
    root = entries["global_orient_y"]
    assert (root["label"], root["group"]) == ("Whole body, about y", "overall")
    assert root["range"] == root["typical"] == [-np.pi, np.pi]
    mass = entries["shape_1"]
    assert (mass["unit"], mass["kind"], mass["group"]) == ("1", "coefficient", "shape")
    assert mass["label"] == "Body mass"
    assert mass["range"] == [-3.0, 3.0]
    tall = entries["stature"]
    assert (tall["unit"], tall["kind"], tall["derived"]) == ("m", "length", True)
    assert tall["range"][0] < tall["typical"][0] < 1.7 < tall["typical"][1] < tall["range"][1]
    assert not any(entry["derived"] for name, entry in entries.items() if name != "stature")


def test_the_stand_in_discriminator_tells_views_apart(model: BodyModel, samples: Samples) -> None:
    assert model.discriminator.points == VIEW
    odds = model.discriminator.odds(samples.points, orientations())
    assert odds.argmax() == 0
    assert odds[0] > DOUBT + np.sort(odds)[-2]
