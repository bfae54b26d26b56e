from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair

from service.deform.binding import inverse_frames
from service.deform.groups import mirror_groups
from service.deform.proximity import Boxes, group_distance, nearness


def boxes() -> Boxes:
    frames = chair().frames(PARAMETERS)
    return Boxes(frames, inverse_frames(frames))


def test_local_coordinates_are_the_frames_inverse():
    x = np.random.default_rng(1).uniform(-0.5, 0.5, (9, 3))
    u = boxes().local(x)
    homogeneous = np.concatenate([u, np.ones((9, 6, 1))], axis=2)
    placed = np.einsum("pij,vpj->vpi", boxes().frames, homogeneous)
    np.testing.assert_allclose(placed, np.repeat(x[:, None], 6, 1), atol=1e-6)


def test_distances_are_zero_inside_and_euclidean_outside():
    w = PARAMETERS[4]
    x = np.array([[0.0, 0.0, 0.0], [w / 2 + 0.03, 0.025 + 0.04, 0.0]])
    np.testing.assert_allclose(boxes().distances(boxes().local(x))[:, 0], [0, 0.05], atol=1e-6)


def test_between_the_legs_their_group_is_nearer_than_each():
    x = np.array([[0.0, -0.25, 0.2], [2.0, -0.25, 0.2]])
    distances = boxes().distances(boxes().local(x))
    legs = mirror_groups(chair())[2]
    to_group = group_distance(x, distances, boxes(), legs)
    nearest = distances[:, list(legs.members)].min(axis=1)
    np.testing.assert_allclose(to_group, [0.5 * nearest[0], nearest[1]], rtol=1e-5)


def test_nearness_sums_to_one_and_favours_the_near():
    near = nearness(np.array([[0.0, 0.05, 0.3], [0.1, 0.1, 0.1]], np.float32))
    np.testing.assert_allclose(near.sum(axis=1), 1.0, atol=1e-6)
    assert near[0, 0] > 0.99
    np.testing.assert_allclose(near[1], 1 / 3, atol=1e-6)
