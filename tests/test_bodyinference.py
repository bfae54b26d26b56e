from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pretend_body import SHAPE, saved

from service.bodyinference import BodyInference
from service.encode.model import SHIPPED, Model, load_models
from service.inference import Inference
from service.mesh.frame import CANONICAL, Orientation
from service.pipeline import infer
from service.requests import InferOptions, Upload
from service.template.anatomy import JOINTS
from service.template.skinned import NAMES, Body, SkinnedTemplate

Z_UP = Orientation(up="+z", front="-y")


@pytest.fixture(scope="module")
def models(body_folder: Path) -> dict[str, Model]:
    return {**load_models(SHIPPED), **load_models(body_folder)}


@pytest.fixture(scope="module")
def found(human: SkinnedTemplate, strider: Body, models: dict[str, Model]) -> BodyInference:
    answer = infer(saved(human, strider, "glb"), models, InferOptions())
    assert isinstance(answer, BodyInference)
    return answer


def joints_of(answer: Inference) -> np.ndarray:
    joints = answer.report()["joints"]
    assert list(joints) == list(JOINTS)
    return np.array(list(joints.values()))


def test_a_body_is_found_among_all_categories(
    found: BodyInference, models: dict[str, Model]
) -> None:
    assert found.model is models["human"]
    assert found.best.orientation == CANONICAL
    assert found.in_distribution
    others = {candidate.model.name for candidate in found.candidates[1:]}
    assert "human" not in others, "ways of turning a body are one reading"


def test_a_chair_is_still_a_chair(chair_glb: bytes, models: dict[str, Model]) -> None:
    answer = infer(Upload(chair_glb, "chair.glb"), models, InferOptions())
    assert answer.model.name == "chair"
    assert answer.best.orientation == CANONICAL
    assert answer.in_distribution
    report = answer.report()
    assert "joints" not in report
    assert "encoder" not in report["fit"]


def test_the_report_is_whole(found: BodyInference, strider: Body) -> None:
    report = found.report()
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert list(report["parameters"]) == list(NAMES)
    units = {name: entry["unit"] for name, entry in report["parameters"].items()}
    assert {name for name, unit in units.items() if unit == "1"} == {
        f"shape_{index}" for index in range(3)
    }
    assert all(unit == "rad" for name, unit in units.items() if "shape" not in name)
    assert all(entry["sigma"] > 0 for entry in report["parameters"].values())
    assert report["fit"]["encoder"] == "point"
    assert report["warnings"] == []
    truth = dict(zip(NAMES, strider.parameters, strict=True))
    for name in ("left_elbow_y", "right_shoulder_z", "left_hip_x", "left_knee_x", "shape_0"):
        assert report["parameters"][name]["value"] == pytest.approx(truth[name], abs=0.15), name


def test_joints_and_stature_are_in_metres(
    found: BodyInference, human: SkinnedTemplate, strider: Body
) -> None:
    np.testing.assert_allclose(joints_of(found), human.posed_joints(strider), atol=0.03)
    tall = np.ptp(human.shaped(np.array(SHAPE))[0][:, 1])
    assert found.report()["derived"]["stature"]["unit"] == "m"
    assert found.report()["derived"]["stature"]["value"] == pytest.approx(tall, abs=0.03)


def test_joints_are_in_the_files_own_frame_and_unit(
    human: SkinnedTemplate, strider: Body, models: dict[str, Model]
) -> None:
    lying = saved(human, strider, "ply", Z_UP.rotation, size=100.0)
    answer = infer(lying, models, InferOptions(units="cm"))
    assert answer.best.orientation == Z_UP
    expected = 100.0 * human.posed_joints(strider) @ Z_UP.rotation
    np.testing.assert_allclose(joints_of(answer), expected, atol=3.0)
    derived = answer.report()["derived"]["stature"]
    assert (derived["unit"], derived["value"]) == ("cm", pytest.approx(175.4, abs=3.0))
    assert answer.report()["warnings"] == []


def test_joints_come_in_the_unit_that_the_client_wants(
    found: BodyInference, models: dict[str, Model]
) -> None:
    answer = infer(found.upload, models, InferOptions(units="mm"))
    np.testing.assert_allclose(joints_of(answer), 1000.0 * joints_of(found), rtol=1e-9)
    assert answer.report()["parameters"] == found.report()["parameters"]


def test_an_implausible_stature_is_warned_of(
    human: SkinnedTemplate, strider: Body, models: dict[str, Model]
) -> None:
    huge = saved(human, strider, "obj", size=100.0)
    (warning,) = infer(huge, models, InferOptions(category="human")).report()["warnings"]
    assert warning.endswith("say units=cm")


def test_a_body_that_the_encoder_was_not_trained_with_is_warned_of(
    found: BodyInference, body_folder: Path
) -> None:
    other = load_models(body_folder)["human"]
    other.card = {**other.card, "template_digest": "sha256-00"}
    best = replace(found.best, model=other)
    warnings = replace(found, candidates=[best, *found.candidates[1:]]).report()["warnings"]
    (warning,) = warnings
    assert "BODY_MODEL" in warning
