"""Labelled synthetic bodies: random pose, shape, build and clothes, seen as point clouds."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from model_export.poses import Poses
from service.mesh.surface import RADIUS
from service.template.anatomy import JOINTS, PARENTS
from service.template.skinned import SHAPES, SkinnedTemplate
from service.template.skinning import blend, pose_joints, rotation_matrices

TILT = math.radians(65.0)
"""Of 24 axis-aligned orientations one is always within 63 degrees of the right one."""


@dataclass(frozen=True)
class Garments:
    """How synthetic bodies are made to look like people who come dressed; 0 turns each off.

    Attributes:
        cloth: largest mean distance of clothes from the skin, in metres.
        hair: largest of hair from the head.
        build: standard deviation of the log of each bone's length, for all that three shape
            coefficients can't say.
        noise: largest standard deviation of point noise, in metres.
        holes: share of clouds with holes.
        partial: share that is seen from one side only.
        tilt: share that is turned any way; the rest nearly face the front.
        turn: largest angle of those, in radians.
    """

    cloth: float = 0.03
    hair: float = 0.10
    build: float = 0.06
    noise: float = 0.008
    holes: float = 0.3
    partial: float = 0.1
    tilt: float = 0.5
    turn: float = TILT

    @classmethod
    def none(cls) -> Garments:
        """Naked, whole, nearly facing the front."""
        return cls(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


WAVES = 6
"""Random waves that make up the folds of a garment."""


@dataclass(frozen=True)
class BodyBatch:
    """Bodies and their labels, in the normalised frame.

    Attributes:
        points: ``[B, n, 3]``.
        normals: ``[B, n, 3]`` of the skin below them.
        parts: ``[B, n]`` the joint that moves each point most.
        joints: ``[B, 24, 3]``.
        rotations: ``[B, 24, 3, 3]`` in the parents' frames; the first is the global orientation.
        shape: ``[B, 3]``.
        scale: ``[B]`` normalised length of a metre of the template.
        translation: ``[B, 3]`` of the template's origin.
    """

    points: Tensor
    normals: Tensor
    parts: Tensor
    joints: Tensor
    rotations: Tensor
    shape: Tensor
    scale: Tensor
    translation: Tensor

    @property
    def columns(self) -> list[Tensor]:
        """The tensors, in the order that makes a batch of them again."""
        return [getattr(self, field.name) for field in fields(self)]

    def rows(self, rows: slice) -> BodyBatch:
        """Some of the bodies."""
        return BodyBatch(*(column[rows] for column in self.columns))


class SyntheticBodies:
    """Draws batches of bodies; the same seed draws the same ones."""

    def __init__(
        self,
        template: SkinnedTemplate,
        garments: Garments,
        seed: int,
        device: torch.device | str = "cpu",
    ) -> None:
        """
        Args:
            template: the body.
            garments: what it wears.
            seed: of everything random.
            device: to draw on.
        """
        self.garments = garments
        self.device = torch.device(device)
        self.generator = torch.Generator(self.device).manual_seed(seed)
        self.poses = Poses(self.generator)
        self.rest, self.shapedirs = self._tensor(template.rest), self._tensor(template.shapedirs)
        self.joints, self.joint_dirs = map(self._tensor, (template.joints, template.joint_dirs))
        self.weights = self._tensor(template.weights)
        self.faces = torch.as_tensor(template.faces, device=self.device)
        corners = self.rest[self.faces]
        cross = torch.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], dim=1)
        self.areas = cross.norm(dim=1)
        self.normals = torch.nn.functional.normalize(cross, dim=1)

    def batch(self, count: int, points: int) -> BodyBatch:
        """``count`` bodies of ``points`` points each."""
        rotations = self.poses.draw(count)
        rotations[:, 0] = self.orientations(count)
        shape = self._normal(count, SHAPES) * 1.15
        face, barycentric = self._draw_faces(count, points)
        corner = self.faces[face]
        rest = (barycentric[..., None] * self.rest[corner]).sum(2)
        directions = (barycentric[..., None, None] * self.shapedirs[corner]).sum(2)
        weights = (barycentric[..., None] * self.weights[corner]).sum(2)
        rest = rest + torch.einsum("bnck,bk->bnc", directions, shape)
        joints = self.joints + torch.einsum("jck,bk->bjc", self.joint_dirs, shape)
        longer = self._build(joints)
        rest, joints = rest + weights @ longer, joints + longer
        normals = self.normals[face]
        rest = rest + normals * self._clothes(rest, normals, weights, face)[..., None]
        turned, placed = pose_joints(rotations, joints, PARENTS)
        maps, shifts = blend(weights, joints, turned, placed)
        posed = (maps @ rest[..., None])[..., 0] + shifts
        facing = (maps @ normals[..., None])[..., 0]
        posed, order = self._scanned(posed, facing)
        center = posed.mean(dim=1, keepdim=True)
        scale = RADIUS / (posed - center).norm(dim=2).amax(dim=1)
        factor = scale[:, None, None]
        translation = -center[:, 0] * scale[:, None]
        normalised = (posed - center) * factor
        return BodyBatch(
            points=normalised,
            normals=facing.gather(1, order[..., None].expand(-1, -1, 3)),
            parts=weights.argmax(dim=2).gather(1, order),
            joints=(placed - center) * factor,
            rotations=rotations,
            shape=shape,
            scale=scale,
            translation=translation,
        )

    def orientations(self, count: int) -> Tensor:
        """``[count, 3, 3]`` random global orientations."""
        axis = torch.nn.functional.normalize(self._normal(count, 3), dim=1)
        any_way = axis * (self.garments.turn * self._uniform(count, 1) ** 0.5)
        slight = self._normal(count, 3) * torch.tensor([0.06, 0.2, 0.06], device=self.device)
        tilted = self._uniform(count, 1) < self.garments.tilt
        return rotation_matrices(torch.where(tilted, any_way, slight))

    def _draw_faces(self, count: int, points: int) -> tuple[Tensor, Tensor]:
        """``[B, n]`` faces by area, unevenly dense from body to body, and barycentric weights."""
        loose = torch.exp(0.25 * self._normal(count, len(JOINTS)))
        dominant = self.weights[self.faces[:, 0]].argmax(dim=1)
        face = torch.multinomial(
            self.areas * loose[:, dominant], points, replacement=True, generator=self.generator
        )
        root = self._uniform(count, points).sqrt()
        v = self._uniform(count, points)
        return face, torch.stack([1 - root, root * (1 - v), root * v], dim=-1)

    def _build(self, joints: Tensor) -> Tensor:
        """``[B, 24, 3]`` how far bones of other lengths shift each joint; both sides alike."""
        count = len(joints)
        log = self.garments.build * self._normal(count, len(JOINTS))
        for index, name in enumerate(JOINTS):
            if name.startswith("right_"):
                log[:, index] = log[:, JOINTS.index(name.replace("right_", "left_"))]
        shifts = [torch.zeros(count, 3, device=self.device)]
        for joint in range(1, len(JOINTS)):
            bone = joints[:, joint] - joints[:, PARENTS[joint]]
            shifts.append(shifts[PARENTS[joint]] + bone * (torch.exp(log[:, joint]) - 1)[:, None])
        return torch.stack(shifts, dim=1)

    def _clothes(self, rest: Tensor, normals: Tensor, weights: Tensor, face: Tensor) -> Tensor:
        """``[B, n]`` how far clothes and hair stand off the skin, in metres."""
        count = len(rest)
        garments = self.garments
        # Each limb is looser or tighter; hands and the face are bare.
        loose = garments.cloth * self._uniform(count, len(JOINTS)) ** 2
        bare = [index for index, name in enumerate(JOINTS) if name.endswith(("hand", "head"))]
        loose[:, bare] *= 0.15
        offset = (weights @ loose[..., None])[..., 0]
        wave = self._normal(count, WAVES, 3) * 12.0
        phase = self._uniform(count, WAVES) * (2 * math.pi)
        folds = torch.sin(rest @ wave.transpose(1, 2) + phase[:, None]).mean(dim=2)
        offset = offset * (1.0 + 1.2 * folds)
        head = weights[..., JOINTS.index("head")]
        hairy = torch.clamp(normals @ torch.tensor([0.0, 0.7, -0.7], device=self.device), 0.0, 1.0)
        length = garments.hair * self._uniform(count, 1) ** 2
        return offset + length * head * hairy * (1.0 + folds)

    def _scanned(self, points: Tensor, facing: Tensor) -> tuple[Tensor, Tensor]:
        """Clouds with noise, holes and unseen sides, and ``[B, n]`` which point each of theirs was:
        lost ones are replaced by others."""
        count, n = points.shape[:2]
        garments = self.garments
        kept = torch.ones(count, n, dtype=torch.bool, device=self.device)
        if garments.partial:
            view = torch.nn.functional.normalize(self._normal(count, 3), dim=1)
            away = torch.einsum("bnc,bc->bn", facing, view) < -0.1
            one_sided = self._uniform(count, 1) < garments.partial
            kept &= ~(away & one_sided)
        if garments.holes:
            for _ in range(3):
                index = torch.randint(n, (count,), generator=self.generator, device=self.device)
                center = points[torch.arange(count, device=self.device), index]
                radius = 0.15 * self._uniform(count, 1)
                torn = (points - center[:, None]).norm(dim=2) < radius
                kept &= ~(torn & (self._uniform(count, 1) < garments.holes))
        share = kept.float() + 1e-6
        chosen = torch.multinomial(share, n, replacement=True, generator=self.generator)
        order = torch.where(kept, torch.arange(n, device=self.device), chosen)
        points = points.gather(1, order[..., None].expand(-1, -1, 3))
        sigma = garments.noise * self._uniform(count, 1, 1) ** 2
        return points + sigma * self._normal(*points.shape), order

    def _tensor(self, array: object) -> Tensor:
        return torch.as_tensor(array, dtype=torch.float32, device=self.device)

    def _normal(self, *size: int) -> Tensor:
        return torch.randn(*size, generator=self.generator, device=self.device)

    def _uniform(self, *size: int) -> Tensor:
        return torch.rand(*size, generator=self.generator, device=self.device)
