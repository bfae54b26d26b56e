from __future__ import annotations

import numpy as np
import pytest

from model_export import raster
from model_export.raster import VEILED, paint

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
TWO = SQUARE[[[0, 1, 2], [0, 2, 3]]]
RED, BLUE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
SIZE = 40


def painted(*layers: tuple[np.ndarray, np.ndarray, float], scale: float = 10.0) -> np.ndarray:
    corners = np.concatenate([layer[0] for layer in layers])
    colours = np.concatenate([np.broadcast_to(layer[1], (len(layer[0]), 3)) for layer in layers])
    opacity = np.concatenate([np.full(len(layer[0]), layer[2]) for layer in layers])
    return paint(corners, colours, opacity, np.zeros(2), scale, (SIZE, SIZE))


def test_a_face_covers_the_pixels_that_it_covers() -> None:
    picture = painted((TWO, RED, 1.0))
    covered = picture[..., 3] == 1.0
    assert covered[10:30, 10:30].all()
    assert covered.sum() == 20 * 20
    assert (picture[~covered] == 0.0).all()


def test_up_is_up_and_right_is_right() -> None:
    shifted = TWO + np.array([0.5, 0.9, 0.0])
    rows, columns = np.nonzero(painted((shifted, RED, 1.0))[..., 3])
    assert (rows.min(), rows.max()) == (1, 20)
    assert (columns.min(), columns.max()) == (15, 34)


@pytest.mark.parametrize("turned", [False, True])
def test_faces_that_pass_through_each_other_are_cut_where_they_do(turned: bool) -> None:
    slope = TWO.copy()
    slope[..., 2] = slope[..., 0]
    layers = [(slope, RED, 1.0), (TWO, BLUE, 1.0)]
    picture = painted(*(layers[::-1] if turned else layers))
    assert (picture[10:30, 10:20, 2] > picture[10:30, 10:20, 0]).all()
    assert (picture[10:30, 20:30, 0] > picture[10:30, 20:30, 2]).all()


def test_faces_are_shaded_by_their_slope_alike_from_both_sides() -> None:
    flat, over = painted((TWO, RED, 1.0)), painted((TWO[:, ::-1], RED, 1.0))
    np.testing.assert_array_equal(flat, over)
    slope = TWO.copy()
    slope[..., 2] = 2 * slope[..., 0]
    assert painted((slope, RED, 1.0))[20, 20, 0] < flat[20, 20, 0] - 0.1


def test_what_is_translucent_lets_through_and_is_faint_behind() -> None:
    near, far = TWO + np.eye(3)[2], TWO - np.eye(3)[2]
    alone = painted((TWO, RED, 1.0))[20, 20]
    over = painted((TWO, RED, 1.0), (near, BLUE, 0.5))[20, 20]
    behind = painted((TWO, RED, 1.0), (far, BLUE, 0.5))[20, 20]
    np.testing.assert_allclose(over[0], 0.5 * alone[0])
    np.testing.assert_allclose(behind[0], (1 - 0.5 * VEILED) * alone[0])
    assert over[3] == behind[3] == 1.0
    assert painted((TWO, BLUE, 0.5))[20, 20, 3] == 0.5


def test_few_pixels_at_a_time_come_to_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    soup = rng.uniform(-2, 2, (50, 3, 3))
    whole = painted((soup, rng.uniform(size=(50, 3)), 1.0))
    rng = np.random.default_rng(0)
    rng.uniform(-2, 2, (50, 3, 3))
    monkeypatch.setattr(raster, "CHUNK", 100)
    np.testing.assert_array_equal(whole, painted((soup, rng.uniform(size=(50, 3)), 1.0)))


def test_what_lies_outside_or_edge_on_is_not_seen() -> None:
    edge_on = TWO[:, :, [2, 1, 0]]
    assert not painted((edge_on, RED, 1.0)).any()
    assert not painted((TWO + 100 * np.eye(3)[0], RED, 1.0)).any()
    assert not painted((TWO[:0], RED, 1.0)).any()
