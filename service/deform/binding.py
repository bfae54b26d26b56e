"""What a mesh is once it is bound: displacements, exactly linear in the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from service.deform.bound import Bound, columns_of
from service.deform.gradient import Gradient
from service.deform.weld import Welded
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
        welded: the mesh without its seams, where that is known.
    """

    jacobian: Array32
    gains: Array32
    stretches: Array32
    welded: Welded | None = None

    def displace(self, df: ArrayLike) -> Array32:
        """See `Bound.displace`."""
        return self.bound(np.flatnonzero(df).tolist()).displace(df)

    def linear(self, df: ArrayLike) -> Array32:
        """See `Bound.linear`."""
        return self.bound(np.flatnonzero(df).tolist()).linear(df)

    def bound(self, parameters: Sequence[int]) -> Bound:
        """What is to be kept of it for changes of the parameters with these indices."""
        gradients = {index: self.gradient(index, slice(None)) for index in parameters}
        columns = columns_of(self.jacobian, parameters)
        return Bound(len(self.jacobian), columns, gradients, self.welded)

    def gradient(self, index: int, rows: NDArray[np.int64] | slice) -> Gradient:
        """What a unit of one parameter adds to the linear maps of some vertices."""
        added = self.stretches[:, :, index]
        ways, cells = (np.flatnonzero(added.any(axis=axis)) for axis in (1, 0))
        gains = [self.gains[rows, way] for way in ways]
        values = np.zeros((len(cells), len(self.gains[rows, 0])), np.float32)
        for value, cell in zip(values, cells, strict=True):
            for gain, change in zip(gains, added[ways, cell], strict=True):
                if change:
                    value += change * gain
        return Gradient([divmod(cell, 3) for cell in cells.tolist()], values)


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
