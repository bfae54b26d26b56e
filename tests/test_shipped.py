from __future__ import annotations

from typing import Any

import pytest

from service.shipped import asked_categories, shipped_categories, usual_categories

USUAL = ("airplane", "chair", "human")


def test_all_but_the_debug_category_are_usual() -> None:
    assert shipped_categories() == ("airplane", "chair", "debug", "human")
    assert usual_categories() == USUAL


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("chair", ("chair",)),
        (" human, chair,chair,", ("human", "chair")),
        ("debug", ("debug",)),
        (("chair", "debug"), ("chair", "debug")),
        ("", USUAL),
        (" , ", USUAL),
        ("none", ()),
        ((), ()),
    ],
)
def test_names_with_commas_between(value: Any, expected: tuple[str, ...]) -> None:
    assert asked_categories(value) == expected


@pytest.mark.parametrize("value", ["sofa", "chair,none", "Chair", "auto", "../chair"])
def test_another_name_is_refused_with_those_that_there_are(value: str) -> None:
    with pytest.raises(ValueError, match="airplane, chair, debug, human, or none"):
        asked_categories(value)
