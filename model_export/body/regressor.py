"""Joint regressor: each joint as a mean of a few vertices around it."""

from __future__ import annotations

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from service.template.anatomy import JOINTS, MIRRORED

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NEAREST = 400
"""Vertices that a joint can be a mean of."""
SUM = 10.0
"""Weight, in metres, of the rows' summing to 1."""


def joint_regressor(
    mean: Array, directions: Array, joints: Array, joint_dirs: Array, mirror: Indices
) -> Array:
    """``[24, V]`` non-negative weights, rows sum to 1, exactly symmetric.

    They meet the joints of the mean body and, as all of it is linear, those of every other shape.

    Args:
        mean, directions: ``[V, 3]`` and ``[V, 3, 3]`` of the vertices.
        joints, joint_dirs: ``[24, 3]`` and ``[24, 3, 3]``.
        mirror: ``[V]`` each vertex's mirror image.
    """
    rows = np.zeros((len(JOINTS), len(mean)))
    features = np.concatenate([mean[:, :, None], directions], axis=2).reshape(len(mean), -1)
    wanted = np.concatenate([joints[:, :, None], joint_dirs], axis=2).reshape(len(joints), -1)
    for joint, other in enumerate(MIRRORED):
        if other < joint:
            continue
        distance = np.linalg.norm(mean - joints[joint], axis=1)
        near = np.argsort(distance, kind="stable")[:NEAREST]
        usable = features.copy()
        if other == joint:
            # Over pairs of mirror images x cancels out.
            usable = 0.5 * (usable + usable[mirror])
        system = np.vstack([usable[near].T, np.full(len(near), SUM)])
        found = scipy.optimize.nnls(system, np.append(wanted[joint], SUM))[0]
        rows[joint, near] = found / found.sum()
        if other == joint:
            rows[joint] = 0.5 * (rows[joint] + rows[joint][mirror])
        rows[other] = rows[joint][mirror]
    return rows
