"""Random disturbances of clouds: what separates one upload from another of the same kind."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import normalize

from model_export.realistic import normalise

STRETCH = 0.15
"""Standard deviation of the log of each axis' scale."""
NOISE = 0.01
"""Largest standard deviation of a cloud's point noise."""
CROPPED, CROP = 0.3, 0.2
"""Share of clouds that lose a part, cut off by a plane, and the largest such part."""
TILT, TILTED, STEEP = 4.0, 0.3, 12.0
"""Degrees by which clouds lean; a share of them leans by the larger angle."""


def disturb(clouds: Tensor, generator: torch.Generator) -> Tensor:
    """Stretched, mirrored, noisy, cropped and leaning: ``[B, n, 3]`` clouds, normalised anew."""
    count = len(clouds)
    stretch = torch.exp(STRETCH * _randn(generator, count, 1, 3))
    stretch[..., 0] *= torch.where(_rand(generator, count, 1) < 0.5, -1.0, 1.0)
    clouds = clouds * stretch
    level = NOISE * _rand(generator, count, 1, 1) ** 2
    clouds = clouds + level * _randn(generator, *clouds.shape)
    clouds = _crop(clouds, generator)
    steep = _rand(generator, count, 1) < TILTED
    angle = torch.deg2rad(torch.where(steep, STEEP, TILT)) * _randn(generator, count, 3)
    return normalise(torch.einsum("bij,bpj->bpi", rotations(angle), clouds))


def rotations(vectors: Tensor) -> Tensor:
    """``[B, 3, 3]`` rotations by axis-angle ``vectors [B, 3]`` in radians."""
    cross = torch.zeros(len(vectors), 3, 3)
    x, y, z = vectors.T
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    return torch.matrix_exp(cross - cross.transpose(1, 2))


def _crop(clouds: Tensor, generator: torch.Generator) -> Tensor:
    """Some clouds without what lies beyond a random plane; other points are drawn twice."""
    count, points, _ = clouds.shape
    direction = normalize(_randn(generator, count, 3), dim=1)
    height = torch.einsum("bpc,bc->bp", clouds, direction)
    kept = 1.0 - CROP * _rand(generator, count, 1) * (_rand(generator, count, 1) < CROPPED)
    limit = height.sort(dim=1).values.gather(1, (kept * (points - 1)).long())
    drawn = torch.multinomial((height <= limit).float(), points, True, generator=generator)
    return clouds.gather(1, drawn[..., None].expand(-1, -1, 3))


def _rand(generator: torch.Generator, *shape: int) -> Tensor:
    return torch.rand(*shape, generator=generator)


def _randn(generator: torch.Generator, *shape: int) -> Tensor:
    return torch.randn(*shape, generator=generator)
