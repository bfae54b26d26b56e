from __future__ import annotations

import numpy as np
from boxes import ORIGIN, PARAMETERS, chair, template_mesh

from service.deform.blend import bind
from service.deform.gradient import Gradient

SHARES = (-0.3, 0.4)


def test_it_is_what_a_unit_adds_to_the_maps():
    binding = bind(*template_mesh(), chair(), PARAMETERS, ORIGIN)
    rows = np.array([3, 7, 20])
    for index in range(8):
        gradient = binding.gradient(index, rows)
        expected = binding.linear(np.eye(8)[index])[rows] - np.eye(3)
        whole = np.zeros((3, 3, 3))
        for (i, j), value in zip(gradient.cells, gradient.values, strict=True):
            whole[:, i, j] = value
        np.testing.assert_allclose(whole, expected, atol=1e-5)
        np.testing.assert_array_equal(gradient.of(np.array([1])).values, gradient.values[:, [1]])


def test_what_is_not_wild_turns_no_normal_by_more_than_thirty_degrees():
    rng = np.random.default_rng(4)
    cells = [(i, j) for i in range(3) for j in range(3)]
    values = (0.5 * np.eye(3).reshape(9, 1) + 0.4 * rng.standard_normal((9, 4000))).astype(
        np.float32
    )
    wild = Gradient(cells, values / 2).wild(2.0, SHARES)
    assert 100 < wild.sum() < 3900
    for share in SHARES:
        maps = np.eye(3) + share * values.T.reshape(-1, 3, 3)[~wild]
        normals = rng.standard_normal((len(maps), 3))
        turned = np.linalg.solve(maps.transpose(0, 2, 1), normals[:, :, None])[:, :, 0]
        cosine = (normals * turned).sum(axis=1)
        cosine /= np.linalg.norm(normals, axis=1) * np.linalg.norm(turned, axis=1)
        assert cosine.min() > np.cos(np.pi / 6)


def test_sides_are_carried_by_the_mean_map_of_their_face():
    values = np.array([[1.0, 2.0, 6.0], [0.0, 3.0, 0.0]], np.float32)
    corners, sides = np.array([[0], [1], [2]]), np.zeros((2, 3, 1))
    sides[0, 1], sides[1, 2] = 2.0, 1.0
    carried = Gradient([(0, 1), (2, 2)], values).carried(corners, sides)
    np.testing.assert_allclose(carried[:, :, 0], [[6, 0, 0], [0, 0, 1]])
