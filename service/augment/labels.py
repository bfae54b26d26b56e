"""Which part of the shape each vertex belongs to, by what of the fitted template it is near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.affineinference import AffineInference
from service.bodyinference import BodyInference
from service.deform.binding import inverse_frames
from service.deform.loft import lofts
from service.deform.proximity import Boxes
from service.deform.weld import Welded, runs, weld
from service.encode.affinemodel import AffineModel
from service.encode.basemodel import Model
from service.encode.bodymodel import BodyModel
from service.inference import Inference
from service.stages import stage
from service.template.anatomy import JOINTS

Array32 = NDArray[np.float32]
Index = NDArray[np.int64]

TOUCH = 0.02
"""A piece nearer to a part than this, in the normalised frame, touches it."""
WHOLE = 0.015
"""A piece is of one part if that lies no farther from it, in the mean over its vertices, than the
nearest of each does, by more than this,"""
FAR = 0.08
"""and no vertex lies farther from it than this: a fin is none of the fuselage it grows out of."""


@dataclass(frozen=True)
class PartLabels:
    """Parts of a category, and of a mesh of it.

    Attributes:
        parts: their names: the same for every mesh of the category.
        labels: ``[V]`` int16, an index into them for each vertex, in the file's order.
    """

    parts: tuple[str, ...]
    labels: NDArray[np.int16]


def category_parts(model: Model) -> tuple[str, ...]:
    """Names of the parts that a category's meshes are made of."""
    if isinstance(model, BodyModel):
        return JOINTS
    assert isinstance(model, AffineModel)
    return model.template.parts


def part_labels(found: Inference) -> PartLabels:
    """The part of the fitted template that each vertex is of, or the joint that it follows most.

    No edit changes them, nor the order or number of vertices.
    """
    if isinstance(found, BodyInference):
        weights = found.skin.weights
        return PartLabels(category_parts(found.model), weights.argmax(axis=1).astype(np.int16))
    assert isinstance(found, AffineInference)
    parts = category_parts(found.model)
    with stage("bind"):
        welded = weld(found.vertices, np.asarray(found.mesh.faces, np.int64))
        nearest = nearest_parts(_distances(found, welded), welded.piece)[welded.of]
    # A fit is of one of the template's variants, which lacks some parts.
    own = np.array([parts.index(name) for name in found.fit.template.parts], np.int16)
    return PartLabels(parts, own[nearest])


def _distances(found: AffineInference, welded: Welded) -> Array32:
    """``[n, P]`` of the welded positions to the fitted template's parts."""
    fit = found.fit
    maps, starts = fit.template.maps(fit.parameters), np.full(len(fit.template.parts), -0.5)
    round_ = lofts(fit.template, fit.parameters, maps.frames, maps.tapers, starts)
    boxes = Boxes(maps.frames, inverse_frames(maps.frames), round_)
    return boxes.distances(boxes.local(welded.vertices - fit.translation))


def nearest_parts(distances: Array32, piece: Index) -> Index:
    """``[n]`` the part that each vertex is of.

    A piece is of parts that it touches: a stretcher of the legs that it joins, though the middle of
    it be nearer to the seat.  What is nearly all near to one part - a cushion to the seat, though
    its edges be nearer to the arms - is of that part as a whole.

    Args:
        distances: ``[n, P]`` to the parts.
        piece: ``[n]`` which connected piece a vertex belongs to.
    """
    order, starts = runs(piece)
    counts = np.diff([*starts, len(piece)])
    sorted_ = distances[order]
    least = np.minimum.reduceat(sorted_, starts, axis=0)
    touched = least <= np.maximum(TOUCH, least.min(axis=1, keepdims=True))
    offered = np.where(np.repeat(touched, counts, axis=0), sorted_, np.inf)
    mean = np.add.reduceat(offered, starts, axis=0) / counts[:, None]
    free = np.add.reduceat(offered.min(axis=1), starts) / counts
    best = mean.argmin(axis=1)
    farthest = np.maximum.reduceat(sorted_, starts, axis=0)[np.arange(len(best)), best]
    whole = (mean.min(axis=1) <= free + WHOLE) & (farthest <= FAR)
    found = np.where(np.repeat(whole, counts), np.repeat(best, counts), offered.argmin(axis=1))
    labels = np.empty(len(piece), np.int64)
    labels[order] = found
    return labels
