"""Points on batches of meshes that share their faces, differentiable in the vertices."""

from __future__ import annotations

import torch
from torch import Tensor


def face_areas(vertices: Tensor, faces: Tensor) -> Tensor:
    """``[B, F]`` twice the areas of the faces ``[F, 3]`` of ``vertices [B, V, 3]``."""
    a, b, c = (vertices[:, faces[:, corner]] for corner in range(3))
    return torch.linalg.cross(b - a, c - a).norm(dim=2)


def sample_faces(
    vertices: Tensor,
    faces: Tensor,
    weight: Tensor,
    points: int,
    generator: torch.Generator | None = None,
) -> tuple[Tensor, Tensor]:
    """Draw ``[B, points, 3]`` points on the faces, and ``[B, points]`` which face each is on.

    Args:
        vertices: ``[B, V, 3]``.
        faces: ``[F, 3]``.
        weight: ``[B, F]`` how likely each face is; gradients do not flow through it.
        points: how many.
        generator: source of randomness; torch's own by default.
    """
    count = len(vertices)

    def rand(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator, device=vertices.device)

    with torch.no_grad():
        cumulative = weight.cumsum(dim=1)
        ticks = rand(count, points) * cumulative[:, -1:]
        face = torch.searchsorted(cumulative, ticks).clamp_(max=len(faces) - 1)
    index = face[..., None].expand(-1, -1, 3)
    a, b, c = (vertices[:, faces[:, corner]].gather(1, index) for corner in range(3))
    root, v = rand(count, points, 1).sqrt(), rand(count, points, 1)
    return (1 - root) * a + root * (1 - v) * b + root * v * c, face
