"""What a mesh is once it is bound: displacements, exactly linear in the parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]

# Parts are no thinner than this to a mesh, in normalised lengths.
FLOOR = 1e-3


@dataclass(frozen=True)
class Binding:
    """A mesh bound to an affine template; any edit of it is one matrix product.

    Attributes:
        jacobian: ``[V, 3, d]`` float32, displacement per unit of each parameter; its columns are
            morph targets, exact in any combination.
        gains: ``[V, k]`` float32, how far each vertex follows each of the ways that the parts
            stretch: three a box, along its axes, and more where a part tapers.
        stretches: ``[k, 9, d]`` float32, the linear map (row-major 3 x 3) that a unit of each
            parameter adds to each.
    """

    jacobian: Array32
    gains: Array32
    stretches: Array32

    def displace(self, df: ArrayLike) -> Array32:
        """Displacements ``[V, 3]`` for a change of the parameters ``df [d]``.

        Coordinates that no changed parameter moves are exactly zero.
        """
        return self.jacobian @ np.asarray(df, np.float32)

    def linear(self, df: ArrayLike) -> Array32:
        """Local linear maps ``[V, 3, 3]`` for ``df [d]``: tangents follow them, normals their
        inverse transpose."""
        added = self.gains @ (self.stretches @ np.asarray(df, np.float32))
        maps: Array32 = added.reshape(-1, 3, 3) + np.eye(3, dtype=np.float32)
        return maps


def inverse_frames(frames: Array) -> Array:
    """``[P, 3, 3]`` inverses of the linear parts of ``frames [P, 3, 4]``.

    Parts thinner than `FLOOR` count as that thick, so that none is singular.
    """
    u, s, vt = np.linalg.svd(frames[:, :, :3])
    inverses: Array = np.einsum("pki,pk,pjk->pij", vt, 1.0 / np.maximum(s, FLOOR), u)
    return inverses


def part_stretches(template: AffineTemplate, inverses: Array) -> Array32:
    """`Binding.stretches` for part p, less its taper, and its axis m: ``dA_p[:, m] (A_p^-1)[m, :]``
    for each parameter."""
    outer = np.einsum("pimd,pmj->pmijd", template.frame_jacobian[:, :, :3], inverses)
    parts = len(inverses)
    return np.ascontiguousarray(outer.reshape(3 * parts, 9, -1), np.float32)
