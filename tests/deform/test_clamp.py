from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair

from service.deform.binding import inverse_frames
from service.deform.clamp import saturate, stretch_limits
from service.deform.groups import mirror_groups
from service.deform.proximity import Boxes


def limits() -> tuple[np.ndarray, np.ndarray]:
    frames = chair().frames(PARAMETERS)
    return stretch_limits(Boxes(frames, inverse_frames(frames)), mirror_groups(chair()), {})


def test_inside_nothing_changes_and_outside_stretch_ends():
    u = np.zeros((4, 6, 3), np.float32)
    u[:, 0, 1] = [0.3, -0.5, 1.0, 60.0]
    clamped, gain = saturate(u, *limits())
    np.testing.assert_allclose(clamped[:2, 0, 1], [0.3, -0.5])
    assert gain[:2, 0, 1].tolist() == [1.0, 1.0]
    assert 0.5 < clamped[2, 0, 1] < clamped[3, 0, 1] <= 1.0
    assert gain[3, 0, 1] == 0.0


def test_it_is_monotone_and_its_gain_is_its_slope():
    u = np.zeros((4001, 6, 3), np.float32)
    u += np.linspace(-2, 2, 4001, dtype=np.float32)[:, None, None]
    clamped, gain = saturate(u, *limits())
    slope = np.diff(clamped.astype(np.float64), axis=0) / 1e-3
    assert slope.min() >= -1e-3
    np.testing.assert_allclose(slope, (gain[1:] + gain[:-1]) / 2, atol=0.02)


def test_towards_its_mirror_image_a_leg_ends_sooner():
    _, reach = limits()
    inward, outward = reach[1, 2, 0], reach[0, 2, 0]
    assert inward < outward
