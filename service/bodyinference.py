"""What was inferred of an upload of a body: joint angles, shape, and where the joints are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform import bodypaper, skinbinding
from service.deform.bodypaper import PaperBinding
from service.deform.skinbinding import SkinBinding
from service.encode.bodyestimate import BodyEstimate
from service.encode.bodymodel import BodyModel, stature
from service.inference import Inference
from service.requests import UNITS
from service.sizes import stature_warning
from service.stages import stage
from service.template.anatomy import JOINTS
from service.template.skinned import NAMES, SHAPES, Body

Array = NDArray[np.float64]

PARAMETER_UNITS = ("rad",) * (len(NAMES) - SHAPES) + ("1",) * SHAPES
"""Of the parameters, in the order of `NAMES`."""
OTHER_BODY = (
    "joints are where the installed body file (BODY_MODEL) has them, while the encoder was trained "
    "with another body: positions may be off by some centimetres, and angles by some degrees"
)


@dataclass(frozen=True)
class BodyInference(Inference):
    """A body's; see `Inference`."""

    @property
    def model(self) -> BodyModel:
        model = self.best.model
        assert isinstance(model, BodyModel)
        return model

    @property
    def fit(self) -> BodyEstimate:
        """What was fitted."""
        fit = self.best.estimate
        assert isinstance(fit, BodyEstimate)
        return fit

    @cached_property
    def parameters(self) -> Array:
        """``[75]`` in the order of `NAMES`."""
        return self.fit.body.parameters

    @property
    def skin(self) -> SkinBinding:
        """The mesh, bound to the joints of the fitted body."""
        return self.memo.get("skin", self._skin)

    def _skin(self) -> SkinBinding:
        with stage("bind"):
            body = self.fit.body
            return skinbinding.bind(self.vertices, self.mesh.faces, self.model.template, body)

    @property
    def paper(self) -> PaperBinding:
        """The mesh, bound to the vertices of the fitted body."""
        return self.memo.get("paper", self._paper)

    def _paper(self) -> PaperBinding:
        with stage("bind"):
            return bodypaper.bind(self.vertices, self.model.template, self.fit.body)

    def stature(self, body: Body) -> float:
        """Height of a body, standing straight, in the reported unit."""
        return stature(self.model.template, body.shape) * body.scale / self.scale

    def parameter_report(self) -> dict[str, dict[str, Any]]:
        rows = zip(NAMES, self.parameters, self.fit.sigma, PARAMETER_UNITS, strict=True)
        return {
            name: {"value": float(value), "sigma": float(sigma), "unit": unit}
            for name, value, sigma, unit in rows
        }

    def derived_report(self) -> dict[str, dict[str, Any]]:
        return {"stature": {"value": self.stature(self.fit.body), "unit": self.unit}}

    def further_report(self) -> dict[str, Any]:
        joints = self.own_joints(self.fit.body) * self.unit_scale
        return {"joints": dict(zip(JOINTS, joints.tolist(), strict=True))}

    def own_joints(self, body: Body) -> Array:
        """``[24, 3]`` joints of a body in the upload's own coordinates."""
        joints = self.model.template.posed_joints(body)
        return self.best.orientation.to_own(self.fit.normalization.invert(joints))

    def fit_report(self) -> dict[str, Any]:
        return {"variant": None, "encoder": self.model.reader(self.mesh.faces)}

    def further_warnings(self) -> list[str]:
        metres = self.stature(self.fit.body) * UNITS[self.unit]
        size = stature_warning(self.model.name, metres, self.mesh.format, self.unit)
        joints = OTHER_BODY if self.model.other_body else None
        return [warning for warning in (size, joints) if warning]
