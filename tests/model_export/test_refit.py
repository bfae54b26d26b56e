from __future__ import annotations

import copy

import torch

from model_export.config import Config
from model_export.labels import label_statistics
from model_export.networks import PointNet
from model_export.refit import refit
from model_export.synthetic import Augmentation, SyntheticShapes
from service.template.affine import AffineTemplate


def encoder_of(stand: AffineTemplate, config: Config) -> PointNet:
    torch.manual_seed(0)
    encoder = PointNet(*label_statistics(stand, config), head=(32, 16)).train()
    shapes = SyntheticShapes(stand, Augmentation.none(), 4)
    with torch.no_grad():
        for _ in range(40):  # random layers, with the normalisation that training gives
            encoder(shapes.batch(50, stand.points).points)
    return encoder.eval()


def error(encoder: PointNet, stand: AffineTemplate) -> float:
    batch = SyntheticShapes(stand, Augmentation.none(), 5).batch(100, stand.points)
    labels = torch.cat([batch.parameters, batch.translation], dim=1)
    with torch.no_grad():
        return float(((encoder(batch.points) - labels) / encoder.spread).square().mean())


def test_the_error_on_clean_shapes_falls(stand: AffineTemplate, small_config: Config) -> None:
    encoder = encoder_of(stand, small_config)
    before = error(encoder, stand)
    refit(encoder, stand, small_config, 400)
    assert error(encoder, stand) < 0.7 * before


def test_only_the_last_layer_changes(stand: AffineTemplate, small_config: Config) -> None:
    encoder = encoder_of(stand, small_config)
    before = copy.deepcopy(encoder.state_dict())
    refit(encoder, stand, small_config, 100)
    changed = {n for n, v in encoder.state_dict().items() if not torch.equal(v, before[n])}
    last = f"head.{len(encoder.head) - 1}"
    assert changed == {f"{last}.weight", f"{last}.bias"}


def test_it_repeats(stand: AffineTemplate, small_config: Config) -> None:
    first, second = encoder_of(stand, small_config), encoder_of(stand, small_config)
    refit(first, stand, small_config, 100)
    refit(second, stand, small_config, 100)
    assert all(
        torch.equal(a, b) for a, b in zip(first.parameters(), second.parameters(), strict=True)
    )
