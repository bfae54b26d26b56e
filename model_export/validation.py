"""The same shapes for every run, synthetic and real, to see how well its encoder does alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from model_export.metrics import Recovery, recovery
from model_export.networks import Encoder
from model_export.realistic import find_shapes
from model_export.synthetic import Augmentation, Batch, SyntheticShapes
from service.encode.distance import Cloud, surface_distance
from service.mesh.formats import read_mesh
from service.mesh.surface import Normalization, sample_surface
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


def held_out_clouds(folder: Path, points: int) -> list[Cloud]:
    """Normalised samples of the real shapes that no run trains on, as the service draws them.

    Raises:
        ShapeError: when one can't be read.
    """
    clouds = []
    for shape in find_shapes(folder):
        if shape.held_out:
            mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
            rng = np.random.default_rng(0)
            samples = sample_surface(mesh.vertices, mesh.visible, points, rng)
            normalised = Normalization.of(samples.points).apply(samples.points)
            clouds.append(Cloud(normalised, samples.normals))
    return clouds


def real_distances(
    encoder: Encoder, template: AffineTemplate, clouds: Sequence[Cloud]
) -> np.ndarray:
    """B2 of the encoder alone: ``[n]`` surface distances of its templates over the diagonals."""
    points = torch.as_tensor(np.stack([cloud.points for cloud in clouds]), dtype=torch.float32)
    outputs = predict(encoder, points.to(encoder.mean.device)).astype(np.float64)
    size = len(template.parameters)
    distances = []
    for answer, cloud in zip(outputs, clouds, strict=True):
        odds = answer[size + 3 :]
        own = template.variants[odds.argmax() if odds.size else 0]
        distances.append(surface_distance(own, answer[:size], answer[size : size + 3], cloud))
    return np.array(distances)
