"""What was inferred of an upload of a rigid category: lengths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform import blend, paper
from service.deform.bound import Bound
from service.deform.dimensions import Dimensions
from service.deform.followers import following
from service.deform.measured import Level, find_levels
from service.deform.unfold import unfold
from service.encode.affinemodel import AffineModel
from service.encode.estimate import Estimate
from service.inference import Inference
from service.requests import UNITS
from service.sizes import size_warning
from service.stages import stage

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AffineInference(Inference):
    """A chair's, an airplane's; see `Inference`."""

    @property
    def model(self) -> AffineModel:
        model = self.best.model
        assert isinstance(model, AffineModel)
        return model

    @property
    def fit(self) -> Estimate:
        """What was fitted."""
        fit = self.best.estimate
        assert isinstance(fit, Estimate)
        return fit

    @property
    def parameters(self) -> Array:
        """``[d]`` in the reported unit."""
        return self.fit.parameters / self.scale

    @cached_property
    def levels(self) -> Mapping[str, Level]:
        """Where derived dimensions are measured on the mesh itself."""
        fit = self.fit
        return find_levels(
            self.vertices, self.mesh.faces, fit.template, fit.parameters, fit.translation
        )

    def bound(self, mode: str) -> Bound:
        """The mesh, bound to its fitted template by the rule of a mode, for edits of all that users
        see."""
        return self.memo.get(("bound", mode), partial(self._bound, mode))

    def _bound(self, mode: str) -> Bound:
        fit, faces, rule = self.fit, self.mesh.faces, blend.bind if mode == "blend" else paper.bind
        with stage("bind"):
            template = following(fit.template, fit.parameters)
            binding = rule(self.vertices, faces, template, fit.parameters, fit.translation)
            if mode == "blend":
                binding = unfold(binding, self.vertices, faces, fit.parameters, self._changing)
            return binding.bound(self._changing)

    @property
    def _changing(self) -> list[int]:
        """Indices of the parameters that an edit may change."""
        template = self.fit.template
        by = [index for dimension in template.derived.values() for index in dimension.by]
        return sorted({*np.flatnonzero(template.public).tolist(), *by})

    def dimensions(self, mode: str | None = None) -> Dimensions:
        """The mesh's dimensions in the reported unit: as the fit has them; or, once the mesh is
        bound by the rule of a mode, as it has them itself and as they can be changed."""
        return self.memo.get(("dimensions", mode), partial(self._dimensions, mode))

    def _dimensions(self, mode: str | None) -> Dimensions:
        template, parameters, scale = self.fit.template, self.parameters, self.scale
        if mode is None:
            return Dimensions(template, parameters, self.vertices, scale)
        columns = self.bound(mode).columns
        with stage("bind"):
            return Dimensions(template, parameters, self.vertices, scale, columns, self.levels)

    def parameter_report(self) -> dict[str, dict[str, Any]]:
        template = self.model.template
        columns = (self.parameters, self.fit.sigma / self.scale, template.public)
        rows = zip(template.names, *columns, strict=True)
        return {
            name: {"value": float(value), "sigma": float(sigma), "unit": self.unit}
            for name, value, sigma, seen in rows
            if seen
        }

    def derived_report(self) -> dict[str, dict[str, Any]]:
        derived = self.dimensions().derived(self.parameters)
        return {name: {"value": value, "unit": self.unit} for name, value in derived.items()}

    def fit_report(self) -> dict[str, Any]:
        return {"variant": self.fit.template.variant or None}

    def further_warnings(self) -> list[str]:
        metres = self.parameters * UNITS[self.unit]
        warning = size_warning(self.model.template, metres, self.mesh.format, self.unit)
        return [warning] if warning else []
