"""Places on a body's surface, and how they move with its joints, shape, scale and place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from service.mesh.surface import sample_surface
from service.template.anatomy import JOINTS, PARENTS, descendants
from service.template.skinned import SHAPES, Body, SkinnedTemplate
from service.template.skinning import pose_joints, rotation_matrices

Array = NDArray[np.float64]

COUNT = len(JOINTS)
STEP = 3 * COUNT + SHAPES + 4
"""Numbers in a step of a body: a turn of each joint, shape, log scale, translation."""
SHAPE = slice(3 * COUNT, 3 * COUNT + SHAPES)
LOG_SCALE = 3 * COUNT + SHAPES
PLACE = slice(LOG_SCALE + 1, STEP)
_DESCENDANTS = descendants().astype(np.float64)


@dataclass(frozen=True)
class Linearisation:
    """Places on a body, and their derivative by a `step`.

    Attributes:
        points, normals: ``[n, 3]``.
        jacobian: ``[n, 3, STEP]``.
        turned: ``[24, 3, 3]`` rotation of each joint in space.
        joints: ``[24, 3]``.
        joint_jacobian: ``[24, 3, STEP]``.
    """

    points: Array
    normals: Array
    jacobian: Array
    turned: Array
    joints: Array
    joint_jacobian: Array


class BodySamples:
    """Fixed places on the template's surface."""

    def __init__(
        self, template: SkinnedTemplate, rest: Array, normals: Array, mix: sparse.csr_array
    ) -> None:
        """
        Args:
            template: the body.
            rest, normals: ``[n, 3]`` of the places at rest.
            mix: ``[n, V]`` which of the template's vertices each is a mean of.
        """
        self.template = template
        self.rest, self.normals = rest, normals
        self.shapedirs = _mixed(mix, template.shapedirs)
        self.weights = _mixed(mix, template.weights)
        # The joints move as places that each hang on its own bone.
        self._rest = np.concatenate([self.rest, np.zeros((COUNT, 3))])
        self._weights = np.concatenate([self.weights, np.eye(COUNT)])
        self._below = self._weights @ _DESCENDANTS.T
        self._dirs = np.concatenate([self.shapedirs, template.joint_dirs])

    @classmethod
    def drawn(cls, template: SkinnedTemplate, count: int) -> BodySamples:
        """``count`` places, drawn by area at rest."""
        samples = sample_surface(template.rest, template.faces, count, np.random.default_rng(0))
        corners = template.faces[samples.faces]
        rows = np.repeat(np.arange(count), 3)
        mix = sparse.csr_array(
            (samples.barycentric.ravel(), (rows, corners.ravel())), (count, len(template.rest))
        )
        return cls(template, samples.points, samples.normals, mix)

    @classmethod
    def of_vertices(cls, template: SkinnedTemplate, chosen: NDArray[np.int64]) -> BodySamples:
        """The template's vertices ``[n]``; their normals are not known, and zero."""
        mix = sparse.csr_array(
            (np.ones(len(chosen)), (np.arange(len(chosen)), chosen)),
            (len(chosen), len(template.rest)),
        )
        return cls(template, template.rest[chosen], np.zeros((len(chosen), 3)), mix)

    def at(self, body: Body) -> tuple[Array, Array]:
        """Points and unit normals ``[n, 3]`` of a body."""
        maps, shifts = self.template.transforms(body, self.weights)
        rest = self.rest + self.shapedirs @ body.shape
        points = (maps @ rest[:, :, None])[:, :, 0] + shifts
        return points, _unit((maps @ self.normals[:, :, None])[:, :, 0])

    def linearise(self, body: Body) -> Linearisation:
        """The places and the joints of a body, and how both move.

        A turn ``d`` of a joint at ``q`` moves a point by ``d x (P - W q)``, where ``W`` is the sum
        of its weights below the joint and ``P`` the sum of what these bones make of it, weighted.
        """
        template, scale = self.template, body.scale
        joints = template.joints + template.joint_dirs @ body.shape
        turned, placed = pose_joints(body.rotations, joints, PARENTS)
        rest = self._rest + self._dirs @ body.shape
        rest[-COUNT:] = joints
        offsets = placed - (turned @ joints[:, :, None])[:, :, 0]
        each = (rest @ turned.reshape(-1, 3).T).reshape(len(rest), COUNT, 3)
        each = scale * (each + offsets) + body.translation
        weighted = self._weights[:, :, None] * each
        points = weighted.sum(axis=1)
        arms = _DESCENDANTS @ weighted
        centres = scale * placed + body.translation
        arms -= self._below[:, :, None] * centres
        jacobian = np.zeros((len(rest), 3, STEP))
        turns = jacobian[:, :, : 3 * COUNT].reshape(len(rest), 3, COUNT, 3)
        for axis in range(3):
            after, before = (axis + 1) % 3, (axis + 2) % 3
            turns[:, after, :, axis] = -arms[:, :, before]
            turns[:, before, :, axis] = arms[:, :, after]
        jacobian[:, :, : 3 * COUNT] = turns.reshape(len(rest), 3, 3 * COUNT)
        maps = (self._weights @ turned.reshape(COUNT, 9)).reshape(-1, 3, 3)
        slopes = _joint_slopes(template, turned) - turned @ template.joint_dirs
        jacobian[:, :, SHAPE] = scale * (
            maps @ self._dirs + (self._weights @ slopes.reshape(COUNT, -1)).reshape(-1, 3, SHAPES)
        )
        jacobian[:, :, LOG_SCALE] = points - body.translation
        jacobian[:, [0, 1, 2], [PLACE.start, PLACE.start + 1, PLACE.start + 2]] = 1.0
        normals = _unit((maps[:-COUNT] @ self.normals[:, :, None])[:, :, 0])
        return Linearisation(
            points[:-COUNT], normals, jacobian[:-COUNT], turned, centres, jacobian[-COUNT:]
        )


def _joint_slopes(template: SkinnedTemplate, turned: Array) -> Array:
    """``[24, 3, S]`` how posed joints move with the shape, in the template's unit."""
    slopes = [template.joint_dirs[0]]
    for joint, parent in enumerate(PARENTS[1:], start=1):
        bone = template.joint_dirs[joint] - template.joint_dirs[parent]
        slopes.append(slopes[parent] + turned[parent] @ bone)
    return np.stack(slopes)


def stepped(body: Body, turned: Array, step: Array) -> Body:
    """A body after a step.

    Args:
        body: before it.
        turned: ``[24, 3, 3]`` rotations of its joints in space.
        step: ``[STEP]``: rotation vectors in space by which each joint turns all that hangs on it;
            change of the shape, of the logarithm of the scale, and of the translation.
    """
    turns = step[: 3 * COUNT].reshape(COUNT, 3)
    parents = np.concatenate([np.eye(3)[None], turned[list(PARENTS[1:])]])
    local = np.einsum("jab,ja->jb", parents, turns)
    rotations = rotation_matrices(local) @ body.rotations
    scale = body.scale * np.exp(step[LOG_SCALE])
    return replace(
        body,
        rotations=rotations,
        shape=body.shape + step[SHAPE],
        scale=float(scale),
        translation=body.translation + step[PLACE],
    )


def _mixed(mix: sparse.csr_array, values: Array) -> Array:
    """``[n, ...]`` means of per-vertex values ``[V, ...]``."""
    flat = np.asarray(mix @ values.reshape(len(values), -1))
    return flat.reshape(-1, *values.shape[1:])


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.maximum(length, 1e-300)
