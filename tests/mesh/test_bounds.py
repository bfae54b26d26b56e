from __future__ import annotations

import numpy as np
import pytest

from service.mesh.bounds import bounds


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
