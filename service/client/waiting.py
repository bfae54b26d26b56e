"""What waiting for a job comes to."""

from __future__ import annotations

from collections.abc import Callable

from service.client.models import Job

OnProgress = Callable[[Job], object]
"""Called with the job at each of its changes."""


def at_end(last: Job | None) -> Job:
    """The last that was heard; following never ends before it is finished."""
    assert last is not None
    return last
