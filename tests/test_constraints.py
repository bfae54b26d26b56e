from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.constraints import Interval, parse_constraints
from service.errors import InvalidRequest

AMOUNTS = st.floats(-1e6, 1e6, allow_nan=False)


def test_each_form_is_read() -> None:
    text = (
        '{"a": 0.5, "b": {"set": 1}, "c": {"min": -1}, "d": {"max": 2}, "e": {"min": 3, "max": 4}}'
    )
    assert parse_constraints(text) == {
        "a": Interval(0.5, 0.5),
        "b": Interval(1.0, 1.0),
        "c": Interval(low=-1.0),
        "d": Interval(high=2.0),
        "e": Interval(3.0, 4.0),
    }
    assert parse_constraints("{}") == {}


@given(st.dictionaries(st.text(), st.tuples(AMOUNTS, AMOUNTS)))
def test_what_is_asked_is_written_as_it_was_read(ends: dict[str, tuple[float, float]]) -> None:
    entries = {
        name: {"min": low, "max": high} if low != high else {"set": low}
        for name, (low, high) in ends.items()
    }
    read = parse_constraints(json.dumps(entries))
    assert {name: interval.asked for name, interval in read.items()} == entries


def test_intervals_are_told_in_words() -> None:
    assert Interval(0.45, 0.45).told("m") == "at 0.45 m"
    assert Interval(high=0.6).told("m") == "at most 0.6 m"
    assert Interval(0.2, 0.6).told("cm") == "at least 0.2 and at most 0.6 cm"
    assert Interval(low=-1.5).told("1") == "at least -1.5"
    assert Interval().low == -math.inf


@pytest.mark.parametrize(
    ("text", "code", "detail"),
    [
        ("", "constraints_not_json", "can't be read"),
        ('{"a": {"max": Infinity}}', "constraints_not_json", "Infinity is not a number"),
        ('{"a": {"max": 1, "max": 2}}', "constraints_not_json", "stands twice"),
        ("[]", "constraints_not_object", "a list"),
        ('{"a": {}}', "constraint_malformed", "'a' has nothing"),
        ('{"a": {"add": 1}}', "constraint_malformed", "'a' has 'add'"),
        ('{"a": {"set": 1, "min": 0}}', "constraint_malformed", "'a' has 'set, min'"),
        ('{"a": {"min": 1, "most": 2}}', "constraint_malformed", "'a' has 'min, most'"),
        ('{"a": "1"}', "constraint_malformed", "'a' is a text"),
        ('{"a": null}', "constraint_malformed", "'a' is a null"),
        ('{"a": [1, 2]}', "constraint_malformed", "'a' is a list"),
        ('{"a": {"min": true}}', "constraint_malformed", "'a' is a truth value"),
        ('{"a": {"min": 0, "max": 1e999}}', "constraint_malformed", "not a finite number"),
    ],
)
def test_anything_else_is_refused_with_its_fault(text: str, code: str, detail: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        parse_constraints(text)
    assert caught.value.code == code
    assert detail in caught.value.detail
    assert "total_width" in caught.value.suggestion
