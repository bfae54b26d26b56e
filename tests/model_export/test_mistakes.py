from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

from model_export.mistakes import Mistake, draws, find_mistakes
from model_export.new import starter
from service.template.loader import compile_template


@pytest.fixture
def spec() -> Any:
    """The starter's entries, to spoil."""
    return yaml.safe_load(starter("table", "table.yaml"))


def told(mistakes: list[Mistake], entry: str) -> Mistake:
    (mistake,) = [m for m in mistakes if m.entry == entry]
    return mistake


def found(spec: Any) -> list[Mistake]:
    return find_mistakes(compile_template(spec))


def test_a_sound_template_has_none(spec: Any) -> None:
    assert found(spec) == []


def test_a_parameter_that_moves_nothing(spec: Any) -> None:
    spec["parameters"]["gloss"] = {"label": "Gloss", "group": "top", "range": [1, 2]}
    assert "moves nothing" in told(found(spec), "parameters gloss").text


def test_a_parameter_that_only_shifts_the_whole(spec: Any) -> None:
    spec["parameters"]["lift"] = {"label": "Lift", "group": "top", "range": [1, 2]}
    for part in spec["parts"].values():
        part["center"][1] = f"{part['center'][1]} + lift"
    assert "only shifts" in told(found(spec), "parameters lift").text


def test_parameters_that_move_the_same_thing(spec: Any) -> None:
    spec["parameters"]["board"] = {"label": "Board", "group": "top", "range": [0.01, 0.02]}
    text = yaml.safe_dump(spec["parts"]).replace("top_thickness", "(top_thickness + board)")
    spec["parts"] = yaml.safe_load(text)
    mistake = told(found(spec), "parameters top_thickness, board")
    assert "can't be told apart" in mistake.text
    assert mistake.error


def test_a_dimension_that_is_measured_on_no_part(spec: Any) -> None:
    spec["derived"]["top_height"]["measure"]["part"] = "lid"
    assert "no part is named 'lid'" in told(found(spec), "derived top_height").text


def test_a_part_that_turns_inside_out(spec: Any) -> None:
    spec["parts"]["top"]["size"][0] = "top_width - 2 * leg_height"
    mistake = told(found(spec), "parts top")
    assert "inside out" in mistake.text
    assert "leg_height" in mistake.text
    # Turned over along two axes its volume is positive again.
    spec["parts"]["top"]["size"] = ["-top_width", "-top_thickness", "top_depth"]
    spec["parts"]["front_right_leg"]["size"][2] = "leg_height - 2 * leg_thickness"
    assert "inside out" in told(found(spec), "parts front_right_leg").text


def test_parts_that_come_apart(spec: Any) -> None:
    shelf = {
        "shape": "box", "cells": [2, 2, 2], "center": [0, "-top_thickness / 2 - leg_height / 2", 0],
        "size": ["top_width", "top_width / 2", "top_depth"],
    }  # fmt: skip
    spec["parts"]["shelf"] = shelf
    mistake = told(found(spec), "parts top, shelf")
    assert "come apart at" in mistake.text
    # The legs hold it, unless it is narrow.
    assert "pieces" not in mistake.text
    shelf["size"][0] = shelf["size"][2] = "top_width / 9"
    assert "% of the draws fall into pieces" in told(found(spec), "parts top, shelf").text


def test_a_variant_without_a_part_that_a_public_parameter_moves(spec: Any) -> None:
    spec["variants"] = {"table": {}, "slab": {"without": ["front_right_leg"]}}
    mistakes = [m for m in found(spec) if m.entry == "variants slab"]
    assert mistakes, "legs have a height and a thickness"
    assert all(m.error and "has no part that leg_" in m.text for m in mistakes)
    for parameter in ("leg_height", "leg_thickness"):
        spec["parameters"][parameter]["nuisance"] = True
    assert not [m for m in found(spec) if m.entry == "variants slab"]


def test_a_part_that_touches_nothing(spec: Any) -> None:
    spec["parts"]["front_right_leg"]["center"][1] = "-top_thickness - leg_height"
    mistake = told(found(spec), "parts front_right_leg")
    assert not mistake.error
    assert "touches no other part" in mistake.text


def test_a_constant_length(spec: Any) -> None:
    spec["parts"]["top"]["size"][1] = "0.02"
    assert "constant length" in told(found(spec), "parts top").text


def test_relations_that_are_always_or_never_kept(spec: Any) -> None:
    spec["relations"] = ["top_width + leg_height", "-top_width"]
    mistakes = found(spec)
    assert not told(mistakes, "relations top_width + leg_height").error
    assert told(mistakes, "relations -top_width").error


def test_relations_that_leave_little_or_nothing(spec: Any) -> None:
    spec["relations"] = ["top_depth - 0.95 * top_width", "leg_height - 0.6 * top_width"]
    spec["parameters"]["top_width"]["range"] = [1.2, 2.6]
    assert not told(found(spec), "relations").error
    spec["relations"].append("top_width - 1.5 * top_depth")
    assert told(found(spec), "relations").error


def test_an_anchor_needs_three_coordinates(spec: Any) -> None:
    spec["keep"]["top"] = [0, 0]
    assert "has 2 coordinates" in told(found(spec), "keep top").text


def test_an_unusual_size_of_clouds(spec: Any) -> None:
    assert not told(found({**spec, "points": 50}), "points").error


def test_an_empty_typical_range(spec: Any) -> None:
    spec["parameters"]["top_width"]["typical"] = [2, 1]
    assert told(found(spec), "parameters top_width").error


def test_draws_keep_the_relations_and_reach_the_ends(spec: Any) -> None:
    template = compile_template(spec)
    f = draws(template)
    kept = f @ template.relations[:, 1:].T + template.relations[:, 0]
    assert (kept > -1e-9).all()
    np.testing.assert_allclose(f.min(axis=0), template.low)
    np.testing.assert_allclose(f.max(axis=0), template.high)
    assert kept.min() < 1e-9
