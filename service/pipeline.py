"""Infer, edit and transfer as plain functions of bytes and values: what every interface calls."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service import affineedit, affinesliders, affinetransfer, bodyedit, bodysliders, bodytransfer
from service.bodyinference import BodyInference
from service.constraints import NONE, Interval
from service.edited import Edited, Moved, write_edited
from service.edits import Change
from service.encode.affinemodel import AffineModel
from service.encode.basemodel import Model
from service.encode.bodymodel import BodyModel
from service.encode.debugmodel import DebugModel
from service.errors import InvalidRequest
from service.finding import inferred, inferred_as, require_recognised
from service.inference import Inference
from service.inferences import Inferences
from service.requests import (
    MODES,
    EditOptions,
    InferOptions,
    SliderOptions,
    TransferOptions,
    Upload,
)
from service.skeleton import Skeleton
from service.transfer import Taken, require_pair, require_transfer, told

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Kind:
    """What depends on the kind of a category.

    Attributes:
        move: carries out an edit of it.
        sliders: puts all edits of it into a GLB.
        template: puts all edits of what was fitted into one.
        take: what an edit takes from another.
        place: puts the edited one where it is to stand.
    """

    move: Callable[[Any, Mapping[str, Change], EditOptions, str, Mapping[str, Interval]], Moved]
    sliders: Callable[[Any, SliderOptions, str], bytes]
    template: Callable[[Any, SliderOptions, str], bytes]
    take: Callable[[Any, Any, TransferOptions, str], Taken]
    place: Callable[[Moved, Array | None, str], Moved]


_AFFINE = _Kind(
    affineedit.move,
    affinesliders.sliders,
    affinesliders.template,
    affinetransfer.take,
    affinetransfer.place,
)
_KINDS = {
    AffineModel.kind: _AFFINE,
    DebugModel.kind: _AFFINE,
    BodyModel.kind: _Kind(
        bodyedit.move,
        bodysliders.sliders,
        bodysliders.template,
        bodytransfer.take,
        bodytransfer.place,
    ),
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
    with inferred(upload, models, options, known) as found:
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
    require_mode(edit_options.mode)
    with inferred(upload, models, options, known) as found:
        require_recognised(found, options.category)
        return write_edited(move(found, edits, edit_options, constraints), edit_options.format)


@contextmanager
def editable(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    edit_options: EditOptions,
    known: Inferences | None = None,
) -> Iterator[Inference]:
    """What is known of an upload that is to be edited several times, for `move` within the block.

    Raises:
        ShapeError: as `edit`, for what is wrong with every edit.
    """
    require_mode(edit_options.mode)
    with inferred(upload, models, options, known) as found:
        require_recognised(found, options.category)
        move(found, {}, edit_options)
        yield found


def move(
    found: Inference,
    edits: Mapping[str, Change],
    edit_options: EditOptions,
    constraints: Mapping[str, Interval] = NONE,
) -> Moved:
    """Carry out an edit of what is known of an upload; see `editable`.

    Raises:
        ShapeError: as `edit`, but for what is wrong with the upload.
    """
    require_mode(edit_options.mode)
    keep = _anchor(found.model, edit_options.keep)
    return _KINDS[found.model.kind].move(found, edits, edit_options, keep, constraints)


def transfer(
    source: Upload,
    target: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    target_options: InferOptions,
    transfer_options: TransferOptions,
    known: Inferences | None = None,
) -> Edited:
    """Edit the source's parameters to the target's: the paper's mode from source to target.

    Args:
        source: the file that is edited and answered.
        target: the file whose parameters it gets.
        models: the categories.
        options, target_options: what the client says of each.
        transfer_options: what is taken from the target, and how the edit is carried out.
        known: as in `infer`, of both.

    Raises:
        ShapeError: as `edit`; details begin with ``source:`` or ``target:`` where one of the two
            is at fault.  ``categories_differ`` for shapes of two categories.
    """
    require_mode(transfer_options.mode)
    require_transfer(transfer_options)
    with inferred_as("source", source, models, options, known) as found:
        keep, kind = _anchor(found.model, transfer_options.keep), _KINDS[found.model.kind]
        with inferred_as("target", target, models, target_options, known) as other:
            require_pair(found, other, options.category, target_options.category)
            taken = kind.take(found, other, transfer_options, keep)
        # One mesh at a time is bound and moved: the other is let go before.
        del other
        moved = kind.move(found, taken.edits, transfer_options, keep, NONE)
        moved = kind.place(moved, taken.goal, keep)
        return told(write_edited(moved, transfer_options.format), taken, transfer_options)


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
    with inferred(upload, models, options, known) as found:
        require_recognised(found, options.category)
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
    with inferred(upload, models, options, known) as found:
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
    with inferred(upload, models, options, known) as found:
        require_recognised(found, options.category)
        if not isinstance(found, BodyInference):
            raise InvalidRequest(
                "no_skeleton",
                f"a {found.model.name} has no skeleton",
                "Send a mesh of a category of bodies.",
            )
        return Skeleton.of(found)


def require_mode(mode: str) -> None:
    """Raise `InvalidRequest` (``unknown_mode``) unless ``mode`` is one of `MODES`."""
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
