"""How far a fitted template and an upload are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service.mesh.surface import sample_surface
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

PROBES = 600
"""Points by which normals are compared."""
OPPOSED = -0.3
"""A cloud whose normals agree with the template's no better than this, on the mean, is inside
out."""


@dataclass(frozen=True)
class Cloud:
    """Samples of an upload in its normalised canonical frame.

    Attributes:
        points: ``[n, 3]``.
        normals: ``[n, 3]`` unit normals of the faces that they lie on.
    """

    points: Array
    normals: Array


def surface_distance(
    template: AffineTemplate, parameters: Array, translation: Array, cloud: Cloud
) -> float:
    """Symmetric mean distance of the surfaces over the diagonal of the points' bounding box.

    Samples stand for surfaces: a pair of nearest samples is taken to be apart by its gap across
    the surface, and along it only by what exceeds the spacing of the samples.

    Args:
        template: the category.
        parameters, translation: ``[d]``, ``[3]`` of the fit.
        cloud: the upload.
    """
    visible = template.faces[~template.hidden]
    return mesh_distance(template.decode(parameters) + translation, visible, cloud)


def mesh_distance(vertices: Array, faces: NDArray[np.int64], cloud: Cloud) -> float:
    """`surface_distance` of a fitted mesh, ``vertices [V, 3]`` and ``faces [F, 3]``."""
    points = cloud.points
    samples = sample_surface(vertices, faces, len(points), np.random.default_rng(1))
    there = _one_way(samples.points, points, cloud.normals)
    back = _one_way(points, samples.points, samples.normals)
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    return 0.5 * (there + back) / diagonal


def _one_way(points: Array, surface: Array, normals: Array) -> float:
    tree = cKDTree(surface)
    spacing = float(np.median(tree.query(surface, k=5)[0][:, -1]))
    distance, nearest = tree.query(points)
    across = np.abs(np.einsum("nc,nc->n", points - surface[nearest], normals[nearest]))
    along = np.sqrt(np.maximum(distance**2 - across**2, 0.0))
    return float(np.hypot(across, np.maximum(along - spacing, 0.0)).mean())


def inside_out(points: Array, normals: Array, cloud: Cloud) -> bool:
    """Whether a cloud's normals point into a fitted surface.

    Args:
        points, normals: ``[PROBES, 3]`` samples of the fit.
        cloud: the upload.
    """
    step = max(1, len(cloud.points) // PROBES)
    nearest = cKDTree(points).query(cloud.points[::step])[1]
    cosine = np.einsum("nc,nc->n", normals[nearest], cloud.normals[::step])
    return float(cosine.mean()) < OPPOSED
