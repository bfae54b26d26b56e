"""`shape-edit transfer`."""

from __future__ import annotations

from typing import Any

import click

from service.cli.destination import Destination
from service.cli.meshes import PIPE, read
from service.cli.names import MeshFile, ParameterNames
from service.cli.options import (
    DIRECTIONS,
    READING,
    Where,
    editing_options,
    name_option,
    picked,
    reading_options,
    telling_options,
    where_options,
    writing_options,
)
from service.cli.output import Output
from service.cli.quantities import METRES
from service.cli.results import deliver, prepared
from service.cli.run import each

HOW = ("keep", "mode", "format", "strict", "parameters", "size", "position")


@click.command()
@click.argument("source", type=MeshFile())
@click.argument("target", type=MeshFile())
@writing_options("transfer")
@click.option(
    "-p",
    "--parameters",
    type=ParameterNames(),
    help="What is taken from the target, with commas between; by default all that both have.",
)
@click.option(
    "--size",
    type=click.Choice(["target", "source"]),
    default="target",
    show_default=True,
    help="The target's values as they are, or its proportions at the source's own size.",
)
@click.option(
    "--position",
    type=click.Choice(["source", "target"]),
    default="source",
    show_default=True,
    help="Where it stands: where the source does, or where the target does.",
)
@click.option("--target-up", type=click.Choice(DIRECTIONS), default="auto", show_default=True)
@click.option("--target-front", type=click.Choice(DIRECTIONS), default="auto", show_default=True)
@click.option(
    "--target-units",
    type=click.Choice(list(METRES)),
    help="The target's unit of length; by default that of the source.",
)
@click.option("-n", "--dry-run", is_flag=True, help="Tell what it would do; write nothing.")
@editing_options()
@reading_options()
@name_option()
@telling_options()
@where_options()
def transfer(
    source: str, target: str, out: str | None, force: bool, dry_run: bool, name: str | None,
    target_up: str, target_front: str, target_units: str | None, url: str | None,
    api_key: str | None, as_json: bool, quiet: bool, **given: Any,
) -> None:  # fmt: skip
    """Give the SOURCE the parameters of the TARGET: make this chair like that one.

    What comes back is the source's file with its vertices moved.

    \b
    Examples:
      shape-edit transfer chair.glb throne.glb -o chair-like-throne.glb
      shape-edit transfer chair.glb throne.glb -p seat_width,leg_height --size source -o wide.glb
    """
    if source == target == PIPE:
        raise click.UsageError("Only one of the two can come from standard input.")
    reading = picked(given, READING)
    beside = {"up": target_up, "front": target_front, "units": target_units or reading["units"]}
    place = Destination(out, force, "transfer")
    if not dry_run:
        place.require_sense((source,), as_json)
    how = picked(given, HOW)
    output = Output(as_json, quiet, not dry_run and place.piped(source))
    shapes = Where(url, api_key).shapes()

    def work(file: str) -> None:
        mesh, other = (read(one, name) for one in (file, target))
        goal = None if dry_run else place
        manner = prepared(mesh, file, goal, how)
        with output.busy(file, shapes):
            made = shapes.transfer(mesh, other, reading, {**reading, **beside}, manner)
        deliver(made, mesh, file, goal, output)

    each([source], work, output)
