"""The paper's mesh encoder: graph convolutions over the template's own edges (section 4.1).

Where the paper has one mean over all vertices there is one for each of some hundred regions: a mean
over a whole body hardly tells where its hands are.
"""

from __future__ import annotations

import itertools

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from service.template.anatomy import JOINTS
from service.template.skinned import SHAPES, SkinnedTemplate

WIDTHS = (16, 32, 64, 96, 128)
OUTPUTS = 6 * len(JOINTS) + SHAPES
"""Two columns of each joint's rotation in space, and the shape."""
REGIONS = 4
"""Regions that each joint's part of the surface is divided into."""
SLOPE = 0.2
GAIN = 1.4
"""Of a fresh convolution: about what keeps features as large as they come in, at that slope."""


class FeaStConv(nn.Module):
    """Feature-steered graph convolution (Verma et al., FeaStNet, CVPR 2018).

    Each neighbour is shared out among weight matrices by a softmax over its difference from the
    vertex, so that the assignment is invariant to translation.  The matrices start as one and the
    same, orthogonal one: a fresh layer loses nothing of what the ring's mean says.
    """

    def __init__(self, inner: int, outer: int, heads: int) -> None:
        """
        Args:
            inner, outer: widths.
            heads: weight matrices.
        """
        super().__init__()
        self.assign = nn.Linear(inner, heads)
        self.mix = nn.Linear(heads * inner, outer)
        start = nn.init.orthogonal_(torch.empty(outer, inner), gain=GAIN)
        with torch.no_grad():
            self.mix.weight.copy_(start.repeat(1, heads))
            self.mix.bias.zero_()

    def forward(self, features: Tensor, rings: Tensor, share: Tensor) -> Tensor:
        """``[B, V, inner]`` to ``[B, W, outer]``.

        Args:
            features: of vertices.
            rings: ``[W, K]`` for each vertex that is asked for itself, its neighbours, and itself
                again as padding.
            share: ``[W, K]`` what each counts; 0 for padding, rows sum to 1.
        """
        near = _gather(features, rings)
        # The difference of what a vertex gives to each head: the same as the heads of a difference.
        given = _gather(nn.functional.linear(features, self.assign.weight), rings)
        odds = given - given[:, :, :1] + self.assign.bias
        weight = odds.softmax(dim=3) * share[None, :, :, None]
        gathered = weight.transpose(2, 3) @ near
        return self.mix(gathered.flatten(2))


class MeshNet(nn.Module):
    """A layer, four graph convolutions, means over regions, and a layer."""

    def __init__(
        self, faces: NDArray[np.int64], count: int, middles: NDArray[np.int64], heads: int = 8
    ) -> None:
        """
        Args:
            faces: ``[F, 3]`` of the template.
            count: its vertices.
            middles: ``[R]`` the vertex in the middle of each region; the mean is over its ring.
            heads: weight matrices of each convolution.
        """
        super().__init__()
        rings, share = one_rings(faces, count)
        pool = rings[middles]
        # Only what the means see is computed, layer by layer.
        seen = np.unique(pool)
        self._keep("pool", np.searchsorted(seen, pool), share[middles])
        for layer in reversed(range(len(WIDTHS) - 1)):
            wanted = np.unique(rings[seen])
            self._keep(f"ring{layer}", np.searchsorted(wanted, rings[seen]), share[seen])
            seen = wanted
        self.register_buffer("seen", torch.as_tensor(seen))
        self.first = nn.Linear(3, WIDTHS[0])
        self.convolutions = nn.ModuleList(
            FeaStConv(inner, outer, heads) for inner, outer in itertools.pairwise(WIDTHS)
        )
        self.last = nn.Linear(len(middles) * WIDTHS[-1], OUTPUTS)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)
        self.register_buffer("upright", torch.tensor([1.0, 0, 0, 0, 1, 0]).repeat(len(JOINTS)))

    def forward(self, vertices: Tensor) -> Tensor:
        """``[B, V, 3]`` normalised vertices, the torso upright, to ``[B, OUTPUTS]``."""
        return self.answer(self.pooled(vertices))

    def pooled(self, vertices: Tensor) -> Tensor:
        """``[B, R * 128]`` means of the last convolution's features."""
        features = self._bent(self.first(4.0 * vertices.index_select(1, self.seen)))
        for layer, convolution in enumerate(self.convolutions):
            features = self._bent(convolution(features, *self._kept(f"ring{layer}")))
        rings, share = self._kept("pool")
        return (_gather(features, rings) * share[None, :, :, None]).sum(2).flatten(1)

    def answer(self, pooled: Tensor) -> Tensor:
        """What follows from the means: ``[B, OUTPUTS]``."""
        outputs = self.last(pooled)
        rotations = outputs[:, : len(self.upright)] + self.upright
        return torch.cat([rotations, outputs[:, len(self.upright) :]], dim=1)

    def _keep(self, name: str, rings: NDArray[np.int64], share: NDArray[np.float64]) -> None:
        self.register_buffer(f"{name}_rings", torch.as_tensor(rings))
        self.register_buffer(f"{name}_share", torch.as_tensor(share, dtype=torch.float32))

    def _kept(self, name: str) -> tuple[Tensor, Tensor]:
        return getattr(self, f"{name}_rings"), getattr(self, f"{name}_share")

    @staticmethod
    def _bent(features: Tensor) -> Tensor:
        return nn.functional.leaky_relu(features, SLOPE)


def _gather(features: Tensor, rings: Tensor) -> Tensor:
    """``[B, W, K, inner]`` the features of the vertices in rings ``[W, K]``."""
    return features.index_select(1, rings.flatten()).unflatten(1, tuple(rings.shape))


def one_rings(
    faces: NDArray[np.int64], count: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """``[V, K]`` each vertex, its neighbours, and itself as padding; and what each counts."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0)
    degree = np.bincount(pairs[:, 0], minlength=count)
    place = 1 + np.arange(len(pairs)) - np.repeat(np.cumsum(degree) - degree, degree)
    rings = np.tile(np.arange(count)[:, None], (1, 1 + degree.max()))
    rings[pairs[:, 0], place] = pairs[:, 1]
    share = np.zeros(rings.shape)
    share[:, 0] = 1.0 / (1 + degree)
    share[pairs[:, 0], place] = share[pairs[:, 0], 0]
    return rings, share


def region_middles(template: SkinnedTemplate, each: int = REGIONS) -> NDArray[np.int64]:
    """``[R]`` vertices in the middle of regions that divide each joint's part of the surface."""
    dominant = template.weights.argmax(axis=1)
    middles = []
    for joint in range(len(JOINTS)):
        own = np.flatnonzero(dominant == joint)
        if len(own):
            middles += own[_middles(template.rest[own], min(each, len(own)))].tolist()
    return np.array(middles)


def _middles(points: NDArray[np.float64], count: int) -> list[int]:
    """Points ``[n, 3]`` in the middle of clusters: Lloyd's method from points far apart."""
    chosen = [int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmin())]
    while len(chosen) < count:
        gaps = np.linalg.norm(points[:, None] - points[chosen], axis=2)
        chosen.append(int(gaps.min(axis=1).argmax()))
    for _ in range(20):
        nearest = np.linalg.norm(points[:, None] - points[chosen], axis=2).argmin(axis=1)
        means = [points[nearest == index].mean(axis=0) for index in range(count)]
        chosen = [int(np.linalg.norm(points - mean, axis=1).argmin()) for mean in means]
    return chosen
