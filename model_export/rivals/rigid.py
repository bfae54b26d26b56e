"""As rigid as possible, held at the template (libigl)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from model_export.rivals.subject import Array, Edit, Editor, Outcome, Subject

HANDLES = 200
ITERATIONS = 10


def as_rigid_as_possible(subject: Subject) -> Editor:
    """Some hundred vertices, spread over the mesh, go where the template's nearest vertex does;
    the rest follows as rigidly as it can (Sorkine and Alexa, 2007)."""
    import igl

    used, corners = np.unique(subject.faces, return_inverse=True)
    vertices = np.ascontiguousarray(subject.vertices[used])
    faces = np.ascontiguousarray(corners.reshape(-1, 3))
    handles = spread(vertices, HANDLES)
    _, nearest = cKDTree(subject.fitted).query(vertices[handles])
    data = igl.ARAPData()
    data.max_iter = ITERATIONS
    igl.arap_precomputation(vertices, faces, 3, handles.astype(np.int32), data)

    def edit(change: Edit) -> Outcome:
        moved = subject.template.jacobian[nearest, :, change.index] * change.df[change.index]
        found = subject.vertices.copy()
        found[used] = igl.arap_solve(vertices[handles] + moved, data, vertices)
        return Outcome(found)

    return edit


def spread(points: Array, count: int) -> np.ndarray:
    """Indices of points that are far from each other, each the farthest from those before."""
    count = min(count, len(points))
    chosen = np.zeros(count, np.int64)
    distance = np.full(len(points), np.inf)
    for index in range(1, count):
        gap = points - points[chosen[index - 1]]
        distance = np.minimum(distance, np.einsum("vc,vc->v", gap, gap))
        chosen[index] = distance.argmax()
    return chosen
