from __future__ import annotations

import numpy as np
import torch

from model_export.config import Config
from model_export.train import Trainer
from model_export.validation import predict, validation_set
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
