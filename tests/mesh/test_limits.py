from __future__ import annotations

from collections.abc import Callable

import pytest

from service.errors import TooLarge
from service.mesh import limits


@pytest.mark.parametrize(
    ("check", "limit", "code"),
    [
        (limits.check_vertices, limits.VERTICES, "too_many_vertices"),
        (limits.check_faces, limits.FACES, "too_many_faces"),
        (limits.check_parts, limits.PARTS, "too_many_parts"),
    ],
)
def test_limits_are_the_last_that_pass(check: Callable[[int], None], limit: int, code: str) -> None:
    check(limit)
    with pytest.raises(TooLarge) as caught:
        check(limit + 1)
    assert caught.value.code == code
    assert str(limit) in caught.value.detail
