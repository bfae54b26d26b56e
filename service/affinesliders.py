"""Sliders of rigid shapes: the columns of a bound mesh's Jacobian are its morph targets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.affineinference import AffineInference
from service.deform.admissible import LEAST, Bounds
from service.deform.bound import Bound, columns_of
from service.deform.followers import following
from service.deform.gradient import Gradient
from service.mesh.convert import convert
from service.mesh.embedding import as_glb
from service.mesh.glb import GlbFile
from service.mesh.polygons import Indices
from service.mesh.stretch import Stretch
from service.mesh.targets import Target, add_targets
from service.requests import UNITS, SliderOptions, file_unit
from service.sliders import Slider, chosen, notes, size_range, targets_of
from service.stages import stage

Array = NDArray[np.float64]
Plane = tuple[float, Array]
"""An affine function of the parameters: a constant, and a row ``[d]``."""

SLIGHT = 5e-6
"""Share of the mesh's size by which all targets together may leave out displacements."""


def sliders(found: AffineInference, options: SliderOptions, keep: str) -> bytes:
    """The mesh as a GLB with a morph target, or two, for each parameter.

    Args:
        found: the upload.
        options: what to offer, and how.
        keep: the point that stays in place.

    Raises:
        InvalidRequest: for an unknown parameter.
    """
    names = _chosen(found, options)
    bound = found.unfolded(found.model.template.names.index(name) for name in names)
    measured = _measured(found, bound)
    with stage("write"):
        shown = as_glb(found.mesh, file_unit(found.mesh.format, found.unit))
        return _with_targets(found, shown, bound, names, options, keep, measured)


def template(found: AffineInference, options: SliderOptions, keep: str) -> bytes:
    """The fitted template as a GLB in the upload's frame, with the same morph targets."""
    names, fit = _chosen(found, options), found.fit
    followed = following(fit.template, fit.parameters)
    own = fit.normalization.invert(fit.template.decode(fit.parameters) + fit.translation)
    vertices = found.best.orientation.to_own(own) * file_unit(found.mesh.format, found.unit)
    file = GlbFile(convert(vertices, fit.template.faces, "glb"))
    every = range(len(followed.names))
    columns = columns_of(followed.jacobian.astype(np.float32), every)
    still = Gradient([], np.zeros((0, len(vertices)), np.float32))
    bound = Bound(len(vertices), columns, dict.fromkeys(every, still))
    shown = (file, np.arange(len(vertices)))
    with stage("write"):
        return _with_targets(found, shown, bound, names, options, keep, {})


def _chosen(found: AffineInference, options: SliderOptions) -> list[str]:
    """Names of the parameters to offer."""
    template = found.model.template
    public = [n for n, seen in zip(template.names, template.public, strict=True) if seen]
    return chosen(public, options.parameters, found.model.name)


def _with_targets(
    found: AffineInference,
    shown: tuple[GlbFile, Indices],
    bound: Bound,
    names: Sequence[str],
    options: SliderOptions,
    keep: str,
    measured: Mapping[str, Plane],
) -> bytes:
    offered = _sliders(found, names)
    targets = _targets(found, shown, bound, offered, options.paired, keep)
    asset = notes(found, keep, offered, _further(found, names, measured))
    return add_targets(shown[0], targets, asset, options.quantize)


def _sliders(found: AffineInference, names: Sequence[str]) -> list[Slider]:
    """Of each parameter: over its range, as far as it can go alone with every limit kept."""
    bounds, metre = _bounds(found), UNITS[found.unit]
    entries = {entry["name"]: entry for entry in found.model.entries()}
    sliders = []
    for name in names:
        index = found.model.template.names.index(name)
        value, (low, high) = float(found.parameters[index]), entries[name]["typical"]
        step = np.zeros_like(found.parameters)
        reach = []
        for end in size_range(value, (low / metre, high / metre)):
            step[index] = end - value
            share = bounds.furthest(found.parameters, step, relations=True)
            reach.append(value + share * step[index])
        entry = entries[name] | {"unit": found.unit, "step": entries[name]["step"] / metre}
        sigma = float(found.fit.sigma[index] / found.scale)
        sliders.append(Slider.of(entry, value, sigma, (reach[0], reach[1])))
    return sliders


def _bounds(found: AffineInference) -> Bounds:
    return Bounds.of(found.fit.template, found.parameters, LEAST / found.scale)


def _targets(
    found: AffineInference,
    shown: tuple[GlbFile, Indices],
    bound: Bound,
    offered: Sequence[Slider],
    paired: bool,
    keep: str,
) -> Iterator[Target]:
    """Each slider's morph targets; small displacements are left out, so that more are none.

    `shown` is a GLB, and the bound vertex that each of its vertices is.
    """
    file, of = shown
    template = found.fit.template
    _, anchor = template.anchor(keep)
    turn = found.best.orientation
    # What a normalised length is in the GLB, in metres.
    metre = file_unit(found.mesh.format, found.unit) / found.fit.normalization.scale
    size = float(np.linalg.norm(np.ptp(file.vertices, axis=0)))
    rotation = turn.rotation.astype(np.float32)
    for slider in offered:
        index = template.names.index(slider.name)
        column = bound.column(index).astype(np.float64) - anchor[:, index]
        shift = turn.to_own(column) * (found.scale * metre)
        largest = np.abs(slider.change) * _largest(shift)
        shift[largest < SLIGHT * size / len(offered)] = 0.0
        gradient = bound.gradients[index]
        cells = dict(zip(gradient.cells, gradient.values * np.float32(found.scale), strict=True))
        stretch = Stretch(cells).between(rotation.T, rotation)
        yield from targets_of(slider, shift[of], stretch.at(of), paired)


def _largest(shift: Array) -> Array:
    """``[V]`` largest coordinate of each displacement; column by column, several times faster."""
    x, y, z = np.abs(shift).T
    return np.maximum(np.maximum(x, y), z)


def _measured(found: AffineInference, bound: Bound) -> dict[str, Plane]:
    """Derived dimensions that edits take from the mesh itself, affine in the parameters."""
    f, rows = found.parameters, {}
    for name, reading in found.dimensions(bound).readings.items():
        if reading.corrects:
            value, row = reading.gauge.tangent(np.zeros_like(f))
            rows[name] = (value - float(row @ f), row)
    return rows


def _further(
    found: AffineInference, names: Sequence[str], measured: Mapping[str, Plane]
) -> dict[str, Any]:
    """Derived dimensions and hard limits, as functions of the offered parameters."""
    template = found.model.template
    kept = [template.names.index(name) for name in names]
    others = np.setdiff1d(np.arange(len(template.names)), kept)
    metre, rotation = UNITS[found.unit], found.best.orientation.rotation

    def affine(row: Array, constant: float) -> dict[str, Any]:
        return {
            "constant": float(constant + row[others] @ found.parameters[others]),
            "coefficients": {
                name: float(row[index])
                for name, index in zip(names, kept, strict=True)
                if row[index]
            },
        }

    derived = {}
    for name, value in found.dimensions().derived(found.parameters).items():
        dimension = template.derived[name]
        typical = (dimension.typical[0] / metre, dimension.typical[1] / metre)
        derived[name] = {
            "label": dimension.label,
            "group": dimension.group,
            "unit": found.unit,
            "value": value,
            "range": list(size_range(value, typical)),
        }
        if name in measured:
            constant, row = measured[name]
            derived[name] |= affine(row, constant)
        elif dimension.row is not None:
            derived[name] |= affine(dimension.row[1:], dimension.row[0])
        elif dimension.extent is not None:
            derived[name]["axis"] = rotation["xyz".index(dimension.extent)].tolist()
    bounds = _bounds(found)
    rows = zip(bounds.texts, bounds.rows, bounds.constants, strict=True)
    limits = [{"text": text, **affine(row, constant)} for text, row, constant in rows]
    return {"derived": derived, "limits": [row for row in limits if row["coefficients"]]}
