"""A mesh bound to a fitted body: its vertices move by their blended bone transforms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.skinweights import skin_values
from service.deform.weld import weld
from service.template.anatomy import JOINTS, PARENTS
from service.template.skinned import Body, SkinnedTemplate
from service.template.skinning import pose_joints

Array = NDArray[np.float64]

# Joints' maps that differ by less than this, of the frame's extent, don't.
STILL = 1e-9
# Weights below this are as good as none.
SLIGHT = 1e-4
INFLUENCES = 4
"""Most joints that move one vertex: what a glTF primitive's first set holds."""


@dataclass(frozen=True)
class SkinBinding:
    """A mesh that follows a body.

    Attributes:
        template: the body's.
        vertices: ``[n, 3]`` as bound, in the frame and unit of the body.
        weights: ``[n, 24]`` skinning weights, at most `INFLUENCES` of a row not zero.
        shapedirs: ``[n, 3, S]`` displacement at rest, in metres, for each standard deviation of
            each shape coefficient.
    """

    template: SkinnedTemplate
    vertices: Array
    weights: Array
    shapedirs: Array

    def move(self, before: Body, after: Body) -> Array:
        """``[n, 3]`` vertices when the body they were bound to changes.

        Each joint's map from ``before`` to ``after`` is blended, not the maps from rest: no blend
        has to be inverted (of bodies with hands on hips, some have a determinant of 0.07), a
        renderer that binds the mesh as it is does the same, and vertices none of whose joints
        moves stay exactly as they are.  Pose correctives of a body's file are left out.

        Args:
            before: the body that the mesh was bound to.
            after: what it becomes.
        """
        maps, shifts = bone_maps(self.template, after)
        changes = relative_maps((maps, shifts), bone_maps(self.template, before))
        blended = (self.weights @ changes.reshape(len(JOINTS), 12)).reshape(-1, 3, 4)
        moved = self.vertices + (
            (blended[:, :, :3] @ self.vertices[:, :, None])[:, :, 0] + blended[:, :, 3]
        )
        change = np.asarray(after.shape - before.shape)
        if change.any():
            linear = (self.weights @ maps.reshape(len(JOINTS), 9)).reshape(-1, 3, 3)
            moved += (linear @ (self.shapedirs @ change)[:, :, None])[:, :, 0]
        return moved

    def linear(self, before: Body, after: Body) -> Array:
        """``[n, 3, 3]`` local linear maps of `move`, for normals and tangents; those of a change
        of shape, which hardly turns anything, are left out."""
        changes = relative_maps(bone_maps(self.template, after), bone_maps(self.template, before))
        blended = self.weights @ changes[:, :, :3].reshape(len(JOINTS), 9)
        maps: Array = blended.reshape(-1, 3, 3) + np.eye(3)
        return maps


def bind(
    vertices: Array, faces: NDArray[np.int64], template: SkinnedTemplate, body: Body
) -> SkinBinding:
    """Bind a mesh to the body that was fitted to it.

    Args:
        vertices: ``[n, 3]`` finite, in the frame and unit of ``body``.
        faces: ``[m, 3]``.
        template: what was fitted.
        body: the fit, posed.
    """
    x = np.asarray(vertices, np.float64)
    mesh = weld(x, np.asarray(faces, np.int64))
    values = skin_values(mesh, template, body)
    count = len(JOINTS)
    weights = sparse_rows(values[:, :count])[mesh.of]
    return SkinBinding(template, x, weights, values[:, count:][mesh.of].reshape(len(x), 3, -1))


def joint_matrices(template: SkinnedTemplate, body: Body) -> Array:
    """``[24, 4, 4]`` each joint's rotation and position in space."""
    joints = template.joints + template.joint_dirs @ body.shape
    turned, placed = pose_joints(body.rotations, joints, PARENTS)
    matrices = np.tile(np.eye(4), (len(JOINTS), 1, 1))
    matrices[:, :3, :3] = turned
    matrices[:, :3, 3] = body.scale * placed + body.translation
    return matrices


def bone_maps(template: SkinnedTemplate, body: Body) -> tuple[Array, Array]:
    """``[24, 3, 3]`` and ``[24, 3]``: each joint's map from rest to space."""
    joints = template.joints + template.joint_dirs @ body.shape
    turned, placed = pose_joints(body.rotations, joints, PARENTS)
    offsets = placed - (turned @ joints[:, :, None])[:, :, 0]
    return body.scale * turned, body.scale * offsets + body.translation


def relative_maps(after: tuple[Array, Array], before: tuple[Array, Array]) -> Array:
    """``[24, 3, 4]`` what each joint adds to a point in space; exact zeros where it stays."""
    inverses = np.linalg.inv(before[0])
    linear = after[0] @ inverses
    shift = after[1] - (linear @ before[1][:, :, None])[:, :, 0]
    changes = np.concatenate([linear - np.eye(3), shift[:, :, None]], axis=2)
    # Parameters that went through axis-angle vectors come back with rounding.
    extent = np.abs(before[1]).max() + np.abs(before[0]).max()
    still = np.abs(changes) < STILL * np.array([1.0, 1.0, 1.0, extent])
    changes[still.all(axis=(1, 2))] = 0.0
    return changes


def sparse_rows(weights: Array) -> Array:
    """``[n, 24]`` the largest `INFLUENCES` of each row, one in sum, without those that hardly
    count."""
    most = np.argpartition(-weights, INFLUENCES - 1, axis=1)[:, :INFLUENCES]
    kept = np.take_along_axis(weights, most, axis=1)
    kept[kept < SLIGHT] = 0.0
    sparse = np.zeros_like(weights)
    np.put_along_axis(sparse, most, kept / kept.sum(axis=1, keepdims=True), axis=1)
    return sparse
