"""`shape-edit categories`."""

from __future__ import annotations

import click

from service.cli.names import CategoryName
from service.cli.options import Where, telling_options, where_options
from service.cli.output import Output
from service.cli.problem import Problem


@click.command()
@click.argument("name", required=False, type=CategoryName())
@telling_options()
@where_options()
def categories(
    name: str | None, as_json: bool, quiet: bool, url: str | None, api_key: str | None
) -> None:
    """List what can be edited; of a category, its parameters with their ranges.

    \b
    Examples:
      shape-edit categories
      shape-edit categories chair
      shape-edit categories chair --json
    """
    output = Output(as_json, quiet)
    try:
        shapes = Where(url, api_key).shapes()
        if name is None:
            entries = shapes.categories()
            output.document({"categories": entries})
        else:
            entry = shapes.category(name)
            output.document(entry)
    except Problem as problem:
        output.failed(problem)
    else:
        if output.talks:
            from service.cli import tables

            output.show(*([tables.categories(entries)] if name is None else tables.category(entry)))
    output.finish()
