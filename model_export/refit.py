"""The last layer once more, in closed form, on synthetic shapes of the served size.

Trained layers answer for clouds of all sizes and every augmentation at once, and a little too small
or large for the clean, full-size clouds that are served.  With the layers before it fixed, the last
one is linear in its weights: ridge regression towards the trained weights takes that bias out.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from model_export.config import Config
from model_export.networks import Encoder
from model_export.synthetic import Augmentation, SyntheticShapes
from service.template.affine import AffineTemplate

REFIT_SEED = 30_000_001
CHUNK = 50
RIDGE = 1e-3
"""Pull towards the trained weights, relative to features of unit variance."""


@torch.no_grad()
def refit(encoder: Encoder, template: AffineTemplate, config: Config, count: int) -> None:
    """Fit the last layer anew, in place, to ``count`` clean and half as many augmented shapes.

    Args:
        encoder: in evaluation mode.
        template: the category.
        config: that it was trained with.
        count: of clean shapes; at least one chunk of 50.
    """
    sets = [(Augmentation.none(), count), (config.augmentation, count // 2)]
    rows = []
    for number, (augmentation, size) in enumerate(sets):
        seed = REFIT_SEED + number + 10 * config.seed
        shapes = SyntheticShapes(template, augmentation, seed, config.log_share)
        rows += [_features(encoder, shapes) for _ in range(max(1, size // CHUNK))]
    features, labels, active = (torch.cat(column) for column in zip(*rows, strict=True))
    features, labels = features.double(), labels.double()
    last, size = _last(encoder), labels.shape[1]
    weights = torch.cat([last.weight, last.bias[:, None]], dim=1).double().T[:, :size]
    standard = (labels - encoder.mean[:size]) / encoder.spread[:size]
    residual = standard - features @ weights
    ridge = RIDGE * torch.eye(features.shape[1], dtype=features.dtype)
    for output in range(size):
        own = features[active[:, output]]
        gram = own.T @ own / len(own) + ridge
        aim = own.T @ residual[active[:, output], output] / len(own)
        weights[:, output] += torch.linalg.solve(gram, aim)
    last.weight[:size] = weights[:-1].T.float()
    last.bias[:size] = weights[-1].float()


def _last(encoder: Encoder) -> nn.Linear:
    last = list(encoder.head)[-1]
    assert isinstance(last, nn.Linear)
    return last


def _features(encoder: Encoder, shapes: SyntheticShapes) -> tuple[Tensor, Tensor, Tensor]:
    """What the last layer sees of a chunk of shapes, with a one for its bias; the labels; and which
    of them say anything, in each shape's variant."""
    batch = shapes.batch(CHUNK, shapes.template.points)
    seen: list[Tensor] = []
    hook = _last(encoder).register_forward_pre_hook(lambda _, inputs: seen.append(inputs[0]))
    encoder(batch.points)
    hook.remove()
    features = torch.cat([seen[0], torch.ones(len(seen[0]), 1)], dim=1)
    active = torch.tensor([[*own.active, True, True, True] for own in shapes.template.variants])
    return features, batch.labels, active[batch.variant]
