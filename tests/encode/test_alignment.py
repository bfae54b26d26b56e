from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from service.encode.alignment import align

RNG = np.random.default_rng(0)
TARGETS = RNG.standard_normal((60, 3))
WEIGHTS = RNG.random(60)


def moved(seed: int) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """The targets as they were before a known move."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=rng).as_matrix()
    scale, shift = float(np.exp(rng.standard_normal())), rng.standard_normal(3)
    return (TARGETS - shift) @ rotation / scale, rotation, scale, shift


@pytest.mark.parametrize("seed", range(4))
def test_a_move_is_found(seed: int) -> None:
    points, rotation, scale, shift = moved(seed)
    found = align(points, TARGETS, WEIGHTS)
    assert np.allclose(found[0], rotation)
    assert found[1] == pytest.approx(scale)
    assert np.allclose(found[2], shift)


def test_points_of_no_weight_do_not_count() -> None:
    points, rotation, _, _ = moved(5)
    weights = np.where(np.arange(60) < 20, 0.0, 1.0)
    points[:20] += 5.0
    assert np.allclose(align(points, TARGETS, weights)[0], rotation)
    assert not np.allclose(align(points, TARGETS, WEIGHTS)[0], rotation, atol=1e-2)


def test_a_mirror_image_is_turned_and_not_mirrored() -> None:
    rotation, _, _ = align(TARGETS * [-1.0, 1.0, 1.0], TARGETS, WEIGHTS)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert np.allclose(rotation @ rotation.T, np.eye(3))


def test_a_batch_of_tensors_is_aligned_alike() -> None:
    clouds = np.stack([moved(seed)[0] for seed in range(3)])
    weights, targets = torch.as_tensor(WEIGHTS), torch.as_tensor(TARGETS)
    batch = align(torch.as_tensor(clouds), targets, weights)
    for index in range(3):
        for own, expected in zip(batch, align(clouds[index], TARGETS, WEIGHTS), strict=True):
            assert np.allclose(own[index].numpy(), expected)
