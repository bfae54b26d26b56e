"""What a refinement makes small: how far samples of template and upload lie from each other.

Pairs are nearest neighbours in position and normal, both ways, so that thin seats keep their two
sides apart.  Of a gap the part across the template's surface counts fully, the part along it
little, for a sample may slide; but beyond an edge, at a wing's tip or a leg's foot, there is no
surface to slide on, and it counts fully too.  Far pairs (wheels, engines, whatever the template
lacks) lose their weight as the scale of the robust kernel shrinks.  Extents of the template meet
those of the upload.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service.encode.distance import Cloud
from service.mesh.surface import sample_surface
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

SLIDE = 0.1
"""Weight of residuals along the surface, relative to those across it,"""
EDGE = 0.015
"""where they are shorter than this; longer ones are off an edge."""
OUTWARD, NEAR = 4.0, 0.04
"""Weight of what lies outside of the template, relative to what lies inside, where it is no farther
than this: a box has the size of what it encloses, a rounded seat or a turned leg, and not of its
mean surface."""
EXTENT_WEIGHT, EXTENT_SCALE = 0.1, 0.03
"""Weight of each of the six extents beside that of all pairs, 2, and how far off it may be before
it is told by what the template lacks (a wheel, an aerial)."""


@dataclass(frozen=True)
class System:
    """Normal equations of half the robust squared distance, and its cost."""

    hessian: Array
    gradient: Array
    cost: float


class MovingSamples:
    """Fixed places on the template's visible faces, which move with the parameters.

    Parts share the samples by the square root of their area, so that thin legs count.
    """

    def __init__(self, template: AffineTemplate, parameters: Array, count: int) -> None:
        """``count`` samples, drawn at ``parameters [d]``."""
        vertices = template.decode(parameters)
        faces = template.faces[~template.hidden]
        areas = template.face_areas(vertices)[~template.hidden]
        part = template.part[faces[:, 0]]
        part_area = np.bincount(part, areas, len(template.parts))
        density = 1.0 / np.sqrt(np.maximum(part_area, 1e-12))
        samples = sample_surface(vertices, faces, count, np.random.default_rng(0), density[part])
        corners = faces[samples.faces]
        points = np.einsum("mk,mkcd->mcd", samples.barycentric, template.jacobian[corners])
        self._corner_jacobian = template.jacobian[corners]
        self.jacobian = _shifted(points)
        self._vertices = _shifted(template.jacobian[np.unique(faces)])

    def at(self, state: Array) -> tuple[Array, Array]:
        """Points and unit normals ``[m, 3]`` for ``state [d + 3]``, parameters and translation."""
        points = self.jacobian @ state
        a, b, c = np.moveaxis(self._corner_jacobian @ state[:-3], 1, 0)
        normals = np.cross(b - a, c - a)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return points, normals / np.maximum(length, 1e-300)

    def extents(self, state: Array) -> tuple[Array, Array]:
        """``[2, 3]`` least and largest coordinates of the template, ``[2, 3, d + 3]`` Jacobian."""
        vertices = self._vertices @ state
        ends = np.stack([vertices.argmin(axis=0), vertices.argmax(axis=0)])
        axis = np.arange(3)
        return vertices[ends, axis], self._vertices[ends, axis]


def _shifted(jacobian: Array) -> Array:
    """``[m, 3, d]`` with the translation's columns behind: ``[m, 3, d + 3]``."""
    shift = np.broadcast_to(np.eye(3), (len(jacobian), 3, 3))
    return np.concatenate([jacobian, shift], axis=2)


class Matcher:
    """The upload's samples, to be paired with the template's."""

    def __init__(self, cloud: Cloud, normal_weight: float, stride: int = 1) -> None:
        """
        Args:
            cloud: the upload's samples.
            normal_weight: length that a right angle between normals counts as.
            stride: one in so many samples is paired.
        """
        self.points = cloud.points[::stride]
        self.extents = np.stack([cloud.points.min(axis=0), cloud.points.max(axis=0)])
        self.weight = normal_weight
        self.features = np.hstack([self.points, normal_weight * cloud.normals[::stride]])
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


def normal_equations(moving: MovingSamples, matcher: Matcher, state: Array, scale: float) -> System:
    """The equations at ``state [d + 3]`` for a robust kernel of a scale.

    The cost is that of the pairs alone.
    """
    points, normals = moving.at(state)
    there, back = matcher.pairs(points, normals)
    sample = np.concatenate([np.arange(len(points)), back])
    gap = points[sample] - matcher.points[np.concatenate([there, np.arange(len(back))])]
    squared = np.square(gap).sum(axis=1)
    share = np.repeat(1.0 / np.array([len(points), len(back)]), [len(points), len(back)])
    # Geman and McClure's kernel: its cost saturates at scale^2, its weight falls to nothing.
    weight = share / (1.0 + squared / scale**2) ** 2
    cost = float((share * squared / (1.0 + squared / scale**2)).sum())
    off = np.einsum("pc,pc->p", normals[sample], gap)
    weight *= np.where(off < 0.0, 1.0 + (OUTWARD - 1.0) / (1.0 + squared / NEAR**2) ** 2, 1.0)
    along = np.maximum(squared - off**2, 0.0)
    even = weight * (SLIDE + (1.0 - SLIDE) * along / (along + EDGE**2))
    # Samples are few and pairs many: gather the pairs' sums on their samples first.
    count = len(points)
    whole, normal = np.bincount(sample, even, count), np.bincount(sample, weight - even, count)
    whole_gap = np.stack([np.bincount(sample, even * gap[:, c], count) for c in range(3)], axis=1)
    normal_gap = np.bincount(sample, (weight - even) * off, count)
    jacobian = moving.jacobian
    across = np.einsum("mc,mcd->md", normals, jacobian)
    flat = jacobian.reshape(-1, jacobian.shape[2])
    hessian = (across * normal[:, None]).T @ across
    hessian += (flat * np.repeat(whole, 3)[:, None]).T @ flat
    gradient = across.T @ normal_gap + np.einsum("mcd,mc->d", jacobian, whole_gap)
    ends, rows = moving.extents(state)
    miss = ends - matcher.extents
    told = EXTENT_WEIGHT / (1.0 + (miss / EXTENT_SCALE) ** 2) ** 2
    hessian += np.einsum("ec,ecd,ecf->df", told, rows, rows)
    gradient += np.einsum("ec,ecd->d", told * miss, rows)
    return System(hessian, gradient, cost)
