"""A body's upload as glTF and its viewers skin it: joints, weights and inverse bind matrices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.bodyinference import BodyInference
from service.deform import skinbinding
from service.deform.skinbinding import SkinBinding
from service.template.anatomy import JOINTS, PARENTS
from service.template.skinned import Body

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Skeleton:
    """An upload's own vertices, bound to a skeleton in a pose of theirs.

    All is in the upload's own frame and coordinates.  A vertex goes to
    ``sum(weight * world @ inverse_bind @ [vertex, 1])``, where a joint's ``world`` is its parent's
    times its own rotation and its offset from there; the root's parent is ``frame``.  The rotations
    are the body's parameters, so that their sliders pose it as edits of the angles do.

    Attributes:
        names: of the 24 joints.
        parents: index of each joint's parent, -1 for the root.
        frame: ``[3, 3]`` rotation from the canonical frame to the upload's.
        joints: ``[24, 3]`` where they are.
        rotations: ``[24, 3, 3]`` of each joint in its parent's frame.
        offsets: ``[24, 3]`` of each joint in its parent's frame, the root's in ``frame``'s.
        inverse_bind: ``[24, 4, 4]``.
        indices, weights: ``[V, 4]`` of the joints that move a vertex; the weights are one in sum.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    frame: Array
    joints: Array
    rotations: Array
    offsets: Array
    inverse_bind: Array
    indices: NDArray[np.int64]
    weights: Array

    @classmethod
    def of(cls, found: BodyInference) -> Skeleton:
        """The skeleton of an inferred body, in the pose that it was inferred to have."""
        return cls.of_binding(found, found.skin, found.fit.body)

    @classmethod
    def of_binding(cls, found: BodyInference, binding: SkinBinding, body: Body) -> Skeleton:
        """The skeleton in another pose ``body``, for vertices that went there with it.

        Args:
            found: the inferred body.
            binding: of its vertices.
            body: the pose.
        """
        binds, nodes = joint_worlds(found, body), joint_nodes(found, body)
        weights = binding.weights
        order = np.argsort(-weights, axis=1, kind="stable")[:, : skinbinding.INFLUENCES]
        return cls(
            names=JOINTS,
            parents=PARENTS,
            frame=found.best.orientation.rotation.T,
            joints=binds[:, :3, 3],
            rotations=nodes[:, :3, :3],
            offsets=nodes[:, :3, 3],
            inverse_bind=np.asarray(np.linalg.inv(binds), dtype=np.float64),
            indices=order,
            weights=np.take_along_axis(weights, order, axis=1),
        )


def joint_worlds(found: BodyInference, body: Body) -> Array:
    """``[24, 4, 4]`` each joint of a body in the upload's own frame and coordinates."""
    worlds = skinbinding.joint_matrices(found.model.template, body)
    worlds[:, :3, :3] = found.best.orientation.rotation.T @ worlds[:, :3, :3]
    worlds[:, :3, 3] = found.own_joints(body)
    return worlds


def joint_nodes(found: BodyInference, body: Body) -> Array:
    """``[24, 4, 4]`` each joint in its parent; the root in the canonical frame, turned alone."""
    worlds = joint_worlds(found, body)
    above = np.eye(4)
    above[:3, :3] = found.best.orientation.rotation
    inverses = np.linalg.inv(worlds[list(PARENTS[1:])])
    nodes: Array = np.concatenate([above[None], inverses]) @ worlds
    return nodes
