"""From samples of an upload to its parameters: normalise, encode, refine, judge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from service.encode.affineoutputs import Encoding
from service.encode.basemodel import STEEPNESS
from service.encode.distance import PROBES, Cloud, inside_out, surface_distance
from service.encode.refine import STANDARD, Settings, refine
from service.mesh.surface import Normalization, Samples, sample_surface
from service.stages import stage
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

DIVERGED = 1.5
"""A refinement that ends this much farther from the mesh than it began has lost its way."""
SIGMA_FLOOR = 0.002
"""Least standard deviation claimed for a refined parameter: the repeat error of measuring real
shapes by hand is of this size (in the normalised frame's unit)."""
SIGMA_ENCODER = 0.04
"""Claimed for the encoder alone, likewise."""
CHOICES, DOUBT = 2, 0.02
"""Variants of the template that are fitted at most, and how likely the second must seem beside the
first."""


class AffineEncoder(Protocol):
    """What is asked of a model."""

    template: AffineTemplate

    @property
    def sigma_scale(self) -> Array:
        """``[d]`` what a fit's own standard deviations are multiplied by to be honest."""

    def encode(self, points: Array) -> Encoding:
        """The answer for a normalised cloud ``[points, 3]``."""


@dataclass(frozen=True)
class Estimate:
    """Parameters of a shape in its normalised canonical frame.

    Attributes:
        template: the variant of the category's template that the shape is one of.
        parameters: ``[d]``.
        translation: ``[3]`` of the template's origin.
        sigma: ``[d]`` standard deviations.
        distance: `surface_distance` of the fit.
        encoder_distance: the same for the encoder's answer alone.
        normalization: from the canonical frame.
        inside_out: the upload's faces are wound the wrong way round, as a mirrored mesh's are.
    """

    template: AffineTemplate
    parameters: Array
    translation: Array
    sigma: Array
    distance: float
    encoder_distance: float
    normalization: Normalization
    inside_out: bool

    @property
    def turn(self) -> Array:
        """``[3, 3]``: none, for a fit that stands upright."""
        return np.eye(3)


def estimate(
    model: AffineEncoder,
    samples: Samples,
    refined: bool = True,
    settings: Settings = STANDARD,
    stride: int = 1,
) -> Estimate:
    """Infer a shape's parameters.

    Args:
        model: the category.
        samples: `model.points` samples in canonical orientation, any scale and place.
        refined: go on from the encoder's answer by refinement; where several variants of the
            template are likely, of each, and take the one that fits.
        settings: of the refinement.
        stride: every so-many-th sample is refined and measured on; the encoder sees them all.
    """
    normalization = Normalization.of(samples.points)
    points = normalization.apply(samples.points)
    with stage("encode"):
        encoding = model.encode(points)
    order = np.argsort(-encoding.shares, kind="stable")
    likeliest = model.template.variants[order[0]]
    # Samples come in the order of the faces, so that every so-many-th is a fair draw.
    cloud = Cloud(points[::stride], samples.normals[::stride])
    turned = opposes(likeliest, encoding, cloud)
    if turned:
        cloud = Cloud(cloud.points, -cloud.normals)
    if not refined:
        return _encoded(likeliest, encoding, cloud, normalization, turned)
    fits = []
    for index in order[:CHOICES]:
        if encoding.shares[index] < DOUBT * encoding.shares[order[0]]:
            continue
        variant = model.template.variants[index]
        start = _encoded(variant, encoding, cloud, normalization, turned)
        fit = _refined(start, cloud, settings, model.sigma_scale)
        # As in recognition: how likely it seemed, and how well it fits.
        fits.append((encoding.shares[index] * fit.distance**-STEEPNESS, fit))
    return max(fits, key=lambda pair: pair[0])[1]


def _encoded(
    variant: AffineTemplate,
    encoding: Encoding,
    cloud: Cloud,
    normalization: Normalization,
    turned: bool,
) -> Estimate:
    """The encoder's answer, for one variant."""
    parameters, translation = encoding.parameters, encoding.translation
    distance = surface_distance(variant, parameters, translation, cloud)
    sigma = np.full(len(parameters), SIGMA_ENCODER)
    return Estimate(
        variant, parameters, translation, sigma, distance, distance, normalization, turned
    )


def _refined(start: Estimate, cloud: Cloud, settings: Settings, scale: Array) -> Estimate:
    """A fit from the encoder's answer on, unless it goes astray; its sigma is times ``scale``."""
    with stage("refine"):
        fit = refine(start.template, start.parameters, start.translation, cloud, settings)
        distance = surface_distance(start.template, fit.parameters, fit.translation, cloud)
    if distance > DIVERGED * start.distance:
        return start
    return replace(
        start,
        parameters=fit.parameters,
        translation=fit.translation,
        sigma=np.hypot(scale * fit.sigma, SIGMA_FLOOR),
        distance=distance,
    )


def opposes(template: AffineTemplate, encoding: Encoding, cloud: Cloud) -> bool:
    """Whether a cloud's normals point into the shape that the template says it is."""
    visible = template.faces[~template.hidden]
    vertices = template.decode(encoding.parameters) + encoding.translation
    samples = sample_surface(vertices, visible, PROBES, np.random.default_rng(3))
    return inside_out(samples.points, samples.normals, cloud)
