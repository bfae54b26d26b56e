from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pretend_body import saved
from scipy.spatial.transform import Rotation

from service.bodyedit import edited, move, of_stature, standing
from service.bodyinference import BodyInference
from service.edited import Edited, Moved
from service.edits import parse_edits
from service.encode.bodymodel import stature
from service.encode.model import Model, load_models
from service.errors import InvalidRequest
from service.mesh.formats import read_mesh
from service.mesh.frame import Orientation
from service.pipeline import edit, infer
from service.requests import EditOptions, InferOptions
from service.template.anatomy import JOINTS
from service.template.skinned import NAMES, Body, SkinnedTemplate

Z_UP = Orientation(up="+z", front="-y")
UPRIGHT = InferOptions(up="+y", front="+z")


@pytest.fixture(scope="module")
def models(body_folder: Path) -> dict[str, Model]:
    return load_models(body_folder)


@pytest.fixture(scope="module")
def found(human: SkinnedTemplate, strider: Body, models: dict[str, Model]) -> BodyInference:
    answer = infer(saved(human, strider, "glb"), models, UPRIGHT)
    assert isinstance(answer, BodyInference)
    return answer


def moved(found: BodyInference, edits: str, mode: str = "blend", keep: str = "floor") -> Moved:
    return move(found, parse_edits(edits), EditOptions(mode=mode), keep)


def change(found: BodyInference, edits: str, **options: str) -> Edited:
    models = {"human": found.model}
    return edit(found.upload, models, UPRIGHT, parse_edits(edits), EditOptions(**options))


def value(found: BodyInference, name: str) -> float:
    return float(found.parameters[NAMES.index(name)])


def pelvis(found: BodyInference) -> np.ndarray:
    return found.own_joints(found.fit.body)[0]


@pytest.mark.parametrize("format", ["glb", "obj", "ply", "stl", "off"])
@pytest.mark.parametrize("mode", ["blend", "paper"])
def test_an_empty_edit_returns_the_very_bytes(
    human: SkinnedTemplate, strider: Body, models: dict[str, Model], format: str, mode: str
) -> None:
    upload = saved(human, strider, format)
    options = replace(UPRIGHT, refine=False)
    answer = edit(upload, models, options, {}, EditOptions(mode=mode))
    assert answer.data == upload.data
    assert answer.report["vertices"]["moved"] == 0


def test_a_value_set_to_what_it_is_changes_nothing(found: BodyInference) -> None:
    report = found.report()
    values = {name: entry["value"] for name, entry in report["parameters"].items()}
    assert change(found, json.dumps(values)).data == found.upload.data
    tall = report["derived"]["stature"]["value"]
    assert change(found, json.dumps({"stature": tall})).data == found.upload.data


@pytest.mark.parametrize("mode", ["blend", "paper"])
def test_a_bent_elbow_moves_the_forearm_alone(
    found: BodyInference, human: SkinnedTemplate, mode: str
) -> None:
    answer = change(found, '{"left_elbow_y": {"add": -0.6}}', mode=mode)
    entry = answer.report["parameters"]["left_elbow_y"]
    assert entry["after"] == pytest.approx(value(found, "left_elbow_y") - 0.6)
    assert answer.parameters["left_elbow_y"] == entry["after"]
    others = [e for n, e in answer.report["parameters"].items() if n != "left_elbow_y"]
    assert all(e["before"] == e["after"] for e in others)
    before, after = found.mesh.vertices, read_mesh(answer.data, "a.glb").vertices
    arm = [JOINTS.index(name) for name in ("left_elbow", "left_wrist", "left_hand")]
    reached = human.weights[:, arm].sum(axis=1)
    far = human.weights[:, [*arm, JOINTS.index("left_shoulder")]].sum(axis=1) == 0.0
    stayed = (after == before).all(axis=1)
    assert far.sum() > 4000
    assert stayed[far].mean() > (0.999 if mode == "blend" else 0.95)
    values = found.parameters.copy()
    values[NAMES.index("left_elbow_y")] -= 0.6
    # The upload is the template's own mesh: it moves as the template does.
    bent = human.decode(edited(found.fit.body, values)) - human.decode(found.fit.body)
    expected = bent / found.fit.normalization.scale
    gap = np.linalg.norm(after - before - expected, axis=1)
    assert np.linalg.norm(expected, axis=1)[reached > 0.99].max() > 0.2
    assert gap[reached > 0.99].mean() < 0.012
    assert gap.mean() < 0.003


@pytest.mark.parametrize("mode", ["blend", "paper"])
def test_the_whole_body_turns_about_its_pelvis(found: BodyInference, mode: str) -> None:
    answer = moved(found, '{"global_orient_y": {"add": 0.7}}', mode)
    turn = (
        Rotation.from_rotvec(found.parameters[:3] + np.array([0.0, 0.7, 0.0]))
        * Rotation.from_rotvec(found.parameters[:3]).inv()
    ).as_matrix()
    expected = (found.mesh.vertices - pelvis(found)) @ turn.T + pelvis(found)
    # The paper's rule shifts what lies off the template as the template's own vertices.
    gap = np.abs(answer.vertices - expected)
    assert gap.max() < (1e-9 if mode == "blend" else 0.1)
    np.testing.assert_allclose(answer.linear, np.broadcast_to(turn, answer.linear.shape), atol=1e-9)


def test_an_edit_is_made_in_the_files_own_frame(
    human: SkinnedTemplate, strider: Body, models: dict[str, Model], found: BodyInference
) -> None:
    lying = infer(
        saved(human, strider, "ply", Z_UP.rotation), models, InferOptions(up="+z", front="-y")
    )
    assert isinstance(lying, BodyInference)
    edits = '{"right_knee_x": {"set": 1.0}, "stature": {"scale": 1.05}}'
    upright, turned = moved(found, edits), moved(lying, edits)
    np.testing.assert_allclose(turned.vertices @ Z_UP.rotation.T, upright.vertices, atol=2e-4)
    maps = Z_UP.rotation @ turned.linear @ Z_UP.rotation.T
    np.testing.assert_allclose(maps, upright.linear, atol=2e-3)


@pytest.mark.parametrize("mode", ["blend", "paper"])
def test_vertices_that_stay_have_the_identity_for_a_map(found: BodyInference, mode: str) -> None:
    answer = moved(found, '{"head_y": {"add": 0.4}}', mode)
    still = (answer.vertices == found.mesh.vertices).all(axis=1)
    assert 0 < (~still).sum() < len(still) / 2
    assert (answer.linear[still] == np.eye(3)).all()
    turned = answer.linear[~still] - np.eye(3)
    assert np.abs(turned).max() > 0.3


@pytest.mark.parametrize("edits", ['{"stature": 1.9}', '{"stature": {"add": 0.146}}'])
def test_a_taller_person_stands_on_the_same_floor(found: BodyInference, edits: str) -> None:
    answer = change(found, edits)
    assert answer.report["derived"]["stature"]["after"] == pytest.approx(1.9, abs=0.02)
    assert answer.report["parameters"]["shape_1"]["after"] == value(found, "shape_1")
    before, after = found.mesh.vertices, read_mesh(answer.data, "a.glb").vertices
    taller = answer.parameters["stature"] / answer.report["derived"]["stature"]["before"]
    assert after[:, 1].min() == pytest.approx(before[:, 1].min(), abs=0.004)
    assert np.ptp(after[:, 1]) == pytest.approx(taller * np.ptp(before[:, 1]), rel=0.02)


def test_the_pelvis_can_be_kept_instead(found: BodyInference) -> None:
    edits = '{"stature": {"scale": 1.1}}'
    floor, hips = (moved(found, edits, keep=keep).vertices for keep in ("floor", "pelvis"))
    shift = floor - hips
    np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-12)
    assert shift[0, 1] > 0.05
    assert np.abs(shift[0, [0, 2]]).max() == 0.0
    near = np.linalg.norm(found.mesh.vertices - pelvis(found), axis=1) < 0.15
    assert np.abs((hips - found.mesh.vertices)[near].mean(axis=0)).max() < 0.01


def test_other_coefficients_count_before_the_stature(found: BodyInference) -> None:
    answer = change(found, '{"stature": 1.6, "shape_1": 1.5, "shape_2": {"add": 1.0}}')
    assert answer.parameters["stature"] == pytest.approx(1.6, abs=1e-9)
    assert answer.parameters["shape_1"] == 1.5


def test_what_joints_can_not_do_is_done_and_warned_of(found: BodyInference) -> None:
    answer = change(found, '{"left_elbow_y": 1.0, "shape_1": -4.0, "global_orient_x": 3.0}')
    assert answer.parameters["left_elbow_y"] == 1.0
    assert "left_elbow_y is outside of what joints can reach" in answer.report["warnings"]
    outside = "shape_1 is outside of what the model was trained on"
    assert outside in answer.report["warnings"]
    assert not any("global_orient" in warning for warning in answer.report["warnings"])


@pytest.mark.parametrize(
    ("edits", "keep", "code"),
    [
        ('{"left_elbow": 1}', "floor", "unknown_parameter"),
        ('{"seat_width": 1}', "floor", "unknown_parameter"),
        ('{"stature": 1.8, "shape_0": 1}', "floor", "dimension_fixed"),
        ('{"stature": -1}', "floor", "size_not_positive"),
        ('{"stature": {"scale": 0}}', "floor", "size_not_positive"),
        ("{}", "seat", "unknown_keep"),
    ],
)
def test_edits_that_make_no_sense_are_refused(
    found: BodyInference, edits: str, keep: str, code: str
) -> None:
    with pytest.raises(InvalidRequest) as caught:
        change(found, edits, keep=keep)
    assert caught.value.code == code
    assert caught.value.suggestion


def test_the_first_coefficient_leads_to_any_height(human: SkinnedTemplate) -> None:
    start = np.array([-0.7, 1.0, 0.5])
    for template in (human, replace(human, shapedirs=-human.shapedirs)):
        for metres in (1.2, 1.75, 2.3):
            shape = of_stature(template, start, metres)
            assert stature(template, shape) == pytest.approx(metres, abs=1e-9)
            assert shape[1:].tolist() == [1.0, 0.5]


def test_a_body_whose_first_coefficient_is_no_height_is_told(human: SkinnedTemplate) -> None:
    flat = replace(human, shapedirs=np.zeros_like(human.shapedirs))
    with pytest.raises(InvalidRequest) as caught:
        of_stature(flat, np.zeros(3), 1.9)
    assert caught.value.code == "dimension_fixed"


def test_joints_that_stay_keep_their_very_rotations(strider: Body) -> None:
    values = strider.parameters
    values[NAMES.index("neck_x")] = 0.2
    after = edited(strider, values)
    same = np.arange(len(JOINTS)) != JOINTS.index("neck")
    assert np.array_equal(after.rotations[same], strider.rotations[same])
    np.testing.assert_allclose(after.parameters, values, atol=1e-12)


def test_a_shape_is_put_where_the_one_before_was(human: SkinnedTemplate, strider: Body) -> None:
    assert standing(human, strider, strider, "floor") is strider
    grown = replace(strider, shape=strider.shape + np.array([1.0, 0.0, 0.0]))
    hips = standing(human, strider, grown, "pelvis")
    np.testing.assert_allclose(
        human.posed_joints(hips)[0], human.posed_joints(strider)[0], atol=1e-12
    )
    floor = standing(human, strider, grown, "floor")
    lowest = [human.decode(body)[:, 1].min() for body in (strider, floor)]
    assert lowest[0] == pytest.approx(lowest[1], abs=1e-12)


def test_a_stature_that_is_set_to_what_it_is_stays_so_in_another_shape(
    found: BodyInference,
) -> None:
    tall = found.stature(found.fit.body)
    answer = moved(found, json.dumps({"shape_1": 1.5, "stature": tall}))
    (stature,) = answer.derived
    assert stature.after == pytest.approx(tall, rel=1e-9)
    values = {shift.name: shift.after for shift in answer.parameters}
    assert values["shape_1"] == 1.5
    assert values["shape_0"] != value(found, "shape_0")
