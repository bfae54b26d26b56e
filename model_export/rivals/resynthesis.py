"""The true edit, made anew from its signed distance: the bound for re-synthesis.

What decodes a shape from a latent code (DualSDF and its kind) gives at best this: the truth's
distance on a grid, and marching cubes.  Vertices, faces and texture coordinates are new ones.
"""

from __future__ import annotations

import numpy as np

from model_export.rivals.subject import Array, Edit, Editor, Faces, Outcome, Subject
from service.mesh.surface import sample_surface

CELLS = 128
"""Of the grid along the longest side."""
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)
SAMPLES = 300_000


def resynthesised(subject: Subject) -> Editor:
    """The truth by way of a grid."""

    def edit(change: Edit) -> Outcome:
        if change.truth is None:
            raise ValueError("re-synthesis is of the true edit")
        return Outcome(*from_distance(change.truth, subject.faces, CELLS))

    return edit


def from_distance(vertices: Array, faces: Faces, cells: int) -> tuple[Array, Faces]:
    """The surface where the signed distance on a grid is zero.

    It is computed in those cells that the surface passes through, and those beside them.
    """
    import igl

    low, size = vertices.min(axis=0), np.ptp(vertices, axis=0).max() / cells
    rng = np.random.default_rng(0)
    on_surface = np.concatenate([vertices, sample_surface(vertices, faces, SAMPLES, rng).points])
    passed = np.unique(np.floor((on_surface - low) / size).astype(np.int64), axis=0)
    near = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)]).astype(np.int64)
    active = np.unique((passed[:, None] + near).reshape(-1, 3), axis=0)
    corners, index = np.unique(
        (active[:, None] + CORNERS).reshape(-1, 3), axis=0, return_inverse=True
    )
    points = low + corners * size
    distance, *_ = igl.signed_distance(
        points, vertices, faces, igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
    )
    made, triangles, _ = igl.marching_cubes(distance, points, index.reshape(-1, 8), 0.0)
    return made, triangles
