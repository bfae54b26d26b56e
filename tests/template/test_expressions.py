from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.template.expressions import ExpressionError, parse_affine

NAMES = ("a", "b", "c")


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("1.5", [1.5, 0, 0, 0]),
        (0.25, [0.25, 0, 0, 0]),
        (3, [3, 0, 0, 0]),
        (-2, [-2, 0, 0, 0]),
        ("b", [0, 0, 1, 0]),
        ("a / 2 - c / 4", [0, 0.5, 0, -0.25]),
        ("a - b - c", [0, 1, -1, -1]),
        ("a - (b - c)", [0, 1, -1, 1]),
        ("2 * a + a * 3", [0, 5, 0, 0]),
        ("-(a + 1) * 2", [-2, -2, 0, 0]),
        ("+a", [0, 1, 0, 0]),
        ("(a + b) * (1 + 3) / 8", [0, 0.5, 0.5, 0]),
        ("(a - a + 2) * b", [0, 0, 2, 0]),
        ("b / (a - a + 4)", [0, 0, 0.25, 0]),
    ],
)
def test_an_affine_expression_becomes_its_coefficients(text: str | float, row: list[float]) -> None:
    parsed = parse_affine(text, NAMES)
    assert parsed.dtype == np.float64
    assert parsed.tolist() == row


NUMBERS = st.integers(-8, 8).map(lambda n: f"({n / 4})")
LEAVES = st.one_of(NUMBERS, st.sampled_from(NAMES))
EXPRESSIONS = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        st.tuples(inner, NUMBERS).map(lambda t: f"({t[0]} * {t[1]})"),
        st.tuples(NUMBERS, inner).map(lambda t: f"{t[0]} * {t[1]}"),
        st.tuples(inner, st.sampled_from(["2", "(-4)", "0.5"])).map(lambda t: f"{t[0]} / {t[1]}"),
        inner.map(lambda text: f"-{text}"),
    ),
    max_leaves=12,
)


@given(EXPRESSIONS, st.lists(st.floats(-10, 10), min_size=3, max_size=3))
def test_the_coefficients_give_the_value_of_the_expression(text: str, values: list[float]) -> None:
    expected = eval(text, {"__builtins__": {}}, dict(zip(NAMES, values, strict=True)))
    row = parse_affine(text, NAMES)
    size = 1.0 + np.abs(row) @ [1.0, *np.abs(values)]
    assert row @ [1.0, *values] == pytest.approx(expected, abs=1e-9 * size)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a * b", "a product of parameters is not affine"),
        ("(a + 1) * (a + 2)", "a product of parameters is not affine"),
        ("1 / a", "dividing by a parameter is not affine"),
        ("a / (b + 1)", "dividing by a parameter is not affine"),
        ("a / 0", "division by zero"),
        ("a / (1 - 1)", "division by zero"),
        ("a ** 2", "only \\+ - \\* / are allowed"),
        ("a % 2", "only \\+ - \\* / are allowed"),
        ("seat", "no parameter is named 'seat'"),
        ("a +", "is not an expression"),
        ("", "is not an expression"),
        ("a = 1", "is not an expression"),
        ("max(a, b)", "'max\\(a, b\\)' is not allowed here"),
        ("a.real", "'a.real' is not allowed here"),
        ("a if b else c", "is not allowed here"),
        ("a < b", "is not allowed here"),
        ("~a", "is not allowed here"),
        ("'a'", "is not allowed here"),
        ("2j", "is not allowed here"),
        (True, "'True' is not allowed here"),
    ],
)
def test_anything_else_is_refused_and_the_spot_named(text: str | float, message: str) -> None:
    with pytest.raises(ExpressionError, match=message):
        parse_affine(text, NAMES)
