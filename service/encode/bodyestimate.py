"""From samples of an upload to a body: turn, encode, refine, judge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from service.encode.bodyfit import ROUGH, STANDARD, Anchor, BodySettings, fit_body, posed_by
from service.encode.bodyoutputs import BodyEncoding
from service.encode.bodysamples import COUNT, LOG_SCALE, SHAPE, BodySamples
from service.encode.distance import PROBES, Cloud, inside_out, mesh_distance
from service.mesh.frame import Orientation, orientations
from service.mesh.surface import Normalization, Samples
from service.stages import stage
from service.template.skinned import SHAPES, Body, SkinnedTemplate

Array = NDArray[np.float64]

READINGS = 4
"""Orientations that are tried at most,"""
DOUBT = 5.0
"""with log odds no farther than this below the likeliest's."""
STEEPNESS = 16
"""How fast a reading's worth falls with its distance."""
PLAUSIBLE = (0.72, 1.4)
"""The file's unit is believed where a metre is so many times as long as the encoder thinks."""
SIGMA_FLOOR = 0.01
"""Least standard deviation claimed for a refined parameter, in radians and likewise for shape."""
SIGMA_ENCODER = 0.25
"""Claimed for the encoder alone."""


class Compass(Protocol):
    """Tells which way a cloud is turned; see `service.encode.discriminator`."""

    def odds(self, cloud: Array, orientations: Sequence[Orientation]) -> Array:
        """Log odds ``[k]`` of each orientation of a cloud ``[n, 3]``."""


class BodyEncoder(Protocol):
    """What is asked of a model."""

    @property
    def template(self) -> SkinnedTemplate:
        """The body."""

    @property
    def discriminator(self) -> Compass:
        """Tells which way a cloud is turned."""

    def encode(self, points: Array) -> BodyEncoding:
        """The answer for a normalised cloud ``[points, 3]``."""


@dataclass(frozen=True)
class BodyEstimate:
    """A body in its normalised canonical frame.

    Attributes:
        body: its scale is the normalised length of a metre of the template.
        sigma: ``[75]`` standard deviations of its parameters.
        distance: `surface_distance` of the fit.
        encoder_distance: the same for the encoder's answer alone.
        normalization: from the canonical frame.
        inside_out: the upload's faces are wound the wrong way round, as a mirrored mesh's are.
    """

    body: Body
    sigma: Array
    distance: float
    encoder_distance: float
    normalization: Normalization
    inside_out: bool

    @property
    def turn(self) -> Array:
        """``[3, 3]`` the global orientation."""
        return np.asarray(self.body.rotations[0])


def estimate_body(
    model: BodyEncoder,
    samples: Samples,
    refined: bool,
    rough: bool = False,
    metre: float | None = None,
    settings: BodySettings = STANDARD,
) -> BodyEstimate:
    """Infer a body that may face, lie or stand on its head any way.

    Args:
        model: the category.
        samples: `model.points` samples in canonical orientation, any scale and place.
        refined: go on from the encoder's answer by refinement.
        rough: only as well as is needed to tell readings apart.
        metre: its length in the unit of the samples, if the file tells; it is believed if the body
            then has a usual size.
        settings: of the refinement.
    """
    normalization = Normalization.of(samples.points)
    cloud = Cloud(normalization.apply(samples.points), samples.normals)
    anchor, turned = _best_anchor(model, samples, cloud)
    if turned:
        cloud = Cloud(cloud.points, -cloud.normals)
    if metre is not None:
        known = normalization.scale * metre
        if PLAUSIBLE[0] < known / anchor.body.scale < PLAUSIBLE[1]:
            anchor = replace(anchor, log_scale=float(np.log(known)))
    template = model.template
    start = posed_by(template, anchor)
    distance = mesh_distance(template.decode(start), template.faces, cloud)
    sigma = np.full(3 * COUNT + SHAPES, SIGMA_ENCODER)
    if not refined:
        return BodyEstimate(start, sigma, distance, distance, normalization, turned)
    with stage("refine"):
        fit = fit_body(template, replace(anchor, body=start), cloud, ROUGH if rough else settings)
        final = mesh_distance(template.decode(fit.body), template.faces, cloud)
    spread = np.sqrt(np.diag(fit.covariance))[:LOG_SCALE]
    spread[SHAPE] = np.maximum(spread[SHAPE], SIGMA_FLOOR)
    return BodyEstimate(
        fit.body, np.hypot(spread, SIGMA_FLOOR), final, distance, normalization, turned
    )


def _best_anchor(model: BodyEncoder, samples: Samples, cloud: Cloud) -> tuple[Anchor, bool]:
    """The encoder's answer for the orientation whose rough fit is best, and whether the faces are
    inside out."""
    template, ways = model.template, orientations()
    odds = model.discriminator.odds(samples.points, ways)
    order = np.argsort(-odds, kind="stable")[:READINGS]
    tried = [index for index in order if odds[index] > odds[order[0]] - DOUBT]
    anchors = []
    for index in tried:
        way = ways[index]
        with stage("encode"):
            encoding = model.encode(way.to_canonical(cloud.points)).turned(way.rotation.T)
        anchors.append(Anchor(encoding.joints, encoding.body(template)))
    starts = [posed_by(template, anchor) for anchor in anchors]
    turned = opposes(template, starts[0], cloud)
    if len(anchors) == 1:
        return anchors[0], turned
    facing = Cloud(cloud.points, -cloud.normals) if turned else cloud
    worths = []
    for index, anchor, start in zip(tried, anchors, starts, strict=True):
        with stage("refine"):
            fit = fit_body(template, replace(anchor, body=start), facing, ROUGH)
            distance = mesh_distance(template.decode(fit.body), template.faces, facing)
        worths.append(float(odds[index]) - STEEPNESS * np.log(distance))
    return anchors[int(np.argmax(worths))], turned


def opposes(template: SkinnedTemplate, body: Body, cloud: Cloud) -> bool:
    """Whether a cloud's normals point into the body."""
    return inside_out(*BodySamples.drawn(template, PROBES).at(body), cloud)
