from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair

from service.deform.binding import inverse_frames
from service.deform.proximity import Boxes
from service.deform.seams import flush_seams


def boxes() -> Boxes:
    frames = chair().frames(PARAMETERS)
    return Boxes(frames, inverse_frames(frames))


def test_strips_over_legs_and_back_are_carried_and_the_rest_stretches():
    seams = flush_seams(chair(), boxes(), {})
    w, d, lw, ld = PARAMETERS[[4, 3, 7, 6]]
    np.testing.assert_allclose(seams.high[0], [0.5 - lw / w, 0.5, 0.5 - ld / d], atol=1e-6)
    # Behind, the legs and the back are both flush; the deeper one counts.
    np.testing.assert_allclose(seams.low[0, 2], 0.04 / d - 0.5, atol=1e-6)
    assert seams.low[2].tolist() == [-0.5, -0.5, -0.5]


def test_the_seat_then_moves_with_the_leg_below_it():
    seams = flush_seams(chair(), boxes(), {})
    lw, w = PARAMETERS[[7, 4]]
    u = np.zeros((4, 6, 3), np.float32)
    u[:, 0, 0] = [0.0, 0.5 - lw / w, 0.5, 0.7]
    carried, gain = u.copy(), np.ones_like(u)
    seams.carry(carried, gain, np.ones(4, bool))
    np.testing.assert_allclose(carried[:, 0, 0], [0.0, 0.5, 0.5, 0.7], atol=1e-6)
    np.testing.assert_allclose(gain[[0, 3], 0, 0], [0.5 / (0.5 - lw / w), 1.0], atol=1e-6)


def test_what_goes_with_one_part_is_left_as_it_is():
    seams = flush_seams(chair(), boxes(), {})
    u = np.full((2, 6, 3), 0.45, np.float32)
    gain = np.ones_like(u)
    seams.carry(u, gain, np.array([True, False]))
    assert u[0, 0, 0] > 0.45
    assert gain[0, 0, 0] == 0.0
    np.testing.assert_array_equal(u[1], np.float32(0.45))
    np.testing.assert_array_equal(gain[1], 1.0)
