from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, minimize

from service.deform.leastdistance import Contradiction, least_distance


def problem(seed: int, count: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, size)), rng.normal(size=count)


@settings(deadline=None, max_examples=80)
@given(st.integers(0, 10**6), st.integers(1, 8), st.integers(1, 5))
def test_it_is_the_shortest_or_there_is_a_proof_that_none_is(
    seed: int, count: int, size: int
) -> None:
    rows, least = problem(seed, count, size)
    possible = linprog(np.zeros(size), -rows, -least, bounds=(None, None)).status == 0
    try:
        found = least_distance(rows, least)
    except Contradiction as proof:
        assert not possible
        weights = proof.weights
        assert (weights >= 0.0).all()
        np.testing.assert_allclose(weights @ rows, 0.0, atol=1e-9 * weights.max())
        assert weights @ least > 0.0
        # Without any one of those that take part, the rest can be kept.
        part = np.flatnonzero(weights)
        for left_out in part:
            others = part[part != left_out]
            least_distance(rows[others], least[others])
        return
    assert possible
    # Far away, what is kept is so to within the rounding of large terms.
    terms = max(float(np.abs(least).max()), float((np.abs(rows) @ np.abs(found)).max()))
    assert (rows @ found >= least - 1e-9 * terms).all()
    other = minimize(
        lambda z: float(z @ z), found + 0.1, method="SLSQP", options={"ftol": 1e-14},
        constraints={"type": "ineq", "fun": lambda z: rows @ z - least},
    )  # fmt: skip
    assert found @ found <= other.fun + 1e-6 * max(1.0, other.fun) or not other.success


def test_what_is_kept_already_needs_no_step() -> None:
    np.testing.assert_array_equal(least_distance(np.eye(3), np.array([-1.0, 0.0, -2.0])), 0.0)
    np.testing.assert_array_equal(least_distance(np.zeros((0, 3)), np.zeros(0)), np.zeros(3))


def test_an_inequality_that_nothing_moves_contradicts_itself() -> None:
    rows = np.array([[1.0, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(least_distance(rows, np.array([2.0, -1.0])), [2.0, 0.0])
    with pytest.raises(Contradiction) as caught:
        least_distance(rows, np.array([2.0, 1.0]))
    np.testing.assert_array_equal(caught.value.weights, [0.0, 1.0])


def test_equalities_are_two_inequalities() -> None:
    rows = np.array([[1.0, 1.0], [-1.0, -1.0], [1.0, 0.0]])
    found = least_distance(rows, np.array([2.0, -2.0, 1.5]))
    np.testing.assert_allclose(found, [1.5, 0.5], atol=1e-12)
