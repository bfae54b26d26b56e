"""What was inferred of an upload, and the way between its frame and the normalised one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform.turning import Turning
from service.encode.basemodel import Model
from service.encode.recognition import Candidate
from service.mesh.meshfile import MeshFile
from service.once import Memo
from service.requests import Upload
from service.stages import stage

Array = NDArray[np.float64]

CLOSE_CALL = 0.5
"""Readings at least so likely as this share of the answer's are close calls."""
IN_DISTRIBUTION = 0.5
"""Least score of what is like the category's shapes."""


@dataclass(frozen=True)
class Inference(ABC):
    """An upload's parameters, and the way between its frame and the normalised one.

    What they are depends on the kind of the category: a subclass each knows.  It may be kept for
    later requests, and shared by several: what they first ask for is found once and stays.

    Attributes:
        upload, mesh: the file, as bytes and read.
        candidates: readings of it, best first.
        unit: that lengths are reported in.
        unit_scale: reported units per unit of the file.
        memo: what was found later.
    """

    upload: Upload
    mesh: MeshFile
    candidates: list[Candidate]
    unit: str
    unit_scale: float
    memo: Memo = field(init=False, repr=False, compare=False, default_factory=Memo)

    @property
    def parts(self) -> int:
        """How much there is of it: it grows as more is asked for."""
        return len(vars(self)) + len(self.memo) + self.mesh.parts

    @property
    def best(self) -> Candidate:
        """The reading that counts."""
        return self.candidates[0]

    @property
    def model(self) -> Model:
        """Its category."""
        return self.best.model

    @property
    def in_distribution(self) -> bool:
        """Whether it looks and fits like one of its category."""
        return self.best.score >= IN_DISTRIBUTION

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
    def turning(self) -> Turning:
        """How its faces turn when its vertices move, in that frame."""
        return self.memo.get("turning", self._turning)

    def _turning(self) -> Turning:
        with stage("bind"):
            return Turning(self.vertices, self.mesh.faces)

    @property
    @abstractmethod
    def parameters(self) -> Array:
        """``[d]`` in the reported units."""

    @abstractmethod
    def parameter_report(self) -> dict[str, dict[str, Any]]:
        """Value, sigma and unit of each parameter that users see."""

    @abstractmethod
    def derived_report(self) -> dict[str, dict[str, Any]]:
        """Value and unit of each derived dimension."""

    @abstractmethod
    def fit_report(self) -> dict[str, Any]:
        """What is told of the fit beside what is told of every one."""

    def further_report(self) -> dict[str, Any]:
        """What is told beside what is told of every category."""
        return {}

    @abstractmethod
    def further_warnings(self) -> list[str]:
        """What the client should know beside what it should of every category."""

    def report(self) -> dict[str, Any]:
        """The answer to `POST /infer`."""
        best, fit = self.best, self.best.estimate
        return {
            "mesh_id": self.upload.mesh_id,
            "category": self.model.name,
            "parameters": self.parameter_report(),
            "derived": self.derived_report(),
            **self.further_report(),
            "frame": {
                "up": best.orientation.up,
                "front": best.orientation.front,
                "scale": fit.normalization.scale,
                "center": (fit.normalization.center @ best.orientation.rotation).tolist(),
                "rotation": best.orientation.rotation.tolist(),
                "lean": best.orientation.degrees,
            },
            "fit": {
                "distance": fit.distance,
                "encoder_distance": fit.encoder_distance,
                **self.fit_report(),
                "in_distribution": self.in_distribution,
                "score": best.score,
                "candidates": [
                    {
                        "category": candidate.model.name,
                        "up": candidate.orientation.up,
                        "front": candidate.orientation.front,
                        "distance": candidate.estimate.distance,
                        "probability": candidate.probability,
                    }
                    for candidate in self.candidates
                ],
            },
            "model": self.model.identity,
            "warnings": list(self.warnings),
        }

    @cached_property
    def warnings(self) -> list[str]:
        """What the client should know."""
        found = (self._close_call(), self._strange(), self._lean(), self._inside_out())
        return [*(warning for warning in found if warning), *self.further_warnings()]

    def _close_call(self) -> str | None:
        best, *others = self.candidates
        close = [c for c in others if c.probability > CLOSE_CALL * best.probability]
        if not close:
            return None
        ways = " or ".join(
            f"{c.model.name} with up={c.orientation.up}, front={c.orientation.front}" for c in close
        )
        return (
            f"it could also be a {ways}: which is a close call; "
            "say category, up and front to be sure"
        )

    def _strange(self) -> str | None:
        if self.in_distribution:
            return None
        return f"this does not look like a {self.model.name}; its parameters may mean little"

    def _lean(self) -> str | None:
        way = self.best.orientation
        if not any(way.lean):
            return None
        return (
            f"the mesh leans {way.degrees:.0f} degrees off up={way.up}, front={way.front}; "
            "parameters are measured, and edits made, along its own axes"
        )

    def _inside_out(self) -> str | None:
        if not self.best.estimate.inside_out:
            return None
        return (
            "the faces are wound inside out, as a mirrored mesh's are; it is read as if they were "
            "not, and answered as it came"
        )
