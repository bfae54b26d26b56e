from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pretend_body import saved

from service.bodyconstraints import TALLER, constrain
from service.bodyedit import move
from service.bodyinference import BodyInference
from service.constraints import Interval
from service.edits import Change
from service.encode.model import load_models
from service.errors import InvalidRequest
from service.pipeline import edit, infer
from service.requests import EditOptions, InferOptions
from service.template.skinned import NAMES, Body, SkinnedTemplate

UPRIGHT = InferOptions(up="+y", front="+z")


@pytest.fixture(scope="module")
def found(human: SkinnedTemplate, strider: Body, body_folder: Path) -> BodyInference:
    answer = infer(saved(human, strider, "glb"), load_models(body_folder), UPRIGHT)
    assert isinstance(answer, BodyInference)
    return answer


def value(values: np.ndarray, name: str) -> float:
    return float(values[NAMES.index(name)])


def changed(found: BodyInference, values: np.ndarray) -> list[str]:
    return [NAMES[index] for index in np.flatnonzero(values != found.parameters)]


def test_angles_and_coefficients_go_to_the_nearest_of_their_interval(found: BodyInference) -> None:
    elbow = value(found.parameters, "left_elbow_y")
    constraints = {
        "left_elbow_y": Interval(low=elbow + 0.2),
        "right_knee_x": Interval(1.0, 1.0),
        "head_x": Interval(-3.0, 3.0),
        "shape_1": Interval(high=-0.5),
    }
    values = constrain(found, found.parameters, {}, constraints)
    assert value(values, "left_elbow_y") == elbow + 0.2
    assert value(values, "right_knee_x") == 1.0
    assert value(values, "shape_1") == -0.5
    assert set(changed(found, values)) == {"left_elbow_y", "right_knee_x", "shape_1"}


@pytest.mark.parametrize("factor", [0.92, 1.07])
def test_a_stature_is_the_edit_of_it(found: BodyInference, factor: float) -> None:
    tall = found.stature(found.fit.body) * factor
    edited = move(found, {"stature": Change("set", tall)}, EditOptions(), "floor")
    for ends in (Interval(tall, tall), Interval(low=tall) if factor > 1 else Interval(high=tall)):
        kept = move(found, {}, EditOptions(), "floor", {"stature": ends})
        np.testing.assert_allclose(kept.vertices, edited.vertices, atol=1e-6)
        (stature,) = kept.dimensions
        assert stature.after == pytest.approx(tall)
        assert stature.asked == ends
    assert changed(found, constrain(found, found.parameters, {}, {"stature": ends})) == [TALLER]


def test_what_is_kept_already_changes_no_byte(found: BodyInference) -> None:
    models = {"human": found.model}
    constraints = {"stature": Interval(0.5, 3.0), "left_elbow_y": Interval(-3.2, 3.2)}
    answer = edit(found.upload, models, UPRIGHT, {}, EditOptions(), constraints)
    assert answer.data == found.upload.data


def test_edits_stay(found: BodyInference) -> None:
    tall = found.stature(found.fit.body)
    kept = move(
        found, {"shape_1": Change("add", 1.0)}, EditOptions(), "floor",
        {"stature": Interval(tall, tall)},
    )  # fmt: skip
    after = {shift.name: shift.after for shift in kept.parameters}
    assert after["shape_1"] == value(found.parameters, "shape_1") + 1.0
    assert kept.dimensions[0].after == pytest.approx(tall)


def test_a_stature_that_its_coefficient_may_not_lead_to_conflicts(found: BodyInference) -> None:
    tall, shape = found.stature(found.fit.body), value(found.parameters, TALLER)
    constraints = {"stature": Interval(low=1.1 * tall), TALLER: Interval(high=shape)}
    with pytest.raises(InvalidRequest) as caught:
        constrain(found, found.parameters, {}, constraints)
    assert caught.value.code == "constraints_conflict"
    entries = {entry["name"]: entry for entry in caught.value.members["conflicts"]}
    assert {name: entry["unit"] for name, entry in entries.items()} == {
        "stature": found.unit, TALLER: "1"
    }  # fmt: skip
    eased = {
        "stature": Interval(low=entries["stature"]["nearest"]),
        TALLER: Interval(high=entries[TALLER]["nearest"]),
    }
    constrain(found, found.parameters, {}, eased)


def test_an_unknown_name_is_refused(found: BodyInference) -> None:
    with pytest.raises(InvalidRequest) as caught:
        move(found, {}, EditOptions(), "floor", {"height": Interval(high=2.0)})
    assert caught.value.code == "unknown_parameter"
