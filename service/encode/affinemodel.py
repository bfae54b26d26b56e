"""Models of rigid categories, whose templates are affine in their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.encode.affineoutputs import Encoding
from service.encode.basemodel import Model
from service.encode.estimate import Estimate, estimate
from service.encode.refine import Settings
from service.mesh.surface import Normalization, Samples, Surface, sample_surface
from service.template.affine import AffineTemplate

ROUGH = Settings(iterations=8, rough=0, template_points=600)
"""Enough refinement to tell readings apart; it sees every third sample."""


class AffineModel(Model):
    """A rigid category."""

    kind = "affine"
    turns_freely = False

    def __init__(self, card: Mapping[str, Any], template: AffineTemplate, path: Path, threads: int):
        """As `Model`, with the category's template."""
        super().__init__(card, path, threads)
        self.template = template

    @property
    def label(self) -> str:
        return self.template.label

    @property
    def keeps(self) -> tuple[str, ...]:
        return tuple(self.template.anchors)

    @property
    def outputs(self) -> int:
        return len(self.template.parameters) + 3 + len(self.template.present)

    @property
    def sigma_scale(self) -> NDArray[np.float64]:
        """``[d]`` what a fit's own standard deviations are multiplied by to be honest."""
        scales = self.card.get("calibration", {}).get("sigma_scale", {})
        return np.array([float(scales.get(name, 1.0)) for name in self.template.names])

    def encode(self, points: NDArray[np.floating]) -> Encoding:
        """What the encoder answers for a normalised cloud ``[points, 3]``."""
        return Encoding.of(self.template, self._session.run(points))

    def estimate(
        self, samples: Samples, refined: bool, rough: bool = False, surface: Surface | None = None
    ) -> Estimate:
        return (
            estimate(self, samples, refined, ROUGH, stride=3)
            if rough
            else estimate(self, samples, refined)
        )

    def golden_cloud(self) -> NDArray[np.float32]:
        return golden_cloud(self.template, self.points)

    def entries(self) -> list[dict[str, Any]]:
        template = self.template
        return [
            *(
                _entry(p.name, p.label, p.group, (p.low, p.high), p.typical, False, p.paper)
                for p in template.parameters
                if not p.nuisance
            ),
            *(
                _entry(d.name, d.label, d.group, d.typical, d.typical, True, None)
                for d in template.derived.values()
            ),
        ]


def _entry(
    name: str,
    label: str,
    group: str,
    ends: tuple[float, float],
    typical: tuple[float, float],
    derived: bool,
    paper: str | None,
) -> dict[str, Any]:
    return {
        "name": name,
        "label": label,
        "group": group,
        "unit": "m",
        "kind": "length",
        "range": list(ends),
        "typical": list(typical),
        "step": 0.001 if typical[1] < 0.3 else 0.005,
        "derived": derived,
        "paper_name": paper,
    }


def golden_cloud(template: AffineTemplate, points: int) -> NDArray[np.float32]:
    """A fixed cloud: the template in the middle of its ranges, sampled with a fixed seed."""
    vertices = template.decode((template.low + template.high) / 2)
    cloud = sample_surface(vertices, template.faces, points, np.random.default_rng(0)).points
    return Normalization.of(cloud).apply(cloud).astype(np.float32)
