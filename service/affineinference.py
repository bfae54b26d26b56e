"""What was inferred of an upload of a rigid category: lengths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform.dimensions import Dimensions
from service.deform.measured import Level, find_levels
from service.encode.affinemodel import AffineModel
from service.encode.estimate import Estimate
from service.inference import Inference
from service.requests import UNITS
from service.sizes import size_warning

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

    def dimensions(self, jacobian: NDArray[np.floating] | None = None) -> Dimensions:
        """The mesh's dimensions in the reported unit; with a Jacobian, as the mesh itself has them
        and as they can be changed."""
        return Dimensions(
            self.fit.template,
            self.parameters,
            self.vertices,
            self.scale,
            jacobian,
            None if jacobian is None else self.levels,
        )

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
