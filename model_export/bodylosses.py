"""What a body's encoder is trained to: labels of synthetic bodies, and the look of real ones."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import torch
from torch import Tensor

from model_export.bodies import BodyBatch
from service.encode.bodyoutputs import ANCHORS
from service.template.anatomy import JOINTS, PARENTS
from service.template.skinned import SHAPES, SkinnedTemplate
from service.template.skinning import orthonormal, pose_joints, rotation_matrices, skin

EDIT = math.radians(60.0)
"""Largest turn of a joint in the editing branch."""
SURFACE = 400
"""Points of the template's surface that bodies are compared at."""


@dataclass(frozen=True)
class BodyWeights:
    """Weights of the terms; lengths are in the normalised frame.

    Attributes:
        joint: the joints as they are voted for.
        vote: each anchor's votes.
        sem: squared geodesic distance of rotations, in their parents' frames and in space.
        shape: squared error of the shape coefficients.
        scale: squared error of the scale's logarithm.
        rec: distance of the surface, and of the edited surface.
        part: log likelihood of the anchors' parts.
        sim: chamfer distance of real clouds.
    """

    joint: float = 5.0
    vote: float = 1.0
    sem: float = 1.0
    shape: float = 0.1
    scale: float = 2.0
    rec: float = 3.0
    part: float = 0.1
    sim: float = 10.0


@dataclass(frozen=True)
class BodyAnswer:
    """The encoder's outputs, taken apart.

    Attributes:
        votes: ``[B, 24, 3]`` positions of the joints.
        turned: ``[B, 24, 3, 3]`` their rotations in space.
        rotations: ``[B, 24, 3, 3]`` in their parents' frames.
        shape: ``[B, 3]``.
        scale: ``[B]``.
    """

    votes: Tensor
    turned: Tensor
    rotations: Tensor
    shape: Tensor
    scale: Tensor

    @classmethod
    def of(cls, outputs: Tensor) -> BodyAnswer:
        """Take ``[B, OUTPUTS]`` apart."""
        count = len(JOINTS)
        votes = outputs[:, : 3 * count].unflatten(1, (count, 3))
        turned = orthonormal(outputs[:, 3 * count : 9 * count].unflatten(1, (count, 6)))
        parents = turned.index_select(1, parents_on(turned.device)).transpose(2, 3)
        rotations = torch.cat([turned[:, :1], parents @ turned[:, 1:]], dim=1)
        shape = outputs[:, 9 * count : 9 * count + SHAPES]
        return cls(votes, turned, rotations, shape, outputs[:, -1].exp())


class BodyLosses:
    """The terms of the objective (section 4.1; geodesic distance for rotations, section 4.3)."""

    def __init__(
        self, template: SkinnedTemplate, seed: int, device: torch.device | str = "cpu"
    ) -> None:
        """
        Args:
            template: the body.
            seed: of the points on its surface.
            device: of the tensors.
        """
        self.device = torch.device(device)
        generator = torch.Generator(self.device).manual_seed(seed)
        corners = torch.as_tensor(template.faces, device=self.device)
        rest, shapedirs, weights = map(
            self._tensor, (template.rest, template.shapedirs, template.weights)
        )
        sides = rest[corners[:, 1:]] - rest[corners[:, :1]]
        areas = torch.linalg.cross(sides[:, 0], sides[:, 1]).norm(dim=1)
        face = corners[torch.multinomial(areas, SURFACE, True, generator=generator)]
        self.rest, self.shapedirs = rest[face].mean(1), shapedirs[face].mean(1)
        self.weights = weights[face].mean(1)
        self.joints, self.joint_dirs = map(self._tensor, (template.joints, template.joint_dirs))

    def synthetic(
        self, answer: BodyAnswer, batch: BodyBatch, parts: Tensor, votes: Tensor, edits: Tensor
    ) -> dict[str, Tensor]:
        """Terms on labelled bodies.

        Args:
            answer: for them.
            batch: the labels.
            parts: ``[B, ANCHORS, 24]`` log odds.
            votes: ``[B, ANCHORS, 24, 3]`` the anchors'.
            edits: ``[B, 24, 3, 3]`` turns of the joints that the editing branch makes.
        """
        turned, _ = pose_joints(batch.rotations, batch.joints, PARENTS)
        own = answer.rotations, answer.shape, answer.scale, answer.votes[:, 0]
        truth = batch.rotations, batch.shape, batch.scale, batch.joints[:, 0]
        gap = self._with_edits(*own, edits) - self._with_edits(*truth, edits)
        return {
            "joint": (answer.votes - batch.joints).abs().sum(2).mean(),
            "vote": (votes - batch.joints[:, None]).abs().sum(3).mean(),
            "sem": geodesic_squared(answer.rotations, batch.rotations).mean()
            + geodesic_squared(answer.turned, turned).mean(),
            "shape": (answer.shape - batch.shape).square().mean(),
            "scale": (answer.scale / batch.scale).log().square().mean(),
            "part": torch.nn.functional.cross_entropy(
                parts.transpose(1, 2), batch.parts[:, :ANCHORS]
            ),
            "rec": 2.0 * gap.abs().sum(2).mean(),
        }

    def _with_edits(
        self, rotations: Tensor, shape: Tensor, scale: Tensor, pelvis: Tensor, edits: Tensor
    ) -> Tensor:
        """``[2 B, SURFACE, 3]`` points of bodies, and of the same ones edited."""
        return self.surface(
            torch.cat([rotations, rotations @ edits]),
            shape.repeat(2, 1), scale.repeat(2), pelvis.repeat(2, 1),
        )  # fmt: skip

    def similarity(self, answer: BodyAnswer, clouds: Tensor) -> Tensor:
        """Mean distance between real clouds ``[B, n, 3]`` and the bodies, both ways."""
        surface = self.surface(answer.rotations, answer.shape, answer.scale, answer.votes[:, 0])
        distance = torch.cdist(surface, clouds)
        return distance.amin(2).mean() + distance.amin(1).mean()

    def surface(self, rotations: Tensor, shape: Tensor, scale: Tensor, pelvis: Tensor) -> Tensor:
        """``[B, SURFACE, 3]`` points of bodies whose root joint is at ``pelvis [B, 3]``."""
        rest = self.rest + torch.einsum("nck,bk->bnc", self.shapedirs, shape)
        joints = self.joints + torch.einsum("jck,bk->bjc", self.joint_dirs, shape)
        turned, placed = pose_joints(rotations, joints, PARENTS)
        points = skin(rest, self.weights, joints, turned, placed) - joints[:, :1]
        return scale[:, None, None] * points + pelvis[:, None]

    def _tensor(self, array: object) -> Tensor:
        return torch.as_tensor(array, dtype=torch.float32, device=self.device)


def draw_edits(count: int, generator: torch.Generator) -> Tensor:
    """``[count, 24, 3, 3]`` turns of a random third of the joints, the root not among them."""
    size = (count, len(JOINTS), 3)
    vectors = torch.rand(size, generator=generator, device=generator.device) * 2 - 1
    chosen = torch.rand(size[:2], generator=generator, device=generator.device) < 1 / 3
    chosen[:, 0] = False
    return rotation_matrices(EDIT * vectors * chosen[..., None])


@functools.cache
def parents_on(device: torch.device) -> Tensor:
    """``[23]`` the parents of all joints but the root, kept where they are needed."""
    return torch.tensor(PARENTS[1:], device=device)


def geodesic_squared(first: Tensor, second: Tensor) -> Tensor:
    """Squared angle in radians between rotations ``[..., 3, 3]``.

    The angle is 2 asin(|R1 - R2| / (2 sqrt 2)), with the Frobenius norm.
    """
    squared = (first - second).square().sum((-1, -2))
    half = (squared / 8.0 + 1e-12).sqrt().clamp_max(1.0 - 1e-4)
    return (2.0 * torch.asin(half)).square()
