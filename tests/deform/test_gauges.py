from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.deform.gauges import Gauge, Heights


def extent(seed: int) -> Gauge:
    rng = np.random.default_rng(seed)
    ends = Heights.of(rng.normal(size=30), rng.normal(size=(30, 4)).astype(np.float32))
    return Gauge(ends, ends)


@given(st.integers(0, 1000))
def test_a_tangent_touches_its_gauge_and_is_nowhere_above(seed: int) -> None:
    gauge, rng = extent(seed), np.random.default_rng(seed)
    change = rng.normal(size=4)
    value, row = gauge.tangent(change)
    assert np.isclose(value + row @ change, gauge.value(change), rtol=1e-6)
    for other in rng.normal(size=(20, 4)):
        assert value + row @ other <= gauge.value(other) + 1e-6


def test_an_extent_is_that_of_the_points_after_the_change() -> None:
    gauge, change = extent(5), np.array([0.1, 0.0, -0.4, 0.0])
    rows = np.stack([gauge.tops.row(index, 4) for index in range(30)])
    moved = gauge.tops.values + rows @ change
    assert np.isclose(gauge.value(change), np.ptp(moved))
    assert gauge.value(np.zeros(4)) == np.ptp(gauge.tops.values)


def test_a_gauge_without_bottoms_is_its_row() -> None:
    gauge = Gauge.affine(2.0, np.array([1.0, -3.0]))
    assert gauge.value(np.array([0.5, 0.5])) == 1.0
    value, row = gauge.tangent(np.ones(2))
    assert value == 2.0
    np.testing.assert_array_equal(row, [1.0, -3.0])


def test_points_that_nothing_moves_can_be_read() -> None:
    ends = Heights(np.array([1.0, 4.0]), {})
    gauge = Gauge(ends, ends)
    assert gauge.value(np.ones(3)) == 3.0
    np.testing.assert_array_equal(gauge.tangent(np.ones(3))[1], np.zeros(3))
