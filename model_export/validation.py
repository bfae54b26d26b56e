"""The same synthetic shapes for every run, to see how well its encoder does alone."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from model_export.metrics import Recovery, recovery
from model_export.networks import Encoder
from model_export.synthetic import Augmentation, Batch, SyntheticShapes
from service.template.affine import AffineTemplate

VALIDATION_SEED = 20_000_003


@torch.no_grad()
def predict(encoder: Encoder, points: Tensor) -> np.ndarray:
    """``[n, d + 3 + K]`` outputs in evaluation mode."""
    encoder.eval()
    chunks = [encoder(chunk) for chunk in points.split(25)]
    return torch.cat(chunks).cpu().numpy()


def validation_set(template: AffineTemplate, count: int) -> Batch:
    """The same clean shapes in every run, as many points as are served."""
    shapes = SyntheticShapes(template, Augmentation.none(), VALIDATION_SEED)
    batches = [shapes.batch(50, template.points).columns for _ in range(count // 50)]
    return Batch(*(torch.cat(column) for column in zip(*batches, strict=True)))


def validate(encoder: Encoder, template: AffineTemplate, batch: Batch) -> Recovery:
    """B1 of the encoder alone."""
    device = encoder.mean.device
    predicted = predict(encoder, batch.points.to(device))
    return recovery(template, predicted, batch.labels.numpy(), batch.variant.numpy())
