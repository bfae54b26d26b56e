"""From samples of an upload to its parameters: normalise, encode, refine, judge."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from service.encode.distance import surface_distance
from service.encode.model import Model
from service.encode.refine import Cloud, refine
from service.mesh.surface import Normalization, Samples

Array = NDArray[np.float64]

SIGMA_FLOOR = 0.004
"""Least standard deviation claimed for a refined parameter: the repeat error of measuring real
shapes by hand is of this size (share of the radius 0.6 frame's unit)."""
SIGMA_ENCODER = 0.04
"""Standard deviation claimed for the encoder alone, likewise."""


@dataclass(frozen=True)
class Estimate:
    """Parameters of a shape in its normalised canonical frame.

    Attributes:
        parameters: ``[d]``.
        translation: ``[3]`` of the template's origin.
        sigma: ``[d]`` standard deviations.
        distance: `surface_distance` of the fit.
        encoder_distance: the same for the encoder's answer alone.
        normalization: from the canonical frame.
    """

    parameters: Array
    translation: Array
    sigma: Array
    distance: float
    encoder_distance: float
    normalization: Normalization


def estimate(model: Model, samples: Samples, refined: bool = True) -> Estimate:
    """Infer a shape's parameters.

    Args:
        model: the category.
        samples: `model.points` samples in canonical orientation, any scale and place.
        refined: go on from the encoder's answer by refinement.
    """
    normalization = Normalization.of(samples.points)
    points = normalization.apply(samples.points)
    parameters, translation = model.encode(points)
    distance = surface_distance(model.template, parameters, translation, points, samples.normals)
    sigma = np.full(len(parameters), SIGMA_ENCODER)
    encoded = Estimate(parameters, translation, sigma, distance, distance, normalization)
    if not refined:
        return encoded
    fit = refine(model.template, parameters, translation, Cloud(points, samples.normals))
    fitted = surface_distance(
        model.template, fit.parameters, fit.translation, points, samples.normals
    )
    if fitted > distance:
        return encoded
    return replace(
        encoded,
        parameters=fit.parameters,
        translation=fit.translation,
        sigma=np.hypot(fit.sigma, SIGMA_FLOOR),
        distance=fitted,
    )
