from __future__ import annotations

import numpy as np
import pytest

from service.mesh.bounds import bounds, same_bound


@pytest.mark.parametrize("dtype", ["f4", "f8", "i2", "u1"])
@pytest.mark.parametrize("step", [1, 2])
def test_bounds_are_those_of_every_column(dtype: str, step: int) -> None:
    points = np.random.default_rng(1).integers(0, 99, (40, 3)).astype(dtype)[::step]
    low, high = bounds(points)
    assert low.dtype == high.dtype == dtype
    assert np.array_equal(low, points.min(axis=0))
    assert np.array_equal(high, points.max(axis=0))


def test_not_a_number_is_passed_on() -> None:
    low, high = bounds(np.array([[0.0, 1.0], [np.nan, 2.0]]))
    assert np.isnan([low[0], high[0]]).all()
    assert (low[1], high[1]) == (1, 2)


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ([0.1, 2], True),
        ([0.10000000149011612, 2.0], True),
        ([0.1, 3], False),
        ([0.1], False),
        ([0.1, "2"], False),
        ("0.1, 2", False),
        (None, False),
    ],
)
def test_bounds_are_compared_as_they_are_stored(text: object, same: bool) -> None:
    assert same_bound(text, np.array([0.1, 2], np.float32)) is same


@pytest.mark.parametrize("dtype", ["<f4", "i1", "<u2"])
@pytest.mark.parametrize("value", [10**400, -(10**400), 70000, 1e300, 1.5, float("nan")])
def test_no_bound_is_too_large_to_be_compared(dtype: str, value: float) -> None:
    assert not same_bound([value], np.array([1], dtype))
    assert same_bound([1.0], np.array([1], dtype))
