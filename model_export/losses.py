"""The training losses of section 4.1, each a mean over its batch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

from model_export.sampling import face_areas, sample_faces
from model_export.synthetic import Batch, present_parts
from service.encode.model import STEEPNESS
from service.mesh.surface import RADIUS
from service.template.affine import AffineTemplate

EDITS = ("multiply", "set", "cycle")
"""What the editing branch compares, see `Losses.branch`."""
NORMS = ("l2", "l1")
"""Of the semantic loss: the mean of squares, or of absolute values."""


@dataclass(frozen=True)
class Weights:
    """Weights of the terms; the defaults are the paper's for chairs.

    Attributes:
        alpha: of the semantic loss and its editing twin.
        beta: of the reconstruction loss and its editing twin.
        gamma: of the similarity loss on real shapes.
        delta: of telling the template's variants apart, which the paper has none of.
    """

    alpha: float = 0.3
    beta: float = 30.0
    gamma: float = 50.0
    delta: float = 0.1


class Losses:
    """L_sem, L_rec, their editing-branch twins and L_sim for an affine template.

    Sums over points in the paper's formulas are means here: only so do its weights balance.
    """

    def __init__(
        self,
        template: AffineTemplate,
        spread: Tensor,
        device: torch.device | str = "cpu",
        *,
        edit: str = "multiply",
        norm: str = "l2",
    ) -> None:
        """
        Args:
            template: decodes parameters.
            spread: ``[d + 3]`` standard deviations of the labels; L_sem is measured in them.
            device: where the arrays live.
            edit: of `EDITS`.
            norm: of `NORMS`.
        """
        self.law, self.norm = edit, norm
        self.size = len(template.parameters)
        self.spread = spread[: self.size + 3]
        self.jacobian = torch.as_tensor(template.jacobian, dtype=torch.float32, device=device)
        faces = template.faces[~template.hidden]
        self.faces = torch.as_tensor(faces, device=device)
        present = present_parts(template)
        self.face_present = torch.as_tensor(present[:, template.part[faces[:, 0]]], device=device)
        self.present = torch.as_tensor(
            present[:, template.part], dtype=torch.float32, device=device
        )
        active = [[*variant.active, True, True, True] for variant in template.variants]
        self.active = torch.tensor(active, dtype=torch.float32, device=device)

    def decode(self, outputs: Tensor) -> Tensor:
        """``[B, d + 3 ...]`` to template vertices ``[B, V, 3]``."""
        parameters, translation = outputs[:, : self.size], outputs[:, self.size : self.size + 3]
        return torch.einsum("vcd,bd->bvc", self.jacobian, parameters) + translation[:, None]

    def semantic(self, predicted: Tensor, true: Tensor, variant: Tensor) -> Tensor:
        """L_sem: mean square over parameters and translation, in standard deviations.

        Parameters that are idle in a shape's variant don't count.  With the norm ``l1`` the mean
        absolute value.
        """
        active = self.active[variant]
        gap = (predicted[:, : self.size + 3] - true) / self.spread
        cost = gap.square() if self.norm == "l2" else gap.abs()
        return (active * cost).sum() / active.sum()

    def reconstruction(self, predicted: Tensor, true: Tensor, variant: Tensor) -> Tensor:
        """L_rec: mean squared distance between corresponding vertices of the variants' parts."""
        present = self.present[variant]
        gap = (self.decode(predicted) - self.decode(true)).square().sum(dim=2)
        return ((present * gap).sum(dim=1) / present.sum(dim=1)).mean()

    def synthetic(
        self,
        predicted: Tensor,
        batch: Batch,
        factors: Tensor | None,
        encode: Callable[[Tensor], Tensor] | None = None,
    ) -> dict[str, Tensor]:
        """All supervised terms.

        Args:
            predicted: ``[B, d + 3 (+ K)]`` outputs.
            batch: the labels.
            factors: ``[B, d]`` the editing branch's target edit, or None without that branch.
            encode: ``[B, n, 3]`` clouds to outputs, for the edits that are encoded again.
        """
        true, variant = batch.labels, batch.variant
        terms = {
            "sem": self.semantic(predicted, true, variant),
            "rec": self.reconstruction(predicted, true, variant),
        }
        if factors is not None:
            edited, target = self.branch(predicted, batch, factors, encode)
            terms["sem_edit"] = self.semantic(edited, target, variant)
            terms["rec_edit"] = self.reconstruction(edited, target, variant)
        if len(self.present) > 1:
            terms["variant"] = functional.cross_entropy(self._odds(predicted), variant)
        return terms

    def _odds(self, predicted: Tensor) -> Tensor:
        """``[B, K]`` log odds of the variants."""
        return predicted[:, self.size + 3 :]

    def edit(self, outputs: Tensor, factors: Tensor) -> Tensor:
        """Parameters times their factors, translation kept."""
        return torch.cat([outputs[:, : self.size] * factors, outputs[:, self.size :]], dim=1)

    def branch(
        self,
        predicted: Tensor,
        batch: Batch,
        factors: Tensor,
        encode: Callable[[Tensor], Tensor] | None,
    ) -> tuple[Tensor, Tensor]:
        """What the editing branch compares: edited outputs, and what they should be.

        ``multiply``: both times the same factors.  ``set``: what the edit changes is set to the
        true edited value, so that only the other parameters can be off.  ``cycle``: the edited
        prediction is decoded, sampled and encoded again, and should be told as the truth edited.
        """
        edited, target = self.edit(predicted, factors), self.edit(batch.labels, factors)
        if self.law == "multiply":
            return edited, target
        if self.law == "set":
            kept = functional.pad(factors == 1.0, (0, edited.shape[1] - self.size), value=True)
            own = torch.cat([target, edited[:, self.size + 3 :]], dim=1)
            return torch.where(kept, edited, own), target
        assert encode is not None
        vertices = self.decode(edited)
        weight = face_areas(vertices, self.faces).detach() * self.face_present[batch.variant]
        points = sample_faces(vertices, self.faces, weight, batch.points.shape[1])[0]
        center = points.mean(dim=1, keepdim=True)
        scale = RADIUS / (points - center).norm(dim=2).amax(dim=1)
        moved = target[:, self.size :] - center[:, 0]
        target = torch.cat([target[:, : self.size], moved], dim=1) * scale[:, None]
        return encode((points - center) * scale[:, None, None]), target.detach()

    def similarity(self, predicted: Tensor, clouds: Tensor, points: int = 768) -> Tensor:
        """L_sim: two-way squared chamfer distance between samples of template and cloud.

        Of the variants the one that counts is likely and fits, as when a model answers.

        Args:
            predicted: ``[B, d + 3 (+ K)]`` outputs for real shapes.
            clouds: ``[B, n, 3]`` the shapes.
            points: samples of each: of the clouds (in random order) the first so many, on the
                template's visible faces by their present areas.
        """
        clouds = clouds[:, :points]
        samples, has = self._sample(self.decode(predicted), points)
        with torch.no_grad():
            distance = torch.cdist(samples, clouds).square()
            least, to_cloud = distance.min(dim=2)
            share = has.float() / has.sum(dim=2, keepdim=True).clamp_min(1)
            there = torch.einsum("bks,bs->bk", share, least)
            back, to_template = zip(
                *(_nearest(distance, own) for own in has.unbind(1)), strict=True
            )
            cost = there + torch.stack([b.mean(dim=1) for b in back], dim=1)
            likely = torch.log_softmax(self._odds(predicted), dim=1) if len(back) > 1 else 0.0
            # A distance to the fourth power is its square's to the second.
            chosen = (likely - 0.5 * STEEPNESS * torch.log(cost + 1e-12)).argmax(dim=1)
            rows = torch.arange(len(clouds), device=clouds.device)
            to_template = torch.stack(to_template, dim=1)[rows, chosen]
            share = share[rows, chosen]
        out = samples - clouds.gather(1, to_cloud[..., None].expand(-1, -1, 3))
        home = clouds - samples.gather(1, to_template[..., None].expand(-1, -1, 3))
        return (share * out.square().sum(dim=2)).sum(dim=1).mean() + home.square().sum(2).mean()

    def _sample(self, vertices: Tensor, points: int) -> tuple[Tensor, Tensor]:
        """Samples ``[B, n, 3]`` of the faces of all parts, and which variants have them,
        ``[B, K, n]``."""
        weight = face_areas(vertices, self.faces).detach()
        samples, face = sample_faces(vertices, self.faces, weight, points)
        return samples, self.face_present[:, face].transpose(0, 1)


def _nearest(distance: Tensor, has: Tensor) -> tuple[Tensor, Tensor]:
    """Least of ``distance [B, n, m]`` over the samples that a variant ``has [B, n]``, and whose."""
    least, index = distance.masked_fill(~has[..., None], torch.inf).min(dim=1)
    return least, index


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
    """The overall objective: alpha (sem + sem') + beta (rec + rec') + gamma sim + delta variant."""
    factor = {
        "sem": weights.alpha,
        "sem_edit": weights.alpha,
        "rec": weights.beta,
        "rec_edit": weights.beta,
        "sim": weights.gamma,
        "variant": weights.delta,
    }
    return torch.stack([factor[name] * value for name, value in terms.items()]).sum()
