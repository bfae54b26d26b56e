from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click
import pytest

from service.cli.assignments import is_assignment, read_wishes, require_kinds
from service.constraints import parse_constraints
from service.edits import parse_edits


@pytest.mark.parametrize(
    ("text", "change"),
    [
        ("seat_width=0.5", {"set": 0.5}),
        ("seat_width=45cm", {"set": 0.45}),
        ("seat_width = 45 cm", {"set": 0.45}),
        ("seat_width+=5cm", {"add": 0.05}),
        ("seat_width-=5cm", {"add": -0.05}),
        ("seat_width=-5cm", {"set": -0.05}),
        ("seat_width*=1.2", {"scale": 1.2}),
        ("seat_width*=120%", {"scale": 1.2}),
        ("seat_width=120%", {"scale": 1.2}),
        ("seat_width+=20%", {"scale": 1.2}),
        ("seat_width-=20%", {"scale": 0.8}),
        ("seat_width/=2", {"scale": 0.5}),
        ("left_elbow_y+=30deg", {"add": math.pi / 6}),
    ],
)
def test_edits_are_what_the_service_takes(text: str, change: dict[str, float]) -> None:
    wishes = read_wishes([text], "m")
    ((_, found),) = wishes.edits.items()
    assert found == {kind: pytest.approx(value) for kind, value in change.items()}
    assert not wishes.constraints


@pytest.mark.parametrize(
    ("text", "ends"),
    [
        ("total_width=40cm..60cm", {"min": 0.4, "max": 0.6}),
        ("total_width=..60cm", {"max": 0.6}),
        ("total_width=40cm..", {"min": 0.4}),
        ("total_width=0.4...6", {"min": 0.4, "max": 0.6}),
        ("total_width<=60cm", {"max": 0.6}),
        ("total_width >= 40cm", {"min": 0.4}),
    ],
)
def test_ranges_are_constraints(text: str, ends: dict[str, float]) -> None:
    wishes = read_wishes([text], "m")
    assert wishes.constraints == {"total_width": pytest.approx(ends)}
    assert not wishes.edits


def test_two_ends_of_one_name_are_a_range() -> None:
    wishes = read_wishes(["width>=40cm", "width<=60cm"], "cm")
    assert wishes.constraints == {"width": {"min": 40.0, "max": 60.0}}


def test_json_stands_beside_what_is_typed(tmp_path: Path) -> None:
    file = tmp_path / "edits.json"
    file.write_text('{"height": 0.5}', "utf-8")
    wishes = read_wishes(["width*=2"], "m", f"@{file}", '{"depth": {"max": 1}}')
    assert wishes.edits == {"height": 0.5, "width": {"scale": 2.0}}
    assert wishes.constraints == {"depth": {"max": 1}}


@pytest.mark.parametrize(
    ("arguments", "more", "told"),
    [
        (["width=wide"], {}, "is no number"),
        (["width*=5cm"], {}, "a factor has no unit"),
        (["width/=0"], {}, "divides by nothing"),
        (["width=.."], {}, "no constraint"),
        (["width=..50%"], {}, "no constraint"),
        (["width=1", "width*=2"], {}, "width is asked for twice"),
        (["width=1", "width<=2"], {}, "width is asked for twice"),
        (["width<=1", "width<=2"], {}, "width is asked for twice"),
        (["width=5cm..6deg"], {}, "of a length and of an angle"),
        (["width=1"], {"edits": '{"width": 2}'}, "width is asked for twice"),
        ([], {"edits": "{"}, "--edits is no JSON"),
        ([], {"edits": "[1]"}, "--edits is no JSON object"),
        ([], {"constraints": "@/nowhere/at-all.json"}, "--constraints"),
    ],
)
def test_what_makes_no_sense_is_refused(
    arguments: list[str], more: dict[str, Any], told: str
) -> None:
    with pytest.raises(click.UsageError, match=told):
        read_wishes(arguments, "m", **more)


@pytest.mark.parametrize(
    "text", ["chair.glb", "a b.obj", "-", "dir/seat_width=1.glb", "../x", "C=:"]
)
def test_files_are_not_taken_for_edits(text: str) -> None:
    assert is_assignment(text) == text.startswith("C=")


def test_what_comes_out_is_read_by_the_service() -> None:
    import json

    wishes = read_wishes(["a=45cm", "b+=1", "c*=2", "d=1..2", "e=..3"], "in")
    assert len(parse_edits(json.dumps(wishes.edits))) == 3
    assert len(parse_constraints(json.dumps(wishes.constraints))) == 2


def test_a_length_is_none_for_an_angle() -> None:
    wishes = read_wishes(["elbow=45cm", "width=45cm", "shape=1", "height=2"], "m")
    units = {"elbow": "rad", "width": "m", "shape": "1", "height": "m"}
    assert require_kinds(wishes.kinds, units) == "elbow"
    assert require_kinds(wishes.kinds, {**units, "elbow": "cm"}) is None
    assert require_kinds({"shape": "angle"}, units) == "shape"
