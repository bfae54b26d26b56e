from __future__ import annotations

import numpy as np

from service.deform.patch import RINGS, Patch, Patches
from service.deform.weld import weld


def ribbon(length: int) -> tuple[np.ndarray, np.ndarray]:
    """Squares along x, of two triangles each."""
    x = np.array([[i, j, 0.0] for i in range(length) for j in (0, 1)], float)
    a = 2 * np.arange(length - 1)
    faces = np.concatenate([np.stack([a, a + 2, a + 1], 1), np.stack([a + 1, a + 2, a + 3], 1)])
    return x, faces


def around(length: int, face: int) -> Patch:
    welded = weld(*ribbon(length))
    folded = np.zeros(len(welded.faces), bool)
    folded[face] = True
    return Patches(welded).around(folded)


def test_it_reaches_so_many_rings_and_its_edge_may_not_move():
    patch = around(200, 0)
    x, faces = ribbon(200)
    # A ring of faces reaches one square further.
    assert patch.vertices[:, 0].max() == RINGS + 1
    np.testing.assert_array_equal(patch.vertices, x[patch.vertex])
    of_whole = {tuple(sorted(face)) for face in faces.tolist()}
    assert {tuple(sorted(face)) for face in patch.vertex[patch.faces].tolist()} < of_whole
    outside = ~np.isin(np.arange(len(x)), patch.vertex)
    beside = faces[outside[faces].any(axis=1)]
    np.testing.assert_array_equal(patch.inner, ~np.isin(patch.vertex, beside))


def test_a_small_mesh_is_its_own_patch():
    patch = around(5, 3)
    assert len(patch.faces) == 8
    assert patch.inner.all()


def test_averaging_takes_each_neighbour_once():
    patch = around(4, 0)
    matrix = patch.averaging.toarray()
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0)
    neighbours = [set(np.flatnonzero(row)) for row in matrix]
    expected = [set() for _ in neighbours]
    for face in patch.faces:
        for corner in face:
            expected[corner] |= set(face) - {corner}
    assert neighbours == expected


def test_the_shortest_side_of_a_face():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 0.5, 0]], float)
    welded = weld(points, np.array([[0, 1, 2]]))
    assert set(Patches(welded).around(np.array([True])).shortest[0]) == {1, 2}
