from __future__ import annotations

import numpy as np
import pytest
from boxes import ORIGIN, PARAMETERS, block, chair, change, template_mesh

from service.deform import paper
from service.deform.normals import vertex_normals


def brute_force(x, normals, points, point_normals, values, k):
    """The paper's formula, one vertex at a time."""
    moved = []
    for position, normal in zip(x, normals, strict=True):
        d = np.linalg.norm(points - position, axis=1)
        near = np.argsort(d, kind="stable")[:k]
        weight = (1 + point_normals[near] @ normal) ** 2 * np.exp(-((d[near] / 0.03) ** 2))
        moved.append((weight[:, None] * values[near]).sum(axis=0) / weight.sum())
    return np.array(moved)


@pytest.mark.parametrize("k", [1, 8, 32])
def test_it_is_the_papers_formula(k):
    rng = np.random.default_rng(4)
    points, normals = rng.uniform(0.0, 0.2, (400, 3)), rng.normal(size=(460, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Most vertices agree with the points near them, as on a shape that fits.
    normals += np.array([1.5, 0.0, 0.0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    x, values = rng.uniform(0.05, 0.15, (60, 3)), rng.normal(size=(400, 3))
    weights = paper.neighbour_weights(x, normals[:60], points, normals[60:], k)
    expected = brute_force(x, normals[:60], points, normals[60:], values, k)
    np.testing.assert_allclose(weights @ values, expected, atol=1e-5)


def test_far_from_the_template_the_nearest_decide():
    template = chair()
    vertices, faces = block((-0.1, 1.5, -0.1), (0.1, 1.6, 0.1))
    moved = paper.bind(vertices, faces, template, PARAMETERS, ORIGIN).displace(
        change("back_height", 0.1)
    )
    np.testing.assert_allclose(moved[:, 1], 0.1, atol=1e-5)


def test_opposing_normals_leave_it_to_the_distance():
    points = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
    up = np.array([[0.0, 1.0, 0.0]])
    weights = paper.neighbour_weights(
        np.array([[0.0, 0.0, 0.0], [0.005, 0.0, 0.0]]), np.repeat(up, 2, 0), points, -up[[0, 0]], 2
    ).toarray()
    near = np.exp(-(np.array([0.0, 0.01]) ** 2) / 0.03**2)
    np.testing.assert_allclose(weights, [near / near.sum(), [0.5, 0.5]], atol=1e-6)


def test_a_mesh_turned_inside_out_moves_alike():
    vertices, faces = template_mesh()
    template = chair()
    df = 0.2 * PARAMETERS
    outside = paper.bind(vertices, faces, template, PARAMETERS, ORIGIN).displace(df)
    inside = paper.bind(vertices, faces[:, ::-1], template, PARAMETERS, ORIGIN).displace(df)
    assert np.abs(outside - inside).mean() < 0.1 * np.abs(outside).mean()


def test_its_linear_maps_stretch_what_the_parts_stretch():
    vertices, faces = template_mesh()
    binding = paper.bind(vertices, faces, chair(), PARAMETERS, ORIGIN)
    maps = binding.linear(change("leg_height", 0.2))
    floor = vertices[:, 1] - ORIGIN[1] < -0.35
    np.testing.assert_allclose(
        maps[floor], np.broadcast_to(np.diag([1, 1.5, 1]), (floor.sum(), 3, 3)), atol=1e-4
    )


def test_weights_sum_to_one_for_vertices_without_normals():
    template = chair()
    fitted = template.decode(PARAMETERS)
    x = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 5.0]])
    weights = paper.neighbour_weights(x, np.zeros((2, 3)), fitted, template.normals(fitted), 32)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert not vertex_normals(x, np.array([[0, 1, 1]])).any()
