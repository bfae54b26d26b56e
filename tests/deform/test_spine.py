from __future__ import annotations

import numpy as np
from boxes import ORIGIN, block

from service.deform.spine import measure_spine
from service.deform.weld import weld

SIZE = np.array([0.05, 0.4, 0.05])
NOWHERE = np.full(3, np.nan)


def leaning(shift: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit coordinates of a leg whose foot stands off by `shift` lengths."""
    vertices, faces = block((-0.025, -0.2, -0.025), (0.025, 0.2, 0.025), 6)
    x = vertices - ORIGIN
    x[:, 0] += shift * (0.5 - x[:, 1] / 0.4)
    welded = weld(x, faces)
    return (welded.vertices / SIZE).astype(np.float32), welded.faces


def test_a_leaning_leg_is_straightened():
    u, faces = leaning(0.1)
    spine = measure_spine(u, faces, SIZE, NOWHERE, 1)
    straight = u[:, [0, 2]] - spine.shift(u)
    np.testing.assert_allclose(np.abs(straight).max(axis=0), 0.5, atol=0.03)
    np.testing.assert_allclose(spine.half, 0.5, atol=0.01)


def test_what_straddles_the_mirror_plane_is_no_leg():
    u, faces = leaning(0.0)
    assert measure_spine(u, faces, SIZE, np.array([0.2, np.nan, np.nan]), 1) is None


def test_a_thicker_block_or_none_has_no_spine():
    u, faces = leaning(0.0)
    thick = u * np.float32([4, 1, 4])
    assert measure_spine(thick, faces, SIZE, NOWHERE, 1) is None
    assert measure_spine(u, faces[:0], SIZE, NOWHERE, 1) is None
    assert measure_spine(u, faces, np.array([0.3, 0.4, 0.3]), NOWHERE, 1) is None


def test_a_bowed_panel_is_flattened():
    vertices, faces = block((-0.2, -0.2, -0.01), (0.2, 0.2, 0.01), 16)
    x = vertices - ORIGIN
    x[:, 2] += 0.03 * (1 - (x[:, 0] / 0.2) ** 2) - 0.05 * x[:, 1]
    welded = weld(x, faces)
    size = np.array([0.4, 0.4, 0.02])
    u = (welded.vertices / size).astype(np.float32)
    flat = u[:, [2]] - measure_spine(u, welded.faces, size, NOWHERE, 1).shift(u)
    assert np.abs(flat).max() < 0.8 < np.abs(u[:, 2]).max()
