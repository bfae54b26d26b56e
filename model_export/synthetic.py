"""Labelled synthetic shapes, drawn from a template's ranges on the fly (section 4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from model_export.sampling import face_areas, sample_faces
from service.mesh.surface import RADIUS
from service.template.affine import AffineTemplate


@dataclass(frozen=True)
class Augmentation:
    """How synthetic clouds are made to look like uploads; 0 turns each off.

    Attributes:
        noise: largest standard deviation of a shape's point noise, as a share of the radius.
        drop_part: chance that a part is missing.
        uneven: standard deviation of the log of a part's sampling density.
        hidden: chance that a shape's hidden faces are sampled too.
        clutter: largest share of points moved onto bars and slabs that the template lacks.
    """

    noise: float = 0.01
    drop_part: float = 0.02
    uneven: float = 0.4
    hidden: float = 0.5
    clutter: float = 0.0

    @classmethod
    def none(cls) -> Augmentation:
        """Clean, evenly sampled surfaces as seen from outside."""
        return cls(noise=0.0, drop_part=0.0, uneven=0.0, hidden=0.0, clutter=0.0)


@dataclass(frozen=True)
class Batch:
    """Normalised clouds with their labels in the same frame.

    Attributes:
        points: ``[B, n, 3]``.
        parameters: ``[B, d]``, lengths times the shape's normalising scale.
        translation: ``[B, 3]`` position of the template's origin.
        variant: ``[B]`` int64, of the template's variants; 0 where it has none.
    """

    points: Tensor
    parameters: Tensor
    translation: Tensor
    variant: Tensor

    @property
    def labels(self) -> Tensor:
        """``[B, d + 3]`` parameters and translation."""
        return torch.cat([self.parameters, self.translation], dim=1)

    @property
    def columns(self) -> tuple[Tensor, ...]:
        """The tensors, in the order that makes a batch of them again."""
        return self.points, self.parameters, self.translation, self.variant

    def rows(self, rows: slice) -> Batch:
        """Some of the shapes."""
        return Batch(*(column[rows] for column in self.columns))


class SyntheticShapes:
    """Draws from the uniform box of a template's ranges; same seed, same shapes."""

    def __init__(
        self,
        template: AffineTemplate,
        augmentation: Augmentation,
        seed: int,
        log_share: float = 0.0,
        device: torch.device | str = "cpu",
    ) -> None:
        """
        Args:
            template: the category.
            augmentation: how far clouds depart from clean samples.
            seed: of every draw.
            log_share: share of shapes drawn evenly in the logarithm, where thin parts abound.
            device: where the arrays live.
        """
        self.template = template
        self.augmentation = augmentation
        self.log_share = log_share
        self.device = torch.device(device)
        self.rng = np.random.default_rng(seed)
        self.generator = torch.Generator(self.device).manual_seed(seed)
        self.jacobian = torch.as_tensor(template.jacobian, dtype=torch.float32, device=device)
        self.faces = torch.as_tensor(template.faces, device=device)
        self.face_part = torch.as_tensor(template.part[template.faces[:, 0]], device=device)
        self.hidden = torch.as_tensor(template.hidden, device=device)
        self.present = torch.as_tensor(present_parts(template), device=device)

    def reseed(self, seed: int) -> None:
        """Draw from a seed on, like one that was made with it."""
        self.rng = np.random.default_rng(seed)
        self.generator.manual_seed(seed)

    def draw_parameters(self, count: int) -> np.ndarray:
        """``[count, d]`` parameters in metres that keep the template's relations."""
        low, high, signed = self.template.low, self.template.high, self.template.signed
        floor = np.where(signed, high, low)
        kept: list[np.ndarray] = []
        missing = count
        while missing > 0:
            uniform = self.rng.random((2 * missing, len(low)))
            linear = low + uniform * (high - low)
            # Signed offsets have no logarithm and stay even.
            logarithmic = np.where(signed, linear, floor * (high / floor) ** uniform)
            use_log = self.rng.random((2 * missing, 1)) < self.log_share
            f = np.where(use_log, logarithmic, linear)
            relations = self.template.relations
            valid = (f @ relations[:, 1:].T + relations[:, 0] >= 0).all(axis=1)
            kept.append(f[valid][:missing])
            missing -= len(kept[-1])
        return np.concatenate(kept)

    def batch(self, count: int, points: int) -> Batch:
        """Fresh clouds of ``points`` points with their labels."""
        f = torch.as_tensor(self.draw_parameters(count), dtype=torch.float32, device=self.device)
        return self.sample(f, self.draw_variants(count), points)

    def draw_variants(self, count: int) -> Tensor:
        """``[count]`` variants, each as often as the others."""
        size = (count,)
        return torch.randint(len(self.present), size, generator=self.generator, device=self.device)

    def sample(self, f: Tensor, variant: Tensor, points: int) -> Batch:
        """Clouds of the shapes with parameters ``f [B, d]`` and variants ``[B]``."""
        cloud = self._sample_points(self._decode(f), self.present[variant], points)
        cloud = self._clutter(cloud)
        cloud = self._noise(cloud)
        center = cloud.mean(dim=1, keepdim=True)
        cloud = cloud - center
        scale = RADIUS / cloud.norm(dim=2).amax(dim=1)
        return Batch(
            points=cloud * scale[:, None, None],
            parameters=f * scale[:, None],
            translation=-center[:, 0] * scale[:, None],
            variant=variant,
        )

    def _decode(self, f: Tensor) -> Tensor:
        return torch.einsum("vcd,bd->bvc", self.jacobian, f)

    def _rand(self, *shape: int) -> Tensor:
        return torch.rand(*shape, generator=self.generator, device=self.device)

    def _randn(self, *shape: int) -> Tensor:
        return torch.randn(*shape, generator=self.generator, device=self.device)

    def _density(self, present: Tensor) -> Tensor:
        """``[B, F]`` relative sampling density of the faces, for parts ``present [B, P]``."""
        count, parts = present.shape
        settings = self.augmentation
        part = torch.exp(settings.uneven * self._randn(count, parts))
        part = part * (self._rand(count, parts) >= settings.drop_part)
        part = (part + 1e-6) * present
        density = part[:, self.face_part]
        closed = self._rand(count, 1) >= settings.hidden
        return torch.where(self.hidden & closed, 0.0, density)

    def _sample_points(self, vertices: Tensor, present: Tensor, points: int) -> Tensor:
        weight = face_areas(vertices, self.faces) * self._density(present)
        return sample_faces(vertices, self.faces, weight, points, self.generator)[0]

    def _clutter(self, cloud: Tensor) -> Tensor:
        """Move a share of points onto a few random boxes inside the cloud's bounding box.

        They stand for what real shapes have and the template lacks (arms, stretchers, rails).
        """
        if self.augmentation.clutter == 0.0:
            return cloud
        count, points, _ = cloud.shape
        low, high = cloud.amin(dim=1), cloud.amax(dim=1)
        boxes = 3
        extent = (high - low)[:, None]
        size = extent * self._rand(count, boxes, 3) ** 3 * 0.9
        center = low[:, None] + size / 2 + self._rand(count, boxes, 3) * (extent - size)
        mirrored = center * torch.tensor([-1.0, 1.0, 1.0], device=self.device)
        center, size = torch.cat([center, mirrored], 1), torch.cat([size, size], 1)
        which = (self._rand(count, points) * 2 * boxes).long()[..., None].expand(-1, -1, 3)
        local = self._rand(count, points, 3) - 0.5
        axis = (self._rand(count, points, 1) * 3).long()
        local = local.scatter(2, axis, local.gather(2, axis).sign() * 0.5)
        on_box = center.gather(1, which) + local * size.gather(1, which)
        share = self.augmentation.clutter * self._rand(count, 1)
        share = share * (self._rand(count, 1) < 0.5)
        return torch.where((self._rand(count, points) < share)[..., None], on_box, cloud)

    def _noise(self, cloud: Tensor) -> Tensor:
        if self.augmentation.noise == 0.0:
            return cloud
        radius = (cloud - cloud.mean(1, keepdim=True)).norm(dim=2).amax(1)[:, None, None]
        level = self.augmentation.noise * self._rand(len(cloud), 1, 1) ** 2
        return cloud + level * radius * self._randn(*cloud.shape)


def present_parts(template: AffineTemplate) -> np.ndarray:
    """``[K, P]`` bool, the parts of each variant; all of them where there are none."""
    if not template.present:
        return np.ones((1, len(template.parts)), bool)
    return np.stack(list(template.present.values()))
