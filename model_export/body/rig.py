"""MakeHuman's rig merged into SMPL's 24 joints: skinning weights and joint positions."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from model_export.body.closed import Half
from model_export.body.makehuman import MakeHuman
from service.template.anatomy import JOINTS, MIRRORED

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

INFLUENCES = 4
"""Most joints that move a vertex."""
SMOOTHING = 2
"""Rounds of averaging skinning weights over neighbours: merged bones leave edges that crease."""
BONES: dict[str, tuple[str, ...]] = {
    "pelvis": ("root", "pelvis", "spine05"),
    "spine1": ("spine04", "spine03"),
    "spine2": ("spine02",),
    "spine3": ("spine01", "breast"),
    "neck": ("neck",),
    "left_collar": ("clavicle", "shoulder"),
    "left_shoulder": ("upperarm",),
    "left_elbow": ("lowerarm",),
    # The thumb's root is at the wrist, far from the knuckles that the hand's joint turns about.
    "left_wrist": ("wrist", "metacarpal", "finger1"),
    "left_hand": ("finger2", "finger3", "finger4", "finger5"),
    "left_hip": ("upperleg",),
    "left_knee": ("lowerleg",),
    "left_ankle": ("foot.",),
    "left_foot": ("toe",),
}
"""Beginnings of the names of the bones that each joint moves; all others are the head's."""
CUBES: dict[str, tuple[str, ...]] = {
    "pelvis": ("joint-pelvis",),
    "left_hip": ("joint-l-upper-leg",),
    "spine1": ("joint-spine-4",),
    "left_knee": ("joint-l-knee",),
    "spine2": ("joint-spine-2",),
    "left_ankle": ("joint-l-ankle",),
    "spine3": ("joint-spine-1",),
    "left_foot": ("joint-l-toe-2-1", "joint-l-toe-3-1"),
    "neck": ("joint-neck",),
    "left_collar": ("joint-l-clavicle",),
    "head": ("joint-head",),
    "left_shoulder": ("joint-l-shoulder",),
    "left_elbow": ("joint-l-elbow",),
    "left_wrist": ("joint-l-hand",),
    "left_hand": ("joint-l-finger-3-1",),
}
"""Cubes of helper vertices whose middle a joint is."""


def joint_positions(source: MakeHuman, shape: Array) -> Array:
    """``[24, 3]`` joints of base mesh vertices ``[N, 3]``, exactly symmetric."""
    joints = np.empty((len(JOINTS), 3))
    for name, cubes in CUBES.items():
        index = JOINTS.index(name)
        middles = [shape[source.groups[cube]].mean(axis=0) for cube in cubes]
        joints[index] = np.mean(middles, axis=0)
        if MIRRORED[index] == index:
            joints[index, 0] = 0.0
        joints[MIRRORED[index]] = joints[index] * (-1.0 if MIRRORED[index] != index else 1.0, 1, 1)
    return joints


def skinning_weights(source: MakeHuman, half: Half) -> Array:
    """``[V, 24]`` weights of the mirrored half: smooth, exactly symmetric, and of 4 joints at most.

    Args:
        source: the base mesh.
        half: of the closed body.
    """
    merged = np.zeros((len(source.vertices), len(JOINTS)))
    for bone, (vertices, weights) in source.bones.items():
        np.add.at(merged[:, _joint_of(bone)], vertices, weights)
    own = merged[half.vertices]
    other = own[~half.middle][:, MIRRORED]
    weights = np.concatenate([own, other])
    faces, mirror = half.mirrored()
    average = neighbour_average(faces, len(weights))
    for _ in range(SMOOTHING):
        weights = 0.5 * (weights + average @ weights)
    weights = 0.5 * (weights + weights[mirror][:, MIRRORED])
    # Ties between a left and a right joint at the middle are kept or dropped together.
    fourth = np.sort(weights, axis=1)[:, -INFLUENCES, None]
    fifth = np.sort(weights, axis=1)[:, -INFLUENCES - 1, None]
    floor = np.where(fourth - fifth > 1e-9, fourth - 1e-12, fourth + 1e-9)
    weights = np.where(weights >= floor, weights, 0.0)
    weights[weights < 1e-3] = 0.0
    weights /= weights.sum(axis=1, keepdims=True)
    return 0.5 * (weights + weights[mirror][:, MIRRORED])


def neighbour_average(faces: Indices, count: int) -> scipy.sparse.csr_array:
    """``[V, V]`` matrix that averages over each vertex's neighbours."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
    share = 1.0 / np.bincount(pairs[:, 0], minlength=count)[pairs[:, 0]]
    return scipy.sparse.csr_array((share, (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def _joint_of(bone: str) -> int:
    """The joint that a bone's weights are added to."""
    for joint, beginnings in BONES.items():
        if bone.startswith(beginnings):
            index = JOINTS.index(joint)
            return MIRRORED[index] if bone.endswith(".R") else index
    return JOINTS.index("head")
