"""The paper's rule for bodies: the displacement of the nearest template vertices (section 3.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from service.deform.skinbinding import blended, bone_maps, relative_maps, with_identity
from service.template.skinned import Body, SkinnedTemplate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PaperBinding:
    """A mesh whose vertices take the mean displacement of template vertices.

    Attributes:
        template: the body's.
        vertices: ``[n, 3]`` as bound, in the frame and unit of the body.
        nearest: ``[n, k]`` the template vertices that were nearest.
    """

    template: SkinnedTemplate
    vertices: Array
    nearest: NDArray[np.int32]

    def carry(self, before: Body, after: Body) -> tuple[Array, Array]:
        """Where vertices go when the body they were bound to changes.

        Returns:
            ``[n, 3]`` displacements, and ``[n, 3, 3]`` how the body turns about each vertex, for
            normals and tangents: the mean of the nearest template vertices' joints.
        """
        moved = self.carried(self.template.decode(after) - self.template.decode(before))
        changes = relative_maps(bone_maps(self.template, after), bone_maps(self.template, before))
        influences = csr_array(self.template.weights[self.nearest].mean(axis=1))
        return moved, with_identity(blended(influences, changes[:, :, :3]))

    def carried(self, displacement: Array) -> Array:
        """``[n, 3]`` displacements when the template's are ``displacement [V, 3]``."""
        count, k = self.nearest.shape
        share = np.full(count * k, 1.0 / k)
        rows = np.arange(0, count * k + 1, k)
        mean = csr_array((share, self.nearest.ravel(), rows), shape=(count, len(displacement)))
        moved: Array = mean @ displacement
        return moved


def bind(vertices: Array, template: SkinnedTemplate, body: Body, k: int = 32) -> PaperBinding:
    """Bind a mesh to a fitted body by its `k` nearest vertices, each of weight 1 as the paper has
    it for bodies.

    Args:
        vertices: ``[n, 3]`` finite, in the frame and unit of ``body``.
        template: what was fitted.
        body: the fit, posed.
        k: how many.
    """
    x = np.asarray(vertices, np.float64)
    points = template.decode(body)
    nearest = cKDTree(points).query(x, k=range(1, min(k, len(points)) + 1))[1]
    return PaperBinding(template, x, nearest.astype(np.int32))
