"""The paper's mesh encoder: graph convolutions over the template's own edges (section 4.1)."""

from __future__ import annotations

import itertools

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from service.template.anatomy import JOINTS
from service.template.skinned import SHAPES

WIDTHS = (16, 32, 64, 96, 128)
OUTPUTS = 6 * len(JOINTS) + SHAPES
"""Two columns of each joint's rotation in space, and the shape."""


class FeaStConv(nn.Module):
    """Feature-steered graph convolution (Verma et al., FeaStNet, CVPR 2018).

    Each neighbour is shared out among weight matrices by a softmax over its difference from the
    vertex, so that the assignment is invariant to translation.
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

    def forward(self, features: Tensor, neighbours: Tensor, share: Tensor) -> Tensor:
        """``[B, V, inner]`` to ``[B, V, outer]``.

        Args:
            features: of the vertices.
            neighbours: ``[V, K]`` vertices about each, itself among them, padded with itself.
            share: ``[V, K]`` what each counts; 0 for padding, rows sum to 1.
        """
        count, degree = neighbours.shape
        near = features[:, neighbours.reshape(-1)].unflatten(1, (count, degree))
        odds = self.assign(near - features[:, :, None])
        weight = odds.softmax(dim=3) * share[None, :, :, None]
        gathered = weight.transpose(2, 3) @ near
        return self.mix(gathered.flatten(2))


class MeshNet(nn.Module):
    """A layer, four graph convolutions, a mean over the vertices, and a layer."""

    def __init__(self, faces: NDArray[np.int64], count: int, heads: int = 8) -> None:
        """
        Args:
            faces: ``[F, 3]`` of the template.
            count: its vertices.
            heads: weight matrices of each convolution.
        """
        super().__init__()
        neighbours, share = one_rings(faces, count)
        self.register_buffer("neighbours", torch.as_tensor(neighbours))
        self.register_buffer("share", torch.as_tensor(share, dtype=torch.float32))
        self.first = nn.Linear(3, WIDTHS[0])
        self.convolutions = nn.ModuleList(
            FeaStConv(inner, outer, heads) for inner, outer in itertools.pairwise(WIDTHS)
        )
        self.last = nn.Linear(WIDTHS[-1], OUTPUTS)
        self.register_buffer("upright", torch.tensor([1.0, 0, 0, 0, 1, 0]).repeat(len(JOINTS)))

    def forward(self, vertices: Tensor) -> Tensor:
        """``[B, V, 3]`` normalised vertices, the torso upright, to ``[B, OUTPUTS]``."""
        features = nn.functional.leaky_relu(self.first(4.0 * vertices))
        for convolution in self.convolutions:
            features = convolution(features, self.neighbours, self.share)
            features = nn.functional.leaky_relu(features)
        outputs = self.last(features.mean(dim=1)).float()
        rotations = outputs[:, : len(self.upright)] + self.upright
        return torch.cat([rotations, outputs[:, len(self.upright) :]], dim=1)


def one_rings(
    faces: NDArray[np.int64], count: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """``[V, K]`` each vertex and its neighbours, padded with itself, and what each counts."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    own = np.repeat(np.arange(count)[:, None], 2, axis=1)
    pairs = np.unique(np.concatenate([own, sides, sides[:, ::-1]]), axis=0)
    degree = np.bincount(pairs[:, 0], minlength=count)
    place = np.arange(len(pairs)) - np.repeat(np.cumsum(degree) - degree, degree)
    neighbours = np.tile(np.arange(count)[:, None], (1, degree.max()))
    neighbours[pairs[:, 0], place] = pairs[:, 1]
    share = np.zeros(neighbours.shape)
    share[pairs[:, 0], place] = 1.0 / degree[pairs[:, 0]]
    return neighbours, share
