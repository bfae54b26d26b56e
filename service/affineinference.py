"""What was inferred of an upload of a rigid category: lengths."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform import blend, paper
from service.deform.bound import Bound, Columns
from service.deform.dimensions import Dimensions
from service.deform.followers import following
from service.deform.measured import Level, find_levels
from service.deform.unfold import Unfolding
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
        at = fit.template, fit.parameters, fit.translation
        with stage("bind"):
            return find_levels(self.vertices, self.mesh.faces, *at)

    def bound(self, mode: str) -> Bound:
        """The mesh, bound to its fitted template by the rule of a mode, for edits of all that users
        see."""
        return self.memo.get(("bound", mode), partial(self._bound, mode))

    def _bound(self, mode: str) -> Bound:
        fit, rule = self.fit, blend.bind if mode == "blend" else paper.bind
        with stage("bind"):
            template = following(fit.template, fit.parameters)
            at = fit.parameters, fit.translation
            binding = rule(self.vertices, self.mesh.faces, template, *at)
            by = [index for dimension in template.derived.values() for index in dimension.by]
            return binding.bound(sorted({*np.flatnonzero(template.public).tolist(), *by}))

    def unfolded(self, changed: Iterable[int]) -> Bound:
        """The mesh, bound by the rule of ``blend``, with fewer folds for the changed parameters."""
        bound, evened = self.bound("blend"), dict[tuple[int, int], NDArray[np.floating]]()
        for index in changed:
            evened |= self.memo.get(("unfolded", index), partial(self._unfolded, index))
        # Most meshes fold nowhere.
        return replace(bound, columns={**bound.columns, **evened}) if evened else bound

    def _unfolded(self, index: int) -> Columns:
        bound, unfolding = self.bound("blend"), self._unfolding
        with stage("bind"):
            return unfolding.evened(bound, index, float(self.fit.parameters[index]))

    @property
    def _unfolding(self) -> Unfolding:
        return self.memo.get("unfolding", self._make_unfolding)

    def _make_unfolding(self) -> Unfolding:
        welded = self.bound("blend").welded
        assert welded is not None
        with stage("bind"):
            return Unfolding(welded)

    def flips(self, bound: Bound, moved: NDArray[np.floating], maps: NDArray[np.floating]) -> int:
        """How many faces displacements ``[V, 3]`` with linear maps ``[V, 3, 3]`` turn inside
        out."""
        if bound.welded is None:
            return len(self.turning.flipped(moved, maps))
        return self._unfolding.flips(moved, maps)

    def dimensions(self, bound: Bound | None = None) -> Dimensions:
        """The mesh's dimensions in the reported unit: as the fit has them; or, once it is bound, as
        it has them itself and as they can be changed."""
        shape = self.fit.template, self.parameters, self.vertices, self.scale
        if bound is None:
            return Dimensions(*shape)
        return Dimensions(*shape, bound.columns, self.levels)

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
