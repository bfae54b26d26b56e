"""Labels of a category, normalised like its clouds: their statistics, and that they can be told."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from model_export.config import Config
from model_export.synthetic import SyntheticShapes
from service.template.affine import AffineTemplate


def require_scale_free(template: AffineTemplate) -> None:
    """Refuse constant lengths: an upload's scale is unknown, so nothing could infer them.

    Raises:
        ValueError: when a vertex does not vanish with the parameters.
    """
    if np.abs(template.base).max() > 0.0:
        raise ValueError(
            f"the template {template.name!r} has a constant length; make it a parameter: "
            "an upload's scale is not known, so a fixed number of metres can't be recognised"
        )


def label_statistics(template: AffineTemplate, config: Config) -> tuple[Tensor, Tensor]:
    """``[d + 3 + K]`` mean and standard deviation of normalised labels; 0 and 1 for log odds."""
    shapes = SyntheticShapes(template, config.augmentation, config.seed + 1, config.log_share)
    labels = shapes.batch(4096 // 4, 256).labels
    odds = torch.zeros(len(template.present))
    mean, spread = labels.mean(dim=0), labels.std(dim=0).clamp_min(1e-3)
    return torch.cat([mean, odds]), torch.cat([spread, odds + 1.0])
