from __future__ import annotations

from typing import Any

import pytest

from service.defaults import named_versions


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("chair=1.0.0", {"chair": "1.0.0"}),
        (" chair = 1.0.0 , human=2.0.0+a=b,", {"chair": "1.0.0", "human": "2.0.0+a=b"}),
        ("", {}),
        ({"chair": "1"}, {"chair": "1"}),
    ],
)
def test_versions_are_read_by_category(value: Any, expected: dict[str, str]) -> None:
    assert named_versions(value) == expected


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("chair", "'chair' is not of the form"),
        ("chair=", "'chair=' is not of the form"),
        ("=1", "'=1' is not of the form"),
        ("chair@1.0.0", "'chair@1.0.0' is not of the form"),
        ("chair=1,chair=2", "chair is named twice"),
    ],
)
def test_another_form_is_refused(value: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        named_versions(value)
