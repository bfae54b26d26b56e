from __future__ import annotations

import numpy as np

from service.constraints import Interval
from service.deform.demands import Limits
from service.deform.gauges import Gauge
from service.deform.within import within

NAMES = ("a", "b", "c")
BEFORE = np.array([1.0, 2.0, 3.0])
NONE = Limits(np.zeros((0, 3)), np.zeros(0), ())
SUM = {"sum": Gauge.affine(6.0, np.ones(3))}


def test_a_parameters_interval_is_kept_to_the_bit() -> None:
    found = within(NAMES, BEFORE, BEFORE, SUM, (), {"b": Interval(high=1.7)}, BEFORE, NONE)
    np.testing.assert_array_equal(found, [1.0, 1.7, 3.0])


def test_what_was_edited_stays_and_the_rest_makes_room_by_its_size() -> None:
    edited = np.array([1.5, 2.0, 3.0])
    limits = {"sum": Interval(6.0, 6.0)}
    found = within(NAMES, BEFORE, edited, SUM, ("a",), limits, BEFORE, NONE)
    assert found[0] == 1.5
    np.testing.assert_allclose(found[1:], [2.0 - 0.5 * 4 / 13, 3.0 - 0.5 * 9 / 13])


def test_a_dimension_that_was_edited_stays() -> None:
    edited = np.array([1.0, 2.0, 4.0])
    limits = {"c": Interval(high=3.5)}
    found = within(NAMES, BEFORE, edited, SUM, ("sum",), limits, BEFORE, NONE)
    assert np.isclose(found.sum(), 7.0)
    assert found[2] == 3.5


def test_nothing_to_do_is_nothing_done() -> None:
    edited = np.array([1.1, 2.0, 3.0])
    found = within(NAMES, BEFORE, edited, SUM, ("a",), {"sum": Interval(low=6.0)}, BEFORE, NONE)
    np.testing.assert_array_equal(found, edited)
