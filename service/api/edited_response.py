"""An edited mesh as an HTTP answer: the file itself, or the report of what became of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping

from starlette.responses import Response

from service.api.accept import negotiate
from service.api.asked import Asked, Form
from service.api.etags import REVALIDATED, named, not_modified, weak
from service.api.filenames import edited_name
from service.api.keeping import EDITED, keep, owner_of
from service.api.mesh_response import mesh_response
from service.api.report_response import report_response
from service.edited import Edited
from service.errors import NotFound
from service.requests import Upload

JSON = "application/json"

_HEADERS = {**REVALIDATED, "Vary": "Accept"}


def edited_response(asked: Asked[Form], make: Callable[[], Edited]) -> Response:
    """The answer to a form that asks for an edit.

    Args:
        asked: the form, with the mesh to edit first.
        make: makes the edit; not called when the client holds its answer.

    Raises:
        ShapeError: as `make`.
    """
    request, upload, inside = asked.request, asked.upload, asked.validator()
    if (tag := _held(asked, inside)) is not None:
        return not_modified(tag, _HEADERS)
    edited = make()
    request.state.report = edited.report
    result = Upload(edited.data, edited_name(upload.name, edited.format), edited.media_type)
    accept = ",".join(request.headers.getlist("accept"))
    if negotiate(accept, [edited.media_type, JSON]) == JSON:
        warnings = asked.keep() + keep(request, asked.store, result, EDITED)
        ids = {"mesh_id": result.mesh_id, **asked.mesh_ids()}
        inside = _of_report(inside, result.mesh_id)
        return report_response(request, {**ids, **edited.report}, warnings, inside, _HEADERS)
    headers = {**_HEADERS, "Shape-Parameters": _compact(edited.parameters)}
    return mesh_response(request, result, weak(inside), headers)


def _held(asked: Asked[Form], inside: str) -> str | None:
    """The tag of an answer that the client holds and that would be the same now.

    A report names the edited mesh, which must still be there.  So its tag holds that mesh's id:
    nothing else knows it before the edit is made again.
    """
    for tag in named(asked.request):
        if tag == inside:
            return weak(tag)
        mesh_id = tag.removeprefix(_of_report(inside, ""))
        if mesh_id != tag:
            try:
                asked.store.get(mesh_id, owner_of(asked.request))
            except NotFound:
                continue
            if not asked.keep():
                return weak(tag)
    return None


def _of_report(inside: str, mesh_id: str) -> str:
    return f"{inside}.{mesh_id}"


def _compact(parameters: Mapping[str, float]) -> str:
    """JSON for a header: six significant digits, no spaces."""
    rounded = {name: float(f"{value:.6g}") for name, value in parameters.items()}
    return json.dumps(rounded, separators=(",", ":"))
