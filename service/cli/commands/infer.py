"""`shape-edit infer`."""

from __future__ import annotations

from typing import Any

import click

from service.cli.meshes import read
from service.cli.names import MeshFile
from service.cli.options import (
    READING,
    Where,
    name_option,
    picked,
    reading_options,
    telling_options,
    where_options,
)
from service.cli.output import Output
from service.cli.run import each


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=MeshFile())
@reading_options()
@name_option()
@telling_options()
@where_options()
def infer(
    files: tuple[str, ...], name: str | None, url: str | None, api_key: str | None,
    as_json: bool, quiet: bool, **given: Any,
) -> None:  # fmt: skip
    """Tell the parameters of meshes, in real units, with an uncertainty.

    FILE may be - for standard input. Of several files, one that can't be served stops none of the
    others.

    \b
    Examples:
      shape-edit infer chair.glb
      shape-edit infer chair.glb --json
      shape-edit infer *.glb --category chair
      cat chair.glb | shape-edit infer -
    """
    reading = picked(given, READING)
    shapes = Where(url, api_key).shapes()
    output = Output(as_json, quiet, several=len(files) > 1)

    def work(file: str) -> None:
        mesh = read(file, name)
        with output.busy(file, shapes):
            report = shapes.infer(mesh, reading)
        output.document({"file": file, **report})
        if output.talks:
            from service.cli import tables

            output.titled(file, tables.inferred(report, shapes.category(report["category"])))

    each(files, work, output)
