"""Surface samples and the frame that clouds are normalised to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from service.errors import InvalidMesh
from service.mesh.frame import CANONICAL, Orientation

RADIUS = 0.6
"""Radius of the sphere that every normalised cloud just fits into (section 4.1 of the paper)."""


@dataclass(frozen=True)
class Samples:
    """Points on a surface.

    Attributes:
        points: ``[n, 3]`` float64.
        normals: ``[n, 3]`` unit normals of the faces that they lie on.
        faces: ``[n]`` int64 indices of those faces.
        barycentric: ``[n, 3]`` weights of each face's corners.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    faces: NDArray[np.int64]
    barycentric: NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """A mesh, in which samples lie.

    Attributes:
        vertices: ``[V, 3]`` in its own frame.
        faces: ``[F, 3]``.
        metre: its length in the unit of the vertices, as far as the file or the client tells.
        orientation: of the frame.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    metre: float | None = None
    orientation: Orientation = CANONICAL

    def turned(self, orientation: Orientation) -> Surface:
        """The same, its frame taken for one of that orientation."""
        return replace(self, orientation=orientation)

    @property
    def canonical(self) -> NDArray[np.float64]:
        """``[V, 3]`` vertices in the canonical frame."""
        return self.orientation.to_canonical(self.vertices)


def sample_surface(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    count: int,
    rng: np.random.Generator,
    density: NDArray[np.float64] | None = None,
) -> Samples:
    """Draw points uniformly by area, stratified so that small parts keep their share.

    Args:
        vertices: ``[V, 3]``.
        faces: ``[F, 3]``.
        count: how many points.
        rng: source of randomness.
        density: ``[F]`` relative density a face; 1 everywhere by default.

    Raises:
        InvalidMesh: when the surface has no area.
    """
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    crosses = np.cross(b - a, c - a)
    doubled = np.linalg.norm(crosses, axis=1)
    weight = doubled if density is None else doubled * density
    total = float(weight.sum())
    if not np.isfinite(total) or total <= 0.0:
        raise InvalidMesh(
            "degenerate_mesh", "the faces have no area", "Export a mesh with a visible surface."
        )
    ticks = (np.arange(count) + rng.random(count)) * (total / count)
    face = np.minimum(np.searchsorted(np.cumsum(weight), ticks, side="right"), len(faces) - 1)
    root, v = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    barycentric = np.hstack([1 - root, root * (1 - v), root * v])
    points = np.einsum("nk,nkc->nc", barycentric, vertices[faces[face]])
    normals = crosses[face] / np.maximum(doubled[face], np.finfo(float).tiny)[:, None]
    return Samples(points, normals, face, barycentric)


@dataclass(frozen=True)
class Normalization:
    """``normalised = (x - center) * scale``: zero mean, farthest point at radius 0.6."""

    center: NDArray[np.float64]
    scale: float

    @classmethod
    def of(cls, points: NDArray[np.float64]) -> Normalization:
        """The one that fits ``points [n, 3]``, which must not all be equal."""
        center = points.mean(axis=0)
        radius = float(np.sqrt(np.square(points - center).sum(axis=1).max()))
        return cls(center, RADIUS / radius)

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """To the normalised frame."""
        return (points - self.center) * self.scale

    def invert(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Back from it."""
        return points / self.scale + self.center
