from __future__ import annotations

import numpy as np
import pytest

from service.deform.inpaint import COTANGENTS, fill, laplacian, smooth


def sheet(columns: int, rows: int):
    """A flat grid of unit squares, each of two triangles."""
    y, x = np.mgrid[0:rows, 0:columns]
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(float)
    a = (y[:-1, :-1] * columns + x[:-1, :-1]).ravel()
    quads = np.stack([a, a + 1, a + columns + 1, a + columns], axis=1)
    return vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def untrusted(count: int):
    return np.zeros(count)


def test_a_right_triangle_has_the_cotangents_of_its_angles():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    matrix = laplacian(vertices, np.array([[0, 1, 2]])).toarray()
    # Both other angles are 45 degrees; the right angle's cotangent is brought into the range.
    least = COTANGENTS[0] / 2
    np.testing.assert_allclose(
        matrix, [[1, -0.5, -0.5], [-0.5, 0.5 + least, -least], [-0.5, -least, 0.5 + least]]
    )


def test_the_laplacian_is_symmetric_and_its_rows_sum_to_zero():
    rng = np.random.default_rng(0)
    vertices, faces = sheet(6, 5)
    matrix = laplacian(vertices + rng.normal(0.0, 0.2, vertices.shape), faces).toarray()
    np.testing.assert_allclose(matrix, matrix.T)
    np.testing.assert_allclose(matrix.sum(axis=1), 0.0, atol=1e-12)
    assert np.linalg.eigvalsh(matrix)[0] > -1e-12


def test_a_face_without_extent_leaves_finite_numbers():
    vertices = np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]])
    matrix = laplacian(vertices, np.array([[0, 1, 2], [0, 2, 3], [3, 3, 3]]))
    assert np.isfinite(matrix.toarray()).all()


def test_between_two_ends_values_pass_over_evenly():
    vertices, faces = sheet(9, 4)
    along = vertices[:, 0] / 8.0
    known = (along == 0.0) | (along == 1.0)
    values = np.where(known, along, 99.0)[:, None]
    filled = fill(laplacian(vertices, faces), known, values, untrusted(len(vertices)))
    # The cotangents of the grid's right angles, brought into the range, bend it a little.
    np.testing.assert_allclose(filled[:, 0], along, atol=0.01)


def test_weights_stay_weights():
    rng = np.random.default_rng(1)
    vertices, faces = sheet(12, 12)
    known = rng.random(len(vertices)) < 0.2
    values = rng.dirichlet(np.ones(5), len(vertices))
    trust = untrusted(len(vertices))
    values[~known] = 7.0
    filled = fill(laplacian(vertices, faces), known, values, trust)
    np.testing.assert_array_equal(filled[known], values[known])
    assert filled.min() >= -1e-12
    np.testing.assert_allclose(filled.sum(axis=1), 1.0)


@pytest.mark.parametrize(("trust", "middle"), [(0.0, 0.0), (1e6, 1.0)])
def test_what_is_trusted_is_kept_far_from_the_rim(trust, middle):
    vertices, faces = sheet(21, 3)
    known = vertices[:, 0] == 0.0
    values = np.where(known, 0.0, 1.0)[:, None]
    filled = fill(laplacian(vertices, faces), known, values, np.full(len(vertices), trust))
    assert filled[10, 0] == pytest.approx(middle, abs=1e-4)


def test_smoothing_keeps_constants_and_flattens_a_spike():
    vertices, faces = sheet(5, 5)
    matrix = laplacian(vertices, faces)
    values = np.ones((25, 2))
    values[12, 1] = 9.0
    smoothed = smooth(matrix, values, np.full(25, 0.5), 1)
    np.testing.assert_allclose(smoothed[:, 0], 1.0)
    assert smoothed[12, 1] == pytest.approx(5.0)
    assert smoothed[7, 1] > 1.0


def test_without_strength_nothing_is_smoothed():
    vertices, faces = sheet(3, 3)
    values = np.arange(9.0)[:, None]
    smoothed = smooth(laplacian(vertices, faces), values, np.zeros(9), 4)
    np.testing.assert_array_equal(smoothed, values)
