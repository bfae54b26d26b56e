"""What is taken to be known of a detailed shape before it is edited."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model_export.detailed import DetailedShape
from service.encode.estimate import estimate
from service.encode.model import Model
from service.mesh.surface import Normalization, sample_surface
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Known:
    """A template over a mesh.

    Attributes:
        template: the variant.
        f, t: ``[d]`` and ``[3]`` parameters and place in the mesh's normalised frame.
    """

    template: AffineTemplate
    f: Array
    t: Array


def told(shape: DetailedShape, category: AffineTemplate, frame: Normalization, off: Array) -> Known:
    """The truth, with the public parameters wrong by factors ``off [n]``."""
    values = dict(zip(shape.names, (shape.parameters * off).tolist(), strict=True))
    template = next(own for own in category.variants if own.variant == shape.variant)
    f = category.vector(values | shape.nuisances) * frame.scale
    return Known(template, f, -frame.center * frame.scale)


def wrong_by(error: float, seed: int, count: int) -> Array:
    """``[count]`` factors, each ``1 + error`` or ``1 - error``."""
    return 1.0 + error * np.random.default_rng([7, seed]).choice([-1.0, 1.0], count)


def inferred(model: Model, vertices: Array, faces: NDArray[np.int64]) -> Known:
    """What the service infers of a mesh, upright as it stands.

    Args:
        model: the category.
        vertices: ``[V, 3]`` in the normalised canonical frame.
        faces: ``[F, 3]``.
    """
    samples = sample_surface(vertices, faces, model.points, np.random.default_rng(0))
    fit = estimate(model, samples)
    # The samples were normalised once more; the way back is a scale and a shift.
    own = fit.normalization
    return Known(fit.template, fit.parameters / own.scale, fit.translation / own.scale + own.center)
