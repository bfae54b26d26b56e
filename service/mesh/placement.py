"""How a glTF node or skin places local vertices in the world, and the way back."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from service.mesh import moves
from service.mesh.meshfile import Linear

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Placement:
    """An affine map, one for all vertices or one for each.

    Attributes:
        linear: ``[3, 3]`` or ``[N, 3, 3]``.
        offset: ``[3]`` or ``[N, 3]``.
    """

    linear: Array
    offset: Array

    @classmethod
    def of(cls, matrix: Array) -> Placement:
        """From ``[4, 4]`` or ``[N, 4, 4]`` matrices."""
        return cls(matrix[..., :3, :3], matrix[..., :3, 3])

    @cached_property
    def inverse(self) -> Array:
        """Of `linear`; a pseudo-inverse where one matrix for all flattens."""
        invert = np.linalg.pinv if self.linear.ndim == 2 else np.linalg.inv
        return np.asarray(invert(self.linear), np.float64)

    @property
    def is_identity(self) -> bool:
        return self.linear.ndim == 2 and bool(
            (self.linear == np.eye(3)).all() and not self.offset.any()
        )

    @property
    def mirrors(self) -> bool:
        """Whether triangles are seen from their other side."""
        return bool(np.median(np.linalg.det(self.linear)) < 0)

    def at(self, rows: NDArray[np.int64] | slice) -> Placement:
        """The placement of some of the vertices."""
        if self.linear.ndim == 2:
            return self
        return Placement(self.linear[rows], self.offset[rows])

    def to_world(self, points: Array) -> Array:
        """``[N, 3]`` world positions of local points."""
        return points.copy() if self.is_identity else times(self.linear, points) + self.offset

    def shifted(self, points: Array, before: Array, after: Array) -> Array:
        """``[N, 3]`` local points whose world positions went from `before` to `after`.

        Along an axis that the map flattens nothing can be moved: the point stays there.
        """
        if self.is_identity:
            return after
        return points + times(self.inverse, after - before)

    def turn_normals(self, normals: Array, linear: Linear) -> Array:
        """``[N, 3]`` local normals after ``[N, 3, 3]`` world-space maps."""
        if self.is_identity:
            return moves.turn_normals(normals, linear)
        world = times(np.swapaxes(self.inverse, -1, -2), normals)
        back = times(np.swapaxes(self.linear, -1, -2), moves.turn_normals(world, linear))
        return moves.unit(back, normals)

    def turn_tangents(self, tangents: Array, linear: Linear) -> Array:
        """``[N, 3]`` local tangents after ``[N, 3, 3]`` world-space maps."""
        if self.is_identity:
            return moves.turn_tangents(tangents, linear)
        world = times(self.linear, tangents)
        back = times(self.inverse, moves.turn_tangents(world, linear))
        return moves.unit(back, tangents)


def times(matrix: Array, vectors: Array) -> Array:
    """``[N, 3]`` products of one matrix, or one each, with vectors."""
    if matrix.ndim == 3:
        product: Array = np.einsum("nij,nj->ni", matrix, vectors)
        return product
    result = np.empty_like(vectors)
    transposed = np.ascontiguousarray(matrix.T)
    # A long product of so few columns would be spread over threads, and wait for them.
    for start in range(0, len(vectors), moves.BLOCK):
        part = slice(start, start + moves.BLOCK)
        np.matmul(vectors[part], transposed, out=result[part])
    return result
