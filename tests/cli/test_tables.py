from __future__ import annotations

from collections.abc import Iterable
from io import StringIO
from typing import Any

import pytest
from rich.console import RenderableType

from service.cli import tables
from service.cli.consoles import PlainConsole

FIT = {"score": 0.987, "distance": 0.0123, "variant": "armchair"}
REPORT = {
    "category": "chair",
    "model": {"version": "1.1.0"},
    "fit": FIT,
    "frame": {"up": "+z", "front": "-y"},
    "derived": {},
    "warnings": [],
}


def printed(what: Iterable[RenderableType]) -> list[str]:
    file = StringIO()
    console = PlainConsole(file)
    for item in what:
        console.print(item)
    return [line.rstrip() for line in file.getvalue().splitlines()]


def inferred(
    parameters: dict[str, Any], typical: tuple[float, float] = (0.2, 0.6), **more: Any
) -> list[str]:
    entries = [{"name": name, "typical": typical} for name in parameters]
    report = {**REPORT, "parameters": parameters, **more}
    return printed(tables.inferred(report, {"parameters": entries}))


@pytest.mark.parametrize(
    ("value", "sigma", "told"),
    [
        (0.52634, 0.0312, ["0.526", "0.031"]),
        (0.52634, 0.0000312, ["0.526340", "0.000031"]),
        (1234.5678, 0.0, ["1,235", "0"]),
        (0.0, 0.5, ["0.00", "0.50"]),
        (82.3456, 12.3, ["82", "12"]),
        (1e9, 0.0, ["1e+09", "0"]),
    ],
)
def test_values_have_as_many_digits_as_are_known(
    value: float, sigma: float, told: list[str]
) -> None:
    lines = inferred({"width": {"value": value, "sigma": sigma, "unit": "m"}})
    assert lines[2].split()[1:3] == told


@pytest.mark.parametrize(
    ("value", "unit", "bar"),
    [
        (0.2, "m", "●───────────────"),
        (0.6, "m", "───────────────●"),
        (40.0, "cm", "────────●───────"),
        (0.1, "m", "◀───────────────"),
        (0.7, "m", "───────────────▶"),
    ],
)
def test_a_bar_shows_where_among_typical_ones_a_value_lies(
    value: float, unit: str, bar: str
) -> None:
    line = inferred({"width": {"value": value, "sigma": 0.01, "unit": unit}})[2]
    assert bar in line
    assert line.endswith("20 to 60" if unit == "cm" else "0.2 to 0.6")


def test_what_was_found_is_told_in_a_line() -> None:
    lines = inferred({}, warnings=["mind the gap"])
    assert lines[0] == (
        "chair 1.1.0   armchair, score 0.99, fit within 1.2 % of the size, up +z, front -y"
    )
    assert lines[-1] == "Warning: mind the gap"


def test_the_angles_of_a_joint_are_on_a_line() -> None:
    angles = {
        f"left_knee_{axis}": {"value": value, "sigma": 0.1, "unit": "rad"}
        for axis, value in zip("xyz", (1.5708, -0.01, 0.0), strict=True)
    }
    lines = inferred({**angles, "shape_0": {"value": 1.0, "sigma": 0.1, "unit": "1"}})
    (line,) = (line for line in lines if line.startswith("left_knee"))
    assert line.split("left_knee")[1].split() == [
        "1.571", "(", "90)", "-0.010", "(", "-1)", "0.000", "(", "0)",
    ]  # fmt: skip
    assert not any(line.startswith("left_knee_x") for line in lines)


def edited(**rows: dict[str, Any]) -> list[str]:
    report = {
        "category": "chair",
        "parameters": {},
        "derived": {},
        "dimensions": rows,
        "vertices": {"moved": 1200, "total": 34567},
        "flipped_faces": 3,
        "warnings": ["mind the gap"],
    }
    return printed(tables.edited(report, "wide.glb"))


def test_what_changed_is_told_and_what_was_asked() -> None:
    lines = edited(
        total_width={"before": 0.5, "after": 0.6, "unit": "m", "asked": {"max": 0.6}},
        total_depth={"before": 0.5, "after": 0.5, "unit": "m"},
        elbow={"before": 0.0, "after": -1.0, "unit": "rad"},
    )
    assert lines[0] == "chair: 1,200 of 34,567 vertices moved, 3 faces turned over -> wide.glb"
    assert lines[2].split() == [
        "total_width", "0.5000", "0.6000", "m", "+20.0", "%", "on", "the", "mesh,", "asked", "at",
        "most", "0.6",
    ]  # fmt: skip
    assert lines[3].split()[:5] == ["elbow", "0", "-1.000", "rad", "-57°"]
    assert lines[4] == "Warning: mind the gap"


def test_an_edit_of_nothing_has_no_table() -> None:
    assert len(edited()) == 2
