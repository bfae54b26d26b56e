"""Which distances of fits are usual for a category: what recognition and scores go by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model_export.realistic import RealisticShape
from service.encode.estimate import estimate
from service.encode.model import Model
from service.encode.recognition import roughly
from service.mesh.formats import read_mesh
from service.mesh.frame import CANONICAL
from service.mesh.surface import Samples, sample_surface

USUAL, LIMIT = 75, 95
"""Percentiles of the shapes' distances: taken at once in their first orientation; half a score."""
DRAWN = 3.0
"""How much farther real shapes lie than noise-free template shapes, where there are none to see."""


def calibrate(
    model: Model, shapes: Sequence[RealisticShape], drawn: Sequence[Samples]
) -> dict[str, float]:
    """The card's ``calibration``.

    Args:
        model: the category; its card need not have a calibration yet.
        shapes: ordinary real shapes, canonically oriented; may be none.
        drawn: samples of template shapes, for a category without real ones.
    """
    samples = [_samples(model, shape) for shape in shapes] or list(drawn)
    factor = 1.0 if shapes else DRAWN
    rough = [roughly(model, s, CANONICAL).estimate.distance for s in samples]
    full = [estimate(model, s).distance for s in samples]
    return {
        "shapes": len(shapes),
        "usual_distance": round(factor * float(np.percentile(rough, USUAL)), 5),
        "limit_distance": round(factor * float(np.percentile(full, LIMIT)), 5),
    }


def _samples(model: Model, shape: RealisticShape) -> Samples:
    mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
    return sample_surface(mesh.vertices, mesh.faces, model.points, np.random.default_rng(0))
