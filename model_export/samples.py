"""Shapes to measure a model on: clouds of real ones, fresh draws, and what is inferred of files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from model_export.realistic import CLOUD_SIZE, RealisticShape, load_cloud
from model_export.synthetic import Augmentation, SyntheticShapes
from service.encode.estimate import Estimate, estimate
from service.encode.model import Model
from service.mesh.formats import read_mesh
from service.mesh.meshfile import MeshFile
from service.mesh.surface import Normalization, Samples, sample_surface

TEST_SEED = 10_000_019


@dataclass(frozen=True)
class Inferred:
    """What the service would answer for a canonically oriented file.

    Attributes:
        mesh: the file.
        samples: of its surface.
        fit: the answer.
    """

    mesh: MeshFile
    samples: Samples
    fit: Estimate


def infer_shape(model: Model, shape: RealisticShape) -> Inferred:
    """Infer a real shape's parameters from its file."""
    mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
    rng = np.random.default_rng(0)
    samples = sample_surface(mesh.vertices, mesh.visible, model.points, rng)
    return Inferred(mesh, samples, estimate(model, samples))


def clouds_of(shapes: Sequence[RealisticShape], cache: Path, points: int) -> list[np.ndarray]:
    """Normalised clouds ``[points, 3]`` of real shapes."""
    # Samples come in the order of the faces: spread the choice over all of them.
    chosen = np.linspace(0, CLOUD_SIZE - 1, points).round().astype(int)
    clouds = [load_cloud(shape, cache)[chosen] for shape in shapes]
    return [Normalization.of(cloud).apply(cloud).astype(np.float32) for cloud in clouds]


def synthetic_samples(model: Model, count: int) -> tuple[list[Samples], np.ndarray, np.ndarray]:
    """Clean surface samples of fresh draws, in metres, their normalised labels and variants."""
    shapes = SyntheticShapes(model.template, Augmentation.none(), TEST_SEED)
    parameters, variant = shapes.draw_parameters(count), shapes.draw_variants(count).numpy()
    samples, labels = [], []
    for index, f in enumerate(parameters):
        template = model.template.variants[variant[index]]
        visible = template.faces[~template.hidden]
        rng = np.random.default_rng([TEST_SEED, index])
        drawn = sample_surface(template.decode(f), visible, model.points, rng)
        normalization = Normalization.of(drawn.points)
        samples.append(drawn)
        labels.append([*(f * normalization.scale), *(-normalization.center * normalization.scale)])
    return samples, np.array(labels), variant
