"""What the commands ask for, whoever does it: this process, or a service elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from service.cli.meshes import Mesh

Options = Mapping[str, Any]
"""Options by the names that the pipeline and the HTTP contract give them."""


Count = Callable[[int, int, int], None]
"""Takes how many are done, of how many, and how many of these failed."""


@dataclass(frozen=True)
class Made:
    """A mesh that was made.

    Attributes:
        data: the file.
        format: what its name ends in.
        report: the account of it, as the service gives it.
    """

    data: bytes
    format: str
    report: dict[str, Any]


class Shapes(Protocol):
    """Infers and edits.

    Every method raises `Problem` for what can't be served.  Reports and descriptions are the JSON
    of the HTTP contract.  `reading` is how a mesh is to be read: category, up, front, units,
    refine.

    Attributes:
        tell: is told how far an upload or a download is, if there is any.
    """

    tell: Callable[[str], None]

    def infer(self, mesh: Mesh, reading: Options) -> dict[str, Any]:
        """The report on a mesh."""

    def edit(
        self, mesh: Mesh, reading: Options, edits: Options, constraints: Options, how: Options
    ) -> Made:
        """A mesh with its parameters changed; `how` has mode, keep, format, strict."""

    def sliders(self, mesh: Mesh, reading: Options, offer: Options) -> bytes:
        """A GLB of a mesh with its sliders inside."""

    def template(self, mesh: Mesh, reading: Options, offer: Options) -> bytes:
        """A GLB of what was fitted, likewise."""

    def transfer(
        self, source: Mesh, target: Mesh, reading: Options, target_reading: Options, how: Options
    ) -> Made:
        """The source with the target's parameters; `how` has those of `edit`, and parameters, size,
        position."""

    def augment(
        self,
        directory: Path,
        out: Path,
        reading: Options,
        how: Options,
        options: Options,
        tell: Count,
    ) -> dict[str, Any]:
        """Variants of the meshes of a folder; what was done, in numbers.

        Args:
            directory, out: where meshes are, and where to write.
            reading: how all of them are to be read.
            how: as for `edit`.
            options: count, seed, strength, engine, workers, shard, deadline_s, force.
            tell: called with how many are done, of how many, and how many failed.
        """

    def categories(self) -> list[dict[str, Any]]:
        """What can be inferred and edited."""

    def category(self, name: str) -> dict[str, Any]:
        """One of them, or a version of it."""
