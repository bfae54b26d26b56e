"""`shape-edit augment`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from service.cli.options import (
    READING,
    Where,
    editing_options,
    picked,
    reading_options,
    telling_options,
    where_options,
)
from service.cli.output import Output
from service.cli.problem import FAILED, Problem

HOW = ("keep", "mode", "format", "strict")
FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)


@click.command()
@click.argument("directory", metavar="DIR", type=FOLDER)
@click.option(
    "-o",
    "--out",
    required=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the variants; a run that was ended goes on there.",
)
@click.option(
    "-n", "--count", type=int, default=20, show_default=True, help="Variants of each mesh."
)
@click.option(
    "--seed", type=int, default=1, show_default=True, help="Another one makes other variants."
)
@click.option(
    "--strength",
    type=float,
    default=1.0,
    show_default=True,
    help="How far from each mesh towards draws from real shapes, 0 to 1.",
)
@click.option(
    "--engine",
    type=click.Choice(["local", "ray"]),
    default="local",
    show_default=True,
    help="Processes of this machine, or a Ray cluster (RAY_ADDRESS).",
)
@click.option("--workers", type=int, help="How many at once; by default one a CPU.")
@click.option(
    "--shard",
    metavar="I/N",
    default="1/1",
    show_default=True,
    help="The I-th of N shares of the meshes, for machines that know nothing of each other.",
)
@click.option(
    "--deadline",
    "deadline_s",
    type=float,
    metavar="SECONDS",
    default=600.0,
    show_default=True,
    help="That one mesh may take.",
)
@click.option("-f", "--force", is_flag=True, help="Do again what is done already.")
@editing_options()
@reading_options()
@telling_options()
@where_options()
def augment(
    directory: Path, out: Path, url: str | None, api_key: str | None, as_json: bool, quiet: bool,
    **given: Any,
) -> None:  # fmt: skip
    """Make plausible variants of all meshes of a folder, with labels, for machine learning.

    Each mesh gets edits towards random draws from real shapes. OUT/meshes holds the variants,
    OUT/manifest a Parquet file a mesh: parameters, part labels of vertices, where each comes from.
    A mesh that can't be used is recorded there and left out. What is done is not done again.

    \b
    Examples:
      shape-edit augment chairs --out varied -n 20 --seed 1
      shape-edit augment chairs --out varied -n 20 --category chair --workers 2
      shape-edit augment chairs --out varied -n 20 --shard 2/8 --json
    """
    reading, how = picked(given, READING), picked(given, HOW)
    output = Output(as_json, quiet)
    try:
        shapes = Where(url, api_key).shapes()
        with output.counting(str(directory)) as tell:
            summary = shapes.augment(directory, out, reading, how, given, tell)
    except Problem as problem:
        output.failed(problem)
        output.finish()
        return
    output.document(summary)
    if output.talks:
        from service.cli import tables

        output.show(*tables.augmented(summary))
    if summary["failed"]:
        raise click.exceptions.Exit(FAILED)
