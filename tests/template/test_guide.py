from __future__ import annotations

import numpy as np
import pytest

from service.template.expressions import ExpressionError
from service.template.guide import read_guide

NAMES = ["body", "mast", "sail", "slant"]
PUBLIC = [True, True, False, False]
BETWEEN = ["-body / 2", "body / 2", "body / 2 + mast"]


def row(entry: object, sail: float, name: str = "sail") -> list[float]:
    guide = read_guide(name, entry, NAMES, PUBLIC)  # type: ignore[arg-type]
    return guide.row(np.array([2.0, 4.0, sail, 0.1])).round(12).tolist()


@pytest.mark.parametrize(
    ("sail", "body", "mast"),
    [
        (0.0, 0.0, 0.0),
        (0.5, 0.25, 0.0),
        (1.0, 0.5, 0.0),
        (2.0, 0.5, 0.25),
        (5.0, 0.5, 1.0),
        (9.0, 0.5, 1.0),
        (-9.0, -0.5, 0.0),
    ],
)
def test_a_place_keeps_its_share_between_two_and_goes_with_the_last_beyond(
    sail: float, body: float, mast: float
) -> None:
    assert row({"between": BETWEEN}, sail) == [body, mast, 0.0, 0.0]


def test_a_name_alone_is_in_proportion_and_no_more_than_one_to_one() -> None:
    assert row("body", 0.5) == [0.25, 0.0, 0.0, 0.0]
    assert row("body", -0.5) == [-0.25, 0.0, 0.0, 0.0]
    assert row("body", 5.0) == [1.0, 0.0, 0.0, 0.0]


def test_another_may_move_by_the_same_place() -> None:
    entry = {"at": "sail", "between": BETWEEN, "moves": [0, 0, "-0.4 * mast"]}
    assert row(entry, 2.0, "slant") == [0.0, -0.1, 0.0, 0.0]


def test_it_says_what_may_lead() -> None:
    entry = {"at": "sail", "between": BETWEEN, "moves": [0, 0, "-0.4 * mast"]}
    assert read_guide("slant", entry, NAMES, PUBLIC).leaders.tolist() == [False, True, False, False]
    assert read_guide("sail", "body", NAMES, PUBLIC).leaders.tolist() == [True, False, False, False]


def test_places_that_fall_together_are_no_division_by_zero() -> None:
    guide = read_guide("sail", {"between": BETWEEN}, NAMES, PUBLIC)
    assert np.isfinite(guide.row(np.zeros(4))).all()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("keel", "no parameter is named 'keel'"),
        ("slant", "only public parameters lead"),
        ({"between": BETWEEN, "moves": ["slant", 0, 0]}, "only public parameters lead"),
        ({"between": ["body"]}, "two places or more"),
        ({"between": BETWEEN, "moves": [0, 0]}, "a move for each"),
        ({"at": "sail"}, "have `between`"),
        ({"between": BETWEEN, "by": "mast"}, "have `between`"),
    ],
)
def test_what_can_not_guide(entry: object, message: str) -> None:
    with pytest.raises(ExpressionError, match=message):
        read_guide("sail", entry, NAMES, PUBLIC)  # type: ignore[arg-type]
