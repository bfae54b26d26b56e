"""Consoles: rich's, but that a reader who has enough is the caller's concern."""

from __future__ import annotations

import os
from typing import TextIO

from rich.console import Console

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
