from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from model_export.poses import Poses
from service.template.anatomy import JOINTS, PARENTS, limits
from service.template.bodyfile import load_body
from service.template.skinning import pose_joints


@pytest.fixture(scope="module")
def rotations() -> np.ndarray:
    return Poses(torch.Generator().manual_seed(0)).draw(600).double().numpy()


def placed(rotations: np.ndarray) -> np.ndarray:
    return pose_joints(rotations, load_body().joints, PARENTS)[1]


def test_poses_are_rotations_and_the_root_stays(rotations: np.ndarray) -> None:
    assert rotations.shape == (600, len(JOINTS), 3, 3)
    assert np.allclose(rotations @ rotations.swapaxes(2, 3), np.eye(3), atol=1e-5)
    assert np.allclose(np.linalg.det(rotations), 1.0, atol=1e-5)
    assert np.allclose(rotations[:, 0], np.eye(3), atol=1e-5)


def test_the_same_seed_draws_the_same_poses(rotations: np.ndarray) -> None:
    again = Poses(torch.Generator().manual_seed(0)).draw(600).double().numpy()
    other = Poses(torch.Generator().manual_seed(1)).draw(600).double().numpy()
    assert (again == rotations).all()
    assert np.abs(other - rotations).max() > 0.5


@pytest.mark.parametrize("joint", ["left_elbow", "right_elbow", "left_knee", "right_knee", "neck"])
def test_hinges_bend_as_far_as_they_reach_and_no_farther(rotations: np.ndarray, joint: str) -> None:
    index = JOINTS.index(joint)
    vectors = Rotation.from_matrix(rotations[:, index]).as_rotvec()
    low, high = (end[index] for end in limits())
    axis = int((high - low).argmax())
    reach = high[axis] - low[axis]
    slack = np.radians(20)
    assert vectors[:, axis].min() > low[axis] - slack
    assert vectors[:, axis].max() < high[axis] + slack
    assert np.ptp(vectors[:, axis]) > 0.55 * reach


def test_hands_go_everywhere_and_feet_mostly_stay_below(rotations: np.ndarray) -> None:
    joints = placed(rotations)
    for side in ("left", "right"):
        hand = joints[:, JOINTS.index(f"{side}_wrist")] - joints[:, JOINTS.index("neck")]
        assert (hand[:, 1] > 0.1).mean() > 0.08
        assert (hand[:, 1] < -0.3).mean() > 0.3
        assert (hand[:, 2] > 0.3).mean() > 0.08
        foot = joints[:, JOINTS.index(f"{side}_ankle")] - joints[:, 0]
        assert (foot[:, 1] < -0.3).mean() > 0.8


def test_both_sides_are_alike(rotations: np.ndarray) -> None:
    joints = placed(rotations)
    flip = np.array([-1.0, 1.0, 1.0])
    for name in ("wrist", "elbow", "knee", "ankle"):
        left = joints[:, JOINTS.index(f"left_{name}")]
        right = joints[:, JOINTS.index(f"right_{name}")] * flip
        assert np.abs(left.mean(axis=0) - right.mean(axis=0)).max() < 0.06
        assert np.abs(left.std(axis=0) - right.std(axis=0)).max() < 0.05
