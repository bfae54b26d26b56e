"""What a request asks of a mesh, with all that it takes to answer it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from fastapi import Request
from starlette.responses import Response

from service.api import keeping
from service.api.context import Context
from service.api.etags import validator
from service.api.forms import InferForm, upload_of
from service.encode.model import Model
from service.inferences import Inferences
from service.requests import Upload
from service.store.meshstore import MeshStore

Form = TypeVar("Form", bound=InferForm)


@dataclass(frozen=True)
class Asked(Generic[Form]):
    """A form about a mesh.

    Attributes:
        request, form: as they came.
        upload: the mesh that the form sends or names.
        models: those of the moment, by the names that clients may use.
        store, known: where meshes and inferences are kept.
    """

    request: Request
    form: Form
    upload: Upload
    models: Mapping[str, Model]
    store: MeshStore
    known: Inferences

    def validator(self) -> str:
        """The inside of the answer's tag; not for the event loop."""
        return validator(self.request, self.upload, self.form, self.models)

    def keep(self) -> list[str]:
        """Keep the upload; see `keeping.keep`."""
        return keeping.keep(self.request, self.store, self.upload)


async def answered(
    request: Request, form: Form, shared: Context, answer: Callable[[Asked[Form]], Response]
) -> Response:
    """What `answer` makes of the request, by a worker.

    Raises:
        ShapeError: as `upload_of` and `Readiness.models`, and what `answer` raises.
    """
    upload = await upload_of(request, form, shared.store)
    models = await shared.readiness.models()
    asked = Asked(request, form, upload, models, shared.store, shared.inferences)
    return await shared.workers.run(request, answer, asked)
