from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import yaml

from service.encode import estimate as inference
from service.encode.distance import Cloud, surface_distance
from service.encode.estimate import DOUBT, SIGMA_ENCODER, estimate
from service.encode.model import SIGMA_FLOOR, SMALLEST, Encoding, Model
from service.encode.refine import Fit
from service.mesh.surface import Samples, sample_surface
from service.template.loader import compile_template


def at(samples: Samples, size: float, place: np.ndarray) -> Samples:
    return replace(samples, points=size * samples.points + place)


def test_it_measures_a_chair_in_its_normalised_frame(
    chair_model: Model, chair_samples: Samples, plain: np.ndarray
) -> None:
    answer = estimate(chair_model, chair_samples)
    scale, center = answer.normalization.scale, answer.normalization.center
    np.testing.assert_allclose(answer.parameters[:8] / scale, plain, atol=0.006)
    np.testing.assert_allclose(answer.translation, -center * scale, atol=0.006)
    assert answer.distance < 0.003
    assert (answer.sigma >= SIGMA_FLOOR).all()
    assert (answer.sigma[:8] < SIGMA_ENCODER).all()


def test_size_and_place_make_no_difference(chair_model: Model, chair_samples: Samples) -> None:
    answer = estimate(chair_model, chair_samples)
    moved = at(chair_samples, 38.0, np.array([5.0, -100.0, 20.0]))
    other = estimate(chair_model, moved)
    np.testing.assert_allclose(other.parameters, answer.parameters, atol=1e-4)
    assert other.normalization.scale == pytest.approx(answer.normalization.scale / 38)
    before = answer.normalization.invert(answer.translation[None])
    after = other.normalization.invert(other.translation[None])
    np.testing.assert_allclose(after, 38 * before + [5, -100, 20], atol=0.01)


def test_unrefined_it_is_the_encoders_answer(chair_model: Model, chair_samples: Samples) -> None:
    answer = estimate(chair_model, chair_samples, refined=False)
    points = answer.normalization.apply(chair_samples.points)
    encoding = chair_model.encode(points)
    parameters, translation = encoding.parameters, encoding.translation
    np.testing.assert_array_equal(answer.parameters, parameters)
    np.testing.assert_array_equal(answer.translation, translation)
    assert (answer.sigma == SIGMA_ENCODER).all()
    assert answer.template.variant == "chair"
    expected = surface_distance(
        answer.template, parameters, translation, Cloud(points, chair_samples.normals)
    )
    assert answer.distance == answer.encoder_distance == expected


def test_refinement_remembers_what_the_encoder_had(
    chair_model: Model, chair_samples: Samples
) -> None:
    plain = estimate(chair_model, chair_samples, refined=False)
    refined = estimate(chair_model, chair_samples)
    assert refined.encoder_distance == plain.distance
    assert refined.distance <= refined.encoder_distance


def test_a_refinement_that_fits_worse_is_dropped(
    chair_model: Model, chair_samples: Samples, monkeypatch: pytest.MonkeyPatch
) -> None:
    def spoil(*_: object) -> Fit:
        size = len(chair_model.template.names)
        return Fit(np.full(size, 0.9), np.full(3, 0.5), np.full(size, 0.01), 0.0)

    monkeypatch.setattr(inference, "refine", spoil)
    answer = estimate(chair_model, chair_samples)
    plain = estimate(chair_model, chair_samples, refined=False)
    np.testing.assert_array_equal(answer.parameters, plain.parameters)
    assert answer.distance == plain.distance
    assert (answer.sigma == SIGMA_ENCODER).all()


def test_no_claim_is_finer_than_a_hand_could_measure(
    chair_model: Model, chair_samples: Samples, plain: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    perfect = estimate(chair_model, chair_samples)

    def exact(*_: object) -> Fit:
        claimed = np.zeros(len(perfect.parameters))
        claimed[7] = 0.003
        return Fit(perfect.parameters, perfect.translation, claimed, 0.0)

    monkeypatch.setattr(inference, "refine", exact)
    sigma = estimate(chair_model, chair_samples).sigma
    np.testing.assert_allclose(sigma[:7], SIGMA_FLOOR)
    assert sigma[7] == pytest.approx(np.hypot(0.003 * chair_model.sigma_scale[7], SIGMA_FLOOR))


def test_fewer_samples_can_be_refined_on(chair_model: Model, chair_samples: Samples) -> None:
    full = estimate(chair_model, chair_samples)
    rough = estimate(chair_model, chair_samples, stride=3)
    np.testing.assert_allclose(rough.parameters[:8], full.parameters[:8], atol=0.01)
    assert not np.array_equal(rough.parameters, full.parameters)


def test_a_ball_gets_an_answer_and_a_large_distance(chair_model: Model) -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(2840, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    ball = Samples(points, points, np.zeros(2840, np.int64), np.full((2840, 3), 1 / 3))
    answer = estimate(chair_model, ball)
    assert (answer.parameters[~chair_model.template.signed] >= SMALLEST).all()
    assert np.isfinite(answer.sigma).all()
    assert answer.distance > 0.015


STOOLS = """
# A slab on a post or on the floor.
name: stool
label: Stool
points: 400
parameters:
  width: {label: Width, group: top, range: [0.3, 0.6]}
  height: {label: Height, group: post, range: [0.3, 0.8], nuisance: true}
parts:
  slab: {shape: box, cells: [2, 1, 2], center: [0, 0, 0], size: [width, width / 6, width]}
  post: {shape: box, cells: [1, 2, 1], center: [0, -width / 12 - height / 2, 0],
         size: [width / 5, height, width / 5], hidden: [top]}
relations: [height - width / 2]
variants: {high: {}, low: {without: [post]}}
keep: {floor: [0, -height, 0]}
"""


class Undecided:
    """A model that answers the right parameters for any stool, and given shares of its variants."""

    def __init__(self, shares: list[float]) -> None:
        self.template = compile_template(yaml.safe_load(STOOLS))
        self.points = 400
        self.shares = np.array(shares)
        self.sigma_scale = np.ones(2)

    def samples(self, variant: int) -> Samples:
        own = self.template.variants[variant]
        visible = own.faces[~own.hidden]
        f = np.array([0.4, 0.5])
        return sample_surface(own.decode(f), visible, self.points, np.random.default_rng(0))

    def encode(self, points: np.ndarray) -> Encoding:
        low, high = points.min(axis=0), points.max(axis=0)
        width = high[0] - low[0]
        center = np.array([(low[0] + high[0]) / 2, high[1] - width / 12, (low[2] + high[2]) / 2])
        return Encoding(width * np.array([1.0, 1.25]), center, self.shares)


@pytest.mark.parametrize("variant", [0, 1])
def test_of_likely_variants_the_one_that_fits_is_taken(variant: int) -> None:
    for shares in ([0.5, 0.5], [0.8, 0.2], [0.2, 0.8]):
        model: Any = Undecided(shares)
        answer = estimate(model, model.samples(variant))
        assert answer.template.variant == ("high", "low")[variant]
        assert answer.parameters[0] / answer.normalization.scale == pytest.approx(0.4, rel=0.02)


def test_an_unlikely_variant_is_not_tried() -> None:
    model: Any = Undecided([1.0 - DOUBT / 2, DOUBT / 2])
    assert estimate(model, model.samples(1)).template.variant == "high"


def test_unrefined_the_likeliest_variant_is_taken() -> None:
    model: Any = Undecided([0.6, 0.4])
    assert estimate(model, model.samples(1), refined=False).template.variant == "high"
