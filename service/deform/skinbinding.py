"""A mesh bound to a fitted body: its vertices move by their blended bone transforms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

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
        influences: ``[n, 24]`` skinning weights, at most `INFLUENCES` a row.
        shapedirs: ``[n, 3, S]`` displacement at rest, in metres, for each standard deviation of
            each shape coefficient.
    """

    template: SkinnedTemplate
    vertices: Array
    influences: csr_array
    shapedirs: Array

    @property
    def weights(self) -> Array:
        """``[n, 24]`` the same with all zeros."""
        return np.asarray(self.influences.toarray())

    def carry(self, before: Body, after: Body) -> tuple[Array, Array]:
        """Where vertices go when the body they were bound to changes.

        Each joint's map from ``before`` to ``after`` is blended, not the maps from rest: no blend
        has to be inverted (of bodies with hands on hips, some have a determinant of 0.07), a
        renderer that binds the mesh as it is does the same, and vertices none of whose joints
        moves stay exactly as they are.  Pose correctives of a body's file are left out.

        Args:
            before: the body that the mesh was bound to.
            after: what it becomes.

        Returns:
            ``[n, 3]`` displacements, and ``[n, 3, 3]`` local linear maps, for normals and tangents;
            those of a change of shape, which hardly turns anything, are left out.
        """
        now, was = bone_maps(self.template, after), bone_maps(self.template, before)
        changes = blended(self.influences, relative_maps(now, was))
        moved = applied(changes[:, :3], self.vertices) + changes[:, 3]
        change = np.asarray(after.shape - before.shape)
        if change.any():
            moved += applied(blended(self.influences, now[0]), self.shapedirs @ change)
        return moved.T, with_identity(changes[:, :3])

    def move(self, before: Body, after: Body) -> Array:
        """``[n, 3]`` vertices after a change; see `carry`."""
        return self.vertices + self.carry(before, after)[0]


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
    influences = csr_array(sparse_rows(values[:, :count]))[mesh.of]
    shapedirs = values[:, count:][mesh.of].reshape(len(x), 3, -1)
    return SkinBinding(template, x, influences, shapedirs)


def blended(influences: csr_array, maps: Array) -> Array:
    """``[a, b, n]`` the joints' maps ``[24, a, b]``, mixed by ``influences [n, 24]``."""
    mixed = np.empty((*maps.shape[1:], influences.shape[0]))
    for row, column in np.ndindex(maps.shape[1:]):
        mixed[row, column] = influences @ maps[:, row, column]
    return mixed


def with_identity(changes: Array) -> Array:
    """``[n, 3, 3]`` linear maps from what they add to a point, ``[3, 3, n]``."""
    maps: Array = (changes + np.eye(3)[:, :, None]).transpose(2, 0, 1)
    return maps


def applied(maps: Array, points: Array) -> Array:
    """``[3, n]`` images of ``points [n, 3]`` by ``maps [3, 3, n]``; coordinate by coordinate,
    several times faster than as products of small matrices."""
    x, y, z = np.ascontiguousarray(points.T)
    images = maps[:, 0] * x
    images += maps[:, 1] * y
    images += maps[:, 2] * z
    return images


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
