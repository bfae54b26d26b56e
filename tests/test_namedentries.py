from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest
from service.namedentries import number_fault, read_entries

JSON = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3),
)


@given(st.dictionaries(st.text(), JSON))
def test_what_is_written_is_read(entries: dict[str, Any]) -> None:
    assert read_entries(json.dumps(entries), "edits", "") == entries


@given(JSON)
def test_anything_but_an_object_is_refused_by_the_fields_name(value: Any) -> None:
    with pytest.raises(InvalidRequest) as caught:
        read_entries(json.dumps(value), "wishes", "write so")
    assert caught.value.code == "wishes_not_object"
    assert caught.value.suggestion == "write so"


@pytest.mark.parametrize(
    ("value", "fault"),
    [
        (0, None),
        (-1.5, None),
        (True, "is a truth value, not a number"),
        (None, "is a null, not a number"),
        ("1", "is a text, not a number"),
        (1e12, "is not a finite number of sensible size"),
        (float("nan"), "is not a finite number of sensible size"),
        (10**400, "is not a finite number of sensible size"),
    ],
)
def test_numbers_are_of_sensible_size(value: Any, fault: str | None) -> None:
    assert number_fault(value) == fault
