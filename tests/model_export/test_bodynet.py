from __future__ import annotations

import numpy as np
import pytest
import torch

from model_export.bodynet import BodyEncoder, spread_first
from service.encode import bodyoutputs
from service.encode.bodyoutputs import ANCHORS, OUTPUTS, BodyEncoding


@pytest.fixture(scope="module")
def clouds() -> torch.Tensor:
    return 0.2 * torch.randn(3, 300, 3, generator=torch.Generator().manual_seed(0))


@pytest.fixture(scope="module")
def encoder() -> BodyEncoder:
    torch.manual_seed(0)
    return BodyEncoder(width=32, depth=1, neighbours=8, mean_log_scale=-0.4).eval()


def test_a_fresh_network_answers_an_upright_body_of_usual_size(
    encoder: BodyEncoder, clouds: torch.Tensor
) -> None:
    with torch.no_grad():
        outputs = encoder(clouds)
    assert outputs.shape == (3, OUTPUTS)
    found = BodyEncoding.of(outputs[0].numpy())
    assert found.rotations[0].trace() > 1.5
    assert found.scale == pytest.approx(np.exp(-0.4), rel=0.6)
    assert np.abs(found.joints).max() < 0.8


def test_the_order_of_the_points_behind_the_anchors_does_not_matter(
    encoder: BodyEncoder, clouds: torch.Tensor
) -> None:
    order = torch.cat([torch.arange(ANCHORS), ANCHORS + torch.randperm(300 - ANCHORS)])
    with torch.no_grad():
        assert torch.allclose(encoder(clouds), encoder(clouds[:, order]), atol=1e-5)


def test_anchors_answer_too(encoder: BodyEncoder, clouds: torch.Tensor) -> None:
    with torch.no_grad():
        outputs, parts, votes = encoder.answers(clouds)
    assert parts.shape == (3, ANCHORS, 24)
    assert votes.shape == (3, ANCHORS, 24, 3)
    joints = outputs[:, :72].reshape(3, 24, 3)
    low, high = votes.amin(dim=1), votes.amax(dim=1)
    assert ((joints >= low - 1e-5) & (joints <= high + 1e-5)).all()


def test_it_learns_where_a_joint_is(clouds: torch.Tensor) -> None:
    torch.manual_seed(0)
    encoder = BodyEncoder(width=32, depth=1, neighbours=8)
    optimizer = torch.optim.Adam(encoder.parameters(), 2e-3)
    target = clouds.amax(dim=1)
    losses = []
    for _ in range(40):
        loss = (encoder(clouds)[:, :3] - target).abs().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[-1] < 0.5 * losses[0]


def test_points_are_spread_as_the_service_spreads_them(clouds: torch.Tensor) -> None:
    order = spread_first(clouds, 40)
    for cloud, own in zip(clouds, order, strict=True):
        served = bodyoutputs.spread_first(cloud.double().numpy(), 40)
        assert (own[:40].numpy() == served[:40]).all()
        assert sorted(own.tolist()) == list(range(300))
