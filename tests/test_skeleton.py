from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pretend_body import saved
from scipy.spatial.transform import Rotation

from service.bodyedit import move
from service.bodyinference import BodyInference
from service.edits import parse_edits
from service.encode.model import SHIPPED, load_models
from service.errors import InvalidRequest
from service.mesh.frame import Orientation
from service.pipeline import infer, skeleton
from service.requests import EditOptions, InferOptions, Upload
from service.skeleton import Skeleton
from service.template.anatomy import JOINTS
from service.template.skinned import Body, SkinnedTemplate

Z_UP = Orientation(up="+z", front="-y")
LYING = InferOptions(up="+z", front="-y", units="cm")


@pytest.fixture(scope="module")
def found(human: SkinnedTemplate, strider: Body, body_folder: Path) -> BodyInference:
    upload = saved(human, strider, "ply", Z_UP.rotation, size=100.0)
    answer = infer(upload, load_models(body_folder), LYING)
    assert isinstance(answer, BodyInference)
    return answer


@pytest.fixture(scope="module")
def bones(found: BodyInference) -> Skeleton:
    return skeleton(found.upload, {"human": found.model}, LYING)


def worlds(bones: Skeleton, rotations: np.ndarray) -> np.ndarray:
    """``[24, 4, 4]`` as a viewer finds them, node by node."""
    found: list[np.ndarray] = []
    for parent, turn, offset in zip(bones.parents, rotations, bones.offsets, strict=True):
        own = np.eye(4)
        own[:3, :3], own[:3, 3] = turn, offset
        above = np.eye(4)
        above[:3, :3] = bones.frame
        found.append((above if parent < 0 else found[parent]) @ own)
    return np.array(found)


def skinned(bones: Skeleton, vertices: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    joints = worlds(bones, rotations) @ bones.inverse_bind
    points = np.column_stack([vertices, np.ones(len(vertices))])
    return np.einsum("vk,vkij,vj->vi", bones.weights, joints[bones.indices], points)[:, :3]


def test_each_vertex_hangs_on_up_to_four_joints(found: BodyInference, bones: Skeleton) -> None:
    assert bones.names == JOINTS
    assert bones.indices.shape == bones.weights.shape == (len(found.mesh.vertices), 4)
    np.testing.assert_allclose(bones.weights.sum(axis=1), 1.0)
    assert (bones.weights >= 0.0).all()


def test_joints_are_where_they_are_in_the_file(found: BodyInference, bones: Skeleton) -> None:
    joints = np.array(list(found.report()["joints"].values()))
    np.testing.assert_allclose(bones.joints, joints)
    np.testing.assert_allclose(worlds(bones, bones.rotations)[:, :3, 3], joints)


def test_at_first_nothing_moves(found: BodyInference, bones: Skeleton) -> None:
    vertices = found.mesh.vertices
    np.testing.assert_allclose(skinned(bones, vertices, bones.rotations), vertices, atol=1e-9)


def test_posing_it_does_what_edits_do(found: BodyInference, bones: Skeleton) -> None:
    edits = '{"right_knee_x": {"add": 0.8}, "neck_y": 0.3, "global_orient_z": {"add": -0.4}}'
    expected = move(found, parse_edits(edits), EditOptions(), "floor").vertices
    vectors = found.parameters[: 3 * len(JOINTS)].reshape(-1, 3).copy()
    vectors[JOINTS.index("right_knee"), 0] += 0.8
    vectors[JOINTS.index("neck"), 1] = 0.3
    vectors[0, 2] -= 0.4
    posed = skinned(bones, found.mesh.vertices, Rotation.from_rotvec(vectors).as_matrix())
    assert np.abs(expected - found.mesh.vertices).max() > 20.0
    np.testing.assert_allclose(posed, expected, atol=1e-6)


def test_a_chair_has_none(chair_glb: bytes) -> None:
    with pytest.raises(InvalidRequest) as caught:
        skeleton(Upload(chair_glb, "chair.glb"), load_models(SHIPPED), InferOptions())
    assert caught.value.code == "no_skeleton"
