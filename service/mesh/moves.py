"""Which vertices moved, and what a vertex's map does to its normal and tangent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.errors import InvalidRequest
from service.mesh.meshfile import Linear, Vertices

# float32 ends at 3.4e38; squares of coordinates must still fit float64 when lengths are taken.
LARGEST_COORDINATE = 1e37
# Rows turned at a time: the nine columns of a block stay in the processor's cache.
BLOCK = 8192
# Directions shorter than this have none.
TINY = float(np.finfo(np.float64).tiny)


# Normals in a file may be anything, infinite or not a number too: those stay as they are.
tolerant = np.errstate(all="ignore")


@dataclass(frozen=True)
class Moves:
    """New positions and maps of a mesh's vertices, and who of them changed.

    Attributes:
        vertices: ``[V, 3]`` new world-space positions.
        linear: ``[V, 3, 3]`` linear part of each vertex's map.
        moved: ``[V]`` bool, the position differs in any bit of its value.
        turned: ``[V]`` bool, the map is not the identity.
    """

    vertices: Vertices
    linear: Linear
    moved: NDArray[np.bool_]
    turned: NDArray[np.bool_]

    @property
    def any(self) -> bool:
        return bool(self.moved.any() or self.turned.any())


def compare(old: Vertices, vertices: Vertices, linear: Linear) -> Moves:
    """Tell apart the vertices that stay.

    Args:
        old: ``[V, 3]`` positions as read.
        vertices: ``[V, 3]`` positions to write.
        linear: ``[V, 3, 3]`` linear maps.

    Raises:
        ValueError: the shapes do not belong to this mesh.
        InvalidRequest: a position or map is not finite, or too large to be stored.
    """
    if vertices.shape != old.shape or linear.shape != (len(old), 3, 3):
        raise ValueError(
            f"expected {old.shape} positions and ({len(old)}, 3, 3) maps, "
            f"got {vertices.shape} and {linear.shape}"
        )
    # Minimum and maximum pass a NaN on, and need no temporary array.
    bounds = [
        bound for array in (vertices, linear) if array.size for bound in (array.min(), array.max())
    ]
    if not all(abs(bound) < LARGEST_COORDINATE for bound in bounds):
        raise InvalidRequest(
            "overflow",
            "The edit moves vertices beyond what the file can store.",
            "Use edits nearer to the parameters' typical ranges.",
        )
    moved = any_of_rows(vertices != old)
    return Moves(vertices, linear, moved, _turned(linear))


def _turned(linear: Linear) -> NDArray[np.bool_]:
    """``[V]`` which maps are not the identity, compared in blocks without a break in them."""
    identities = np.tile(np.eye(3, dtype=linear.dtype).reshape(9), min(BLOCK, len(linear)))
    result = np.empty(len(linear), bool)
    for start in range(0, len(linear), BLOCK):
        flat = linear[start : start + BLOCK].reshape(-1)
        differs = flat != identities[: len(flat)]
        result[start : start + BLOCK] = any_of_rows(differs.reshape(-1, 9))
    return result


def any_of_rows(flags: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """``flags.any(axis=1)`` for few columns, column by column: several times faster."""
    result = flags[:, 0].copy()
    for column in range(1, flags.shape[1]):
        result |= flags[:, column]
    return result


def turn_normals(normals: NDArray[np.float64], linear: Linear) -> NDArray[np.float64]:
    """Normals by the inverse transpose, of unit length; ``[N, 3]`` and ``[N, 3, 3]``.

    The cofactor matrix is the inverse transpose times the determinant: it needs no division, and
    still answers rightly where a map flattens the surface.  A normal that vanishes stays.
    """
    result = np.empty_like(normals)
    for start in range(0, len(normals), BLOCK):
        part = slice(start, start + BLOCK)
        (a, b, c), (d, e, f), (g, h, i) = np.ascontiguousarray(
            linear[part].transpose(1, 2, 0), dtype=np.float64
        )
        x, y, z = np.ascontiguousarray(normals[part].T)
        p, q, r = e * i - f * h, f * g - d * i, d * h - e * g
        u = p * x + q * y + r * z
        v = (c * h - b * i) * x + (a * i - c * g) * y + (b * g - a * h) * z
        w = (b * f - c * e) * x + (c * d - a * f) * y + (a * e - b * d) * z
        length = np.sqrt(u * u + v * v + w * w)
        usable = (length > TINY) & (length < np.inf)
        sign = np.where(a * p + b * q + c * r < 0, -1.0, 1.0)
        scale = sign / np.where(usable, length, 1.0)
        for column, turned in enumerate((u, v, w)):
            np.multiply(turned, scale, out=result[part, column])
        if not usable.all():
            result[part][~usable] = normals[part][~usable]
    return result


def turn_tangents(tangents: NDArray[np.float64], linear: Linear) -> NDArray[np.float64]:
    """Tangent directions by the map itself, of unit length; ``[N, 3]`` and ``[N, 3, 3]``."""
    return unit(np.einsum("nij,nj->ni", linear, tangents), tangents)


def unit(directions: NDArray[np.float64], otherwise: NDArray[np.float64]) -> NDArray[np.float64]:
    """``[N, 3]`` directions scaled to length 1; others where that can't be."""
    x, y, z = directions.T
    length = np.sqrt(x * x + y * y + z * z)[:, None]
    usable = (length > TINY) & (length < np.inf)
    result: NDArray[np.float64] = directions / np.where(usable, length, 1.0)
    return result if usable.all() else np.where(usable, result, otherwise)
