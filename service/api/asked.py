"""What a request asks of a mesh, or of several, with all that it takes to answer it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from fastapi import Request
from starlette.responses import Response

from service.api.context import Context
from service.api.etags import validator
from service.api.forms import MeshForm, uploads_of
from service.api.keeping import PARTS, keep
from service.encode.model import Model
from service.inferences import Inferences
from service.requests import Upload
from service.store.meshstore import MeshStore

Form = TypeVar("Form", bound=MeshForm)


@dataclass(frozen=True)
class Asked(Generic[Form]):
    """A form about meshes.

    Attributes:
        request, form: as they came.
        uploads: the meshes that the form sends or names, in the order of its `uploads`.
        models: those of the moment, by the names that clients may use.
        store, known: where meshes and inferences are kept.
    """

    request: Request
    form: Form
    uploads: tuple[Upload, ...]
    models: Mapping[str, Model]
    store: MeshStore
    known: Inferences

    @property
    def upload(self) -> Upload:
        """The mesh, or the first, which the answer is named after."""
        return self.uploads[0]

    def validator(self) -> str:
        """The inside of the answer's tag; not for the event loop."""
        return validator(self.request, self.uploads, self.form, self.models)

    def mesh_ids(self) -> dict[str, str]:
        """Ids of the uploads, as reports of edits name them: the mesh that is edited is their
        ``source``."""
        parts = zip(self.form.uploads, self.uploads, strict=True)
        return {
            f"{'source' if part == 'mesh' else part}_mesh_id": mesh.mesh_id for part, mesh in parts
        }

    def keep(self) -> list[str]:
        """Keep the uploads; see `keeping.keep`."""
        parts = zip(self.form.uploads, self.uploads, strict=True)
        kept = [keep(self.request, self.store, mesh, PARTS[part]) for part, mesh in parts]
        return [warning for warnings in kept for warning in warnings]


async def answered(
    request: Request, form: Form, shared: Context, answer: Callable[[Asked[Form]], Response]
) -> Response:
    """What `answer` makes of the request, by a worker.

    Raises:
        ShapeError: as `uploads_of` and `Readiness.models`, and what `answer` raises.
    """
    uploads = await uploads_of(request, form, shared.store)
    models = await shared.readiness.models()
    asked = Asked(request, form, uploads, models, shared.store, shared.inferences)
    return await shared.workers.run(request, answer, asked)
