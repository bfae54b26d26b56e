"""`shape-edit sliders` and `shape-edit template`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from service.cli.destination import Destination, write
from service.cli.meshes import Mesh, read
from service.cli.names import MeshFile
from service.cli.options import (
    READING,
    Where,
    name_option,
    offering_options,
    picked,
    reading_options,
    telling_options,
    where_options,
    writing_options,
)
from service.cli.output import Output
from service.cli.run import each
from service.cli.shapes import Options, Shapes

FORMAT = "glb"


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=MeshFile())
@writing_options("sliders.glb")
@offering_options()
@reading_options()
@name_option()
@telling_options()
@where_options()
def sliders(files: tuple[str, ...], url: str | None, api_key: str | None, **given: Any) -> None:
    """Put the parameters of meshes into them: a GLB that any glTF viewer edits.

    Chairs, airplanes and the like get a morph target a parameter, people a skeleton.

    \b
    Examples:
      shape-edit sliders chair.glb
      shape-edit sliders chair.glb -p seat_width,leg_height -o two.glb
      shape-edit sliders person.glb --joint-names mixamo --rest t_pose -o rigged.glb
    """
    shapes = Where(url, api_key).shapes()
    _make(files, "sliders", shapes, shapes.sliders, given)


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=MeshFile())
@writing_options("template.glb")
@offering_options()
@reading_options()
@name_option()
@telling_options()
@where_options()
def template(files: tuple[str, ...], url: str | None, api_key: str | None, **given: Any) -> None:
    """Show what was fitted to meshes: a GLB to be drawn over them.

    \b
    Examples:
      shape-edit template chair.glb
      shape-edit template chair.glb -o - > fitted.glb
    """
    shapes = Where(url, api_key).shapes()
    _make(files, "template", shapes, shapes.template, given)


def _make(
    files: tuple[str, ...],
    what: str,
    shapes: Shapes,
    make: Callable[[Mesh, Options, Options], bytes],
    given: dict[str, Any],
) -> None:
    """Make a GLB of each file.

    Args:
        files: the inputs.
        what: is made of them.
        shapes: makes it.
        make: its way to do so, of a mesh, how it is to be read, and what to offer.
        given: the other options.
    """
    reading = picked(given, READING)
    out, force, name = (given.pop(option) for option in ("out", "force", "name"))
    as_json, quiet = given.pop("as_json"), given.pop("quiet")
    place = Destination(out, force, what, len(files) > 1)
    place.require_sense(files, as_json)
    output = Output(as_json, quiet, any(place.piped(file) for file in files), len(files) > 1)

    def work(file: str) -> None:
        mesh = read(file, name, looks=True)
        place.require_room(file, mesh.name, FORMAT)
        with output.busy(file, shapes):
            data = make(mesh, reading, given)
        if place.piped(file):
            output.mesh(data)
            return
        path = place.path(file, mesh.name, FORMAT)
        write(path, data)
        output.document({"file": file, "output": str(path), "bytes": len(data)})
        output.show(f"{file} -> {path} ({len(data):,} bytes)")

    each(files, work, output)
