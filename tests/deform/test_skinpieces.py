from __future__ import annotations

import numpy as np
import trimesh
from bodies import below, hands_on_hips, index, template

from service.deform.normals import vertex_normals
from service.deform.skinmatch import BodySurface
from service.deform.skinpieces import (
    carried_pieces,
    carry,
    contacts,
    one_limb,
    piece_sizes,
    touching_pieces,
)

REST = template().at_rest()
VERTICES = template().decode(REST)
CHEST = int(template().weights[:, index("spine2")].argmax())
NORMALS = vertex_normals(VERTICES, template().faces)


def together(*clouds):
    """Clouds of points joined, and the piece that each point is of."""
    piece = np.repeat(np.arange(len(clouds)), [len(cloud) for cloud in clouds])
    return np.concatenate(clouds), piece


def ball(center, radius):
    return trimesh.creation.icosphere(1, radius).vertices + center


def test_sizes_are_of_each_piece():
    x, piece = together(np.array([[0.0, 0, 0], [3, 4, 0]]), np.array([[1.0, 1, 1]]))
    np.testing.assert_allclose(piece_sizes(x, piece), [5.0, 0.0])


def test_a_button_is_carried_but_shards_are_not():
    x, piece = together(VERTICES, ball([0.0, 0.2, 0.2], 0.01))
    np.testing.assert_array_equal(carried_pieces(x, np.ones(len(x)), piece), [False, True])
    shards, of = together(*(ball([0.1 * i, 0, 0], 0.02) for i in range(9)))
    assert not carried_pieces(shards, np.ones(len(shards)), of).any()


def test_a_button_takes_one_set_of_weights_from_beneath():
    button = ball(VERTICES[CHEST], 0.01)
    x, piece = together(VERTICES, button)
    values = np.concatenate([template().weights, np.tile(np.eye(24)[0], (len(button), 1))])
    sound = np.arange(len(x)) < len(VERTICES)
    carried = carry(x, piece, np.array([False, True]), sound, values)
    own = carried[len(VERTICES) :]
    np.testing.assert_array_equal(own, np.broadcast_to(own[0], own.shape))
    assert np.abs(own[0] - template().weights[CHEST]).sum() < 0.2
    np.testing.assert_array_equal(carried[: len(VERTICES)], template().weights)


def test_a_finger_that_touches_a_hip_stays_a_finger():
    hip = template().weights[:, 0].argmax()
    finger = ball(VERTICES[hip], 0.01)
    x, piece = together(VERTICES, finger)
    hand = np.eye(24)[index("left_hand")]
    values = np.concatenate([template().weights, np.tile(hand, (len(finger), 1))])
    carried = carry(x, piece, np.array([False, True]), np.ones(len(x), bool), values)
    np.testing.assert_allclose(carried[len(VERTICES) :], values[len(VERTICES) :])


def test_a_bag_takes_what_it_hangs_on():
    bag = np.array([[0.0, 0.3, -0.2], [0.0, 0.3, -0.3], [0.0, 0.2, -0.5]])
    x, piece = together(VERTICES, bag)
    sound = np.arange(len(x)) < len(VERTICES)
    values = np.concatenate([template().weights, np.zeros((3, 24))])
    touching, taken = contacts(x, piece, np.zeros(2, bool), sound, values)
    np.testing.assert_array_equal(np.flatnonzero(touching), [len(VERTICES)])
    nearest = np.linalg.norm(VERTICES - bag[0], axis=1).argmin()
    np.testing.assert_array_equal(taken[len(VERTICES)], template().weights[nearest])


def test_links_that_touch_are_one_as_far_as_a_hand_reaches():
    chain = [ball([0.02 * i, 0.0, 0.0], 0.0101) for i in range(5)]
    x, piece = together(*chain, ball([1.0, 0.0, 0.0], 0.01))
    joined = touching_pieces(x, piece)
    assert len(np.unique(joined[piece < 5])) == 1
    assert joined[-1] != joined[0]
    endless, of = together(*(ball([0.02 * i, 0.0, 0.0], 0.0101) for i in range(20)))
    assert len(np.unique(touching_pieces(endless, of))) == 20


def test_a_hand_of_its_own_on_a_hip_is_matched_as_a_whole():
    body = hands_on_hips(inward=0.1)
    posed = template().decode(body)
    normals = vertex_normals(posed, template().faces)
    hand = below(template().weights, "left_hand", "left_wrist") > 0.5
    x, n = posed[hand], normals[hand]
    # The fit is off by a finger's breadth.
    x = x - 0.02 * np.sign(x.mean(axis=0)) * [1.0, 0.0, 0.0]
    surface = BodySurface.of(template(), body)
    free = surface.match(x, n)
    whole = one_limb(x, n, np.zeros(len(x), np.int64), free, surface)
    arm = ("left_elbow", "left_wrist", "left_hand")
    assert (below(free.values, *arm) < 0.5).any()
    assert (below(whole.values, *arm) > 0.5).all()
