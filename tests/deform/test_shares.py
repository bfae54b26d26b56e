from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair
from planes import plane, plane_values

from service.deform.binding import inverse_frames
from service.deform.groups import mirror_groups
from service.deform.loft import lofts
from service.deform.proximity import Boxes
from service.deform.roots import rooted
from service.deform.shares import Blocks, all_shares

W, LW = PARAMETERS[[4, 7]]


def shares(x: np.ndarray, whole: bool) -> np.ndarray:
    frames = chair().frames(PARAMETERS)
    boxes = Boxes(frames, inverse_frames(frames))
    blocks = Blocks(np.zeros(len(x), np.int64), np.ptp(x, axis=0)[None], np.array([whole]))
    return all_shares(boxes.local(x), boxes, mirror_groups(chair()), blocks)


def test_between_two_legs_the_share_is_linear():
    across = np.linspace(-W / 2 + LW, W / 2 - LW, 9)
    x = np.stack([across, np.full(9, -0.3), np.full(9, 0.2)], axis=1)
    left = shares(x, False)[:, 3]
    np.testing.assert_allclose(left, np.linspace(0, 1, 9), atol=1e-5)


def test_wings_keep_their_own_to_the_root_and_share_what_is_between():
    f = plane_values()
    cut, starts = rooted(plane(), f)
    maps = cut.maps(f)
    found = lofts(plane(), f, maps.frames, maps.tapers, starts)
    boxes = Boxes(maps.frames, inverse_frames(maps.frames), found)
    across = np.array([-0.4, -0.05, 0.0, 0.0225, 0.05, 0.4])
    x = np.stack([across, np.full(6, -0.02), np.full(6, 0.05)], axis=1)
    blocks = Blocks(np.zeros(6, np.int64), np.ptp(x, axis=0)[None], np.array([False]))
    left = all_shares(boxes.local(x), boxes, mirror_groups(cut), blocks)[:, 1]
    np.testing.assert_allclose(left, [0, 0, 0.5, 0.75, 1, 1], atol=1e-5)


def test_lone_parts_have_all_and_legs_share_one():
    x = np.random.default_rng(2).uniform(-0.5, 0.5, (50, 3))
    result = shares(x, False)
    np.testing.assert_array_equal(result[:, :2], 1.0)
    np.testing.assert_allclose(result[:, 2:].sum(axis=1), 1.0, atol=1e-5)


def test_a_short_piece_has_one_share_throughout():
    x = np.array([[-0.02, -0.3, 0.0], [0.05, -0.3, 0.01], [0.03, -0.25, 0.05]])
    together = shares(x, True)
    np.testing.assert_allclose(together, np.broadcast_to(together[0], together.shape), atol=1e-6)
    assert np.ptp(shares(x, False)[:, 3]) > 0.05
