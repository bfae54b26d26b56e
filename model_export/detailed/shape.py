"""What a detailed shape is: an object that can be made again with other parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from numpy.typing import ArrayLike

from model_export.primitives import Array, Faces, Mesh


@dataclass(frozen=True)
class DetailedShape:
    """A shape that can be generated again with other parameters.

    Attributes:
        category: whose template's parameters they are.
        names: of the parameters, in the template's order; the public ones.
        parameters: ``[n]`` metres.
        faces: ``[F, 3]``, the same for all parameters.
        welded: whether it is one connected piece.
        nuisances: what the template needs besides to stand as this shape does.
        variant: of the template; empty for a category that has none.
        build: the mesh for named parameters.
    """

    category: str
    names: tuple[str, ...]
    parameters: Array
    faces: Faces
    welded: bool
    nuisances: dict[str, float]
    variant: str
    build: Callable[[SimpleNamespace], Mesh]

    def mesh(self, f: ArrayLike) -> Array:
        """Vertices ``[V, 3]`` in metres for ``f [n]``, in the template's frame and origin."""
        return self.build(named(self.names, f))[0]


def named(names: tuple[str, ...], f: ArrayLike) -> SimpleNamespace:
    """Parameters ``f [n]`` by their names."""
    return SimpleNamespace(**dict(zip(names, np.asarray(f, np.float64), strict=True)))
