"""Refinement: fit the analytic decoder to the upload, starting from the encoder's answer.

A damped Gauss-Newton on the two-way distance between samples of the upload and of the template (see
`service.encode.residuals`).  Since template points are affine in the parameters, each step is one
small linear solve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.encode.affineoutputs import positive
from service.encode.distance import Cloud
from service.encode.residuals import Matcher, MovingSamples, normal_equations
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Settings:
    """How a refinement goes about it; lengths are in the normalised frame (radius 0.6).

    Attributes:
        iterations: Gauss-Newton steps,
        rough: the first of them on one in `STRIDE` samples.
        template_points: samples on the template.
        coarse, fine: scale of the robust kernel at the first and the last step.
        normal_weight: length that a right angle between normals counts as, in matching.
        pull: weight of the encoder's answer.
    """

    iterations: int = 20
    rough: int = 12
    template_points: int = 1600
    coarse: float = 0.30
    fine: float = 0.04
    normal_weight: float = 0.10
    pull: float = 5e-6


STANDARD = Settings()
STRIDE = 3
"""At a wide kernel's scale a fraction of the samples shows the way as well."""
SPREAD = 0.1
"""How far off the encoder's answer the pull expects the fit to end."""
SIGMA_SAMPLES = 40
"""Independent measurements that the correlated residuals of a fit are worth."""


@dataclass(frozen=True)
class Fit:
    """Where a refinement ended.

    Attributes:
        parameters: ``[d]``, normalised.
        translation: ``[3]`` of the template's origin.
        sigma: ``[d]`` standard deviation of each parameter.
        residual: mean robust cost; smaller fits better.
    """

    parameters: Array
    translation: Array
    sigma: Array
    residual: float


def refine(
    template: AffineTemplate,
    parameters: Array,
    translation: Array,
    cloud: Cloud,
    settings: Settings = STANDARD,
) -> Fit:
    """Fit the template to a cloud.

    Args:
        template: the category's decoder.
        parameters, translation: ``[d]`` and ``[3]``, the encoder's answer, normalised.
        cloud: the upload.
        settings: of the optimisation.

    Returns:
        The fitted parameters, sizes no smaller than `SMALLEST`.
    """
    start = np.concatenate([parameters, translation])
    prior = np.full(len(start), settings.pull / SPREAD**2)
    state = start.copy()
    scales = np.geomspace(settings.coarse, settings.fine, settings.iterations)
    stages = [(STRIDE, scales[: settings.rough]), (1, scales[settings.rough :])]
    for stride, own in stages if settings.rough else stages[1:]:
        moving, matcher = _sampled(template, state, cloud, settings, stride)
        for scale in own:
            deadline.check()
            system = normal_equations(moving, matcher, state, scale)
            hessian = system.hessian + np.diag(prior)
            damped = hessian + 1e-4 * np.diag(np.diag(hessian)) + 1e-9 * np.eye(len(state))
            step = np.linalg.solve(damped, -system.gradient + prior * (start - state))
            state = state + np.clip(step, -0.15, 0.15)
            state[: len(parameters)] = _admissible(template, state[: len(parameters)])
    system = normal_equations(moving, matcher, state, settings.fine)
    covariance = np.linalg.inv(system.hessian + np.diag(prior))
    sigma = np.sqrt(np.diag(covariance) * system.cost / SIGMA_SAMPLES)
    d = len(parameters)
    return Fit(state[:d], state[d:], sigma[:d], system.cost)


def _sampled(
    template: AffineTemplate, state: Array, cloud: Cloud, settings: Settings, stride: int
) -> tuple[MovingSamples, Matcher]:
    """Samples of the template at a state and of the upload, one in so many."""
    count = settings.template_points // stride
    moving = MovingSamples(template, state[:-3], count)
    return moving, Matcher(cloud, settings.normal_weight, stride)


def _admissible(template: AffineTemplate, parameters: Array) -> Array:
    """The nearest parameters, or nearly so, with positive sizes that keep the relations."""
    for constant, *row in template.relations:
        lack = -(constant + parameters @ row)
        if lack > 0.0:
            parameters = parameters + np.array(row) * (lack / np.dot(row, row))
    return positive(template, parameters)
