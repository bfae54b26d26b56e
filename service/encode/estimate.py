"""From samples of an upload to its parameters: normalise, encode, refine, judge."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service.encode.distance import Cloud, surface_distance
from service.encode.model import Model
from service.encode.refine import STANDARD, Settings, refine
from service.mesh.surface import Normalization, Samples, sample_surface
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

SIGMA_FLOOR = 0.004
"""Least standard deviation claimed for a refined parameter: the repeat error of measuring real
shapes by hand is of this size (share of the radius 0.6 frame's unit)."""
DIVERGED = 1.5
"""A refinement that ends this much farther from the mesh than it began has lost its way."""
PROBES = 600
"""Points by which normals are compared."""
OPPOSED = -0.3
"""A cloud whose normals agree with the template's no better than this, on the mean, is inside
out."""
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
        inside_out: the upload's faces are wound the wrong way round, as a mirrored mesh's are.
    """

    parameters: Array
    translation: Array
    sigma: Array
    distance: float
    encoder_distance: float
    normalization: Normalization
    inside_out: bool


def estimate(
    model: Model,
    samples: Samples,
    refined: bool = True,
    settings: Settings = STANDARD,
    stride: int = 1,
) -> Estimate:
    """Infer a shape's parameters.

    Args:
        model: the category.
        samples: `model.points` samples in canonical orientation, any scale and place.
        refined: go on from the encoder's answer by refinement.
        settings: of the refinement.
        stride: every so-many-th sample is refined and measured on; the encoder sees them all.
    """
    normalization = Normalization.of(samples.points)
    points = normalization.apply(samples.points)
    parameters, translation = model.encode(points)
    # Samples come in the order of the faces, so that every so-many-th is a fair draw.
    cloud = Cloud(points[::stride], samples.normals[::stride])
    inside_out = opposes(model.template, parameters, translation, cloud)
    if inside_out:
        cloud = Cloud(cloud.points, -cloud.normals)
    distance = surface_distance(model.template, parameters, translation, cloud)
    sigma = np.full(len(parameters), SIGMA_ENCODER)
    encoded = Estimate(
        parameters, translation, sigma, distance, distance, normalization, inside_out
    )
    if not refined:
        return encoded
    fit = refine(model.template, parameters, translation, cloud, settings)
    fitted = surface_distance(model.template, fit.parameters, fit.translation, cloud)
    if fitted > DIVERGED * distance:
        return encoded
    return replace(
        encoded,
        parameters=fit.parameters,
        translation=fit.translation,
        sigma=np.hypot(fit.sigma, SIGMA_FLOOR),
        distance=fitted,
    )


def opposes(template: AffineTemplate, parameters: Array, translation: Array, cloud: Cloud) -> bool:
    """Whether a cloud's normals point into the shape that the template says it is."""
    visible = template.faces[~template.hidden]
    vertices = template.decode(parameters) + translation
    samples = sample_surface(vertices, visible, PROBES, np.random.default_rng(3))
    step = max(1, len(cloud.points) // PROBES)
    nearest = cKDTree(samples.points).query(cloud.points[::step])[1]
    cosine = np.einsum("nc,nc->n", samples.normals[nearest], cloud.normals[::step])
    return float(cosine.mean()) < OPPOSED
