"""Consoles: rich's, but that a reader who has enough is the caller's concern."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

PIPED_COLUMNS = 160
"""Width of tables that go to no terminal: wide enough that nothing is cut off."""


class PlainConsole(Console):
    """Prints texts as they are."""

    def __init__(self, file: TextIO) -> None:
        """`file` is where to; a terminal's width counts, and elsewhere lines are long."""
        width = None if file.isatty() or "COLUMNS" in os.environ else PIPED_COLUMNS
        super().__init__(file=file, width=width, highlight=False, emoji=False, markup=False)

    def on_broken_pipe(self) -> None:
        """Let the caller know, which rich would end the process for."""
        raise BrokenPipeError


@contextmanager
def counter(what: str, console: Console) -> Iterator[Callable[[int, int, int], None]]:
    """A bar of files that are done, which goes when the block ends; see `Output.counting`."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[failed]} failed"),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(what, total=None, failed=0)
        yield lambda done, total, failed: progress.update(
            task, completed=done, total=total or None, failed=failed
        )
