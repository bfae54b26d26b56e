"""`shape-edit edit`."""

from __future__ import annotations

from typing import Any

import click

from service.cli.assignments import Wishes, is_assignment, read_wishes, require_kinds
from service.cli.destination import Destination
from service.cli.meshes import Mesh, read
from service.cli.names import FileOrEdit
from service.cli.options import (
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
from service.cli.problem import Problem
from service.cli.results import deliver, prepared
from service.cli.run import each
from service.cli.shapes import Made, Shapes

HOW = ("keep", "mode", "format", "strict")


@click.command()
@click.argument("arguments", nargs=-1, metavar="FILE... [EDIT]...", type=FileOrEdit())
@writing_options("edited")
@click.option("--edits", metavar="JSON|@FILE", help="Edits as the HTTP interface takes them.")
@click.option("--constraints", metavar="JSON|@FILE", help="Constraints, likewise.")
@click.option("-n", "--dry-run", is_flag=True, help="Tell what the edit would do; write nothing.")
@editing_options()
@reading_options()
@name_option()
@telling_options()
@where_options()
def edit(
    arguments: tuple[str, ...], out: str | None, force: bool, edits: str | None,
    constraints: str | None, dry_run: bool, name: str | None, url: str | None,
    api_key: str | None, as_json: bool, quiet: bool, **given: Any,
) -> None:  # fmt: skip
    """Change parameters of meshes: the same file comes back with its vertices moved.

    An EDIT is a parameter or derived dimension, and what is to become of it:

    \b
      seat_top_height=45cm       set; units are m, cm, mm, in, ft, deg, rad
      leg_height+=2in            add to it, or -= take off
      seat_width*=1.2            scale; without a star: seat_width=120%, seat_width+=20%
      total_width=..60cm         keep to a range, by the least change of what no other
                                 edit names; 40cm..60cm, 40cm.., 'total_width<=60cm'

    Numbers without a unit are in --units, angles in radians. Shells expand * and take < and > for
    themselves: quote these. Nothing is replaced without --force.

    \b
    Examples:
      shape-edit edit chair.glb 'seat_width*=1.2' seat_top_height=45cm -o wide.glb
      shape-edit edit chair.glb seat_top_height=45cm..45cm total_width=..60cm -o fits.glb
      shape-edit edit chair.glb back_height+=5cm --dry-run
      shape-edit edit *.glb leg_height=110% -o longer/
      cat chair.glb | shape-edit edit - seat_width=120% -o - > wide.glb
    """
    files = tuple(text for text in arguments if not is_assignment(text))
    asked = [text for text in arguments if is_assignment(text)]
    if not files:
        raise click.UsageError("Name a mesh file, or - for standard input.")
    reading = picked(given, READING)
    wishes = read_wishes(asked, reading["units"], edits, constraints)
    if not (asked or edits or constraints):
        raise click.UsageError("Say what to change, such as seat_width=120%; see --help.")
    place = Destination(out, force, "edited", len(files) > 1)
    if not dry_run:
        place.require_sense(files, as_json)
    how = picked(given, HOW)
    aside = not dry_run and any(place.piped(file) for file in files)
    output = Output(as_json, quiet, aside, len(files) > 1)
    shapes = Where(url, api_key).shapes()

    def work(file: str) -> None:
        mesh = read(file, name)
        goal = None if dry_run else place
        manner = prepared(mesh, file, goal, how)
        with output.busy(file, shapes):
            made = edited(shapes, mesh, reading, wishes, manner)
        deliver(made, mesh, file, goal, output)

    each(files, work, output)


def edited(
    shapes: Shapes, mesh: Mesh, reading: dict[str, Any], wishes: Wishes, how: dict[str, Any]
) -> Made:
    """The edited mesh.

    Raises:
        Problem: as `Shapes.edit`, and for a length that was given to an angle, or the like.
    """
    made = shapes.edit(mesh, reading, wishes.edits, wishes.constraints, how)
    rows = {**made.report["parameters"], **made.report["derived"]}
    units = {known: row["unit"] for known, row in rows.items()}
    wrong = require_kinds(wishes.kinds, units)
    if wrong is not None:
        own = {"rad": "an angle", "1": "a plain number"}.get(units[wrong], "a length")
        raise Problem(
            "unit_mismatch",
            f"{wrong} was given in a unit of {wishes.kinds[wrong]}, but it is {own}.",
            "Give it a unit of its own kind, or none.",
        )
    return made
