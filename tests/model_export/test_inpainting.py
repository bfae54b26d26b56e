from __future__ import annotations

import numpy as np
import pytest

from model_export.rivals.inpainting import inpaint, inpainted, matched
from service.template.bodyfile import load_body

TEMPLATE = load_body()
REST = TEMPLATE.at_rest()


def strip(count: int) -> tuple[np.ndarray, np.ndarray]:
    """A strip of squares along x."""
    at = np.arange(count + 1.0)
    x = np.stack([np.repeat(at, 2), np.tile([0.0, 1.0], count + 1), np.zeros(2 * count + 2)], 1)
    a = 2 * np.arange(count)
    return x, np.concatenate([np.stack([a, a + 2, a + 1], 1), np.stack([a + 1, a + 2, a + 3], 1)])


def test_weights_between_are_smooth_and_one_in_sum() -> None:
    x, faces = strip(10)
    weights = np.stack([x[:, 0] < 5, x[:, 0] >= 5], 1).astype(float)
    safe = (x[:, 0] < 2.5) | (x[:, 0] > 7.5)
    filled = inpaint(x, faces, weights, safe)
    np.testing.assert_array_equal(filled[safe], weights[safe])
    np.testing.assert_allclose(filled.sum(axis=1), 1.0)
    middle = filled[::2][3:8, 1]
    assert (np.diff(middle) > 0.05).all()
    assert middle[2] == pytest.approx(0.5, abs=0.02)


def test_pieces_without_a_match_keep_what_they_have() -> None:
    x, faces = strip(2)
    both = np.concatenate([x, x + np.array([0.0, 0.0, 5.0])])
    weights = np.tile([0.3, 0.7], (len(both), 1))
    safe = np.arange(len(both)) < len(x)
    filled = inpaint(both, np.concatenate([faces, faces + len(x)]), weights, safe)
    np.testing.assert_array_equal(filled, weights)


def test_the_body_itself_has_its_own_weights() -> None:
    x = TEMPLATE.decode(REST)
    weights = inpainted(x, TEMPLATE.faces, TEMPLATE, REST)
    assert np.abs(weights - TEMPLATE.weights).mean() < 1e-3
    assert np.abs(weights - TEMPLATE.weights).max(axis=1).mean() < 0.02


def test_matches_that_are_far_or_face_another_way_are_not_safe() -> None:
    x = TEMPLATE.decode(REST)
    _, safe = matched(x, TEMPLATE.faces, TEMPLATE, REST)
    assert safe.mean() > 0.9
    _, turned = matched(x, TEMPLATE.faces[:, ::-1], TEMPLATE, REST)
    assert turned.mean() < 0.05
    far = x + np.array([0.0, 0.0, 1.0])
    assert not matched(far, TEMPLATE.faces, TEMPLATE, REST)[1].any()
