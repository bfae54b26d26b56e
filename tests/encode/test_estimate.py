from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from service.encode import estimate as inference
from service.encode.distance import Cloud, surface_distance
from service.encode.estimate import SIGMA_ENCODER, SIGMA_FLOOR, estimate
from service.encode.model import SMALLEST, Model
from service.encode.refine import Fit
from service.mesh.surface import Samples


def at(samples: Samples, size: float, place: np.ndarray) -> Samples:
    return replace(samples, points=size * samples.points + place)


def test_it_measures_a_chair_in_its_normalised_frame(
    chair_model: Model, chair_samples: Samples, plain: np.ndarray
) -> None:
    answer = estimate(chair_model, chair_samples)
    scale, center = answer.normalization.scale, answer.normalization.center
    np.testing.assert_allclose(answer.parameters / scale, plain, atol=0.006)
    np.testing.assert_allclose(answer.translation, -center * scale, atol=0.006)
    assert answer.distance < 0.003
    assert (answer.sigma >= SIGMA_FLOOR).all()
    assert (answer.sigma < SIGMA_ENCODER).all()


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
    assert answer.sigma.tolist() == [SIGMA_ENCODER] * 8
    expected = surface_distance(
        chair_model.template, parameters, translation, Cloud(points, chair_samples.normals)
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
        return Fit(np.full(8, 0.9), np.full(3, 0.5), np.full(8, 0.01), 0.0)

    monkeypatch.setattr(inference, "refine", spoil)
    answer = estimate(chair_model, chair_samples)
    plain = estimate(chair_model, chair_samples, refined=False)
    np.testing.assert_array_equal(answer.parameters, plain.parameters)
    assert answer.distance == plain.distance
    assert answer.sigma.tolist() == [SIGMA_ENCODER] * 8


def test_no_claim_is_finer_than_a_hand_could_measure(
    chair_model: Model, chair_samples: Samples, plain: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    perfect = estimate(chair_model, chair_samples)

    def exact(*_: object) -> Fit:
        return Fit(perfect.parameters, perfect.translation, np.array([0.0] * 7 + [0.003]), 0.0)

    monkeypatch.setattr(inference, "refine", exact)
    sigma = estimate(chair_model, chair_samples).sigma
    np.testing.assert_allclose(sigma, [SIGMA_FLOOR] * 7 + [np.hypot(0.003, SIGMA_FLOOR)])


def test_fewer_samples_can_be_refined_on(chair_model: Model, chair_samples: Samples) -> None:
    full = estimate(chair_model, chair_samples)
    rough = estimate(chair_model, chair_samples, stride=3)
    np.testing.assert_allclose(rough.parameters, full.parameters, atol=0.01)
    assert not np.array_equal(rough.parameters, full.parameters)


def test_a_ball_gets_an_answer_and_a_large_distance(chair_model: Model) -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(2840, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    ball = Samples(points, points, np.zeros(2840, np.int64), np.full((2840, 3), 1 / 3))
    answer = estimate(chair_model, ball)
    assert (answer.parameters >= SMALLEST).all()
    assert np.isfinite(answer.sigma).all()
    assert answer.distance > 0.015
