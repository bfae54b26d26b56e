from __future__ import annotations

import pytest
import torch
from torch import Tensor, nn

from model_export.networks import (
    Discriminator,
    Encoder,
    KeypointEncoder,
    PointNet,
    build_encoder,
    fold_batch_norm,
)

OUTPUTS = 11
MEAN, SPREAD = torch.linspace(-1, 1, OUTPUTS), torch.linspace(0.1, 2, OUTPUTS)
SHARED = (16, 24, 32, 20)


def encoder(head: tuple[int, ...] | None = None) -> PointNet:
    torch.manual_seed(0)
    return PointNet(MEAN, SPREAD, head=head)


def keypoint_encoder() -> KeypointEncoder:
    torch.manual_seed(0)
    return KeypointEncoder(MEAN, SPREAD, SHARED, (30,), keypoints=7)


def used(head: tuple[int, ...] | None = None) -> PointNet:
    """The paper's encoder, after some use."""
    network = encoder(head)
    _use(network)
    return network


def _use(network: Encoder) -> None:
    """Let the normalisations see data and learn something."""
    for layer in network.modules():
        if isinstance(layer, nn.BatchNorm1d):
            nn.init.uniform_(layer.weight, 0.5, 1.5)
            nn.init.uniform_(layer.bias, -0.5, 0.5)
    for _ in range(5):
        network(clouds(8, 40))
    network.eval()


@pytest.fixture(params=["paper", "keypoints"])
def any_used(request: pytest.FixtureRequest) -> Encoder:
    """An encoder of either kind, after some use."""
    network = encoder() if request.param == "paper" else keypoint_encoder()
    _use(network)
    return network


def clouds(count: int, points: int) -> Tensor:
    """Clouds ``[count, points, 3]`` of different extents."""
    return torch.rand(count, 1, 3) * torch.randn(count, points, 3)


def widths(network: PointNet) -> list[tuple[int, int]]:
    return [
        (layer.in_features, layer.out_features)
        for layer in network.modules()
        if isinstance(layer, nn.Linear)
    ]


def test_the_papers_encoder_has_seven_layers_of_its_widths() -> None:
    shared = [(3, 64), (64, 128), (128, 128), (128, 256)]
    assert widths(encoder()) == [*shared, (256, 11), (11, 11), (11, 11)]
    assert widths(encoder((256, 128))) == [*shared, (256, 256), (256, 128), (128, 11)]


def test_the_papers_encoder_has_61203_weights() -> None:
    folded = fold_batch_norm(encoder())
    assert sum(weight.numel() for weight in folded.parameters()) == 61203


def test_every_layer_but_the_last_is_normalised_and_rectified() -> None:
    for part in (encoder().shared, encoder().head):
        kinds = [type(layer) for layer in part.modules() if not isinstance(layer, nn.Sequential)]
        hidden = kinds if len(kinds) % 3 == 0 else kinds[:-1]
        assert hidden == [nn.Linear, nn.BatchNorm1d, nn.ReLU] * (len(hidden) // 3)
    last = encoder().head[-1]
    assert isinstance(last, nn.Linear)
    assert last.bias is not None


def test_the_order_of_the_points_makes_no_difference(any_used: Encoder) -> None:
    network, points = any_used, clouds(3, 100)
    with torch.no_grad():
        expected = network(points)
        shuffled = network(points[:, torch.randperm(100)])
    assert torch.allclose(expected, shuffled, atol=1e-6)
    assert (expected[0] - expected[1]).abs().max() > 5e-3


def test_repeated_points_make_no_difference(any_used: Encoder) -> None:
    network, points = any_used, clouds(2, 60)
    with torch.no_grad():
        assert torch.allclose(network(points), network(points.repeat(1, 3, 1)), atol=1e-6)


def test_each_cloud_is_judged_alone(any_used: Encoder) -> None:
    network, points = any_used, clouds(4, 60)
    with torch.no_grad():
        together = network(points)
        alone = torch.cat([network(cloud[None]) for cloud in points])
    assert torch.allclose(together, alone, atol=1e-5)


def test_outputs_are_standardised() -> None:
    network = used()
    points = clouds(2, 60)
    with torch.no_grad():
        raw = network.head(network.shared(points.reshape(-1, 3)).reshape(2, 60, -1).amax(dim=1))
        assert torch.allclose(network(points), network.mean + network.spread * raw, atol=1e-6)
        network.head[-1].weight.zero_()
        network.head[-1].bias.zero_()
        assert torch.equal(network(points), torch.linspace(-1, 1, OUTPUTS).expand(2, -1))


@pytest.mark.parametrize("head", [None, (32, 16), ()])
def test_folding_keeps_the_function(head: tuple[int, ...] | None) -> None:
    network = used(head)
    folded = fold_batch_norm(network)
    assert not any(isinstance(layer, nn.BatchNorm1d) for layer in folded.modules())
    assert not folded.training
    points = clouds(5, 100)
    with torch.no_grad():
        assert torch.allclose(folded(points), network(points), atol=2e-5)


def test_an_encoder_with_keypoints_folds_to_the_same_function() -> None:
    network = keypoint_encoder()
    _use(network)
    folded = fold_batch_norm(network)
    assert not any(isinstance(layer, nn.BatchNorm1d) for layer in folded.modules())
    points = clouds(5, 100)
    with torch.no_grad():
        assert torch.allclose(folded(points), network(points), atol=2e-5)


def test_keypoints_are_means_of_points_and_move_with_them() -> None:
    network, points = keypoint_encoder(), clouds(3, 50)
    _use(network)
    seen: list[Tensor] = []
    network.head.register_forward_pre_hook(lambda _, inputs: seen.append(inputs[0]))
    with torch.no_grad():
        network(points)
        network.attention.weight.zero_()
        network.attention.bias.zero_()
        network(points)
    attended, even = (features[:, SHARED[-1] :].reshape(3, 7, 3) for features in seen)
    assert torch.allclose(even, points.mean(dim=1, keepdim=True).expand(-1, 7, -1), atol=1e-5)
    assert (attended <= points.amax(dim=1, keepdim=True) + 1e-5).all()
    assert (attended >= points.amin(dim=1, keepdim=True) - 1e-5).all()
    assert (attended - even).abs().max() > 1e-3


def test_the_kind_of_encoder_is_chosen_by_its_keypoints() -> None:
    assert isinstance(build_encoder(MEAN, SPREAD, SHARED, None, None), PointNet)
    chosen = build_encoder(MEAN, SPREAD, SHARED, (30,), 7)
    assert isinstance(chosen, KeypointEncoder)
    assert chosen.attention.out_features == 7
    with pytest.raises(ValueError, match="widths of its head"):
        build_encoder(MEAN, SPREAD, SHARED, None, 7)


def test_folding_leaves_the_original_as_it_was() -> None:
    network = used()
    before = {name: value.clone() for name, value in network.state_dict().items()}
    folded = fold_batch_norm(network)
    with torch.no_grad():
        for weight in folded.parameters():
            weight.zero_()
    folded.mean.zero_()
    assert all(torch.equal(before[name], value) for name, value in network.state_dict().items())


def discriminator() -> Discriminator:
    """One whose normalisations have seen data."""
    torch.manual_seed(0)
    network = Discriminator()
    for _ in range(5):
        network(clouds(8, 40))
    return network.eval()


def test_a_discriminator_gives_a_number_a_cloud_whatever_the_order_of_points() -> None:
    network, points = discriminator(), clouds(3, 100)
    with torch.no_grad():
        odds = network(points)
        assert odds.shape == (3,)
        assert torch.allclose(network(points[:, torch.randperm(100)]), odds, atol=1e-5)
        assert torch.allclose(network(points[1:2])[0], odds[1], atol=1e-5)
    assert odds.std() > 1e-3


def test_a_folded_discriminator_is_the_same_function() -> None:
    network, points = discriminator(), clouds(3, 100)
    folded = fold_batch_norm(network)
    assert not any(isinstance(layer, nn.BatchNorm1d) for layer in folded.modules())
    assert any(isinstance(layer, nn.BatchNorm1d) for layer in network.modules())
    with torch.no_grad():
        assert torch.allclose(folded(points), network(points), atol=1e-5)
