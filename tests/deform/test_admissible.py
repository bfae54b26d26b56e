from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from service.deform.admissible import Bounds, unusual
from service.template.loader import load_template

CHAIR = load_template("paper_chair")
F = np.array([0.40, 0.04, 0.06, 0.45, 0.48, 0.36, 0.05, 0.05])
INDEX = {name: index for index, name in enumerate(CHAIR.names)}
BOUNDS = Bounds.of(CHAIR, F, 1e-3)


def asked(**values: float) -> np.ndarray:
    f = F.copy()
    for name, value in values.items():
        f[INDEX[name]] = value
    return f


def test_what_was_before_is_within_the_bounds_whatever_it_is() -> None:
    for f in (F, F * 1e-4, asked(leg_width=0.3), asked(back_thickness=1e-9)):
        assert Bounds.of(CHAIR, f, 1e-3).broken(f) == []


def test_broken_limits_are_named() -> None:
    f = asked(leg_height=-0.1, leg_width=0.2)
    assert BOUNDS.broken(f) == ["leg_height > 0", "0.8 * seat_width - 2 * leg_width >= 0"]


@settings(deadline=None, max_examples=60)
@given(
    st.dictionaries(st.sampled_from(CHAIR.names), st.floats(-1e6, 1e6, allow_nan=False), min_size=1)
)
def test_the_nearest_keeps_every_limit_and_what_was_not_edited(values: dict[str, float]) -> None:
    target = asked(**values)
    found = BOUNDS.nearest(target, F)
    assert BOUNDS.broken(found) == []
    still = target == F
    np.testing.assert_array_equal(found[still], F[still])


@settings(deadline=None, max_examples=25)
@given(st.floats(-0.5, 0.4), st.floats(-0.2, 0.5), st.floats(-0.2, 0.5))
def test_it_is_the_nearest(width: float, leg: float, depth: float) -> None:
    target = asked(seat_width=width, leg_width=leg, leg_depth=depth)
    assume(BOUNDS.broken(target))
    free = np.flatnonzero(target != F)
    found = BOUNDS.nearest(target, F)

    def cost(x: np.ndarray) -> float:
        return float(np.square((x - target[free]) / F[free]).sum())

    def gaps(x: np.ndarray) -> np.ndarray:
        f = target.copy()
        f[free] = x
        return BOUNDS.rows @ f + BOUNDS.constants

    other = minimize(
        cost, F[free], constraints={"type": "ineq", "fun": gaps}, method="SLSQP",
        options={"ftol": 1e-12},
    )  # fmt: skip
    assert cost(found[free]) <= other.fun * (1 + 1e-6) + 1e-9


def test_what_keeps_the_limits_stays_to_the_bit() -> None:
    target = asked(seat_width=0.7, back_height=5.0)
    np.testing.assert_array_equal(BOUNDS.nearest(target, F), target)


def test_a_relation_that_the_fit_only_just_keeps_holds_nothing_back() -> None:
    pedestal = asked(leg_width=0.4 * 0.48 * (1 - 1e-6))
    narrower = pedestal.copy()
    narrower[INDEX["seat_width"]] *= 0.7
    assert Bounds.of(CHAIR, pedestal, 1e-3).broken(narrower) == []
    assert BOUNDS.broken(asked(seat_width=0.1)) != []


def test_signed_parameters_may_turn_negative() -> None:
    first = replace(CHAIR.parameters[0], low=-0.2, nuisance=True)
    signed = replace(CHAIR, parameters=(first, *CHAIR.parameters[1:]))
    assert Bounds.of(signed, F, 1e-3).broken(asked(back_height=-0.1)) == []
    assert BOUNDS.broken(asked(back_height=-0.1)) == ["back_height > 0"]


def test_a_step_ends_where_a_size_reaches_its_limit() -> None:
    step = asked(leg_height=-0.359) - F
    assert BOUNDS.furthest(F, step) == pytest.approx(0.359 / 0.719)
    assert BOUNDS.furthest(F, -step) == 1.0
    # Relations end no step.
    assert BOUNDS.furthest(F, asked(leg_width=0.4) - F) == 1.0


def test_shapes_outside_of_the_ranges_are_unusual_at_any_scale() -> None:
    for scale in (0.01, 1.0, 1000.0):
        assert unusual(CHAIR, scale * F, scale * asked(back_height=4.0)) == ["back_height"]
        assert unusual(CHAIR, scale * F, scale * asked(back_height=0.7)) == []
        assert unusual(CHAIR, F, scale * F) == []


def test_what_was_unusual_before_says_nothing_new() -> None:
    odd = asked(seat_depth=20.0)
    assert unusual(CHAIR, odd, asked(seat_depth=20.0, back_height=0.5)) == []
