"""Which part of the shape each vertex belongs to, by what it follows in an edit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.affineinference import AffineInference
from service.bodyinference import BodyInference
from service.deform.blend import part_weights
from service.deform.followers import following
from service.encode.affinemodel import AffineModel
from service.encode.basemodel import Model
from service.encode.bodymodel import BodyModel
from service.inference import Inference
from service.stages import stage
from service.template.anatomy import JOINTS


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
    """The part that each vertex follows most: of the template, or a body's joint.

    No edit changes them, nor the order or number of vertices.
    """
    if isinstance(found, BodyInference):
        weights = found.skin.weights
        return PartLabels(category_parts(found.model), weights.argmax(axis=1).astype(np.int16))
    assert isinstance(found, AffineInference)
    fit, parts = found.fit, category_parts(found.model)
    template = following(fit.template, fit.parameters)
    with stage("bind"):
        at = template, fit.parameters, fit.translation
        nearest = part_weights(found.vertices, found.mesh.faces, *at).argmax(axis=1)
    # A fit is of one of the template's variants, which lacks some parts.
    own = np.array([parts.index(name) for name in fit.template.parts], np.int16)
    return PartLabels(parts, own[nearest])
