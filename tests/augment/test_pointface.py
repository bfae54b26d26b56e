"""Distances from points to faces."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from service.augment.pointface import face_distance, nearest_on_faces


def test_distances_are_those_of_many_points_of_the_faces() -> None:
    rng = np.random.default_rng(0)
    corners, points = rng.normal(size=(50, 3, 3)), rng.normal(size=(50, 3))
    faces = np.arange(150).reshape(-1, 3)
    distance, weights = nearest_on_faces(corners.reshape(-1, 3), faces, points)
    at = (corners * weights[:, :, None]).sum(axis=1)
    np.testing.assert_allclose(np.linalg.norm(at - points, axis=1), distance)
    assert (weights >= -1e-12).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    many = rng.dirichlet([0.5] * 3, 20_000)
    for index in range(50):
        tried = np.linalg.norm(many @ corners[index] - points[index], axis=1).min()
        assert distance[index] <= tried + 1e-12
        assert tried < distance[index] + 0.05


def test_a_point_beside_a_box_is_as_far_as_its_nearest_side() -> None:
    box = trimesh.creation.box((2, 2, 2))
    assert face_distance(box.vertices, box.faces, np.array([3.0, 0.2, 0.1])) == pytest.approx(2.0)


def test_a_face_without_area_is_its_edge() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    assert face_distance(vertices, np.array([[0, 1, 2]]), np.array([1.5, 1, 0])) == pytest.approx(1)
