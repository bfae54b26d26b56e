"""The training losses of section 4.1, each a mean over its batch."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from model_export.sampling import face_areas, sample_faces
from model_export.synthetic import Batch
from service.template.affine import AffineTemplate


@dataclass(frozen=True)
class Weights:
    """Weights of the terms; the defaults are the paper's for chairs.

    Attributes:
        alpha: of the semantic loss and its editing twin.
        beta: of the reconstruction loss and its editing twin.
        gamma: of the similarity loss on real shapes.
    """

    alpha: float = 0.3
    beta: float = 30.0
    gamma: float = 50.0


class Losses:
    """L_sem, L_rec, their editing-branch twins and L_sim for an affine template.

    Sums over points in the paper's formulas are means here: only so do its weights balance.
    """

    def __init__(
        self, template: AffineTemplate, spread: Tensor, device: torch.device | str = "cpu"
    ) -> None:
        """
        Args:
            template: decodes parameters.
            spread: ``[d + 3]`` standard deviations of the labels; L_sem is measured in them.
            device: where the arrays live.
        """
        self.size = len(template.parameters)
        self.spread = spread
        self.jacobian = torch.as_tensor(template.jacobian, dtype=torch.float32, device=device)
        visible = torch.as_tensor(template.faces[~template.hidden], device=device)
        self.faces = visible

    def decode(self, outputs: Tensor) -> Tensor:
        """``[B, d + 3]`` to template vertices ``[B, V, 3]``."""
        parameters, translation = outputs[:, : self.size], outputs[:, self.size :]
        return torch.einsum("vcd,bd->bvc", self.jacobian, parameters) + translation[:, None]

    def semantic(self, predicted: Tensor, true: Tensor) -> Tensor:
        """L_sem: mean square over parameters and translation, in standard deviations."""
        return ((predicted - true) / self.spread).square().mean()

    def reconstruction(self, predicted: Tensor, true: Tensor) -> Tensor:
        """L_rec: mean squared distance between corresponding template vertices."""
        return (self.decode(predicted) - self.decode(true)).square().sum(dim=2).mean()

    def synthetic(
        self, predicted: Tensor, batch: Batch, factors: Tensor | None
    ) -> dict[str, Tensor]:
        """All supervised terms.

        Args:
            predicted: ``[B, d + 3]`` outputs.
            batch: the labels.
            factors: ``[B, d]`` the editing branch's target edit, or None without that branch.
        """
        true = torch.cat([batch.parameters, batch.translation], dim=1)
        terms = {
            "sem": self.semantic(predicted, true),
            "rec": self.reconstruction(predicted, true),
        }
        if factors is not None:
            edited, target = self.edit(predicted, factors), self.edit(true, factors)
            terms["sem_edit"] = self.semantic(edited, target)
            terms["rec_edit"] = self.reconstruction(edited, target)
        return terms

    def edit(self, outputs: Tensor, factors: Tensor) -> Tensor:
        """Parameters times their factors, translation kept."""
        return torch.cat([outputs[:, : self.size] * factors, outputs[:, self.size :]], dim=1)

    def similarity(self, predicted: Tensor, clouds: Tensor, points: int = 768) -> Tensor:
        """L_sim: two-way squared chamfer distance between samples of template and cloud.

        Args:
            predicted: ``[B, d + 3]`` outputs for real shapes.
            clouds: ``[B, n, 3]`` the shapes.
            points: samples of each: of the clouds (in random order) the first so many, on the
                template's visible faces by their present areas.
        """
        clouds = clouds[:, :points]
        samples = self._sample(self.decode(predicted), points)
        with torch.no_grad():
            distance = torch.cdist(samples, clouds)
            to_cloud, to_template = distance.argmin(dim=2), distance.argmin(dim=1)
        there = samples - clouds.gather(1, to_cloud[..., None].expand(-1, -1, 3))
        back = clouds - samples.gather(1, to_template[..., None].expand(-1, -1, 3))
        return there.square().sum(dim=2).mean() + back.square().sum(dim=2).mean()

    def _sample(self, vertices: Tensor, points: int) -> Tensor:
        weight = face_areas(vertices, self.faces).detach()
        return sample_faces(vertices, self.faces, weight, points)


def draw_edit(
    count: int, size: int, generator: torch.Generator, device: torch.device | str
) -> Tensor:
    """``[count, size]`` factors of random edits: log-uniform in [0.6, 1.67] on a random subset.

    Multiplicative on purpose: for an affine decoder an additive edit leaves both losses as they
    are without an edit.
    """
    bound = 0.5 * float(torch.log(torch.tensor(1.67 / 0.6)))
    log = (2 * torch.rand(count, size, generator=generator, device=device) - 1) * bound
    chosen = torch.rand(count, size, generator=generator, device=device) < 0.5
    sure = torch.randint(size, (count, 1), generator=generator, device=device)
    chosen.scatter_(1, sure, True)
    return torch.exp(torch.where(chosen, log, 0.0))


def total(terms: dict[str, Tensor], weights: Weights) -> Tensor:
    """The overall objective: alpha (sem + sem') + beta (rec + rec') + gamma sim."""
    factor = {
        "sem": weights.alpha,
        "sem_edit": weights.alpha,
        "rec": weights.beta,
        "rec_edit": weights.beta,
        "sim": weights.gamma,
    }
    return torch.stack([factor[name] * value for name, value in terms.items()]).sum()
