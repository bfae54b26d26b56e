from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from six_boxes import ANSWER, SIX_BOXES, rewrite

from service.encode.affinemodel import golden_cloud
from service.encode.affineoutputs import SMALLEST
from service.encode.model import AffineModel, file_digest, load_models
from service.mesh.surface import Normalization
from service.template.affine import AffineTemplate
from service.template.loader import load_template


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
    network = write_network(folder / "chair.onnx", [*ANSWER, 0.1, 0.2, 0.3], (1, 100, 3))
    rewrite(folder, digest=file_digest(network))
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


def test_the_golden_cloud_is_a_normalised_chair_and_always_the_same(
    chair: AffineTemplate,
) -> None:
    cloud = golden_cloud(chair, 300)
    assert (cloud.shape, cloud.dtype) == ((300, 3), np.float32)
    np.testing.assert_allclose(Normalization.of(cloud).apply(cloud), cloud, atol=1e-6)
    assert np.array_equal(cloud, golden_cloud(load_template("paper_chair"), 300))


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


def test_the_installed_model_tells_chairs_apart(
    chair_model: AffineModel, chair: AffineTemplate, labelled: Any
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
