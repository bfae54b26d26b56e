from __future__ import annotations

from service.conflict import conflict_error
from service.constraints import Interval
from service.deform.demands import Conflict, Unsatisfiable

WIDE = Conflict("seat_width", Interval(low=0.7), 0.65, 0.05)
NARROW = Conflict("total_width", Interval(high=0.6), 0.65, 0.05)


def test_all_that_conflict_are_told_with_what_comes_nearest() -> None:
    error = conflict_error(Unsatisfiable([WIDE, NARROW], [], []), lambda _: "m")
    assert error.code == "constraints_conflict"
    assert error.detail == (
        "seat_width at least 0.7 m and total_width at most 0.6 m can't be had together"
    )
    assert "seat_width 0.65 m (off by 0.05 m); total_width 0.65 m" in error.suggestion
    assert error.members["conflicts"][1] == {
        "name": "total_width", "asked": {"max": 0.6}, "nearest": 0.65, "by": 0.05, "unit": "m"
    }  # fmt: skip


def test_edits_and_limits_that_stand_against_one_are_told() -> None:
    found = Unsatisfiable([NARROW], ["seat_width"], ["arm_width > 0"])
    assert conflict_error(found, lambda _: "cm").detail == (
        "total_width at most 0.6 cm can't be had: the edit of seat_width stays "
        "and arm_width > 0 must be kept"
    )


def test_coefficients_have_no_unit() -> None:
    shape = Conflict("shape_0", Interval(1.0, 1.0), 0.5, 0.5)
    error = conflict_error(Unsatisfiable([shape], [], []), lambda _: "1")
    assert error.detail == "shape_0 at 1 can't be had: no parameter moves it any further"
    assert "shape_0 0.5 (off by 0.5)" in error.suggestion
