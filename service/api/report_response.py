"""A report on a mesh as an HTTP answer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from service.api.etags import held, not_modified, weak


def report_response(
    request: Request,
    report: Mapping[str, Any],
    warnings: list[str],
    inside: str,
    headers: Mapping[str, str],
) -> Response:
    """The report as JSON, with further warnings, or 304 when the client holds it.

    With warnings it is an account of this moment, not to be held on to: it has no tag then.

    Args:
        warnings: of how the meshes that it names are kept.
        inside: of its tag.
        headers: more headers, of both answers.
    """
    if warnings:
        told = {**report, "warnings": [*report.get("warnings", []), *warnings]}
        return JSONResponse(told, headers={**headers, "Cache-Control": "no-store"})
    tag = weak(inside)
    if held(request, tag):
        return not_modified(tag, headers)
    return JSONResponse(report, headers={**headers, "ETag": tag})
