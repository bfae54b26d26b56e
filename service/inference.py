"""What was inferred of an upload, and the way between its frame and the normalised one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform.dimensions import Dimensions
from service.encode.model import Model
from service.encode.recognition import Candidate
from service.mesh.meshfile import MeshFile
from service.requests import UNITS, Upload

Array = NDArray[np.float64]

CLOSE_CALL = 1.1
"""Two orientations whose fits are within this factor of each other are a close call."""
PLAUSIBLE = (0.1, 100.0)
"""Sizes in metres outside of which a unit must be wrong."""


@dataclass(frozen=True)
class Inference:
    """An upload's parameters, and the way between its frame and the normalised one.

    Attributes:
        upload, mesh: the file, as bytes and read.
        candidates: readings of it, best first.
        unit: that lengths are reported in.
        unit_scale: reported units per unit of the file.
    """

    upload: Upload
    mesh: MeshFile
    candidates: list[Candidate]
    unit: str
    unit_scale: float

    @property
    def best(self) -> Candidate:
        """The reading that counts."""
        return self.candidates[0]

    @property
    def model(self) -> Model:
        """Its category."""
        return self.best.model

    @property
    def scale(self) -> float:
        """Normalised length per reported length."""
        return self.best.estimate.normalization.scale / self.unit_scale

    @cached_property
    def vertices(self) -> Array:
        """``[V, 3]`` of the mesh in the normalised canonical frame."""
        canonical = self.best.orientation.to_canonical(self.mesh.vertices)
        return self.best.estimate.normalization.apply(canonical)

    @property
    def parameters(self) -> Array:
        """``[d]`` in the reported unit."""
        return self.best.estimate.parameters / self.scale

    def dimensions(self, jacobian: NDArray[np.floating] | None = None) -> Dimensions:
        """The mesh's dimensions in the reported unit; with a Jacobian, as they can be changed."""
        return Dimensions(self.model.template, self.parameters, self.vertices, self.scale, jacobian)

    def describe_model(self) -> dict[str, str]:
        """Which model it was."""
        model = self.model
        return {"name": model.name, "version": model.version, "digest": model.digest}

    def report(self) -> dict[str, Any]:
        """The answer to `POST /infer`."""
        best, fit = self.best, self.best.estimate
        named = zip(self.model.template.names, self.parameters, fit.sigma / self.scale, strict=True)
        derived = self.dimensions().derived(self.parameters)
        score = self.model.score(fit.distance)
        return {
            "mesh_id": self.upload.mesh_id,
            "category": self.model.name,
            "parameters": {
                name: {"value": float(value), "sigma": float(sigma), "unit": self.unit}
                for name, value, sigma in named
            },
            "derived": {n: {"value": v, "unit": self.unit} for n, v in derived.items()},
            "frame": {
                "up": best.orientation.up,
                "front": best.orientation.front,
                "scale": fit.normalization.scale,
                "center": (fit.normalization.center @ best.orientation.rotation).tolist(),
            },
            "fit": {
                "distance": fit.distance,
                "encoder_distance": fit.encoder_distance,
                "in_distribution": score >= 0.5,
                "score": score,
                "candidates": [
                    {
                        "category": candidate.model.name,
                        "up": candidate.orientation.up,
                        "front": candidate.orientation.front,
                        "distance": candidate.estimate.distance,
                    }
                    for candidate in self.candidates
                ],
            },
            "model": self.describe_model(),
            "warnings": self.warnings,
        }

    @cached_property
    def warnings(self) -> list[str]:
        """What the client should know."""
        warnings = []
        ranks = [candidate.rank for candidate in self.candidates if candidate.model is self.model]
        if len(ranks) > 1 and ranks[1] < CLOSE_CALL * ranks[0]:
            other = self.candidates[1].orientation
            warnings.append(
                f"orientation is a close call: up={other.up}, front={other.front} fits nearly "
                "as well; say up and front to be sure"
            )
        if self.model.score(self.best.estimate.distance) < 0.5:
            warnings.append(
                f"this does not look like a {self.model.name}; its parameters may mean little"
            )
        size = float(np.ptp(self.mesh.vertices, axis=0).max()) * self.unit_scale * UNITS[self.unit]
        if not PLAUSIBLE[0] < size < PLAUSIBLE[1]:
            warnings.append(
                f"the mesh is {size:.3g} m long if its unit is {self.unit}; "
                "say units to correct that"
            )
        return warnings
