"""What only the whole service can be asked: B7, B8 and B9, on files that it reads and writes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model_export.benchmark.accuracy import diagonal
from model_export.benchmark.case import Case
from model_export.benchmark.continuity import STEPS, evenness, monotone
from model_export.benchmark.identity import same_but_shape, there_and_back
from model_export.benchmark.known import inferred
from model_export.benchmark.symmetry import MIRROR
from model_export.web_samples import Piece, glb
from service.edits import Change
from service.encode.model import Model
from service.mesh.formats import read_mesh
from service.pipeline import edit, infer, move
from service.requests import EditOptions, InferOptions, Upload

Array = NDArray[np.float64]

SLIDER = (0.7, 1.4)


@dataclass(frozen=True)
class Identity:
    """B7 of one input.

    Attributes:
        empty: an empty edit answers with the bytes that came.
        kept: how many edits leave all but positions, normals and tangents as they were,
        edits: of so many.
        back: the largest distance from the input after an edit and its inverse, each inferred from
            its file alone, over the diagonal; in the mean over the edits.
    """

    empty: bool
    kept: int
    edits: int
    back: float


def as_glb(vertices: Array, faces: NDArray[np.int64]) -> Upload:
    """A file with normals and colours."""
    shade = np.linspace(0.2, 1.0, len(vertices))
    colours = np.stack([shade, shade[::-1], 0.0 * shade + 0.5], axis=1)
    piece = Piece(vertices, faces, "paint", (1.0, 1.0, 1.0), colours=colours, smooth=True)
    return Upload(glb("mesh", [piece]), "mesh.glb")


def upright(category: str) -> InferOptions:
    """For a mesh in the canonical frame."""
    return InferOptions(category=category, up="+y", front="+z")


def identity(model: Model, case: Case, factor: float = 1.4) -> Identity:
    """Edit each public parameter, and back."""
    models, options = {model.name: model}, upright(model.name)
    upload = as_glb(case.vertices, case.faces)
    x = read_mesh(upload.data, "mesh.glb").vertices
    empty = edit(upload, models, options, {}, EditOptions()).data == upload.data
    kept, back = 0, []
    names = [p.name for p in case.category.parameters if not p.nuisance]
    for name in names:
        there = edit(upload, models, options, {name: Change("scale", factor)}, EditOptions())
        kept += same_but_shape(upload.data, there.data)
        again = Upload(there.data, "mesh.glb")
        change = {name: Change("scale", 1.0 / factor)}
        home = edit(again, models, options, change, EditOptions())
        back.append(there_and_back(x, read_mesh(home.data, "mesh.glb").vertices))
    return Identity(empty, kept, len(names), float(np.mean(back)))


def mirrored_parameters(model: Model, case: Case) -> float:
    """The largest change of a public parameter under a mirrored input, over the diagonal."""
    public = model.template.public
    x, faces = case.vertices, case.faces
    own = inferred(model, x, faces).f
    other = inferred(model, x * MIRROR, faces[:, ::-1]).f
    return float(np.abs(own - other)[public].max() / diagonal(x))


def continuity(model: Model, case: Case, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """`evenness` and `monotone` of a slider of each parameter, through files."""
    models, options = {model.name: model}, upright(model.name)
    found = infer(as_glb(case.vertices, case.faces), models, options)
    index = {p.name: i for i, p in enumerate(model.template.parameters)}
    answer = {}
    for name in names:
        factors = np.linspace(*SLIDER, STEPS)
        meshes = [
            move(found, {name: Change("scale", float(f))}, EditOptions()).vertices for f in factors
        ]
        again = [inferred(model, mesh, case.faces).f[index[name]] for mesh in meshes]
        answer[name] = evenness(meshes), monotone(factors.tolist(), again)
    return answer
