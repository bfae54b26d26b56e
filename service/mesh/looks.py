"""What a mesh looks like beyond its shape, in the way that glTF stores it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.mesh.meshfile import Faces
from service.mesh.polygons import Indices

Values = NDArray[np.floating[Any]]
Statements = dict[str, str]
"""What a material says: the rest of a line by its keyword."""
Material = tuple[str, Statements]
"""A name, and what is said."""

# glTF stores float32; no texture is repeated this often.
FARTHEST = 1e6


@dataclass(frozen=True)
class Part:
    """Faces of one material.

    Attributes:
        material: what an .mtl says of it; None for the default material.
        start, stop: the vertices that they use, of the looks'.
        faces: ``[F, 3]`` indices of the looks' vertices, all between those.
    """

    material: Material | None
    start: int
    stop: int
    faces: Faces


@dataclass(frozen=True)
class Looks:
    """The vertices of a mesh with all that is said of each; one that looks different in different
    faces comes several times.

    Attributes:
        of: ``[W]`` which vertex of the file each is; every one of the file's is among them.
        parts: one after the other, all vertices and all faces.
        normals: ``[W, 3]`` of any length; what isn't known, or is no number, is NaN.
        coordinates: ``[W, 2]`` of textures, from the upper left corner; NaN where there are none.
        colours: ``[W, 3]`` or ``[W, 4]`` linear, from 0 to 1.
    """

    of: Indices
    parts: list[Part]
    normals: Values | None = None
    coordinates: Values | None = None
    colours: Values | None = None

    @staticmethod
    def whole(
        count: int, faces: Faces, material: Material | None = None, **attributes: Values | None
    ) -> Looks | None:
        """Looks of `count` vertices of which none comes twice; None where there are none."""
        if all(values is None for values in attributes.values()):
            return None
        return Looks(np.arange(count), [Part(material, 0, count, faces)], **attributes)


def flipped(coordinates: Values) -> Values:
    """Texture coordinates ``[N, 2]`` with v counted from the other end; no number is NaN."""
    turned = coordinates * [1.0, -1.0] + [0.0, 1.0]
    turned[~np.isfinite(turned).all(axis=1)] = np.nan
    return np.clip(turned, -FARTHEST, FARTHEST)
