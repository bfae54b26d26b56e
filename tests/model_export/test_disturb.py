from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from model_export.disturb import disturb, rotations


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def test_disturbed_clouds_are_normalised_and_all_different() -> None:
    cloud = torch.randn(1, 200, 3, generator=generator())
    found = disturb(cloud.expand(20, -1, -1), generator())
    assert found.shape == (20, 200, 3)
    assert torch.allclose(found.mean(dim=1), torch.zeros(20, 3), atol=1e-5)
    assert torch.allclose(found.norm(dim=2).amax(dim=1), torch.full((20,), 0.6), atol=1e-5)
    assert torch.cdist(found.flatten(1), found.flatten(1)).add(torch.eye(20)).min() > 0.1


def test_the_same_seed_disturbs_alike() -> None:
    clouds = torch.randn(4, 50, 3, generator=generator())
    assert torch.equal(disturb(clouds, generator(3)), disturb(clouds, generator(3)))


def test_a_disturbed_cloud_stays_the_shape_it_was() -> None:
    line = torch.linspace(-1, 1, 300)[:, None] * torch.tensor([0.0, 1.0, 0.0])
    spread = disturb(line.expand(50, -1, -1), generator()).std(dim=1)
    upright = spread[:, 1] / spread.norm(dim=1)
    assert upright.min() > 0.6
    assert upright.median() > 0.95


@pytest.mark.parametrize("vector", [(0.3, -0.2, 0.1), (0.0, 0.0, 0.0), (0.0, 2.0, 0.0)])
def test_rotations_are_by_axis_and_angle(vector: tuple[float, float, float]) -> None:
    (found,) = rotations(torch.tensor([vector]))
    np.testing.assert_allclose(found, Rotation.from_rotvec(vector).as_matrix(), atol=1e-4)
