"""Infer and edit as plain functions of bytes and values: what every interface calls."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.deform import blend, paper
from service.deform.binding import Binding
from service.deform.followers import following
from service.deform.unfold import unfold
from service.edited import Edited, Moved, write_edited
from service.edits import Change
from service.encode.model import Model
from service.encode.recognition import recognise
from service.errors import InvalidRequest, NotFound
from service.inference import Inference
from service.mesh.formats import read_mesh
from service.mesh.frame import AUTO, orientations
from service.mesh.meshfile import MeshFile
from service.mesh.surface import Samples, sample_surface
from service.requests import (
    MODES,
    UNITS,
    EditOptions,
    InferOptions,
    Upload,
    file_unit,
    require_units,
)

Array = NDArray[np.float64]


def infer(upload: Upload, models: Mapping[str, Model], options: InferOptions) -> Inference:
    """Infer the semantic parameters of an upload.

    Raises:
        ShapeError: for a file that can't be served, or an option that makes no sense.
    """
    chosen = _categories(models, options.category)
    require_units(options.units)
    ways = orientations(options.up, options.front)
    mesh = read_mesh(upload.data, upload.name, upload.content_type)
    deadline.check()
    samples = {points: _sample(mesh, points) for points in {model.points for model in chosen}}
    deadline.check()
    candidates = recognise(chosen, samples, ways, options.refine)
    # glTF is in metres whatever the client's unit; other files are in the unit it names.
    unit_scale = file_unit(mesh.format, options.units) / UNITS[options.units]
    return Inference(upload, mesh, candidates, options.units, unit_scale)


def edit(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    edits: Mapping[str, Change],
    edit_options: EditOptions,
) -> Edited:
    """Edit an upload's parameters and move its vertices accordingly.

    Raises:
        ShapeError: as `infer`, and for an edit that can't be made.
    """
    _require_mode(edit_options.mode)
    found = infer(upload, models, options)
    _require_recognised(found, options.category)
    keep = _anchor(found.model, edit_options.keep)
    deadline.check()
    binding = _bind(found, edit_options.mode)
    deadline.check()
    after = found.dimensions(binding.jacobian).after(edits)
    if edit_options.mode == "blend":
        changed = np.flatnonzero(after != found.parameters).tolist()
        fit = found.best.estimate.parameters
        binding = unfold(binding, found.vertices, found.mesh.faces, fit, changed)
    dimensions = found.dimensions(binding.jacobian)
    outcome = dimensions.outcome(edits, edit_options.strict)
    after = outcome.parameters
    change = np.where(after == found.parameters, 0.0, (after - found.parameters) * found.scale)
    _, anchor = found.best.estimate.template.anchor(keep)
    turn, scale = found.best.orientation, found.best.estimate.normalization.scale
    shift = turn.to_own((binding.displace(change) - anchor @ change) / scale)
    linear = turn.maps_to_own(binding.linear(change))
    deadline.check()
    moved = Moved(found, dimensions, outcome, found.mesh.vertices + shift, linear)
    return write_edited(moved, edit_options.format)


def _categories(models: Mapping[str, Model], category: str) -> list[Model]:
    if not models:
        raise NotFound(
            "no_models", "no model is installed", "Put models into the models folder and restart."
        )
    if category == AUTO:
        return list(models.values())
    if category not in models:
        raise InvalidRequest(
            "unknown_category",
            f"no category is named {category[:80]!r}",
            f"Use one of {', '.join(models)}, or auto.",
        )
    return [models[category]]


def _require_recognised(found: Inference, category: str) -> None:
    """An edit of what is taken for something else would only bend it."""
    if category == AUTO and not found.in_distribution:
        raise InvalidRequest(
            "not_recognised",
            f"the mesh is most like a {found.model.name}, but does not look like one "
            f"(score {found.best.score:.2f})",
            f"Send category={found.model.name} to edit it as one all the same.",
        )


def _require_mode(mode: str) -> None:
    if mode not in MODES:
        raise InvalidRequest(
            "unknown_mode", f"mode={mode[:40]!r} is no mode", f"Use {' or '.join(MODES)}."
        )


def _anchor(model: Model, keep: str | None) -> str:
    """The point to hold in place: the client's, else the category's first."""
    anchors = list(model.template.anchors)
    if keep is not None and keep not in anchors:
        raise InvalidRequest(
            "unknown_keep",
            f"a {model.name} can't keep {keep[:40]!r}",
            f"Use one of {', '.join(anchors)}.",
        )
    return keep or anchors[0]


def _bind(found: Inference, mode: str) -> Binding:
    rule = blend.bind if mode == "blend" else paper.bind
    fit = found.best.estimate
    template = following(fit.template, fit.parameters)
    return rule(found.vertices, found.mesh.faces, template, fit.parameters, fit.translation)


def _sample(mesh: MeshFile, points: int) -> Samples:
    """The same samples for the same mesh, always."""
    return sample_surface(mesh.vertices, mesh.visible, points, np.random.default_rng(0))
