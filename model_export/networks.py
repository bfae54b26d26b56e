"""Encoder and discriminator: PointNets without transforms (section 4.1; Qi et al., CVPR 2017)."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeVar

import torch
from torch import Tensor, nn

Network = TypeVar("Network", bound=nn.Module)


class PointEncoder(nn.Module):
    """Shared layers on each point, a max over the points, a head on the pooled feature.

    The paper lists seven layers (64, 128, 128, 256, d, d, d): four shared ones, the pool, and
    three of the output's size.  Each is followed by batch normalisation and ReLU, but the last.
    The outputs are standardised, so that a fresh network answers the mean shape.
    """

    def __init__(
        self,
        mean: Tensor,
        spread: Tensor,
        shared: Sequence[int] = (64, 128, 128, 256),
        head: Sequence[int] | None = None,
    ) -> None:
        """
        Args:
            mean, spread: ``[d + 3]`` mean and standard deviation of the labels.
            shared: widths of the layers before the pool.
            head: widths of the hidden layers after it; None is the paper's ``(d+3, d+3)``.
        """
        super().__init__()
        outputs = len(mean)
        self.shared = _layers([3, *shared])
        widths = [shared[-1], *(head if head is not None else (outputs, outputs))]
        self.head = nn.Sequential(*_layers(widths), nn.Linear(widths[-1], outputs))
        self.register_buffer("mean", mean.clone())
        self.register_buffer("spread", spread.clone())

    def forward(self, points: Tensor) -> Tensor:
        """``[B, n, 3]`` normalised clouds to ``[B, d + 3]`` parameters and translation."""
        count, size, _ = points.shape
        features = self.shared(points.reshape(count * size, 3))
        pooled = features.reshape(count, size, -1).amax(dim=1)
        return self.mean + self.spread * self.head(pooled).float()


def _layers(widths: Sequence[int]) -> nn.Sequential:
    """Linear, batch normalisation and ReLU between consecutive widths."""
    blocks: list[nn.Module] = []
    for inner, outer in pairwise(widths):
        blocks += [nn.Linear(inner, outer, bias=False), nn.BatchNorm1d(outer), nn.ReLU()]
    return nn.Sequential(*blocks)


class Discriminator(nn.Module):
    """Tells clouds of a category that stand upright and face the front from all others.

    A PointNet in two rounds: the second sees each point beside the maximum of the first, so that a
    point can mean something else in another shape.
    """

    def __init__(
        self,
        first: Sequence[int] = (64, 64),
        second: Sequence[int] = (128, 256),
        head: Sequence[int] = (256, 64),
    ) -> None:
        """Widths of the layers of both rounds and of the hidden ones after the pool."""
        super().__init__()
        self.first = _layers([3, *first])
        self.second = _layers([2 * first[-1], *second])
        self.head = nn.Sequential(*_layers([2 * second[-1], *head]), nn.Linear(head[-1], 1))

    def forward(self, points: Tensor) -> Tensor:
        """``[B, n, 3]`` normalised clouds to ``[B]`` log odds."""
        count, size, _ = points.shape
        near = self.first(points.reshape(count * size, 3)).reshape(count, size, -1)
        context = near.amax(dim=1, keepdim=True).expand(-1, size, -1)
        both = torch.cat([near, context], dim=2)
        far = self.second(both.reshape(count * size, -1)).reshape(count, size, -1)
        pooled = torch.cat([far.amax(dim=1), far.mean(dim=1)], dim=1)
        return self.head(pooled)[:, 0].float()


def fold_batch_norm(network: Network) -> Network:
    """The same function in evaluation mode, with each normalisation folded into its layer."""
    folded = copy.deepcopy(network)
    for name, layers in network.named_children():
        setattr(folded, name, _fold(layers))
    return folded.eval()


@torch.no_grad()
def _fold(layers: nn.Sequential) -> nn.Sequential:
    folded: list[nn.Module] = []
    for layer in _flat(layers):
        if isinstance(layer, nn.Linear):
            copy = nn.Linear(layer.in_features, layer.out_features)
            copy.weight.copy_(layer.weight)
            copy.bias.zero_()
            if layer.bias is not None:
                copy.bias.copy_(layer.bias)
            folded.append(copy)
        elif isinstance(layer, nn.BatchNorm1d):
            linear = folded[-1]
            gain = layer.weight / torch.sqrt(layer.running_var + layer.eps)
            linear.weight.mul_(gain[:, None])
            linear.bias.copy_((linear.bias - layer.running_mean) * gain + layer.bias)
        else:
            folded.append(layer)
    return nn.Sequential(*folded)


def _flat(layers: nn.Sequential) -> list[nn.Module]:
    """The leaves of nested sequences."""
    flat: list[nn.Module] = []
    for layer in layers:
        flat += _flat(layer) if isinstance(layer, nn.Sequential) else [layer]
    return flat
