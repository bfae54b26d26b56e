"""What went wrong, in the same words whether it was here or at a service elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

from service.errors import ShapeError

FAILED, USAGE, UNREACHABLE, INTERRUPTED, CLOSED = 1, 2, 3, 130, 141
"""Exit codes: a file couldn't be served; the command line makes no sense; no service answers;
Ctrl-C; whoever read the output is gone."""

NOTHING: Mapping[str, Any] = MappingProxyType({})


class Problem(Exception):
    """A foreseeable error: told without a traceback.

    Attributes:
        code: stable, in snake case: the service's own, or one of the command line.
        detail: what was found.
        suggestion: what to do.
        members: more for programs.
        exit_code: one of those above.
    """

    def __init__(
        self,
        code: str,
        detail: str,
        suggestion: str,
        members: Mapping[str, Any] = NOTHING,
        exit_code: int = FAILED,
    ) -> None:
        super().__init__(f"{code}: {detail}")
        self.code = code
        self.detail = detail
        self.suggestion = suggestion
        self.members = members
        self.exit_code = exit_code

    def document(self) -> dict[str, Any]:
        """The same as JSON; ``conflicts`` and their like as the service has them."""
        own = {"code": self.code, "detail": self.detail, "suggestion": self.suggestion}
        return {**own, **self.members}


@contextmanager
def told() -> Iterator[None]:
    """Turn the service's own errors into problems."""
    try:
        yield
    except ShapeError as error:
        raise Problem(error.code, error.detail, error.suggestion, error.members) from error


def reason(error: OSError) -> str:
    """What the system says of an error, without the file's name."""
    return error.strerror or str(error)
