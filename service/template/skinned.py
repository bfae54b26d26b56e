"""The skinned body template: shape directions, a skeleton and skinning weights (SMPL's format)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from service.template.anatomy import JOINTS, PARENTS
from service.template.skinning import blend, pose_joints, rotation_matrices

Array = NDArray[np.float64]

SHAPES = 3
"""Shape coefficients that are inferred and offered."""
NAMES: tuple[str, ...] = (
    *(f"global_orient_{axis}" for axis in "xyz"),
    *(f"{joint}_{axis}" for joint in JOINTS[1:] for axis in "xyz"),
    *(f"shape_{index}" for index in range(SHAPES)),
)
"""The body's parameters in their order."""


@dataclass(frozen=True)
class Body:
    """A body's parameters, in some frame and unit.

    Attributes:
        rotations: ``[24, 3, 3]`` of each joint in its parent's frame; the first is the global
            orientation.
        shape: ``[3]`` coefficients, in standard deviations.
        scale: length in the frame's unit of a metre of the template.
        translation: ``[3]`` of the template's origin.
    """

    rotations: Array
    shape: Array
    scale: float
    translation: Array

    @property
    def parameters(self) -> Array:
        """``[75]`` in the order of `NAMES`: axis-angle vectors in radians, then the shape."""
        vectors = Rotation.from_matrix(self.rotations).as_rotvec()
        return np.concatenate([vectors.ravel(), self.shape])

    def with_parameters(self, parameters: Array) -> Body:
        """The same body with other parameters ``[75]``."""
        vectors = parameters[: 3 * len(JOINTS)].reshape(-1, 3)
        rotations = Rotation.from_rotvec(vectors).as_matrix()
        return Body(rotations, parameters[3 * len(JOINTS) :], self.scale, self.translation)

    def turned(self, rotation: Array, pivot: Array) -> Body:
        """The body turned by a rotation ``[3, 3]`` of space about the origin.

        Args:
            rotation: of space.
            pivot: ``[3]`` the template's root joint at rest, which the global orientation turns
                about.
        """
        rotations = self.rotations.copy()
        rotations[0] = rotation @ rotations[0]
        root = self.scale * pivot + self.translation
        return Body(rotations, self.shape, self.scale, rotation @ root - self.scale * pivot)


@dataclass(frozen=True)
class SkinnedTemplate:
    """A body that shape coefficients and joint rotations deform; metres, T-pose, +Y up, +Z front.

    Attributes:
        name, label: of the category.
        points: size of the clouds that its encoder takes.
        rest: ``[V, 3]`` vertices of the mean shape.
        shapedirs: ``[V, 3, S]`` displacement for each standard deviation of each coefficient.
        joints: ``[24, 3]`` of the mean shape, at rest.
        joint_dirs: ``[24, 3, S]`` how the coefficients move them.
        weights: ``[V, 24]`` skinning weights.
        posedirs: ``[V, 3, P]`` pose correctives, per entry of the rotations less the identity;
            ``P`` is 0 without them, 207 with.
        faces: ``[F, 3]``.
        shape_labels: what each coefficient reads as.
        digest: of the file that it was read from.
    """

    name: str
    label: str
    points: int
    rest: Array
    shapedirs: Array
    joints: Array
    joint_dirs: Array
    weights: Array
    posedirs: Array
    faces: NDArray[np.int64]
    shape_labels: tuple[str, ...]
    digest: str

    def shaped(self, shape: Array) -> tuple[Array, Array]:
        """``[V, 3]`` vertices and ``[24, 3]`` joints at rest for ``shape [S]``."""
        return self.rest + self.shapedirs @ shape, self.joints + self.joint_dirs @ shape

    def posed_joints(self, body: Body) -> Array:
        """``[24, 3]`` joints of a body."""
        joints = self.joints + self.joint_dirs @ body.shape
        placed: Array = pose_joints(body.rotations, joints, PARENTS)[1]
        return body.scale * placed + body.translation

    def decode(self, body: Body) -> Array:
        """``[V, 3]`` vertices of a body."""
        maps, shifts = self.transforms(body)
        vertices = self.rest + self.shapedirs @ body.shape
        if self.posedirs.shape[2]:
            feature = (body.rotations[1:] - np.eye(3)).ravel()
            vertices = vertices + self.posedirs @ feature
        return (maps @ vertices[:, :, None])[:, :, 0] + shifts

    def transforms(self, body: Body, weights: Array | None = None) -> tuple[Array, Array]:
        """``[n, 3, 3]`` and ``[n, 3]``: the maps from rest to space of points with ``weights``
        ``[n, 24]``, by default the template's own vertices."""
        joints = self.joints + self.joint_dirs @ body.shape
        turned, placed = pose_joints(body.rotations, joints, PARENTS)
        own = self.weights if weights is None else weights
        maps, shifts = blend(own, joints, turned, placed)
        return body.scale * maps, body.scale * shifts + body.translation

    def at_rest(self) -> Body:
        """The mean shape in its T-pose."""
        count = len(JOINTS)
        return Body(np.tile(np.eye(3), (count, 1, 1)), np.zeros(SHAPES), 1.0, np.zeros(3))


def body_of(vectors: Array, shape: Array, scale: float, translation: Array) -> Body:
    """A body from axis-angle vectors ``[24, 3]`` in radians."""
    return Body(rotation_matrices(vectors), shape, scale, translation)
