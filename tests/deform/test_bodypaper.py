from __future__ import annotations

import numpy as np
from bodies import template, turned

from service.deform import bodypaper

REST = template().at_rest()
AFTER = turned(REST, left_elbow=(0.0, -1.0, 0.0))


def test_the_nearest_alone_is_the_template_itself():
    vertices = template().decode(REST)
    binding = bodypaper.bind(vertices, template(), REST, k=1)
    np.testing.assert_array_equal(binding.nearest[:, 0], np.arange(len(vertices)))
    moved = binding.carry(REST, AFTER)[0]
    np.testing.assert_allclose(vertices + moved, template().decode(AFTER), atol=1e-12)


def test_neighbours_count_alike():
    x = np.array([[0.5, 0.4, 0.0]])
    points = template().decode(REST)
    near = np.argsort(np.linalg.norm(points - x, axis=1))[:4]
    displacement = np.zeros_like(points)
    displacement[near] = [[0, 0, 4], [0, 4, 0], [4, 0, 0], [0, 0, 0]]
    moved = bodypaper.bind(x, template(), REST, k=4).carried(displacement)
    np.testing.assert_allclose(moved, [[1.0, 1.0, 1.0]])
