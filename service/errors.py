"""What can go wrong with a request, free of HTTP.

    ShapeError
    |- UnsupportedFormat    not a format we read, or a feature we can't carry through
    |- InvalidMesh          the file is broken or holds no usable surface
    |- TooLarge             over a limit on bytes, vertices or faces
    |- TooComplex           more work than one request may make
    |- InvalidRequest       an option, parameter name or edit value that makes no sense
    |- NotFound             no such category, stored mesh or job
    |- Conflict             it does not go with what there is already
    |- Overloaded           others' work left no time for this; later it may
    |- Crowded              there is no room for one more; later there may be
    `- ModelFault           an installed model that can't be trusted

Each error carries a stable `code` (snake_case, part of the API), a `detail` that names what was
found, and a `suggestion` that says what to do; some carry further `members` for programs.
`service.api.problems` maps classes to statuses.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class ShapeError(Exception):
    """Base of every error that a client can be told about."""

    def __init__(
        self, code: str, detail: str, suggestion: str, members: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__(f"{code}: {detail}")
        self.code = code
        self.detail = detail
        self.suggestion = suggestion
        self.members = members or {}


class UnsupportedFormat(ShapeError):
    """The format, or a feature of it, can't be carried through without loss."""


class InvalidMesh(ShapeError):
    """The file is broken, or holds no usable surface."""


class TooLarge(ShapeError):
    """The upload is over a limit."""


class TooComplex(ShapeError):
    """The upload makes more work than one request may."""


class InvalidRequest(ShapeError):
    """An option, a name or a value of the request makes no sense."""


class NotFound(ShapeError):
    """There is no such thing here."""


class Conflict(ShapeError):
    """What is asked does not go with what there is already."""


class Crowded(ShapeError):
    """There is no room for one more; the same request may pass later."""


class Overloaded(ShapeError):
    """The service is too busy; the same request may pass later."""


class ModelFault(ShapeError):
    """An installed model is missing a part, altered, or answers wrongly."""
