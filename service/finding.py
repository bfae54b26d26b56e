"""From an upload to what is known of it: the file read, and the best reading of it fitted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from functools import partial

import numpy as np

from service.affineinference import AffineInference
from service.bodyinference import BodyInference
from service.encode.affinemodel import AffineModel
from service.encode.basemodel import Model
from service.encode.bodymodel import BodyModel
from service.encode.debugmodel import DebugModel
from service.encode.recognition import recognise
from service.encode.versions import choose
from service.errors import InvalidRequest, ModelFault, Overloaded, ShapeError
from service.inference import Inference
from service.inferences import Inferences
from service.mesh.formats import detect, read_mesh
from service.mesh.frame import AUTO, Orientation, orientations
from service.mesh.meshfile import MeshFile
from service.mesh.surface import Samples, Surface, sample_surface
from service.requests import UNITS, InferOptions, Upload, file_unit, require_units
from service.stages import stage

_INFERENCES: dict[str, type[Inference]] = {
    AffineModel.kind: AffineInference,
    DebugModel.kind: AffineInference,
    BodyModel.kind: BodyInference,
}
"""What is known of an upload, by the kind of its category."""


def inferred(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    known: Inferences | None,
) -> AbstractContextManager[Inference]:
    """What is known of an upload, or is now found; within the block it may be asked for more.

    Blocks may lie within each other, also of the same upload: none waits for another's end.

    Args:
        upload: a mesh file.
        models: the categories.
        options: what the client says of it.
        known: inferences that may be used again, and where this one is kept.

    Raises:
        ShapeError: for a file that can't be served, or an option that makes no sense.
    """
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
    inference = _INFERENCES[candidates[0].model.kind]
    return inference(upload, mesh, candidates, options.units, unit / UNITS[options.units])


def _sample(mesh: MeshFile, points: int) -> Samples:
    """The same samples for the same mesh, always."""
    return sample_surface(mesh.vertices, mesh.visible, points, np.random.default_rng(0))


def require_recognised(found: Inference, category: str) -> None:
    """Raise `InvalidRequest` (``not_recognised``) for what would be edited as what it is not: that
    would only bend it."""
    if category == AUTO and not found.in_distribution:
        raise InvalidRequest(
            "not_recognised",
            f"the mesh is most like the category {found.model.name}, but does not look like one "
            f"(score {found.best.score:.2f})",
            f"Send category={found.model.name} to edit it as one all the same.",
        )


@contextmanager
def inferred_as(
    name: str,
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    known: Inferences | None,
) -> Iterator[Inference]:
    """As `inferred`, for one of several uploads, whose faults are told by its name."""
    with ExitStack() as stack:
        with blaming(name):
            found = stack.enter_context(inferred(upload, models, options, known))
        yield found


@contextmanager
def blaming(name: str) -> Iterator[None]:
    """Tell of one of several uploads by its name what is wrong with it, or with what is said of
    it."""
    try:
        yield
    except (Overloaded, ModelFault):
        raise  # no upload's fault
    except ShapeError as error:
        detail = f"{name}: {error.detail}"
        raise type(error)(error.code, detail, error.suggestion, error.members) from error
