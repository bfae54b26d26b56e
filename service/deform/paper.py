"""The paper's rule: the displacement of the nearest template vertices (section 3.4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from service.deform.binding import Binding, inverse_frames, part_stretches
from service.deform.normals import vertex_normals
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

SIGMA = 0.03


def bind(
    vertices: Array,
    faces: NDArray[np.int64],
    template: AffineTemplate,
    f: Array,
    t: Array,
    k: int = 32,
) -> Binding:
    """Bind a mesh to a fitted template by its nearest template vertices.

    A vertex takes the mean displacement of the `k` nearest template vertices, weighted
    ``(1 + <n_x, n_v>)^2 exp(-d^2 / 0.03^2)``.

    Args:
        vertices: ``[V, 3]`` in the normalised canonical frame (+Y up, +Z front, radius 0.6).
        faces: ``[F, 3]``.
        f: ``[d]`` fitted parameters, in the same scale.
        t: ``[3]`` where the template's origin lies.
    """
    fitted = template.decode(f)
    x = np.asarray(vertices, np.float64) - t
    weights = neighbour_weights(
        x, vertex_normals(x, np.asarray(faces, np.int64)), fitted, template.normals(fitted), k
    )
    columns = template.jacobian.reshape(len(fitted), -1).astype(np.float32)
    inverses = inverse_frames(template.frames(f))
    parts = len(inverses)
    share = weights @ np.eye(parts, dtype=np.float32)[template.part]
    return Binding(
        jacobian=(weights @ columns).reshape(len(x), 3, -1),
        gains=np.repeat(share, 3, axis=1),
        stretches=part_stretches(template, inverses),
    )


def neighbour_weights(
    x: Array, normals: Array, points: Array, point_normals: Array, k: int
) -> csr_array:
    """``[V, T]`` sparse float32 weights of the `k` nearest of ``points [T, 3]``, one in sum a row.

    The least squared distance is subtracted before the exponential, which would underflow beyond
    0.28 in single precision; where all normals oppose, distance alone decides.  A vertex without a
    normal, and a mesh whose faces turn both ways, take the nearer reading of the sign.
    """
    distance, index = cKDTree(points).query(x, k=range(1, min(k, len(points)) + 1))
    cosine = np.einsum("vkc,vc->vk", point_normals[index], normals)
    if np.median(cosine[:, 0]) < 0.0 or np.mean(cosine[:, 0] < -0.5) > 0.25:
        cosine = np.abs(cosine)
    agree = (1.0 + cosine) ** 2
    agree[agree.max(axis=1) < 1e-6] = 1.0
    near = np.exp((distance[:, :1] ** 2 - distance**2) / SIGMA**2)
    weight = agree * near
    # A far neighbour may be the only one that agrees, with a weight that underflows.
    weight = np.where(weight.sum(axis=1, keepdims=True) > 1e-30, weight, near)
    weight /= weight.sum(axis=1, keepdims=True)
    rows = np.arange(0, index.size + 1, index.shape[1])
    return csr_array(
        (weight.ravel().astype(np.float32), index.ravel(), rows), shape=(len(x), len(points))
    )
