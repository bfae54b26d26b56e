"""Refinement of a body: pose, shape, scale and place, from the encoder's answer on.

Levenberg's method on the robust point-to-plane distance between samples of the upload and of the
template, both ways.  What the surface can't tell (a twist of an arm, a hand in a pocket) is held by
what the encoder said, and by how far joints bend.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from service import deadline
from service.encode.bodysamples import (
    COUNT,
    LOG_SCALE,
    SHAPE,
    STEP,
    BodySamples,
    Linearisation,
    stepped,
)
from service.encode.distance import Cloud
from service.template.anatomy import JOINTS, PARENTS, limits
from service.template.skinned import Body, SkinnedTemplate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stage:
    """Of the refinement; lengths in the normalised frame, where the body has radius 0.6.

    Attributes:
        iterations: how many.
        places: samples of the template.
        stride: one in so many of the upload's samples is looked at.
        largest, smallest: scale of the robust kernel, which shrinks.
        inside: weight of where the template lies outside of the upload, relative to inside: clothes
            are worn outside.
    """

    iterations: int
    places: int
    stride: int
    largest: float
    smallest: float
    inside: float


@dataclass(frozen=True)
class BodySettings:
    """Of the refinement; lengths in the normalised frame.

    Attributes:
        stages: one after the other.
        sigma: how far a surface lies off the fitted one, clothes and all.
        counted: how many of the samples tell something of their own.
        sigma_vote: of the encoder's joints.
        sigma_shape: of the shape, in standard deviations of the population.
        sigma_limit: how far joints bend beyond their limits, in radians.
        sigma_scale: of the logarithm of the scale, where it is known.
        normal_weight: length that a right angle between normals counts as.
        slide: weight of residuals along the surface, relative to those across it.
    """

    stages: tuple[Stage, ...] = (
        Stage(10, 400, 4, 0.12, 0.06, 1.0),
        Stage(12, 1600, 1, 0.06, 0.03, 3.0),
    )
    sigma: float = 0.01
    counted: float = 500.0
    sigma_vote: float = 0.06
    sigma_shape: float = 1.2
    sigma_limit: float = 0.1
    sigma_scale: float = 0.02
    normal_weight: float = 0.05
    slide: float = 0.3


DAMPING = 1e-3
"""Share of the Hessian's diagonal that is added to it."""
STANDARD = BodySettings()
ROUGH = BodySettings(stages=(Stage(6, 300, 6, 0.12, 0.05, 1.0),))
"""Enough refinement to tell readings apart."""


@dataclass(frozen=True)
class Anchor:
    """What the encoder said, for a refinement to hold on to.

    Attributes:
        joints: ``[24, 3]``.
        body: pose, shape, scale and place.
        log_scale: logarithm of the scale where the upload's unit tells it, else None.
    """

    joints: Array
    body: Body
    log_scale: float | None = None


@dataclass(frozen=True)
class BodyFit:
    """Result of a refinement.

    Attributes:
        body: the fit.
        covariance: ``[STEP, STEP]`` of a step from it.
    """

    body: Body
    covariance: Array


class _System:
    """Normal equations of half a sum of squares, added up term by term."""

    def __init__(self) -> None:
        self.hessian = np.zeros((STEP, STEP))
        self.gradient = np.zeros(STEP)

    def add(self, rows: Array, miss: Array, weight: Array) -> None:
        """Residuals ``miss [m]`` of derivative ``rows [m, STEP]`` and weights ``[m]``."""
        weighted = rows * weight[:, None]
        self.hessian += weighted.T @ rows
        self.gradient += weighted.T @ miss

    def solve(self, damping: float) -> Array:
        """The damped step downhill."""
        damped = self.hessian + np.diag(damping * np.diag(self.hessian) + 1e-9)
        return np.asarray(np.linalg.solve(damped, -self.gradient), dtype=np.float64)


def posed_by(template: SkinnedTemplate, anchor: Anchor, settings: BodySettings = STANDARD) -> Body:
    """A body whose joints and rotations agree as well as they can with the encoder's."""
    samples = BodySamples.drawn(template, 1)
    body = anchor.body
    for _ in range(6):
        line = samples.linearise(body)
        system = _System()
        _hold(system, line, body, anchor, settings, vote=0.5)
        body = stepped(body, line.turned, np.clip(system.solve(1e-3), -0.5, 0.5))
    return body


def fit_body(
    template: SkinnedTemplate, anchor: Anchor, cloud: Cloud, settings: BodySettings = STANDARD
) -> BodyFit:
    """Fit the template to a cloud.

    Args:
        template: the body.
        anchor: the encoder's answer; the refinement begins with its body.
        cloud: the upload, normalised.
        settings: of the optimisation.
    """
    body = anchor.body
    for stage in settings.stages:
        samples = BodySamples.drawn(template, stage.places)
        points, normals = cloud.points[:: stage.stride], cloud.normals[:: stage.stride]
        features = np.hstack([points, settings.normal_weight * normals])
        tree = cKDTree(features, balanced_tree=False, compact_nodes=False)
        for scale in np.geomspace(stage.largest, stage.smallest, stage.iterations):
            deadline.check()
            line = samples.linearise(body)
            system = _System()
            _surface(system, line, points, features, tree, scale, stage.inside, settings)
            _hold(system, line, body, anchor, settings, vote=1.0)
            body = stepped(body, line.turned, np.clip(system.solve(DAMPING), -0.3, 0.3))
    covariance = np.linalg.inv(system.hessian + 1e-9 * np.eye(STEP))
    return BodyFit(body, np.asarray(covariance, dtype=np.float64))


def _surface(
    system: _System,
    line: Linearisation,
    points: Array,
    features: Array,
    tree: cKDTree,
    scale: float,
    inside: float,
    settings: BodySettings,
) -> None:
    """Distance between samples of the template and of the upload, both ways."""
    own = np.hstack([line.points, settings.normal_weight * line.normals])
    there = tree.query(own)[1]
    back = cKDTree(own, balanced_tree=False, compact_nodes=False).query(features)[1]
    sample = np.concatenate([np.arange(len(own)), back])
    gap = line.points[sample] - points[np.concatenate([there, np.arange(len(back))])]
    squared = np.square(gap).sum(axis=1)
    share = np.repeat(0.5 / np.array([len(own), len(back)]), [len(own), len(back)])
    # Geman and McClure's kernel, whose weight falls to nothing.
    weight = share * settings.counted / settings.sigma**2 / (1.0 + squared / scale**2) ** 2
    off = np.einsum("pc,pc->p", line.normals[sample], gap)
    weight = weight * np.where(off > 0.0, inside, 1.0)
    # Samples are few and pairs many: gather the pairs' sums on their samples first.
    count = len(own)
    across = np.bincount(sample, weight * (1.0 - settings.slide), count)
    across_gap = np.bincount(sample, weight * (1.0 - settings.slide) * off, count)
    whole = np.bincount(sample, weight * settings.slide, count)
    whole_gap = np.stack(
        [np.bincount(sample, weight * settings.slide * gap[:, c], count) for c in range(3)], axis=1
    )
    flat = line.jacobian.reshape(-1, STEP)
    planes = np.einsum("nc,ncd->nd", line.normals, line.jacobian)
    system.hessian += (planes * across[:, None]).T @ planes
    system.gradient += planes.T @ across_gap
    system.hessian += (flat * np.repeat(whole, 3)[:, None]).T @ flat
    system.gradient += flat.T @ whole_gap.ravel()


def _hold(
    system: _System,
    line: Linearisation,
    body: Body,
    anchor: Anchor,
    settings: BodySettings,
    vote: float,
) -> None:
    """What is known without the surface: votes, rotations, reach of the joints, shape, scale."""
    miss = line.joints - anchor.joints
    even = 1.0 / (1.0 + np.square(miss).sum(axis=1) / (4.0 * settings.sigma_vote) ** 2) ** 2
    weight = np.repeat(even / (vote * settings.sigma_vote) ** 2, 3)
    system.add(line.joint_jacobian.reshape(-1, STEP), miss.ravel(), weight)
    # Turns in the parents' frames.
    parents = np.concatenate([np.eye(3)[None], line.turned[list(PARENTS[1:])]]).transpose(0, 2, 1)
    rows = np.zeros((3 * COUNT, STEP))
    for joint in range(COUNT):
        own = slice(3 * joint, 3 * joint + 3)
        rows[own, own] = parents[joint]
    away = Rotation.from_matrix(body.rotations @ anchor.body.rotations.transpose(0, 2, 1))
    system.add(rows, away.as_rotvec().ravel(), np.repeat(1.0 / _SIGMA_TURN**2, 3))
    vectors = Rotation.from_matrix(body.rotations).as_rotvec()
    beyond = np.minimum(vectors - _LOW, 0.0) + np.maximum(vectors - _HIGH, 0.0)
    beyond[0] = 0.0
    held = np.where(beyond != 0.0, 1.0 / settings.sigma_limit**2, 0.0)
    system.add(rows, beyond.ravel(), held.ravel())
    each = np.eye(STEP)
    system.add(each[SHAPE], body.shape, np.full(len(body.shape), settings.sigma_shape**-2))
    known = anchor.log_scale
    target, sigma = (known, settings.sigma_scale) if known is not None else (
        np.log(anchor.body.scale), 0.15)  # fmt: skip
    system.add(each[[LOG_SCALE]], np.array([np.log(body.scale) - target]), np.array([sigma**-2]))


_LOW, _HIGH = limits()
_LOOSE = {"pelvis": 0.5, "shoulder": 0.45, "elbow": 0.4, "hip": 0.4, "knee": 0.4}
_SIGMA_TURN = np.array([_LOOSE.get(name.split("_")[-1], 0.2) for name in JOINTS])
"""How far the encoder's rotations may be off, in radians: the joints of long limbs turn most."""
