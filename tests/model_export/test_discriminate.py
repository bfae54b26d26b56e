from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from model_export.discriminate import (
    POINTS,
    ROTATIONS,
    Clouds,
    Data,
    drawn_from,
    pool,
    train,
    write_onnx,
)
from model_export.distractors import heaps
from model_export.networks import Discriminator
from model_export.synthetic import Augmentation, SyntheticShapes
from service.encode.discriminator import Discriminator as Served
from service.mesh.frame import orientations
from service.template.affine import AffineTemplate

STEPS = 25


@pytest.fixture(scope="module")
def trained(stand: AffineTemplate) -> Discriminator:
    """Trained for a moment on stands and heaps."""
    others = pool([samples.points for samples in heaps(30, 600, 0)])
    return train(Clouds(drawn_from(stand, 0), pool([]), others), STEPS)


def test_the_first_rotation_leaves_a_cloud_as_it_is() -> None:
    assert ROTATIONS.shape == (24, 3, 3)
    assert torch.equal(ROTATIONS[0], torch.eye(3))


def test_a_pool_holds_normalised_clouds() -> None:
    assert pool([]).shape[0] == 0
    clouds = pool([np.random.default_rng(seed).normal(size=(50, 3)) + 4 for seed in range(3)])
    assert clouds.shape == (3, 50, 3)
    assert torch.allclose(clouds.norm(dim=2).amax(dim=1), torch.full((3,), 0.6), atol=1e-6)


def test_a_moments_training_tells_upright_stands_from_fallen_ones(
    trained: Discriminator, stand: AffineTemplate
) -> None:
    upright = SyntheticShapes(stand, Augmentation.none(), 9).batch(12, POINTS).points
    with torch.no_grad():
        right = trained(upright)
        fallen = trained(torch.einsum("ij,bpj->bpi", ROTATIONS[8], upright))
        upside_down = trained(upright * torch.tensor([1.0, -1.0, -1.0]))
    assert (right > fallen).float().mean() > 0.9
    assert (right > upside_down).float().mean() > 0.9


def test_what_is_written_is_what_was_trained(trained: Discriminator, tmp_path: Path) -> None:
    write_onnx(trained, tmp_path / "stand.discriminator.onnx")
    served = Served(tmp_path / "stand.discriminator.onnx")
    assert served.points == POINTS
    (cloud,) = pool([np.random.default_rng(0).normal(size=(POINTS, 3))]).numpy().astype(float)
    ways = orientations()
    views = torch.as_tensor(np.stack([way.to_canonical(cloud) for way in ways]))
    with torch.no_grad():
        expected = trained(views.float()).numpy()
    np.testing.assert_allclose(served.odds(cloud, ways), expected, atol=1e-4)
    np.testing.assert_allclose(served.odds(cloud, ways[3:4]), expected[3:4], atol=1e-4)


def test_without_real_shapes_there_is_nothing_to_hold_out(meshes: Path) -> None:
    assert Data.of(None, [], None).shapes == []
    assert len(Data.of(meshes, [], None).shapes) == 10
    assert Data.of(None, [meshes], "stand").others(50, held_out=False) == []
