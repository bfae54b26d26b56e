"""`shape-edit`: infer and edit the semantic parameters of meshes on the command line."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from io import TextIOWrapper

import click

from service.cli.commands.augment import augment
from service.cli.commands.categories import categories
from service.cli.commands.completion import completion
from service.cli.commands.edit import edit
from service.cli.commands.infer import infer
from service.cli.commands.jobs import jobs
from service.cli.commands.serve import serve
from service.cli.commands.sliders import sliders, template
from service.cli.commands.transfer import transfer
from service.cli.problem import INTERRUPTED

PROGRAM = "shape-edit"


def _print_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        from importlib.metadata import version

        click.echo(f"{PROGRAM} {version('shape-parameters')}")
        ctx.exit()


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Show the version and exit.",
)
def cli() -> None:
    """Edit 3D shapes by what they mean: seat width, wing length, the bend of an elbow.

    Everything is done on this machine, with the models that come along; --url has a service do it.

    \b
    Examples:
      shape-edit infer chair.glb
      shape-edit edit chair.glb 'seat_width*=1.2' seat_top_height=45cm -o wide.glb
      shape-edit categories chair

    \b
    Exit codes:
      0    fine
      1    a file couldn't be served; what is wrong is told on standard error
      2    the command line, or a setting, makes no sense
      3    the service at --url can't be reached
      130  Ctrl-C
      141  whoever read the output is gone
    """


for command in (
    infer,
    edit,
    sliders,
    template,
    transfer,
    augment,
    jobs,
    categories,
    serve,
    completion,
):
    cli.add_command(command)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and answer the exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal may lack a character of a table
    try:
        code = cli.main(
            None if arguments is None else list(arguments), PROGRAM, standalone_mode=False
        )
    except (click.exceptions.Abort, KeyboardInterrupt):
        return INTERRUPTED
    except click.ClickException as error:
        error.show()
        return error.exit_code
    return code if isinstance(code, int) else 0


if __name__ == "__main__":
    sys.exit(main())
