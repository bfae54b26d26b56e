from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from service.template.anatomy import PARENTS
from service.template.skinning import (
    blend,
    library,
    orthonormal,
    pose_joints,
    rotation_matrices,
    skin,
)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def assert_alike(ours: Any, torchs: Any) -> None:
    """What numpy and torch gave, both in float64."""
    for a, b in zip(ours, torchs, strict=True):
        assert isinstance(a, np.ndarray)
        assert isinstance(b, torch.Tensor)
        assert np.abs(a - b.numpy()).max() < 1e-12


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-5, 1e-3, 1.0, 3.1])
def test_rotations_are_scipys(rng: np.random.Generator, size: float) -> None:
    axes = rng.normal(size=(2, 30, 3))
    vectors = size * axes / np.linalg.norm(axes, axis=2, keepdims=True)
    expected = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(2, 30, 3, 3)
    matrices = rotation_matrices(vectors)
    assert np.abs(matrices - expected).max() < 1e-11
    assert np.abs(matrices @ matrices.swapaxes(-1, -2) - np.eye(3)).max() < 1e-11


def test_no_rotation_has_finite_derivatives_that_are_right() -> None:
    vector = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    entries = rotation_matrices(vector).ravel()
    rows = [torch.autograd.grad(entry, vector, retain_graph=True)[0] for entry in entries]
    jacobian = torch.stack(rows).reshape(3, 3, 3)
    generators = torch.zeros(3, 3, 3, dtype=torch.float64)
    for a, (b, c) in enumerate(((1, 2), (2, 0), (0, 1))):
        generators[c, b, a], generators[b, c, a] = 1.0, -1.0
    assert torch.allclose(jacobian, generators, atol=1e-9)
    step = 1e-6 * np.eye(3)
    finite = (rotation_matrices(step) - rotation_matrices(-step)) / 2e-6
    assert np.abs(finite - generators.permute(2, 0, 1).numpy()).max() < 1e-8


def test_six_numbers_make_a_rotation(rng: np.random.Generator) -> None:
    six = rng.normal(size=(50, 6))
    matrices = orthonormal(six)
    assert np.abs(matrices.swapaxes(-1, -2) @ matrices - np.eye(3)).max() < 1e-9
    assert np.allclose(np.linalg.det(matrices), 1.0)
    along = (matrices[:, :, 0] * six[:, :3]).sum(axis=1)
    assert np.allclose(along, np.linalg.norm(six[:, :3], axis=1))
    assert ((matrices[:, :, 1] * six[:, 3:]).sum(axis=1) > 0).all()


def test_a_rotations_columns_are_its_six_numbers(rng: np.random.Generator) -> None:
    matrices = Rotation.random(20, rng=rng).as_matrix()
    six = np.concatenate([matrices[:, :, 0], matrices[:, :, 1]], axis=1)
    assert np.abs(orthonormal(3.0 * six) - matrices).max() < 1e-9


def test_joints_follow_the_product_along_their_chain(rng: np.random.Generator) -> None:
    rotations = Rotation.random(24, rng=rng).as_matrix()
    joints = rng.normal(size=(24, 3))
    turned, placed = pose_joints(rotations, joints, PARENTS)
    for joint in range(24):
        chain = []
        at = joint
        while at >= 0:
            chain.append(at)
            at = PARENTS[at]
        product = np.eye(4)
        for link in reversed(chain):
            local = np.eye(4)
            local[:3, :3] = rotations[link]
            start = joints[PARENTS[link]] if PARENTS[link] >= 0 else 0.0
            local[:3, 3] = joints[link] - start
            product = product @ local
        assert np.allclose(turned[joint], product[:3, :3], atol=1e-12)
        assert np.allclose(placed[joint], product[:3, 3], atol=1e-12)


def test_points_of_one_joint_move_rigidly_with_it(rng: np.random.Generator) -> None:
    rotations = Rotation.random(24, rng=rng).as_matrix()
    joints, points = rng.normal(size=(24, 3)), rng.normal(size=(24, 3))
    turned, placed = pose_joints(rotations, joints, PARENTS)
    moved = skin(points, np.eye(24), joints, turned, placed)
    for joint in range(24):
        expected = placed[joint] + turned[joint] @ (points[joint] - joints[joint])
        assert np.allclose(moved[joint], expected, atol=1e-12)


def test_at_rest_nothing_moves(rng: np.random.Generator) -> None:
    weights = rng.dirichlet(np.ones(24), 10)
    joints, points = rng.normal(size=(24, 3)), rng.normal(size=(10, 3))
    turned, placed = pose_joints(np.tile(np.eye(3), (24, 1, 1)), joints, PARENTS)
    assert np.allclose(skin(points, weights, joints, turned, placed), points, atol=1e-12)


def test_numpy_and_torch_give_the_same_for_batches(rng: np.random.Generator) -> None:
    vectors, six = rng.normal(size=(3, 24, 3)), rng.normal(size=(3, 24, 6))
    joints, points = rng.normal(size=(3, 24, 3)), rng.normal(size=(3, 10, 3))
    weights = rng.dirichlet(np.ones(24), 10)

    def everything(*arrays: Any) -> tuple[Any, ...]:
        vectors, six, joints, points, weights = arrays
        rotations = rotation_matrices(vectors)
        turned, placed = pose_joints(rotations, joints, PARENTS)
        maps, shifts = blend(weights, joints, turned, placed)
        moved = skin(points, weights, joints, turned, placed)
        return rotations, orthonormal(six), turned, placed, maps, shifts, moved

    arrays = (vectors, six, joints, points, weights)
    ours = everything(*arrays)
    assert_alike(ours, everything(*map(torch.as_tensor, arrays)))
    singles = torch.as_tensor(vectors[1]), torch.as_tensor(six[1]), joints[1], points[1], weights
    alone = everything(*map(torch.as_tensor, singles))
    assert_alike(
        [all_[1] for all_ in ours[:6]] + [ours[6][1]],
        alone,
    )


def test_single_precision_is_close(rng: np.random.Generator) -> None:
    vectors, joints = rng.normal(size=(24, 3)), rng.normal(size=(24, 3))
    wide = pose_joints(rotation_matrices(vectors), joints, PARENTS)
    single = (torch.as_tensor(a, dtype=torch.float32) for a in (vectors, joints))
    turned, placed = pose_joints(rotation_matrices(next(single)), next(single), PARENTS)
    assert np.abs(wide[0] - turned.numpy()).max() < 3e-6
    assert np.abs(wide[1] - placed.numpy()).max() < 1e-5


def test_the_library_is_that_of_the_array() -> None:
    assert library(np.zeros(1)) is np
    assert library(torch.zeros(1)) is torch
