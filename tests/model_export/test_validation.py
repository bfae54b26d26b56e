from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np
import pytest
import torch

from model_export.config import Config
from model_export.networks import Encoder
from model_export.realistic import find_shapes
from model_export.train import Trainer
from model_export.validation import (
    held_out_clouds,
    predict,
    real_distances,
    validation_set,
)
from service.encode.distance import Cloud
from service.mesh.surface import Normalization, sample_surface
from service.template.affine import AffineTemplate


def test_validation_shapes_are_the_same_for_every_run(stand: AffineTemplate) -> None:
    first, again = validation_set(stand, 100), validation_set(stand, 100)
    assert first.points.shape == (100, 64, 3)
    assert torch.equal(first.points, again.points)
    assert torch.equal(first.parameters, again.parameters)
    assert len(torch.unique(first.parameters, dim=0)) == 100


def test_predictions_are_in_evaluation_mode_and_in_order(small_config: Config) -> None:
    trainer = Trainer(small_config, None)
    trainer.train_step()
    points = trainer.synthetic.batch(60, 64).points
    predicted = predict(trainer.encoder, points)
    assert predicted.shape == (60, 6)
    single = predict(trainer.encoder, points[41:42])
    np.testing.assert_allclose(predicted[41:42], single, atol=1e-6)


class Telling(torch.nn.Module):
    """Stands for an encoder that is told what to answer."""

    def __init__(self, answers: np.ndarray) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(1))
        self.answers = torch.as_tensor(answers, dtype=torch.float32)

    def forward(self, points: torch.Tensor) -> torch.Tensor:
        assert len(points) == len(self.answers)
        return self.answers


def test_held_out_shapes_are_normalised_samples(meshes: Path) -> None:
    clouds = held_out_clouds(meshes, 300)
    assert len(clouds) == sum(shape.held_out for shape in find_shapes(meshes)) == 2
    for cloud in clouds:
        assert cloud.points.shape == cloud.normals.shape == (300, 3)
        np.testing.assert_allclose(cloud.points.mean(axis=0), 0.0, atol=1e-9)
        assert np.linalg.norm(cloud.points, axis=1).max() == pytest.approx(0.6)
    again = held_out_clouds(meshes, 300)
    assert np.array_equal(clouds[0].points, again[0].points)


def test_real_shapes_are_near_the_right_template_and_far_from_others(
    stand: AffineTemplate, kinds: AffineTemplate
) -> None:
    rng = np.random.default_rng(0)
    visible = stand.faces[~stand.hidden]
    answers, clouds = [], []
    for f in rng.uniform(stand.low, stand.high, (3, 3)):
        samples = sample_surface(stand.decode(f), visible, 800, rng)
        normalization = Normalization.of(samples.points)
        clouds.append(Cloud(normalization.apply(samples.points), samples.normals))
        answers.append([*(f * normalization.scale), *(-normalization.center * normalization.scale)])
    right = np.array(answers)
    near = real_distances(cast(Encoder, Telling(right)), stand, clouds)
    assert near.shape == (3,)
    assert near.max() < 0.002
    wrong = right + np.array([0.1, 0.0, 0.1, 0.0, 0.0, 0.0])
    assert real_distances(cast(Encoder, Telling(wrong)), stand, clouds).min() > 3 * near.max()
    # The likely variant is the one that counts: the second lacks the post.
    for odds, least, most in (([2.0, -2.0], 0.0, 0.002), ([-2.0, 2.0], 0.005, 1.0)):
        told = np.hstack([right, np.tile(odds, (3, 1))])
        found = real_distances(cast(Encoder, Telling(told)), kinds, clouds)
        assert (found >= least).all()
        assert (found <= most).all()
