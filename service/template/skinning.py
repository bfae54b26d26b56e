"""Linear blend skinning, written once for numpy and torch.

Arrays are of either library; the functions take and give the same one.  Leading axes are those of
a batch.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

SMALL = 1e-12
"""Added under a square root: its derivative at no rotation stays finite."""


def rotation_matrices(vectors: Any) -> Any:
    """Axis-angle vectors ``[..., 3]`` in radians to rotation matrices ``[..., 3, 3]``."""
    xp = library(vectors)
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    angle = xp.sqrt(x * x + y * y + z * z + SMALL)
    sine = xp.sin(angle) / angle
    half = xp.sin(0.5 * angle) / angle
    versine = 2.0 * half * half
    cosine = xp.cos(angle)
    rows = (
        (cosine + versine * x * x, versine * x * y - sine * z, versine * x * z + sine * y),
        (versine * x * y + sine * z, cosine + versine * y * y, versine * y * z - sine * x),
        (versine * x * z - sine * y, versine * y * z + sine * x, cosine + versine * z * z),
    )
    return xp.stack([xp.stack(list(row), -1) for row in rows], -2)


def orthonormal(six: Any) -> Any:
    """Six numbers ``[..., 6]`` to rotation matrices ``[..., 3, 3]``: two columns, orthonormalised.

    A continuous parametrisation (Zhou et al., On the Continuity of Rotation Representations in
    Neural Networks, 2019), which is what a network can learn.
    """
    xp = library(six)
    a, b = six[..., 0:3], six[..., 3:6]
    first = a / _length(xp, a)
    rest = b - (first * b).sum(-1)[..., None] * first
    second = rest / _length(xp, rest)
    return xp.stack([first, second, _cross(xp, first, second)], -1)


def pose_joints(rotations: Any, joints: Any, parents: Sequence[int]) -> tuple[Any, Any]:
    """Forward kinematics.

    Args:
        rotations: ``[..., J, 3, 3]`` of each joint in its parent's frame.
        joints: ``[..., J, 3]`` at rest.
        parents: index of each joint's parent, which comes before it; the first is the root.

    Returns:
        ``[..., J, 3, 3]`` rotation and ``[..., J, 3]`` position of each joint in space.
    """
    xp = library(rotations)
    # Joints may lack the batch's axes.
    root = joints[..., 0, :] + 0.0 * rotations[..., 0, 0, :]
    turned, placed = [rotations[..., 0, :, :]], [root]
    for joint, parent in enumerate(parents[1:], start=1):
        offset = (joints[..., joint, :] - joints[..., parent, :])[..., None]
        placed.append(placed[parent] + (turned[parent] @ offset)[..., 0])
        turned.append(turned[parent] @ rotations[..., joint, :, :])
    return xp.stack(turned, -3), xp.stack(placed, -2)


def skin(points: Any, weights: Any, joints: Any, turned: Any, placed: Any) -> Any:
    """Move rest points with the joints.

    Args:
        points: ``[..., n, 3]`` at rest.
        weights: ``[n, J]``, rows sum to 1.
        joints: ``[..., J, 3]`` at rest.
        turned, placed: what `pose_joints` gives.

    Returns:
        ``[..., n, 3]``.
    """
    maps, shifts = blend(weights, joints, turned, placed)
    return (maps @ points[..., None])[..., 0] + shifts


def blend(weights: Any, joints: Any, turned: Any, placed: Any) -> tuple[Any, Any]:
    """``[..., n, 3, 3]`` linear parts and ``[..., n, 3]`` shifts of the blended transforms."""
    offsets = placed - (turned @ joints[..., None])[..., 0]
    flat = turned.reshape(*turned.shape[:-2], 9)
    maps = weights @ flat
    return maps.reshape(*maps.shape[:-1], 3, 3), weights @ offsets


def library(array: Any) -> Any:
    """The module that an array's functions are in: numpy, or torch where it is a tensor."""
    return np if isinstance(array, np.ndarray) else sys.modules["torch"]


def _length(xp: Any, vectors: Any) -> Any:
    return xp.sqrt((vectors * vectors).sum(-1) + SMALL)[..., None]


def _cross(xp: Any, a: Any, b: Any) -> Any:
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return xp.stack([x, y, z], -1)
