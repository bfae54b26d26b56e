from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from service.constraints import Interval
from service.deform.constrained import constrained
from service.deform.demands import Demand, Limits, Unsatisfiable
from service.deform.gauges import Gauge, Heights

FREE = Limits(np.zeros((0, 4)), np.zeros(0), ())
WEIGHTS = np.array([1.0, 0.5, 2.0, 0.1])
STILL = np.zeros(4)
POSITIVE = Limits(np.eye(4), np.full(4, -0.6), tuple(f"p{i} > 0" for i in range(4)))


def row(seed: int) -> Gauge:
    rng = np.random.default_rng(seed)
    return Gauge.affine(1.0 + rng.random(), rng.normal(size=4))


def extent(seed: int, points: int = 12) -> Gauge:
    """About 2 long, and longer for larger parameters."""
    rng = np.random.default_rng(seed)
    values = rng.choice([-1.0, 1.0], points) * (1.0 - 0.2 * rng.random(points))
    rows = values[:, None] * (0.5 + rng.random((points, 4)))
    ends = Heights.of(values, rows)
    return Gauge(ends, ends)


def cost(change: np.ndarray) -> float:
    return float(np.square(change / WEIGHTS).sum())


def test_nothing_changes_where_all_is_met() -> None:
    demands = [Demand("a", row(0), Interval(0.0, 5.0)), Demand("b", extent(0), Interval(1.0, 3.0))]
    np.testing.assert_array_equal(constrained(STILL, WEIGHTS, demands, FREE), STILL)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6), st.floats(0.7, 1.3), st.floats(0.7, 1.3))
def test_it_is_the_smallest_change(seed: int, first: float, second: float) -> None:
    one, two = row(seed), row(seed + 1)
    low = one.value(STILL) * first
    high = two.value(STILL) * second
    demands = [Demand("a", one, Interval(low=low)), Demand("b", two, Interval(high=high))]
    try:
        found = constrained(STILL, WEIGHTS, demands, POSITIVE)
    except Unsatisfiable:
        return
    assert one.value(found) >= low * (1 - 1e-9)
    assert two.value(found) <= high * (1 + 1e-9)
    assert (found >= -0.6 - 1e-9).all()
    other = minimize(
        cost, STILL, method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
        constraints=[
            {"type": "ineq", "fun": lambda c: one.value(c) - low},
            {"type": "ineq", "fun": lambda c: high - two.value(c)},
            {"type": "ineq", "fun": lambda c: c + 0.6},
        ],
    )  # fmt: skip
    assert not other.success or cost(found) <= other.fun * (1 + 1e-6) + 1e-10


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6), st.floats(0.75, 1.3))
def test_extents_are_met_by_the_smallest_change(seed: int, factor: float) -> None:
    gauge = extent(seed)
    target = gauge.value(STILL) * factor
    end = Interval(high=target) if factor < 1.0 else Interval(low=target)
    found = constrained(STILL, WEIGHTS, [Demand("a", gauge, end)], FREE)
    assert gauge.value(found) == pytest.approx(target, rel=1e-9)
    exact = constrained(STILL, WEIGHTS, [Demand("a", gauge, Interval(target, target))], FREE)
    assert gauge.value(exact) == pytest.approx(target, rel=1e-9)
    values = gauge.tops.values
    ends = np.stack([gauge.tops.row(index, 4) for index in range(len(values))])
    pairs = [
        (values[i] - values[j], ends[i] - ends[j]) for i, j in product(range(len(values)), repeat=2)
    ]
    if factor < 1.0:
        # Convex: every pair is at most so far apart.
        other = minimize(
            cost, STILL, method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
            constraints={
                "type": "ineq",
                "fun": lambda c: target - np.array([v + r @ c for v, r in pairs]),
            },
        )  # fmt: skip
        assert cost(found) <= other.fun * (1 + 1e-6) or not other.success
        return
    # Any pair may be the one that reaches: of all of them the nearest.
    reached = [
        np.square((target - value) / np.linalg.norm(row * WEIGHTS))
        for value, row in pairs
        if row.any()
    ]
    assert cost(found) <= min(reached) * 1.3
    assert cost(found) >= min(reached) * (1 - 1e-9)


def test_a_minimum_is_not_exceeded_by_another_end() -> None:
    # The end that is outermost at first hardly moves; the other soon passes it.
    values = np.array([-1.0, 1.0, -0.9, 0.9])
    rows = np.zeros((4, 4))
    rows[:, 0] = [-0.05, 0.05, -1.0, 1.0]
    ends = Heights.of(values, rows)
    gauge = Gauge(ends, ends)
    for interval in (Interval(low=3.0), Interval(3.0, 3.0), Interval(3.0, 3.5)):
        found = constrained(STILL, WEIGHTS, [Demand("a", gauge, interval)], FREE)
        np.testing.assert_allclose(found, [0.6, 0.0, 0.0, 0.0], atol=1e-9)


def test_what_need_not_change_stays_to_the_bit() -> None:
    gauge = Gauge.affine(1.0, np.array([1.0, 1e-9, 0.0, 0.0]))
    found = constrained(STILL, WEIGHTS, [Demand("a", gauge, Interval(2.0, 2.0))], FREE)
    np.testing.assert_array_equal(found[1:], 0.0)
    held = constrained(
        STILL, np.array([1.0, 0.0, 1.0, 1.0]), [Demand("a", row(3), Interval(low=9.0))], FREE
    )
    assert held[1] == 0.0


def test_firm_demands_stay_and_the_rest_moves_around_them() -> None:
    start = np.array([0.4, 0.0, 0.0, 0.0])
    edited = Gauge.affine(1.0, np.array([1.0, 0.0, 0.0, 0.0]))
    both = Gauge.affine(2.0, np.array([1.0, 1.0, 0.0, 0.0]))
    demands = [
        Demand("edited", edited, Interval(1.4, 1.4), firm=True),
        Demand("sum", both, Interval(high=2.2)),
    ]
    found = constrained(start, WEIGHTS, demands, FREE)
    np.testing.assert_allclose(found, [0.4, -0.2, 0.0, 0.0], atol=1e-9)


def refused(
    demands: list[Demand], limits: Limits = FREE, start: np.ndarray = STILL
) -> Unsatisfiable:
    with pytest.raises(Unsatisfiable) as caught:
        constrained(start, WEIGHTS, demands, limits)
    return caught.value


def test_two_that_conflict_share_what_is_missing_in_proportion() -> None:
    same = np.array([1.0, 0.0, 0.0, 0.0])
    demands = [
        Demand("a", Gauge.affine(1.0, same), Interval(low=2.0)),
        Demand("b", Gauge.affine(1.0, same), Interval(high=1.0)),
        Demand("other", row(1), Interval(low=3.0)),
    ]
    conflict = refused(demands)
    assert [c.name for c in conflict.conflicts] == ["a", "b"]
    assert not conflict.limits
    assert not conflict.held
    a, b = conflict.conflicts
    # Least squares of a / 2 and b / 1, with a + b = 1.
    assert (a.by, b.by) == (pytest.approx(0.8, rel=1e-5), pytest.approx(0.2, rel=1e-5))
    assert (a.nearest, b.nearest) == (pytest.approx(1.2), pytest.approx(1.2))


def test_limits_and_edits_that_stand_against_a_demand_are_named() -> None:
    width = Gauge.affine(1.0, np.array([1.0, 0.0, 0.0, 0.0]))
    conflict = refused([Demand("width", width, Interval(high=0.1))], POSITIVE)
    (only,) = conflict.conflicts
    assert only.nearest == pytest.approx(0.4, abs=1e-5)
    assert list(conflict.limits) == ["p0 > 0"]
    edited = Demand("edited", width, Interval(1.0, 1.0), firm=True)
    conflict = refused([edited, Demand("again", width, Interval(low=1.5))])
    assert [c.name for c in conflict.conflicts] == ["again"]
    assert list(conflict.held) == ["edited"]
    assert conflict.conflicts[0].nearest == pytest.approx(1.0, abs=1e-5)


def test_ends_the_wrong_way_round_conflict_with_each_other() -> None:
    (only,) = refused([Demand("a", row(2), Interval(3.0, 2.0))]).conflicts
    # Each end gives way in shares of itself: 9 to 4.
    assert only.nearest == pytest.approx(3.0 - 9 / 13, abs=1e-5)


def test_what_nothing_moves_can_only_be_what_it_is() -> None:
    still = Gauge.affine(1.0, STILL)
    (only,) = refused([Demand("a", still, Interval(high=0.7))]).conflicts
    assert only.nearest == pytest.approx(1.0, abs=1e-5)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.lists(st.floats(0.4, 2.0), min_size=3, max_size=6))
def test_the_nearest_can_be_had(seed: int, factors: list[float]) -> None:
    # Of extents the convex ends: the others are sought near the start alone.
    demands = []
    for index, factor in enumerate(factors):
        gauge = row(seed + index) if index % 3 else extent(seed + index)
        target = gauge.value(STILL) * factor
        low = target if index % 2 and index % 3 else -np.inf
        high = target if index % 2 == 0 or index % 3 == 0 else np.inf
        demands.append(Demand(str(index), gauge, Interval(low, high)))
    try:
        found = constrained(STILL, WEIGHTS, demands, POSITIVE)
    except Unsatisfiable as conflict:
        nearest = {c.name: c.nearest for c in conflict.conflicts}
        demands = [
            Demand(d.name, d.gauge, widened(d.interval, nearest.get(d.name))) for d in demands
        ]
        found = constrained(STILL, WEIGHTS, demands, POSITIVE)
    for demand in demands:
        value, ends = demand.gauge.value(found), demand.interval
        assert ends.low - 1e-8 * abs(value) <= value <= ends.high + 1e-8 * abs(value)
    assert (found >= -0.6 - 1e-8).all()


def widened(interval: Interval, to: float | None) -> Interval:
    if to is None:
        return interval
    return Interval(min(interval.low, to), max(interval.high, to))
