from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pretend_body import saved

from service.bodyinference import BodyInference
from service.bodytransfer import take
from service.edited import Edited
from service.encode.bodymodel import stature
from service.encode.model import SHIPPED, Model, load_model
from service.errors import InvalidRequest
from service.inferences import Inferences
from service.mesh.formats import read_mesh
from service.mesh.frame import Orientation
from service.pipeline import infer, transfer
from service.requests import InferOptions, TransferOptions, Upload
from service.template.anatomy import JOINTS
from service.template.skinned import NAMES, Body, SkinnedTemplate, body_of

UPRIGHT = InferOptions("human", "+y", "+z")
Z_UP = Orientation(up="+z", front="-y")
SITTING = {"left_hip": (-1.4, 0, 0), "right_hip": (-1.4, 0, 0), "left_knee": (1.5, 0, 0),
           "right_knee": (1.5, 0, 0), "left_shoulder": (0, 0, -1.0)}  # fmt: skip


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return {"human": load_model(SHIPPED / "human.json")}


@pytest.fixture(scope="module")
def known() -> Inferences:
    return Inferences(1 << 28)


@pytest.fixture(scope="module")
def sitter(human: SkinnedTemplate) -> Body:
    """Someone who sits, turned a little, small and stout, on the floor at y = 0."""
    vectors = np.zeros((len(JOINTS), 3))
    for name, vector in SITTING.items():
        vectors[JOINTS.index(name)] = vector
    vectors[0] = (0.0, 0.6, 0.0)
    body = body_of(vectors, np.array([-0.8, 0.9, 0.4]), 1.0, np.zeros(3))
    lowest = human.decode(body)[:, 1].min()
    return replace(body, translation=np.array([0.0, -lowest, 0.0]))


@pytest.fixture(scope="module")
def source(human: SkinnedTemplate, strider: Body) -> Upload:
    return saved(human, strider, "glb")


@pytest.fixture(scope="module")
def target(human: SkinnedTemplate, sitter: Body) -> Upload:
    return saved(human, sitter, "glb")


def vertices(edited: Edited) -> np.ndarray:
    return read_mesh(edited.data, f"a.{edited.format}").vertices


def gaps(edited: Edited, expected: np.ndarray) -> np.ndarray:
    """``[V]`` distances from where the vertices should be, but for a shift of the whole."""
    apart = vertices(edited) - expected
    return np.asarray(np.linalg.norm(apart - np.median(apart, axis=0), axis=1))


def test_a_body_takes_pose_shape_and_stature(
    human: SkinnedTemplate, sitter: Body, source: Upload, target: Upload, models: dict[str, Model],
    known: Inferences,
) -> None:  # fmt: skip
    edited = transfer(source, target, models, UPRIGHT, UPRIGHT, TransferOptions(), known)
    expected = human.decode(sitter)
    assert gaps(edited, expected).mean() < 0.01
    tall = stature(human, sitter.shape)
    assert edited.parameters["stature"] == pytest.approx(tall, rel=0.01)
    account = edited.report["transfer"]
    wanted = account["target"]["stature"]
    assert edited.parameters["stature"] == pytest.approx(wanted["value"], rel=1e-9)
    assert set(NAMES) - set(account["parameters"]) == {"shape_0"}
    assert "stature" in account["parameters"]
    # The seat of the pose is lower; the feet stay on the floor.
    assert vertices(edited)[:, 1].min() == pytest.approx(0.0, abs=1e-4)


def test_a_body_keeps_its_own_stature(
    source: Upload, target: Upload, models: dict[str, Model], known: Inferences
) -> None:
    options = TransferOptions(size="source")
    edited = transfer(source, target, models, UPRIGHT, UPRIGHT, options, known)
    (entry,) = edited.report["derived"].values()
    assert entry["after"] == pytest.approx(entry["before"], rel=1e-9)
    account = edited.report["transfer"]
    assert account["scale"] == pytest.approx(
        entry["before"] / account["target"]["stature"]["value"], rel=1e-9
    )
    parameters = edited.report["parameters"]
    assert parameters["shape_1"]["after"] == account["target"]["shape_1"]["value"]
    pose = TransferOptions(size="source", parameters=("left_knee_x",))
    turned = transfer(source, target, models, UPRIGHT, UPRIGHT, pose, known)
    assert turned.report["transfer"]["parameters"] == ["left_knee_x"]


@pytest.mark.parametrize(
    "options",
    [TransferOptions(), TransferOptions(size="source"), TransferOptions(position="target")],
)
def test_a_body_with_its_own_parameters_is_its_own_bytes(
    source: Upload, models: dict[str, Model], known: Inferences, options: TransferOptions
) -> None:
    edited = transfer(source, source, models, UPRIGHT, UPRIGHT, options, known)
    assert edited.data == source.data


@pytest.mark.parametrize("keep", ["floor", "pelvis"])
def test_it_is_put_where_the_target_is(
    human: SkinnedTemplate, sitter: Body, source: Upload, models: dict[str, Model],
    known: Inferences, keep: str,
) -> None:  # fmt: skip
    away = replace(sitter, translation=sitter.translation + np.array([3.0, 0.7, -2.0]))
    cm = saved(human, away, "ply", Z_UP.rotation, size=100.0)
    options = UPRIGHT, InferOptions("human", "+z", "-y", "cm")
    how = TransferOptions(position="target", keep=keep)
    edited = transfer(source, cm, models, *options, how, known)
    apart = vertices(edited) - human.decode(away)
    assert np.linalg.norm(np.median(apart, axis=0)) < 0.015
    if keep == "floor":
        assert vertices(edited)[:, 1].min() == pytest.approx(0.7, abs=1e-4)


def test_a_stature_out_of_reach_is_left_and_told_of(
    human: SkinnedTemplate, sitter: Body, source: Upload, models: dict[str, Model],
    known: Inferences,
) -> None:  # fmt: skip
    giant = saved(human, sitter, "ply", size=100.0)
    edited = transfer(source, giant, models, UPRIGHT, UPRIGHT, TransferOptions(), known)
    account = edited.report["transfer"]
    assert "stature" not in account["parameters"]
    parameters = edited.report["parameters"]
    assert parameters["shape_0"]["after"] == account["target"]["shape_0"]["value"]
    (warning,) = [w for w in edited.report["warnings"] if w.startswith("stature comes to")]
    assert f"{edited.parameters['stature']:.4g} m" in warning
    assert "units" in warning


def test_names_may_be_chosen(
    source: Upload, target: Upload, models: dict[str, Model], known: Inferences
) -> None:
    found, other = (infer(upload, models, UPRIGHT, known) for upload in (source, target))
    assert isinstance(found, BodyInference)
    assert isinstance(other, BodyInference)

    def taken(*names: str) -> list[str]:
        return list(take(found, other, TransferOptions(parameters=names), "floor").edits)

    assert taken("stature", "left_knee_x") == ["left_knee_x", "stature"]
    assert taken("shape_0") == ["shape_0"]
    with pytest.raises(InvalidRequest, match="unknown_parameter"):
        taken("left_kneee_x")
    options = TransferOptions(parameters=("shape_0", "stature"))
    with pytest.raises(InvalidRequest, match="dimension_fixed"):
        transfer(source, target, models, UPRIGHT, UPRIGHT, options, known)


def test_arms_alone_leave_the_rest_where_it_is(
    human: SkinnedTemplate, source: Upload, target: Upload, models: dict[str, Model],
    known: Inferences,
) -> None:  # fmt: skip
    names = tuple(f"left_{joint}_{axis}" for joint in ("shoulder", "elbow") for axis in "xyz")
    options = TransferOptions(parameters=names)
    edited = transfer(source, target, models, UPRIGHT, UPRIGHT, options, known)
    legs = [
        JOINTS.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("hip", "knee")
    ]
    still = human.weights[:, legs].sum(axis=1) > 0.99
    before = read_mesh(source.data, "a.glb").vertices
    np.testing.assert_array_equal(vertices(edited)[still], before[still])
