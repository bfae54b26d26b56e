"""From MakeHuman's rest, arms lowered and elbows and legs bent, to a T-pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from service.template.anatomy import JOINTS, MIRRORED, PARENTS
from service.template.skinning import blend

Array = NDArray[np.float64]

STRAIGHT: dict[str, tuple[str, tuple[float, float, float]]] = {
    "left_shoulder": ("left_elbow", (1.0, 0.0, 0.0)),
    "left_elbow": ("left_wrist", (1.0, 0.0, 0.0)),
    "left_wrist": ("left_hand", (1.0, 0.0, 0.0)),
    "left_hip": ("left_knee", (0.0, -1.0, 0.0)),
    "left_knee": ("left_ankle", (0.0, -1.0, 0.0)),
}
"""Joints whose bones are straightened: the bone's far end and its direction in a T-pose."""


def t_pose(vertices: Array, joints: Array, weights: Array) -> tuple[Array, Array]:
    """Straighten a body.

    The vertices are those that skinning takes back to the given ones exactly: what the artists made
    is met again whenever the body is posed as they had it.

    Args:
        vertices: ``[V, 3]`` in MakeHuman's rest.
        joints: ``[24, 3]`` likewise.
        weights: ``[V, 24]``.

    Returns:
        ``[V, 3]`` and ``[24, 3]`` in the T-pose, arms along x, legs along y, feet as they were.
    """
    turned = _straightening(joints)
    placed = joints.copy()
    for joint, parent in enumerate(PARENTS[1:], start=1):
        placed[joint] = placed[parent] + turned[parent] @ (joints[joint] - joints[parent])
    back = np.swapaxes(turned, 1, 2)
    maps, shifts = blend(weights, placed, back, joints)
    straight = np.linalg.solve(maps, (vertices - shifts)[:, :, None])[:, :, 0]
    return straight, placed


def _straightening(joints: Array) -> Array:
    """``[24, 3, 3]`` rotations of each joint in space, exactly symmetric."""
    turned = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    flip = np.diag([-1.0, 1.0, 1.0])
    for name, (end, direction) in STRAIGHT.items():
        joint = JOINTS.index(name)
        bone = joints[JOINTS.index(end)] - joints[joint]
        # An elbow and a wrist bend on from the arm that is straight already.
        above = turned[PARENTS[joint]]
        turned[joint] = _shortest(above @ bone, np.array(direction)) @ above
        turned[MIRRORED[joint]] = flip @ turned[joint] @ flip
    for side in ("left", "right"):
        turned[JOINTS.index(f"{side}_hand")] = turned[JOINTS.index(f"{side}_wrist")]
    return turned


def _shortest(start: Array, end: Array) -> Array:
    """``[3, 3]`` the shortest rotation that takes one direction to another."""
    axis = np.cross(start, end)
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:
        return np.eye(3)
    angle = np.arctan2(sine, float(start @ end))
    return Rotation.from_rotvec(axis / sine * angle).as_matrix()
