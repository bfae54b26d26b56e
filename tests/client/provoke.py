"""What it takes to provoke the service's problems through its client, and to see that all are."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import httpx
import pytest
import trimesh

from service.client import Retry, ShapeClient, errors
from service.client.errors import ProblemError
from service.client.models import Fault

BOX = bytes(trimesh.creation.box((0.5, 1.0, 2.0)).export(file_type="glb"))

PROVOKED: dict[str, set[int]] = {}
"""Statuses of the problems that tests provoke, by code; 200 of faults that `/readyz` lists."""

KINDS: dict[int, type[ProblemError]] = {
    400: errors.BadRequest,
    401: errors.Unauthorized,
    403: errors.Forbidden,
    404: errors.NotFound,
    405: errors.MethodNotAllowed,
    408: errors.RequestTimeout,
    409: errors.Conflict,
    413: errors.TooLarge,
    415: errors.UnsupportedMedia,
    422: errors.Unprocessable,
    429: errors.TooManyRequests,
    431: ProblemError,
    500: errors.ServerFault,
    503: errors.Unavailable,
}
"""The exceptions by status; a code may have a narrower one of its own."""

Test = Callable[..., Any]


def client_of(http: httpx.Client, api_key: str | None = None) -> ShapeClient:
    """A client of the service that another one reaches; it asks once."""
    return ShapeClient(http=http, api_key=api_key, timeout=30, retries=Retry(attempts=1))


def provokes(**statuses: int) -> Callable[[Test], Test]:
    """A test that returns the refusal, or the fault, of each of these codes with this status.

    Where there are several, the test takes the `code` that it is to provoke.
    """
    for name, status in statuses.items():
        PROVOKED.setdefault(name, set()).add(status)

    def decorate(test: Test) -> Test:
        @wraps(test)
        def run(**fixtures: Any) -> None:
            code = fixtures["code"] if len(statuses) > 1 else next(iter(statuses))
            _check(test(**fixtures), statuses[code], code)

        if len(statuses) > 1:
            return pytest.mark.parametrize("code", list(statuses))(run)
        return run

    return decorate


def refused(call: Callable[[], object]) -> ProblemError:
    """The problem that a call ends with."""
    with pytest.raises(ProblemError) as caught:
        call()
    return caught.value


def told(status: int, body: bytes) -> ProblemError:
    """The problem in an answer to what the client does not send, as it would tell it."""
    found = errors.problem(httpx.Response(status, content=body).json(), status)
    assert found is not None
    return found


def _check(found: ProblemError | Fault, status: int, code: str) -> None:
    assert found.code == code
    for words in (found.detail, found.suggestion):
        assert words.strip()
        assert words.isprintable()
        assert len(words) < 1000
    if isinstance(found, ProblemError):
        narrower = ProblemError.by_code.get(code, KINDS[status])
        assert type(found) is narrower
        assert found.status == status
        assert found.title
        assert found.trace_id
        assert code in str(found)
    else:
        assert status == 200
