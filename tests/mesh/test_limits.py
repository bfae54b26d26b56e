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
        (limits.check_lines, limits.LINES, "too_many_lines"),
        (limits.check_tokens, limits.TOKENS, "too_many_tokens"),
        (limits.check_members, limits.MEMBERS, "archive_too_large"),
        (lambda count: limits.check_json(b"[" * count), limits.VALUES, "too_many_json_values"),
        (lambda size: limits.check_inflated(size, [size]), limits.INFLATED, "archive_too_large"),
    ],
)
def test_limits_are_the_last_that_pass(check: Callable[[int], None], limit: int, code: str) -> None:
    check(limit)
    with pytest.raises(TooLarge) as caught:
        check(limit + 1)
    assert caught.value.code == code
    assert str(limit) in caught.value.detail


def test_what_is_affordable_is_less() -> None:
    with limits.at_most(10):
        limits.check_vertices(10)
        limits.check_faces(20)
        with pytest.raises(TooLarge, match="the limit is 10") as caught:
            limits.check_vertices(11)
        assert "MAX_VERTICES" in caught.value.suggestion
        with pytest.raises(TooLarge, match="the limit is 20"):
            limits.check_faces(21)
    limits.check_vertices(11)
    with limits.at_most(limits.VERTICES + 1), pytest.raises(TooLarge):
        limits.check_vertices(limits.VERTICES + 1)


def test_only_large_archives_may_not_shrink_much() -> None:
    limits.check_inflated(1, [limits.SMALL])
    limits.check_inflated(limits.SMALL // limits.RATIO + 1, [limits.SMALL, 1])
    with pytest.raises(TooLarge, match=f"the limit is {limits.RATIO}"):
        limits.check_inflated(limits.SMALL // limits.RATIO, [limits.SMALL, limits.RATIO])
