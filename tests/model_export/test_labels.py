from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from model_export.config import Config
from model_export.labels import label_statistics, require_scale_free
from model_export.synthetic import SyntheticShapes
from service.template.affine import AffineTemplate


def test_labels_are_standardised_by_their_own_statistics(
    stand: AffineTemplate, small_config: Config
) -> None:
    mean, spread = label_statistics(stand, small_config)
    assert mean.shape == spread.shape == (6,)
    shapes = SyntheticShapes(stand, small_config.augmentation, seed=99)
    batch = shapes.batch(1500, 256)
    labels = torch.cat([batch.parameters, batch.translation], dim=1)
    np.testing.assert_allclose(labels.mean(dim=0) / spread, mean / spread, atol=0.2)
    np.testing.assert_allclose(labels.std(dim=0) / spread, 1.0, atol=0.15)
    assert (spread >= 1e-3).all()
    again = label_statistics(stand, small_config)
    assert torch.equal(mean, again[0])
    assert torch.equal(spread, again[1])


def test_a_template_with_a_fixed_length_is_refused(stand: AffineTemplate) -> None:
    require_scale_free(stand)
    fixed = replace(stand, base=stand.base + np.eye(1, 3) * 0.05)
    with pytest.raises(ValueError, match="'stand' has a constant length"):
        require_scale_free(fixed)
