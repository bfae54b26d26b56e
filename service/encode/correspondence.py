"""Fit of a body to vertices that correspond to its own, one by one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.encode.bodyfit import BodyFit
from service.encode.bodysamples import LOG_SCALE, SHAPE, STEP, BodySamples, stepped
from service.template.skinned import Body, SkinnedTemplate

Array = NDArray[np.float64]

PLACES = 1500
"""Vertices that are looked at."""
ITERATIONS = 30
SIGMA, ROBUST = 0.002, 0.05
"""How far vertices are off, and from where on they count for little, in metres of the body."""
SIGMA_SHAPE, SIGMA_SCALE = 3.0, 1.0
"""Weak priors: stature and scale can't be told apart but by proportions."""
COUNTED = 100.0
"""How many of the vertices tell something of their own."""


def fit_vertices(
    template: SkinnedTemplate, start: Body, vertices: Array, log_scale: float | None = None
) -> BodyFit:
    """Fit pose, shape, scale and place by a damped Gauss-Newton method.

    Args:
        template: the body.
        start: where to begin.
        vertices: ``[V, 3]`` in the template's order.
        log_scale: logarithm of the scale where it is known, else None.
    """
    chosen = np.linspace(0, len(vertices) - 1, min(PLACES, len(vertices))).round().astype(np.int64)
    samples, targets = BodySamples.of_vertices(template, chosen), vertices[chosen]
    target = float(np.log(start.scale)) if log_scale is None else log_scale
    firm = SIGMA_SCALE if log_scale is None else 0.01
    prior = np.zeros(STEP)
    prior[SHAPE], prior[LOG_SCALE] = SIGMA_SHAPE**-2, firm**-2
    body = start
    for _ in range(ITERATIONS):
        deadline.check()
        line = samples.linearise(body)
        gap = line.points - targets
        squared = np.square(gap).sum(axis=1) / body.scale**2
        weight = COUNTED / len(gap) / (SIGMA * body.scale) ** 2 / (1.0 + squared / ROBUST**2) ** 2
        rows = line.jacobian.reshape(-1, STEP)
        weighted = rows * np.repeat(weight, 3)[:, None]
        hessian = weighted.T @ rows + np.diag(prior)
        gradient = weighted.T @ gap.ravel()
        gradient[SHAPE] += prior[SHAPE] * body.shape
        gradient[LOG_SCALE] += prior[LOG_SCALE] * (np.log(body.scale) - target)
        damped = hessian + np.diag(1e-6 * np.diag(hessian) + 1e-9)
        step = np.clip(np.linalg.solve(damped, -gradient), -0.5, 0.5)
        body = stepped(body, line.turned, step)
        if np.abs(step).max() < 1e-6:
            break
    covariance = np.linalg.inv(hessian + 1e-9 * np.eye(STEP))
    return BodyFit(body, np.asarray(covariance, dtype=np.float64))
