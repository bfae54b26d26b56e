"""The joints of a body: SMPL's names, order and tree, and how far people bend each.

Axes are those of the T-pose: +x to the body's left, +y up, +z to the front.  An elbow thus bends
about y, a knee about x, and an arm is lowered about z.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PARENTS: tuple[int, ...] = (
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
)  # fmt: skip
"""Index of each joint's parent; the root has none."""
JOINTS: tuple[str, ...] = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
    "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar",
    "head", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist",
    "right_wrist", "left_hand", "right_hand",
)  # fmt: skip
"""SMPL's joints, in its order; the first is the root."""
MIRRORED: tuple[int, ...] = tuple(
    JOINTS.index(
        name.replace("left_", "right_")
        if name.startswith("left_")
        else name.replace("right_", "left_")
    )
    for name in JOINTS
)
"""Index of each joint's mirror image."""
GROUPS: dict[str, tuple[str, ...]] = {
    "torso": ("spine1", "spine2", "spine3"),
    "head": ("neck", "head"),
    "left arm": ("left_collar", "left_shoulder", "left_elbow", "left_wrist", "left_hand"),
    "right arm": ("right_collar", "right_shoulder", "right_elbow", "right_wrist", "right_hand"),
    "left leg": ("left_hip", "left_knee", "left_ankle", "left_foot"),
    "right leg": ("right_hip", "right_knee", "right_ankle", "right_foot"),
}
"""Limbs, to sort sliders by."""

_DEGREES: dict[str, tuple[tuple[float, float], tuple[float, float], tuple[float, float]]] = {
    "spine1": ((-25, 45), (-25, 25), (-25, 25)),
    "spine2": ((-20, 35), (-25, 25), (-20, 20)),
    "spine3": ((-15, 30), (-25, 25), (-20, 20)),
    "neck": ((-35, 45), (-45, 45), (-30, 30)),
    "head": ((-30, 35), (-40, 40), (-25, 25)),
    "left_collar": ((-15, 15), (-25, 20), (-20, 30)),
    "left_shoulder": ((-70, 70), (-110, 50), (-100, 85)),
    "left_elbow": ((-80, 80), (-150, 8), (-15, 15)),
    "left_wrist": ((-60, 60), (-35, 35), (-70, 70)),
    "left_hand": ((-20, 20), (-20, 20), (-45, 45)),
    "left_hip": ((-125, 40), (-45, 45), (-30, 60)),
    "left_knee": ((-5, 150), (-15, 15), (-8, 8)),
    "left_ankle": ((-35, 50), (-25, 25), (-30, 30)),
    "left_foot": ((-40, 30), (-10, 10), (-10, 10)),
}
"""Reach about each axis in degrees: of the left side, and of the middle."""


def limits() -> tuple[Array, Array]:
    """``[24, 3]`` lower and upper ends of each joint's axis-angle components, in radians.

    The root, which turns freely, has half a turn either way.
    """
    ends = np.empty((len(JOINTS), 3, 2))
    ends[0] = np.pi * np.array([-1.0, 1.0])
    for index, name in enumerate(JOINTS[1:], start=1):
        if name.startswith("right_"):
            x, (y_low, y_high), (z_low, z_high) = _DEGREES[name.replace("right_", "left_")]
            ends[index] = np.radians([x, (-y_high, -y_low), (-z_high, -z_low)])
        else:
            ends[index] = np.radians(_DEGREES[name])
    return ends[:, :, 0], ends[:, :, 1]


def descendants() -> NDArray[np.bool_]:
    """``[24, 24]`` whether a joint (row) carries another (column), itself included."""
    carries = np.eye(len(JOINTS), dtype=bool)
    for child in reversed(range(1, len(JOINTS))):
        carries[PARENTS[child]] |= carries[child]
    return carries
