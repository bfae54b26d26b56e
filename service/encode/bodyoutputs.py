"""What a body's encoder answers, in which order, and the cloud that it is asked with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.template.anatomy import JOINTS, PARENTS
from service.template.skinned import SHAPES, Body, SkinnedTemplate
from service.template.skinning import orthonormal

Array = NDArray[np.float64]

ANCHORS = 128
"""Points of a cloud that patches are cut about; they come first in it."""
OUTPUTS = 9 * len(JOINTS) + SHAPES + 1
"""Joint positions; two columns of each joint's rotation in space; shape; the scale's logarithm."""


@dataclass(frozen=True)
class BodyEncoding:
    """An encoder's answer, in the normalised frame.

    Attributes:
        joints: ``[24, 3]``.
        rotations: ``[24, 3, 3]`` in the parents' frames; the first is the global orientation.
        shape: ``[3]``.
        scale: normalised length of a metre of the template.
    """

    joints: Array
    rotations: Array
    shape: Array
    scale: float

    @classmethod
    def of(cls, outputs: NDArray[np.floating]) -> BodyEncoding:
        """Take the network's outputs ``[OUTPUTS]`` apart."""
        count = len(JOINTS)
        numbers = np.asarray(outputs, dtype=np.float64)
        turned = orthonormal(numbers[3 * count : 9 * count].reshape(count, 6))
        parents = np.concatenate([np.eye(3)[None], turned[list(PARENTS[1:])]])
        return cls(
            joints=numbers[: 3 * count].reshape(count, 3),
            rotations=parents.transpose(0, 2, 1) @ turned,
            shape=numbers[9 * count : 9 * count + SHAPES],
            scale=float(np.exp(numbers[-1])),
        )

    def body(self, template: SkinnedTemplate) -> Body:
        """The body of these rotations whose root joint is where it was said to be."""
        root = template.joints[0] + template.joint_dirs[0] @ self.shape
        translation = self.joints[0] - self.scale * root
        return Body(self.rotations, self.shape, self.scale, translation)

    def turned(self, rotation: Array) -> BodyEncoding:
        """The answer for a cloud that is turned by ``rotation [3, 3]``."""
        rotations = self.rotations.copy()
        rotations[0] = rotation @ rotations[0]
        return BodyEncoding(self.joints @ rotation.T, rotations, self.shape, self.scale)


def spread_first(points: Array, count: int) -> NDArray[np.int64]:
    """``[n]`` an order of ``points [n, 3]`` that begins with ``count`` far from one another.

    Farthest-point sampling, beginning with the first point.
    """
    columns = np.ascontiguousarray(points.T, dtype=np.float32)
    chosen = np.zeros(count, dtype=np.int64)
    distance = np.full(len(points), np.inf, dtype=np.float32)
    for index in range(1, count):
        away = columns - columns[:, chosen[index - 1], None]
        distance[chosen[index - 1]] = -1.0  # never again, even among copies of one point
        np.minimum(distance, np.einsum("cn,cn->n", away, away), out=distance)
        chosen[index] = distance.argmax()
    return np.concatenate([chosen, np.delete(np.arange(len(points)), chosen)])
