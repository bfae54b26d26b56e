from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import service.template
from service.encode.model import (
    SMALLEST,
    Model,
    file_digest,
    golden_cloud,
    load_models,
)
from service.encode.session import EncoderSession
from service.errors import ModelFault
from service.mesh.surface import Normalization
from service.template.affine import AffineTemplate
from service.template.loader import load_template

SIX_BOXES = (
    (Path(service.template.__file__).parent / "paper_chair.yaml")
    .read_text("utf-8")
    .replace("name: paper_chair", "name: chair")
    .replace("label: Chair of six boxes", "label: Chair")
)
ANSWER = [0.4, 0.04, 0.06, -0.2, 0.5, 0.4, 0.05, 0.0]


@pytest.fixture
def folder(
    tmp_path: Path, write_network: Any, write_discriminator: Any, chair: AffineTemplate
) -> Path:
    """A models folder with a chair of six boxes whose network answers `ANSWER`."""
    network = write_network(tmp_path / "chair.onnx", ANSWER, (1, 100, 3))
    discriminator = write_discriminator(tmp_path / "chair.discriminator.onnx")
    golden = EncoderSession(network).run(golden_cloud(chair, 100))
    card = {
        "name": "chair",
        "version": "1.2.3",
        "digest": file_digest(network),
        "golden": golden.tolist(),
        "discriminator": {"digest": file_digest(discriminator)},
        "calibration": {"limit_distance": 0.03, "limit_odds": 1.0},
    }
    (tmp_path / "chair.json").write_text(json.dumps(card), "utf-8")
    (tmp_path / "chair.yaml").write_text(SIX_BOXES, "utf-8")
    return tmp_path


def rewrite(folder: Path, **changes: Any) -> None:
    path = folder / "chair.json"
    card = json.loads(path.read_text("utf-8")) | changes
    path.write_text(json.dumps({k: v for k, v in card.items() if v is not None}), "utf-8")


def test_a_folder_of_models_is_loaded(folder: Path) -> None:
    models = load_models(folder)
    assert list(models) == ["chair"]
    model = models["chair"]
    assert (model.name, model.version, model.points) == ("chair", "1.2.3", 100)
    assert model.template.name == "chair"
    model.verify()


def test_an_empty_folder_holds_no_models(tmp_path: Path) -> None:
    assert load_models(tmp_path) == {}


def test_encoding_splits_the_answer_and_keeps_sizes_positive(folder: Path) -> None:
    model = load_models(folder)["chair"]
    cloud = np.random.default_rng(0).normal(size=(100, 3))
    answer = model.encode(cloud)
    expected = np.where(np.array(ANSWER) > 0, ANSWER, SMALLEST)
    np.testing.assert_allclose(answer.parameters, expected, rtol=1e-6)
    np.testing.assert_allclose(answer.translation, cloud.max(axis=0), rtol=1e-6)
    assert answer.shares.tolist() == [1.0], "there is but one variant"


def test_the_rest_of_the_answer_is_the_odds_of_the_variants(
    folder: Path, write_network: Any
) -> None:
    write_network(folder / "chair.onnx", [*ANSWER, 0.1, 0.2, 0.3], (1, 100, 3))
    variants = "\nvariants:\n  a: {}\n  b: {without: [back]}\n  c: {}\n"
    (folder / "chair.yaml").write_text(SIX_BOXES + variants, "utf-8")
    model = load_models(folder)["chair"]
    cloud = np.random.default_rng(0).normal(size=(100, 3))
    answer = model.encode(cloud)
    np.testing.assert_allclose(answer.translation, [0.1, 0.2, 0.3], rtol=1e-6)
    odds = np.exp(cloud.max(axis=0))
    np.testing.assert_allclose(answer.shares, odds / odds.sum(), rtol=1e-5)


def test_signed_offsets_stay_as_the_network_says(folder: Path, chair: AffineTemplate) -> None:
    model = load_models(folder)["chair"]
    offsets = {"seat_depth": -0.3, "leg_width": 0.0}
    parameters = tuple(replace(p, low=offsets.get(p.name, p.low)) for p in chair.parameters)
    model.template = replace(chair, parameters=parameters)
    answer = model.encode(np.zeros((100, 3)))
    np.testing.assert_allclose(answer.parameters, ANSWER, rtol=1e-6)


def test_nuisance_parameters_are_not_described(folder: Path, chair: AffineTemplate) -> None:
    model = load_models(folder)["chair"]
    parameters = tuple(replace(p, nuisance="leg" in p.name) for p in chair.parameters)
    model.template = replace(chair, parameters=parameters)
    offered = [e["name"] for e in model.describe()["parameters"] if not e["derived"]]
    assert offered == [name for name in chair.names if "leg" not in name]


def test_a_template_beside_the_card_is_the_categorys(folder: Path) -> None:
    text = SIX_BOXES.replace("label: Chair", "label: Throne")
    (folder / "chair.yaml").write_text(text, "utf-8")
    assert load_models(folder)["chair"].template.label == "Throne"


def test_the_golden_cloud_is_a_normalised_chair_and_always_the_same(
    chair: AffineTemplate,
) -> None:
    cloud = golden_cloud(chair, 300)
    assert (cloud.shape, cloud.dtype) == ((300, 3), np.float32)
    np.testing.assert_allclose(Normalization.of(cloud).apply(cloud), cloud, atol=1e-6)
    assert np.array_equal(cloud, golden_cloud(load_template("paper_chair"), 300))


def test_an_altered_file_is_noticed(folder: Path, write_network: Any) -> None:
    write_network(folder / "chair.onnx", [*ANSWER[:-1], 0.1], (1, 100, 3))
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_digest"
    assert "chair.onnx is sha256-" in caught.value.detail


def test_an_altered_discriminator_is_noticed(folder: Path) -> None:
    rewrite(folder, discriminator={"digest": "sha256-00"})
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_digest"
    assert "chair.discriminator.onnx is sha256-" in caught.value.detail


@pytest.mark.parametrize("index", [0, 3, 10])
def test_an_altered_golden_answer_is_noticed(folder: Path, index: int) -> None:
    golden = json.loads((folder / "chair.json").read_text("utf-8"))["golden"]
    golden[index] += 0.002
    rewrite(folder, golden=golden)
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_golden"
    assert "0.002" in caught.value.detail


def test_a_golden_answer_that_is_not_a_number_is_noticed(folder: Path) -> None:
    rewrite(folder, golden=[float("nan")] * 11)
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_golden"


@pytest.mark.parametrize("golden", [[0.1] * 9, [], None])
def test_a_golden_answer_of_another_size_is_noticed(
    folder: Path, golden: list[float] | None
) -> None:
    rewrite(folder, golden=golden)
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_golden"


@pytest.mark.parametrize("fault", ["json", "array", "name", "digest", "template", "yaml"])
def test_a_card_that_cannot_be_used_is_refused(folder: Path, fault: str) -> None:
    if fault == "json":
        (folder / "chair.json").write_text("{", "utf-8")
    elif fault == "array":
        (folder / "chair.json").write_text("[]", "utf-8")
    elif fault == "template":
        rewrite(folder, name="sofa")
        (folder / "chair.yaml").unlink()
    elif fault == "yaml":
        (folder / "chair.yaml").write_text("name: chair", "utf-8")
    else:
        rewrite(folder, **{fault: None})
    with pytest.raises(ModelFault) as caught:
        load_models(folder)
    assert caught.value.code == "model_unreadable"
    assert caught.value.detail.startswith("chair.json can't be loaded")


@pytest.mark.parametrize("name", ["chair.onnx", "chair.discriminator.onnx"])
def test_a_card_without_its_networks_is_refused(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(ModelFault) as caught:
        load_models(folder)
    assert name in caught.value.detail


def test_the_score_falls_with_the_distance_past_a_half_at_the_limit(folder: Path) -> None:
    score = load_models(folder)["chair"].score
    assert score(0.0, 50.0) == 1.0
    assert score(0.03, 50.0) == pytest.approx(0.5)
    distances = np.linspace(0, 0.2, 50)
    assert (np.diff([score(d, 50.0) for d in distances]) < 0).all()
    assert score(0.2, 50.0) < 0.01


def test_the_score_falls_with_the_odds_past_a_half_at_the_limit(folder: Path) -> None:
    score = load_models(folder)["chair"].score
    assert score(0.0, 1.0) == pytest.approx(0.5)
    assert score(0.0, -8.0) < 0.001
    assert score(0.03, 1.5) == pytest.approx(0.5)
    assert score(0.1, -8.0) == pytest.approx(score(0.0, -8.0))


def test_the_description_names_every_parameter_and_dimension(folder: Path) -> None:
    model = load_models(folder)["chair"]
    text = model.describe()
    assert json.loads(json.dumps(text)) == text
    assert (text["name"], text["label"], text["points"]) == ("chair", "Chair", 100)
    assert text["model"] == {"name": "chair", "version": "1.2.3", "digest": model.digest}
    assert text["keep"] == ["floor", "seat", "center"]
    entries = {entry["name"]: entry for entry in text["parameters"]}
    assert list(entries) == [*model.template.names, *model.template.derived]
    assert {n for n, e in entries.items() if e["derived"]} == set(model.template.derived)
    seat = entries["seat_thickness"]
    assert (seat["paper_name"], seat["group"], seat["unit"]) == ("seat height", "seat", "m")
    assert (seat["range"], seat["typical"]) == ([0.002, 0.35], [0.02, 0.2])
    assert (seat["step"], entries["leg_height"]["step"]) == (0.001, 0.005)
    assert entries["total_height"]["paper_name"] is None


def test_the_installed_model_is_whole(chair_model: Model, chair: AffineTemplate) -> None:
    chair_model.verify()
    assert chair_model.points == chair.points == 2840
    assert 0.01 < chair_model.limit_distance < 0.04


def test_the_installed_model_tells_chairs_apart(
    chair_model: Model, chair: AffineTemplate, labelled: Any
) -> None:
    template = chair_model.template
    assert template.names[:8] == chair.names
    middle = (chair.low + chair.high) / 2
    for name in ("seat_width", "leg_height", "back_height", "seat_depth"):
        index = template.names.index(name)
        shares = []
        for factor in (0.6, 1.5):
            f = middle.copy()
            f[index] *= factor
            cloud, _, _ = labelled(f)
            parameters = chair_model.encode(cloud.points).parameters[:8]
            shares.append(parameters[index] / np.linalg.norm(parameters))
        assert shares[1] > 1.2 * shares[0], name


def test_a_copied_model_is_as_good(folder: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(folder, tmp_path / "copy")
    load_models(copy)["chair"].verify()
