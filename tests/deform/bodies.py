"""The shipped body, posed, as a mesh that is bound to itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from service.template.anatomy import JOINTS
from service.template.bodyfile import load_body
from service.template.skinned import Body, SkinnedTemplate


@cache
def template() -> SkinnedTemplate:
    return load_body()


def index(joint: str) -> int:
    return JOINTS.index(joint)


def turned(body: Body, **vectors: tuple[float, float, float]) -> Body:
    """A body with joints turned further by axis-angle vectors."""
    rotations = body.rotations.copy()
    for joint, vector in vectors.items():
        rotations[index(joint)] = rotations[index(joint)] @ Rotation.from_rotvec(vector).as_matrix()
    return replace(body, rotations=rotations)


def hands_on_hips(inward: float = 0.0) -> Body:
    """Arms that end on the hips, or that much further inside."""
    return turned(
        template().at_rest(),
        left_shoulder=(1.24, -0.46, -0.77 - inward),
        right_shoulder=(1.24, 0.46, 0.77 + inward),
        left_elbow=(0.0, -1.75, 0.0),
        right_elbow=(0.0, 1.75, 0.0),
    )


def below(weights: np.ndarray, *joints: str) -> np.ndarray:
    """Sum of each vertex's weights of some joints."""
    return weights[:, [index(joint) for joint in joints]].sum(axis=1)
