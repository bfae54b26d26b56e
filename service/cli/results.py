"""Meshes that are made: written where they go, and told of."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from service.cli.destination import Destination, write
from service.cli.meshes import Mesh
from service.cli.neighbours import members
from service.cli.output import Output
from service.cli.problem import Problem
from service.cli.shapes import Made, Options

ZIP = "zip"


def prepared(mesh: Mesh, file: str, place: Destination | None, how: Options) -> dict[str, Any]:
    """How an edit is carried out, with the format that the place asks for.

    Args:
        mesh, file: what is edited, and where that came from.
        place: where it goes; None for nowhere.
        how: as the command line has it.

    Raises:
        Problem: when the result could not be written.
    """
    if place is None:
        return dict(how)
    format = how["format"] or place.format
    if mesh.gathered and how["format"] is None and format == "gltf":
        raise Problem(
            "several_files",
            f"{file!r} has its buffers or pictures in files beside it, and so has what is made.",
            "Write to a folder (-o DIR/) or to a zip (-o wide.zip).",
        )
    place.require_room(file, mesh.name, format)
    return {**how, "format": format}


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
    written = None if place is None else _written(made, mesh, file, place, output)
    told: Mapping[str, Any] = {} if written is None else {"output": written}
    output.document({"file": file, **told, **made.report})
    if output.talks:
        from service.cli import tables

        output.titled(file, tables.edited(made.report, written))
        own = Path(mesh.name or "").suffix.lower().removeprefix(".")
        if own and own != made.format:
            bare = f"it is {made.format} now: the geometry alone, without materials or nodes"
            output.show(*tables.warnings([bare]))


def _written(made: Made, mesh: Mesh, file: str, place: Destination, output: Output) -> str:
    """Where it was written to."""
    if place.piped(file):
        output.mesh(made.data)
        return "standard output"
    if mesh.gathered and made.format == ZIP and place.folder:
        return _unpacked(made.data, file, place)
    path = place.path(file, mesh.name, made.format)
    write(path, made.data)
    return str(path)


def _unpacked(archive: bytes, file: str, place: Destination) -> str:
    """Write what lay beside each other again so; the mesh file last."""
    files = [(place.within(name), data) for name, data in members(archive)]
    own = next(path for path, _ in files if path.name == Path(file).name)
    for path, data in sorted(files, key=lambda entry: entry[0] == own):
        write(path, data)
    return str(own)
