"""Goes through the files of a command line: one that can't be served stops none of the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from service.cli.output import Output
from service.cli.problem import UNREACHABLE, Problem


def each(files: Sequence[str], work: Callable[[str], None], output: Output) -> None:
    """Work on each file, and end with the exit code that becomes of it."""
    for file in files:
        try:
            work(file)
        except Problem as problem:
            output.failed(problem, file)
            if problem.exit_code == UNREACHABLE:
                break  # it would be no other for the next
    output.finish(len(files))
