from __future__ import annotations

import numpy as np

from service.mesh.colours import as_light, linear


def test_the_curve() -> None:
    assert np.allclose(linear(np.array([0.0, 0.04045, 0.5, 1.0])), [0, 0.0031308, 0.2140411, 1])


def test_what_stands_for_one() -> None:
    white = np.array([[1.0, 1.0, 1.0]])
    assert np.array_equal(as_light(white), white)
    assert np.array_equal(as_light(255 * white), white)
    assert as_light(white.astype(np.uint8), 255.0).max() < 0.001


def test_no_number_is_a_colour_too() -> None:
    assert as_light(np.array([[np.nan, np.inf, -np.inf]])).tolist() == [[1, 1, 0]]


def test_an_alpha_that_says_something() -> None:
    rows = np.array([[1.0, 0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 1.0]])
    assert np.array_equal(as_light(rows), rows)
    for alpha, width in ((1.0, 3), (0.0, 3), (0.5, 4)):
        rows[:, 3] = alpha
        assert as_light(rows).shape == (2, width)
