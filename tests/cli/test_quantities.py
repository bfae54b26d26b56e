from __future__ import annotations

import math

import pytest

from service.cli.quantities import METRES, RADIANS, Quantity, read_quantity
from service.requests import UNITS


@pytest.mark.parametrize(
    ("text", "value", "kind"),
    [
        ("0.45", 0.45, "plain"),
        ("-.5", -0.5, "plain"),
        ("+1e-2", 0.01, "plain"),
        ("45cm", 0.45, "length"),
        ("45 cm", 0.45, "length"),
        ("450MM", 0.45, "length"),
        ("18in", 0.4572, "length"),
        ("6ft", 1.8288, "length"),
        ("5ft11in", 71 * 0.0254, "length"),
        ("-1ft6in", -18 * 0.0254, "length"),
        ("1m", 1.0, "length"),
        ("30deg", math.pi / 6, "angle"),
        ("-90°", -math.pi / 2, "angle"),
        ("0.5rad", 0.5, "angle"),
        ("120%", 1.2, "percent"),
    ],
)
def test_numbers_are_read_with_their_units(text: str, value: float, kind: str) -> None:
    found = read_quantity(text)
    assert found.value == pytest.approx(value)
    assert found.kind == kind


@pytest.mark.parametrize(
    "text", ["", "wide", "45 parsecs", "1,5", "nan", "inf", "1e400", "--5", "5ft-3in"]
)
def test_what_is_no_number_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"number|unit"):
        read_quantity(text)


def test_lengths_become_the_unit_that_the_service_is_told() -> None:
    assert Quantity(0.45, "length").number("cm") == pytest.approx(45.0)
    assert Quantity(0.4572, "length").number("in") == pytest.approx(18.0)
    assert Quantity(0.45).number("cm") == 0.45
    assert Quantity(1.0, "angle").number("mm") == 1.0


def test_the_units_are_those_of_the_service() -> None:
    assert METRES == UNITS
    assert RADIANS["deg"] == math.radians(1.0)
