"""The one place where a file that parsed is found to hold a usable mesh, or not."""

from __future__ import annotations

import numpy as np

from service.errors import InvalidMesh
from service.mesh import limits
from service.mesh.bounds import bounds
from service.mesh.faults import face_out_of_range
from service.mesh.meshfile import MeshFile
from service.mesh.moves import LARGEST_COORDINATE

# A triangle counts as surface from this part of the squared extent on.
LEAST_AREA = 1e-14
# Faces looked at together for one that has an area: the first few nearly always do.
BLOCK = 4096


def check(mesh: MeshFile) -> None:
    """Raise InvalidMesh or TooLarge when `mesh` can't be worked with."""
    vertices, faces = mesh.vertices, mesh.faces
    if len(vertices) == 0 or len(faces) == 0:
        raise InvalidMesh(
            "empty_mesh",
            f"The file has {len(vertices)} vertices and {len(faces)} faces.",
            "Upload a mesh with a surface; point clouds and curves can't be edited.",
        )
    limits.check_vertices(len(vertices))
    limits.check_faces(len(faces))
    low, high = bounds(vertices)
    # Minimum and maximum pass on a NaN, and comparing with that is false.
    if not (low.min() > -LARGEST_COORDINATE and high.max() < LARGEST_COORDINATE):
        finite = (np.abs(vertices) < LARGEST_COORDINATE).all(axis=1)
        raise InvalidMesh(
            "non_finite_vertices",
            f"{len(vertices) - int(finite.sum())} vertices are not finite numbers; the first is "
            f"vertex {int(np.argmin(finite))} (counted from 0).",
            "Remove these vertices and export the mesh again.",
        )
    for index in (int(faces.min()), int(faces.max())):
        if not 0 <= index < len(vertices):
            raise face_out_of_range(index, len(vertices))
    extent = float((high - low).max())
    if extent == 0 or not _has_area(mesh, extent):
        raise InvalidMesh(
            "degenerate_mesh",
            f"The mesh has no surface: its size is {extent:g} and all of its {len(faces)} faces "
            "have no area.",
            "Upload a mesh whose triangles are not all collapsed to lines or points.",
        )


def _has_area(mesh: MeshFile, extent: float) -> bool:
    for start in range(0, len(mesh.faces), BLOCK):
        corners = mesh.vertices[mesh.faces[start : start + BLOCK]] / extent
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        if (np.abs(normal) > LEAST_AREA).any():
            return True
    return False
