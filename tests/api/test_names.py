from __future__ import annotations

import pytest

from service.api.names import parse_names
from service.errors import InvalidRequest


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("", ()),
        ("a", ("a",)),
        (" a, b ,", ("a", "b")),
        ('["a", "b"]', ("a", "b")),
        (" []", ()),
    ],
)
def test_lists_of_names(text: str, names: tuple[str, ...]) -> None:
    assert parse_names(text) == names


@pytest.mark.parametrize("text", ["[", "[1]", '["a", null]', "[" * 100_000])
def test_arrays_that_hold_something_else(text: str) -> None:
    with pytest.raises(InvalidRequest) as error:
        parse_names(text)
    assert error.value.code == "names_malformed"
