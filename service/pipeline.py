"""Infer and edit as plain functions of bytes and values: what every interface calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from service import affineedit, affinesliders, bodyedit, bodysliders, deadline
from service.affineinference import AffineInference
from service.bodyinference import BodyInference
from service.constraints import NONE, Interval
from service.edited import Edited, Moved, write_edited
from service.edits import Change
from service.encode.affinemodel import AffineModel
from service.encode.basemodel import Model
from service.encode.bodymodel import BodyModel
from service.encode.recognition import recognise
from service.errors import InvalidRequest, NotFound
from service.inference import Inference
from service.mesh.formats import read_mesh
from service.mesh.frame import AUTO, orientations
from service.mesh.meshfile import MeshFile
from service.mesh.surface import Samples, Surface, sample_surface
from service.requests import (
    MODES,
    UNITS,
    EditOptions,
    InferOptions,
    SliderOptions,
    Upload,
    file_unit,
    require_units,
)
from service.skeleton import Skeleton


@dataclass(frozen=True)
class _Kind:
    """What depends on the kind of a category.

    Attributes:
        inference: what is known of an upload of one.
        move: carries out an edit of it.
        sliders: puts all edits of it into a GLB.
        template: puts all edits of what was fitted into one.
    """

    inference: type[Inference]
    move: Callable[[Any, Mapping[str, Change], EditOptions, str, Mapping[str, Interval]], Moved]
    sliders: Callable[[Any, SliderOptions, str], bytes]
    template: Callable[[Any, SliderOptions, str], bytes]


_KINDS = {
    AffineModel.kind: _Kind(
        AffineInference, affineedit.move, affinesliders.sliders, affinesliders.template
    ),
    BodyModel.kind: _Kind(BodyInference, bodyedit.move, bodysliders.sliders, bodysliders.template),
}


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
    # glTF is in metres whatever the client's unit; other files are in the unit it names.
    unit = file_unit(mesh.format, options.units)
    surface = Surface(mesh.vertices, mesh.faces, 1.0 / unit)
    candidates = recognise(chosen, samples, ways, options.refine, surface)
    kind = _KINDS[candidates[0].model.kind]
    return kind.inference(upload, mesh, candidates, options.units, unit / UNITS[options.units])


def edit(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    edits: Mapping[str, Change],
    edit_options: EditOptions,
    constraints: Mapping[str, Interval] = NONE,
) -> Edited:
    """Edit an upload's parameters and move its vertices accordingly.

    Constraints are kept by the least further change; what the edits name stays as they have it.

    Raises:
        ShapeError: as `infer`, and for an edit that can't be made, or constraints that conflict.
    """
    _require_mode(edit_options.mode)
    found = infer(upload, models, options)
    _require_recognised(found, options.category)
    keep = _anchor(found.model, edit_options.keep)
    deadline.check()
    moved = _KINDS[found.model.kind].move(found, edits, edit_options, keep, constraints)
    return write_edited(moved, edit_options.format)


def sliders(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    slider_options: SliderOptions,
) -> bytes:
    """An upload as a GLB that holds its editing: morph targets, and a skeleton for a body.

    Raises:
        ShapeError: as `infer`, and for options that make no sense.
    """
    found = infer(upload, models, options)
    _require_recognised(found, options.category)
    keep = _anchor(found.model, slider_options.keep)
    deadline.check()
    return _KINDS[found.model.kind].sliders(found, slider_options, keep)


def template(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    slider_options: SliderOptions,
) -> bytes:
    """What was fitted to an upload, as a GLB in its frame, with the same sliders.

    Raises:
        ShapeError: as `sliders`.
    """
    found = infer(upload, models, options)
    keep = _anchor(found.model, slider_options.keep)
    deadline.check()
    return _KINDS[found.model.kind].template(found, slider_options, keep)


def skeleton(upload: Upload, models: Mapping[str, Model], options: InferOptions) -> Skeleton:
    """A body's upload, bound to the skeleton that was found in it.

    Raises:
        ShapeError: as `infer`, and when it is no body.
    """
    found = infer(upload, models, options)
    _require_recognised(found, options.category)
    if not isinstance(found, BodyInference):
        raise InvalidRequest(
            "no_skeleton",
            f"a {found.model.name} has no skeleton",
            "Send a mesh of a category of bodies.",
        )
    deadline.check()
    return Skeleton.of(found)


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
    if keep is not None and keep not in model.keeps:
        raise InvalidRequest(
            "unknown_keep",
            f"a {model.name} can't keep {keep[:40]!r}",
            f"Use one of {', '.join(model.keeps)}.",
        )
    return keep or model.keeps[0]


def _sample(mesh: MeshFile, points: int) -> Samples:
    """The same samples for the same mesh, always."""
    return sample_surface(mesh.vertices, mesh.visible, points, np.random.default_rng(0))
