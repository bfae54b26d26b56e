"""Skinning weights carried over where that is safe, and inpainted elsewhere.

Abdrashitov, Raichstat, Monsen and Hill, Robust skin weights transfer via weight inpainting, 2023:
vertices take the weights of the nearest point of the source where it is near and faces the same
way; those of the rest are as smooth as they can be on the mesh.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from model_export.benchmark.detail import laplacian
from service.deform.normals import face_crosses, vertex_normals
from service.deform.weld import weld
from service.mesh.surface import sample_surface
from service.template.skinned import Body, SkinnedTemplate

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

NEAR, ANGLE = 0.05, 30.0
"""Greatest distance, as a share of the diagonal, and greatest angle in degrees of a safe match:
the paper's."""
SAMPLES = 60_000
"""Points of the body's surface that stand for it."""


def inpainted(x: Array, faces: Faces, template: SkinnedTemplate, body: Body) -> Array:
    """``[V, 24]`` skinning weights of a mesh over a fitted body.

    Args:
        x: ``[V, 3]`` in the frame of ``body``.
        faces: ``[F, 3]``.
        template, body: what was fitted.
    """
    mesh = weld(x, faces)
    weights, safe = matched(mesh.vertices, mesh.faces, template, body)
    return inpaint(mesh.vertices, mesh.faces, weights, safe)[mesh.of]


def matched(
    x: Array, faces: Faces, template: SkinnedTemplate, body: Body
) -> tuple[Array, NDArray[np.bool_]]:
    """``[n, 24]`` weights of the nearest points, and ``[n]`` which are safe."""
    surface = template.decode(body)
    rng = np.random.default_rng(0)
    drawn = sample_surface(surface, template.faces, SAMPLES, rng)
    corners = template.faces[drawn.faces]
    distance, nearest = cKDTree(drawn.points).query(x)
    share = drawn.barycentric[nearest][:, :, None]
    weights = (share * template.weights[corners[nearest]]).sum(axis=1)
    along = np.einsum("nc,nc->n", vertex_normals(x, faces), drawn.normals[nearest])
    near = distance < NEAR * np.linalg.norm(np.ptp(x, axis=0))
    return weights, near & (along > np.cos(np.radians(ANGLE)))


def inpaint(x: Array, faces: Faces, weights: Array, safe: NDArray[np.bool_]) -> Array:
    """``[n, 24]`` the weights, those that aren't safe replaced by the smoothest that go with the
    others; pieces without a safe vertex keep what they have."""
    count = len(x)
    ends = faces[:, [0, 1, 1, 2]].reshape(-1, 2).T
    graph = csr_array((np.ones(ends.shape[1]), tuple(ends)), shape=(count, count))
    pieces, piece = connected_components(graph, directed=False)
    anchored = np.bincount(piece, safe, pieces) > 0
    free = np.flatnonzero(~safe & anchored[piece])
    if not len(free):
        return weights
    held = np.flatnonzero(safe)
    stiffness = laplacian(x, faces)
    area = np.linalg.norm(face_crosses(x, faces), axis=1) / 6.0
    mass = np.bincount(faces.T.ravel(), np.tile(area, 3), count)
    inverse = diags_array(1.0 / np.maximum(mass, 1e-9 * mass.max()))
    energy = csr_array(stiffness + stiffness @ inverse @ stiffness)
    own = energy[free][:, free] + 1e-9 * energy.diagonal().mean() * diags_array(np.ones(len(free)))
    found = splu(own.tocsc()).solve(-(energy[free][:, held] @ weights[held]))
    filled = weights.copy()
    filled[free] = np.maximum(found, 0.0)
    total = filled[free].sum(axis=1, keepdims=True)
    filled[free] = np.where(total > 1e-9, filled[free] / np.maximum(total, 1e-9), weights[free])
    return filled
