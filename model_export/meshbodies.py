"""Synthetic bodies with all of their vertices, for the mesh encoder."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from model_export.poses import Poses
from service.encode.alignment import align
from service.encode.meshencoder import torso_weights
from service.mesh.surface import RADIUS
from service.template.anatomy import PARENTS
from service.template.skinned import SHAPES, SkinnedTemplate
from service.template.skinning import pose_joints, skin

NOISE, CLOTH = 0.004, 0.015
"""Largest noise of vertices and largest smooth offset from the skin, in metres."""
WAVES = 4


class MeshBodies:
    """Draws bodies with all of their vertices, in the template's order, the torso upright."""

    def __init__(
        self, template: SkinnedTemplate, seed: int, device: torch.device | str = "cpu"
    ) -> None:
        """The same seed draws the same ones, on the same kind of device."""
        self.device = torch.device(device)
        self.generator = torch.Generator(self.device).manual_seed(seed)
        self.poses = Poses(self.generator)
        self.rest, self.shapedirs, self.joints, self.joint_dirs, self.weights = (
            torch.as_tensor(array, dtype=torch.float32, device=self.device)
            for array in (template.rest, template.shapedirs, template.joints,
                          template.joint_dirs, template.weights)
        )  # fmt: skip
        torso = torso_weights(template)
        self.torso = torch.as_tensor(torso, dtype=torch.float32, device=self.device)

    def batch(self, count: int) -> tuple[Tensor, Tensor, Tensor]:
        """``[count, V, 3]`` normalised vertices, ``[count, 24, 3, 3]`` rotations of the joints in
        that space, and ``[count, 3]`` shapes."""
        shape = 1.15 * self._normal(count, SHAPES)
        rest = self.rest + torch.einsum("vck,bk->bvc", self.shapedirs, shape)
        rest = rest + self._offsets(count)
        joints = self.joints + torch.einsum("jck,bk->bjc", self.joint_dirs, shape)
        turned, placed = pose_joints(self.poses.draw(count), joints, PARENTS)
        posed = skin(rest, self.weights, joints, turned, placed)
        noise = self._uniform(count, 1, 1)
        posed = posed + NOISE * noise * self._normal(*posed.shape)
        turn, _, _ = align(posed, self.rest, self.torso)
        upright = posed @ turn.transpose(1, 2)
        away = upright - upright.mean(dim=1, keepdim=True)
        radius = away.norm(dim=2).amax(dim=1)[:, None, None]
        return RADIUS * away / radius, turn[:, None] @ turned, shape

    def _offsets(self, count: int) -> Tensor:
        """``[count, V, 3]`` smooth displacements of the surface."""
        draw = self._normal(count, WAVES, 6)
        phase = 2 * math.pi * self._uniform(count, WAVES, 1)
        waves = torch.sin(8.0 * self.rest @ draw[..., :3].transpose(1, 2) + phase.transpose(1, 2))
        return CLOTH / WAVES * waves @ draw[..., 3:]

    def _normal(self, *size: int) -> Tensor:
        return torch.randn(*size, generator=self.generator, device=self.device)

    def _uniform(self, *size: int) -> Tensor:
        return torch.rand(*size, generator=self.generator, device=self.device)
