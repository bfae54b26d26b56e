from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.edits import Change, parse_edits
from service.errors import InvalidRequest

AMOUNTS = st.floats(-1e6, 1e6, allow_nan=False)


def test_each_kind_of_change_is_read() -> None:
    edits = parse_edits('{"a": {"set": 0.5}, "b": {"add": -1}, "c": {"scale": 1.2}, "d": 3}')
    assert edits == {
        "a": Change("set", 0.5),
        "b": Change("add", -1.0),
        "c": Change("scale", 1.2),
        "d": Change("set", 3.0),
    }
    assert all(isinstance(change.amount, float) for change in edits.values())


def test_no_changes_are_no_fault() -> None:
    assert parse_edits("{}") == {}


@given(AMOUNTS, AMOUNTS)
def test_changes_do_what_they_are_called(value: float, amount: float) -> None:
    assert Change("set", amount).apply(value) == amount
    assert Change("add", amount).apply(value) == value + amount
    assert Change("scale", amount).apply(value) == value * amount


@given(st.dictionaries(st.text(), AMOUNTS), st.sampled_from(["set", "add", "scale"]))
def test_what_is_written_as_json_is_read_back(amounts: dict[str, float], kind: str) -> None:
    text = json.dumps({name: {kind: amount} for name, amount in amounts.items()})
    assert {name: (c.kind, c.amount) for name, c in parse_edits(text).items()} == {
        name: (kind, amount) for name, amount in amounts.items()
    }


@pytest.mark.parametrize(
    ("text", "code", "detail"),
    [
        ("", "edits_not_json", "can't be read"),
        ("{", "edits_not_json", "can't be read"),
        ("{'a': 1}", "edits_not_json", "can't be read"),
        ('{"a": NaN}', "edits_not_json", "NaN is not a number"),
        ('{"a": Infinity}', "edits_not_json", "Infinity is not a number"),
        ('{"a": {"set": -Infinity}}', "edits_not_json", "-Infinity is not a number"),
        ('{"a": 1, "a": 2}', "edits_not_json", "stands twice"),
        ('{"a": {"set": 1, "set": 1}}', "edits_not_json", "stands twice"),
        ("[" * 100_000, "edits_not_json", "can't be read"),
        ('{"a": ' + "9" * 5000 + "}", "edits_not_json", "can't be read"),
        ("[]", "edits_not_object", "a list"),
        ("1", "edits_not_object", "a number"),
        ("1.5", "edits_not_object", "a number"),
        ('"a"', "edits_not_object", "a text"),
        ("null", "edits_not_object", "a null"),
        ("true", "edits_not_object", "a truth value"),
        ('{"a": {}}', "edit_malformed", "'a' has nothing"),
        ('{"a": {"multiply": 2}}', "edit_malformed", "'a' has 'multiply'"),
        ('{"a": {"add": 1, "scale": 2}}', "edit_malformed", "'a' has 'add, scale'"),
        ('{"a": "1"}', "edit_malformed", "'a' is a text"),
        ('{"a": true}', "edit_malformed", "'a' is a truth value"),
        ('{"a": null}', "edit_malformed", "'a' is a null"),
        ('{"a": [1]}', "edit_malformed", "'a' is a list"),
        ('{"a": {"set": {"set": 1}}}', "edit_malformed", "'a' is a object"),
        ('{"a": {"scale": false}}', "edit_malformed", "'a' is a truth value"),
        ('{"a": 1e999}', "edit_malformed", "not a finite number"),
        ('{"a": 1e12}', "edit_malformed", "not a finite number"),
        ('{"a": {"add": -1e12}}', "edit_malformed", "not a finite number"),
    ],
)
def test_anything_else_is_refused_with_its_fault(text: str, code: str, detail: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        parse_edits(text)
    assert caught.value.code == code
    assert detail in caught.value.detail
    assert "seat_width" in caught.value.suggestion


def test_a_long_name_is_cut_short_in_the_answer() -> None:
    with pytest.raises(InvalidRequest) as caught:
        parse_edits(json.dumps({"x" * 10_000: "a"}))
    assert len(caught.value.detail) < 200
