"""Infer and edit as plain functions of bytes and values: what every interface calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from service import affineedit, affinesliders, bodyedit, bodysliders
from service.affineinference import AffineInference
from service.bodyinference import BodyInference
from service.constraints import NONE, Interval
from service.edited import Edited, Moved, write_edited
from service.edits import Change
from service.encode.affinemodel import AffineModel
from service.encode.basemodel import Model
from service.encode.bodymodel import BodyModel
from service.encode.debugmodel import DebugModel
from service.encode.recognition import recognise
from service.encode.versions import choose
from service.errors import InvalidRequest
from service.inference import Inference
from service.inferences import Inferences
from service.mesh.formats import detect, read_mesh
from service.mesh.frame import AUTO, Orientation, orientations
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
from service.stages import stage


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


_AFFINE = _Kind(AffineInference, affineedit.move, affinesliders.sliders, affinesliders.template)
_KINDS = {
    AffineModel.kind: _AFFINE,
    DebugModel.kind: _AFFINE,
    BodyModel.kind: _Kind(BodyInference, bodyedit.move, bodysliders.sliders, bodysliders.template),
}


def infer(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    known: Inferences | None = None,
) -> Inference:
    """Infer the semantic parameters of an upload.

    Args:
        upload: a mesh file.
        models: the categories.
        options: what the client says of it.
        known: inferences that may be used again, and where this one is kept.  Answers are the same
            without, here and below.

    Raises:
        ShapeError: for a file that can't be served, or an option that makes no sense.
    """
    with _inferred(upload, models, options, known) as found:
        return found


def edit(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    edits: Mapping[str, Change],
    edit_options: EditOptions,
    constraints: Mapping[str, Interval] = NONE,
    known: Inferences | None = None,
) -> Edited:
    """Edit an upload's parameters and move its vertices accordingly.

    Constraints are kept by the least further change; what the edits name stays as they have it.

    Raises:
        ShapeError: as `infer`, and for an edit that can't be made, or constraints that conflict.
    """
    _require_mode(edit_options.mode)
    with _inferred(upload, models, options, known) as found:
        _require_recognised(found, options.category)
        keep = _anchor(found.model, edit_options.keep)
        moved = _KINDS[found.model.kind].move(found, edits, edit_options, keep, constraints)
        return write_edited(moved, edit_options.format)


def sliders(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    slider_options: SliderOptions,
    known: Inferences | None = None,
) -> bytes:
    """An upload as a GLB that holds its editing: morph targets, and a skeleton for a body.

    Raises:
        ShapeError: as `infer`, and for options that make no sense.
    """
    with _inferred(upload, models, options, known) as found:
        _require_recognised(found, options.category)
        keep = _anchor(found.model, slider_options.keep)
        return _KINDS[found.model.kind].sliders(found, slider_options, keep)


def template(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    slider_options: SliderOptions,
    known: Inferences | None = None,
) -> bytes:
    """What was fitted to an upload, as a GLB in its frame, with the same sliders.

    Raises:
        ShapeError: as `sliders`.
    """
    with _inferred(upload, models, options, known) as found:
        keep = _anchor(found.model, slider_options.keep)
        return _KINDS[found.model.kind].template(found, slider_options, keep)


def skeleton(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    known: Inferences | None = None,
) -> Skeleton:
    """A body's upload, bound to the skeleton that was found in it.

    Raises:
        ShapeError: as `infer`, and when it is no body.
    """
    with _inferred(upload, models, options, known) as found:
        _require_recognised(found, options.category)
        if not isinstance(found, BodyInference):
            raise InvalidRequest(
                "no_skeleton",
                f"a {found.model.name} has no skeleton",
                "Send a mesh of a category of bodies.",
            )
        return Skeleton.of(found)


def _inferred(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    known: Inferences | None,
) -> AbstractContextManager[Inference]:
    """What is known of an upload, or is now found; within the block it may be asked for more."""
    chosen = choose(models, options.category)
    require_units(options.units)
    ways = orientations(options.up, options.front)
    find = partial(_find, upload, chosen, ways, options)
    if known is None:
        return nullcontext(find())
    # Models are told apart as objects: those that were loaded anew may be others of the same name.
    format = detect(upload.data, upload.name, upload.content_type)
    return known.held((upload.mesh_id, format, options, *chosen), find)


def _find(
    upload: Upload, models: Sequence[Model], ways: Sequence[Orientation], options: InferOptions
) -> Inference:
    with stage("read"):
        mesh = read_mesh(upload.data, upload.name, upload.content_type)
    # glTF is in metres whatever the client's unit; other files are in the unit it names.
    unit = file_unit(mesh.format, options.units)
    with stage("encode"):
        samples = {points: _sample(mesh, points) for points in {model.points for model in models}}
        surface = Surface(mesh.vertices, mesh.faces, 1.0 / unit)
        candidates = recognise(models, samples, ways, options.refine, surface)
    kind = _KINDS[candidates[0].model.kind]
    return kind.inference(upload, mesh, candidates, options.units, unit / UNITS[options.units])


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
