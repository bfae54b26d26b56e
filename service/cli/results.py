"""Meshes that were made: written where they go, and told of."""

from __future__ import annotations

from pathlib import Path

from service.cli.destination import Destination, write
from service.cli.meshes import Mesh
from service.cli.output import Output
from service.cli.shapes import Made


def deliver(made: Made, mesh: Mesh, file: str, place: Destination | None, output: Output) -> None:
    """Write what was made and tell of it.

    Args:
        made: the result.
        mesh, file: what it was made of, and where that came from.
        place: where it goes; None to tell of it only.
        output: where to tell it.

    Raises:
        Problem: when it can't be written.
    """
    written = None
    if place is not None and place.piped(file):
        output.mesh(made.data)
        written = "standard output"
    elif place is not None:
        path = place.path(file, mesh.name, made.format)
        write(path, made.data)
        written = str(path)
    told = {} if written is None else {"output": written}
    output.document({"file": file, **told, **made.report})
    if output.talks:
        from service.cli import tables

        output.titled(file, tables.edited(made.report, written))
        own = Path(mesh.name or "").suffix.lower().removeprefix(".")
        if own and own != made.format:
            bare = f"it is {made.format} now: the geometry alone, without materials or nodes"
            output.show(*tables.warnings([bare]))
