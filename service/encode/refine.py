"""Refinement: fit the analytic decoder to the upload, starting from the encoder's answer.

A damped Gauss-Newton on the two-way distance between samples of the upload and of the template.
Since template points are affine in the parameters, each step is one small linear solve.  Pairs are
nearest neighbours in position and normal, so that thin seats keep their two sides apart; residuals
count fully along the template's normal and little along its surface; far pairs (arms, wheels,
whatever the template lacks) lose their weight as the scale of the robust kernel shrinks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service import deadline
from service.encode.distance import Cloud
from service.encode.model import positive
from service.mesh.surface import sample_surface
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Settings:
    """How a refinement goes about it; lengths are in the normalised frame (radius 0.6).

    Attributes:
        iterations: Gauss-Newton steps.
        template_points: samples on the template.
        coarse, fine: scale of the robust kernel at the first and the last step.
        normal_weight: length that a right angle between normals counts as, in matching.
        slide: weight of residuals along the surface, relative to those across it.
        pull: weight of the encoder's answer.
    """

    iterations: int = 20
    template_points: int = 1600
    coarse: float = 0.30
    fine: float = 0.04
    normal_weight: float = 0.10
    slide: float = 0.10
    pull: float = 5e-6


STANDARD = Settings()


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
    moving = _MovingSamples(template, parameters, settings.template_points)
    matcher = _Matcher(cloud, settings.normal_weight)
    spread = np.concatenate([np.full(len(parameters), 0.1), np.full(3, 0.1)])
    state = start.copy()
    scales = np.geomspace(settings.coarse, settings.fine, settings.iterations)
    for scale in scales:
        deadline.check()
        system = _normal_equations(moving, matcher, state, scale, settings.slide)
        prior = settings.pull / spread**2
        hessian = system.hessian + np.diag(prior)
        damped = hessian + 1e-4 * np.diag(np.diag(hessian)) + 1e-9 * np.eye(len(state))
        step = np.linalg.solve(damped, -system.gradient + prior * (start - state))
        state = state + np.clip(step, -0.15, 0.15)
        state[: len(parameters)] = _admissible(template, state[: len(parameters)])
    system = _normal_equations(moving, matcher, state, settings.fine, settings.slide)
    covariance = np.linalg.inv(system.hessian + np.diag(settings.pull / spread**2))
    sigma = np.sqrt(np.diag(covariance) * system.cost / SIGMA_SAMPLES)
    d = len(parameters)
    return Fit(state[:d], state[d:], sigma[:d], system.cost)


def _admissible(template: AffineTemplate, parameters: Array) -> Array:
    """The nearest parameters, or nearly so, with positive sizes that keep the relations."""
    for constant, *row in template.relations:
        lack = -(constant + parameters @ row)
        if lack > 0.0:
            parameters = parameters + np.array(row) * (lack / np.dot(row, row))
    return positive(template, parameters)


SIGMA_SAMPLES = 40
"""Independent measurements that the correlated residuals of a fit are worth."""


@dataclass(frozen=True)
class _System:
    hessian: Array
    gradient: Array
    cost: float


class _MovingSamples:
    """Fixed places on the template's faces, which move with the parameters.

    Parts share the samples by the square root of their area, so that thin legs count.
    """

    def __init__(self, template: AffineTemplate, parameters: Array, count: int) -> None:
        vertices = template.decode(parameters)
        faces = template.faces[~template.hidden]
        areas = template.face_areas(vertices)[~template.hidden]
        part = template.part[faces[:, 0]]
        part_area = np.bincount(part, areas, len(template.parts))
        density = 1.0 / np.sqrt(np.maximum(part_area, 1e-12))
        samples = sample_surface(vertices, faces, count, np.random.default_rng(0), density[part])
        corners = faces[samples.faces]
        self._jacobian = np.einsum("mk,mkcd->mcd", samples.barycentric, template.jacobian[corners])
        self._corner_jacobian = template.jacobian[corners]
        shift = np.broadcast_to(np.eye(3), (count, 3, 3))
        self.jacobian = np.concatenate([self._jacobian, shift], axis=2)

    def at(self, state: Array) -> tuple[Array, Array]:
        """Points and unit normals ``[m, 3]`` for ``state [d + 3]``."""
        points = self.jacobian @ state
        a, b, c = np.moveaxis(self._corner_jacobian @ state[:-3], 1, 0)
        normals = np.cross(b - a, c - a)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return points, normals / np.maximum(length, 1e-300)


class _Matcher:
    """Nearest neighbours both ways in position and normal."""

    def __init__(self, cloud: Cloud, normal_weight: float) -> None:
        self.points = cloud.points
        self.weight = normal_weight
        self.features = np.hstack([cloud.points, normal_weight * cloud.normals])
        self.tree = _tree(self.features)

    def pairs(self, points: Array, normals: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """For each template sample its cloud point; for each cloud point its template sample."""
        features = np.hstack([points, self.weight * normals])
        there = self.tree.query(features)[1]
        back = _tree(features).query(self.features)[1]
        return there, back


def _tree(features: Array) -> cKDTree:
    """Midpoint splits: flat sides make median ones slow, with most coordinates equal."""
    return cKDTree(features, balanced_tree=False, compact_nodes=False)


def _normal_equations(
    moving: _MovingSamples, matcher: _Matcher, state: Array, scale: float, slide: float
) -> _System:
    """Hessian, gradient and cost of half the robust squared distance, both ways averaged."""
    points, normals = moving.at(state)
    there, back = matcher.pairs(points, normals)
    sample = np.concatenate([np.arange(len(points)), back])
    gap = points[sample] - matcher.points[np.concatenate([there, np.arange(len(back))])]
    squared = np.square(gap).sum(axis=1)
    share = np.repeat(1.0 / np.array([len(points), len(back)]), [len(points), len(back)])
    # Geman and McClure's kernel: its cost saturates at scale^2, its weight falls to nothing.
    weight = share / (1.0 + squared / scale**2) ** 2
    cost = float((share * squared / (1.0 + squared / scale**2)).sum())
    # Samples are few and pairs many: gather the pairs' sums on their samples first.
    total = np.bincount(sample, weight, len(points))
    mean_gap = np.stack([np.bincount(sample, weight * gap[:, c], len(points)) for c in range(3)], 1)
    jacobian = moving.jacobian
    across = np.einsum("mc,mcd->md", normals, jacobian)
    hessian = (1 - slide) * (across * total[:, None]).T @ across
    flat = jacobian.reshape(-1, jacobian.shape[2])
    hessian += slide * (flat * np.repeat(total, 3)[:, None]).T @ flat
    normal_gap = np.einsum("mc,mc->m", normals, mean_gap)
    gradient = (1 - slide) * across.T @ normal_gap
    gradient += slide * np.einsum("mcd,mc->d", jacobian, mean_gap)
    return _System(hessian, gradient, cost)
