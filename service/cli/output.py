"""What a command says: tables for people, JSON for programs, and what went wrong."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import click

from service.cli.problem import CLOSED, Problem

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from service.cli.shapes import Shapes


@dataclass
class Output:
    """Where a command speaks.

    Attributes:
        as_json: one JSON document a line on standard output, and nothing else there.
        quiet: nothing but problems.
        aside: tables go to standard error, since a mesh goes to standard output.
        several: whether there are several files, so that each is named.
    """

    as_json: bool = False
    quiet: bool = False
    aside: bool = False
    several: bool = False
    _failed: list[str] = field(default_factory=list)
    _code: int = 0

    @cached_property
    def console(self) -> Console:
        """For people."""
        from service.cli.consoles import PlainConsole

        return PlainConsole(sys.stderr if self.aside else sys.stdout)

    @cached_property
    def errors(self) -> Console:
        """For problems."""
        from service.cli.consoles import PlainConsole

        return PlainConsole(sys.stderr)

    @property
    def talks(self) -> bool:
        """Whether people are to be told things."""
        return not (self.as_json or self.quiet)

    @contextmanager
    def busy(self, file: str, shapes: Shapes) -> Iterator[None]:
        """Show on a terminal that a file is being worked on, and how far, until the block ends."""
        if self.quiet or not sys.stderr.isatty():
            yield
            return
        with self.errors.status(file) as status:
            shapes.tell = lambda far: status.update(f"{file}  {far}")
            yield

    @contextmanager
    def counting(self, what: str) -> Iterator[Callable[[int, int, int], None]]:
        """Show on a terminal how many files are done, until the block ends.

        Args:
            what: is gone through.

        Yields:
            a function that takes how many are done, of how many, and how many failed.
        """
        if self.quiet or not sys.stderr.isatty():
            yield lambda *_: None
            return
        from service.cli.consoles import counter

        with counter(what, self.errors) as tell:
            yield tell

    def show(self, *what: RenderableType) -> None:
        """Tell people."""
        if self.talks:
            from rich.text import Text

            with closing_quietly():
                for item in what:
                    self.console.print(item, soft_wrap=isinstance(item, str | Text))
                self.console.file.flush()

    def titled(self, file: str, what: Iterable[RenderableType]) -> None:
        """Tell people of a file, under its name where there are several."""
        if self.several:
            self.show(f"\n{file}")
        self.show(*what)

    def document(self, document: Mapping[str, Any]) -> None:
        """Tell programs."""
        if self.as_json:
            with closing_quietly():
                click.echo(json.dumps(document, allow_nan=False))

    def mesh(self, data: bytes) -> None:
        """Pass a mesh on."""
        with closing_quietly():
            sys.stdout.buffer.write(data)
            sys.stdout.buffer.flush()

    def failed(self, problem: Problem, file: str | None = None) -> None:
        """Tell what went wrong, and remember it for `finish`."""
        from rich.text import Text

        self._failed.append(file or "")
        self._code = max(self._code, problem.exit_code)
        if self.as_json:
            self.document(({} if file is None else {"file": file}) | problem.document())
            return
        said = Text("Error: ", style="bold red")
        said.append(f"{file}: " if file else "", style="not bold default")
        said.append(problem.code, style="bold default")
        said.append(f"\n  {problem.detail}\n  {problem.suggestion}", style="not bold default")
        if trace := problem.members.get("trace_id"):
            said.append(f"\n  (trace_id {trace})", style="not bold dim")
        self.errors.print(said, soft_wrap=True)

    def finish(self, count: int = 1) -> None:
        """End the command, with the exit code that its problems call for.

        Args:
            count: how many files there were.
        """
        if self._failed and count > 1 and not self.as_json:
            files = ", ".join(self._failed)
            click.echo(f"{len(self._failed)} of {count} files failed: {files}", err=True)
        if self._code:
            raise click.exceptions.Exit(self._code)


@contextmanager
def closing_quietly() -> Iterator[None]:
    """Whoever reads the output may have enough of it: then the command ends without a word."""
    try:
        yield
    except BrokenPipeError:
        # What is still to be flushed when Python ends goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise click.exceptions.Exit(CLOSED) from None
