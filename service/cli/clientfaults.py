"""The client's errors as problems."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from service.cli.problem import UNREACHABLE, Problem
from service.client.errors import AnswerMalformed, ProblemError, ServiceError, TimedOut


@contextmanager
def told() -> Iterator[None]:
    """Turn the client's errors into problems."""
    try:
        yield
    except ProblemError as error:
        trace = {"trace_id": error.trace_id} if error.trace_id else {}
        members = {**error.members, **trace}
        raise Problem(error.code, error.detail, error.suggestion, members) from error
    except ServiceError as error:
        match error:
            case AnswerMalformed():
                code, suggestion = "answer_malformed", "Check that --url is the service's own."
            case TimedOut():
                code, suggestion = "timed_out", "Try again, or ask for less at once."
            case _:
                code, suggestion = "unreachable", "Check --url, and that the service runs."
        raise Problem(code, f"{error}.", suggestion, exit_code=UNREACHABLE) from error
