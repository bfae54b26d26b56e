"""Encoders and discriminator: point networks of next to no layers."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeVar

import torch
from torch import Tensor, nn

Network = TypeVar("Network", bound=nn.Module)


class PointNet(nn.Module):
    """The paper's encoder: shared layers, a max over the points, a head on the pooled feature.

    A PointNet without transforms (section 4.1; Qi et al., CVPR 2017).  The paper lists seven layers
    (64, 128, 128, 256, d, d, d): four shared ones, the pool, and three of the output's size.  Each
    is followed by batch normalisation and ReLU, but the last.  The outputs are standardised, so
    that a fresh network answers the mean shape.
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
            mean, spread: ``[o]`` mean and standard deviation of the labels.
            shared: widths of the layers before the pool.
            head: widths of the hidden layers after it; None is the paper's ``(o, o)``.
        """
        super().__init__()
        outputs = len(mean)
        self.shared = _layers([3, *shared])
        widths = [shared[-1], *(head if head is not None else (outputs, outputs))]
        self.head = nn.Sequential(*_layers(widths), nn.Linear(widths[-1], outputs))
        self.register_buffer("mean", mean.clone())
        self.register_buffer("spread", spread.clone())

    def forward(self, points: Tensor) -> Tensor:
        """``[B, n, 3]`` normalised clouds to ``[B, o]`` outputs."""
        count, size, _ = points.shape
        features = self.shared(points.reshape(count * size, 3))
        pooled = features.reshape(count, size, -1).amax(dim=1)
        return self.mean + self.spread * self.head(pooled).float()


class KeypointEncoder(nn.Module):
    """An encoder that finds where things are: keypoints, each a weighted mean of the points.

    Shared layers in two rounds, the second with the maximum of the first in view, give each point
    a feature.  From it follow the point's weights in ``keypoints`` means, which attend to a wing's
    tip or a seat's front edge.  Positions so reach the head undistorted, to better than a maximum
    over features can tell them, and alike for clouds of any size.
    """

    def __init__(
        self,
        mean: Tensor,
        spread: Tensor,
        shared: Sequence[int] = (64, 128, 128, 256),
        head: Sequence[int] = (512, 256),
        keypoints: int = 128,
    ) -> None:
        """
        Args:
            mean, spread: ``[o]`` mean and standard deviation of the labels.
            shared: widths of the layers, an even number of them, half in each round.
            head: widths of the hidden layers after the pool.
            keypoints: how many.
        """
        super().__init__()
        half = len(shared) // 2
        first, second = shared[:half], shared[half:]
        self.first = _layers([3, *first])
        self.mixed = Mixed(first[-1], second[0])
        self.second = _layers(second)
        self.attention = nn.Linear(second[-1], keypoints)
        widths = [second[-1] + 3 * keypoints, *head]
        self.head = nn.Sequential(*_layers(widths), nn.Linear(widths[-1], len(mean)))
        self.register_buffer("mean", mean.clone())
        self.register_buffer("spread", spread.clone())

    def forward(self, points: Tensor) -> Tensor:
        """``[B, n, 3]`` normalised clouds to ``[B, o]`` outputs."""
        count, size, _ = points.shape
        near = self.first(points.reshape(count * size, 3)).reshape(count, size, -1)
        features = self.second(self.mixed(near).reshape(count * size, -1))
        weights = self.attention(features).reshape(count, size, -1).float().softmax(dim=1)
        keypoints = torch.einsum("bnk,bnc->bkc", weights, points).flatten(1)
        largest = features.reshape(count, size, -1).amax(dim=1)
        return self.mean + self.spread * self.head(torch.cat([largest, keypoints], dim=1)).float()


class Mixed(nn.Module):
    """A layer that sees a point's feature beside the maximum over all points."""

    def __init__(self, inner: int, outer: int) -> None:
        super().__init__()
        self.own = nn.Linear(inner, outer, bias=False)
        self.all = nn.Linear(inner, outer)
        self.norm: nn.Module = nn.BatchNorm1d(outer)

    def forward(self, features: Tensor) -> Tensor:
        """``[B, n, inner]`` to ``[B, n, outer]``."""
        mixed = self.own(features) + self.all(features.amax(dim=1, keepdim=True))
        shape = mixed.shape
        return torch.relu(self.norm(mixed.reshape(-1, shape[-1])).reshape(shape))

    @torch.no_grad()
    def folded(self) -> Mixed:
        """The same in evaluation mode, without its normalisation."""
        norm = self.norm
        assert isinstance(norm, nn.BatchNorm1d)
        result = copy.deepcopy(self)
        gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
        result.own.weight.mul_(gain[:, None])
        result.all.weight.mul_(gain[:, None])
        result.all.bias.copy_((self.all.bias - norm.running_mean) * gain + norm.bias)
        result.norm = nn.Identity()
        return result


Encoder = PointNet | KeypointEncoder


def build_encoder(
    mean: Tensor,
    spread: Tensor,
    shared: Sequence[int],
    head: Sequence[int] | None,
    keypoints: int | None,
) -> Encoder:
    """An encoder with keypoints, or without any the paper's; see their classes."""
    if keypoints is None:
        return PointNet(mean, spread, shared, head)
    if head is None:
        raise ValueError("an encoder with keypoints needs the widths of its head")
    return KeypointEncoder(mean, spread, shared, head, keypoints)


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
        self.mixed = Mixed(first[-1], second[0])
        self.second = _layers(second)
        self.head = nn.Sequential(*_layers([2 * second[-1], *head]), nn.Linear(head[-1], 1))

    def forward(self, points: Tensor) -> Tensor:
        """``[B, n, 3]`` normalised clouds to ``[B]`` log odds."""
        count, size, _ = points.shape
        near = self.first(points.reshape(count * size, 3)).reshape(count, size, -1)
        far = self.second(self.mixed(near).reshape(count * size, -1)).reshape(count, size, -1)
        pooled = torch.cat([far.amax(dim=1), far.mean(dim=1)], dim=1)
        return self.head(pooled)[:, 0].float()


def fold_batch_norm(network: Network) -> Network:
    """The same function in evaluation mode, with each normalisation folded into its layer."""
    folded = copy.deepcopy(network)
    for name, layers in network.named_children():
        if isinstance(layers, nn.Sequential):
            setattr(folded, name, _fold(layers))
        elif isinstance(layers, Mixed):
            setattr(folded, name, layers.folded())
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
