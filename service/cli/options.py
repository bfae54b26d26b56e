"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from service.cli.names import CategoryName, KeepPoint, ParameterNames
from service.cli.quantities import METRES

if TYPE_CHECKING:
    from service.cli.shapes import Shapes

Command = Callable[..., Any]
Decorator = Callable[[Command], Command]

DIRECTIONS = ("auto", "+x", "-x", "+y", "-y", "+z", "-z")
MODES = ("blend", "paper")
FORMATS = ("glb", "gltf", "obj", "ply", "stl", "off")
READING = ("category", "up", "front", "units", "refine")
"""Names of the options of `reading_options`."""


@dataclass(frozen=True)
class Where:
    """Who does the work: this process, or the service at a URL."""

    url: str | None
    api_key: str | None

    def shapes(self) -> Shapes:
        """That which does it; what it takes is imported only now."""
        if self.url is None:
            from service.cli.local import Local

            return Local()
        from service.cli.remote import Remote

        remote = Remote(self.url, self.api_key)
        click.get_current_context().call_on_close(remote.client.close)
        return remote


def _all(*decorators: Decorator) -> Decorator:
    """Several decorators as one, the first outermost."""

    def decorate(command: Command) -> Command:
        for decorator in reversed(decorators):
            command = decorator(command)
        return command

    return decorate


def where_options() -> Decorator:
    """--url, --api-key."""
    return _all(
        click.option(
            "--url",
            envvar="SHAPE_URL",
            show_envvar=True,
            metavar="URL",
            help="Have a service do it, such as http://127.0.0.1:8000, instead of this process.",
        ),
        click.option(
            "--api-key",
            envvar="SHAPE_API_KEY",
            show_envvar=True,
            metavar="KEY",
            help="The key that the service wants.",
        ),
    )


def telling_options() -> Decorator:
    """--json, --quiet."""
    return _all(
        click.option(
            "--json", "as_json", is_flag=True, help="JSON, a document a line, and only that."
        ),
        click.option("-q", "--quiet", is_flag=True, help="Tell nothing but problems."),
    )


def reading_options() -> Decorator:
    """How a mesh is to be read: `READING`."""
    return _all(
        click.option(
            "-c",
            "--category",
            type=CategoryName(),
            default="auto",
            show_default=True,
            help="What it is; saying so is faster than having it found.",
        ),
        _direction("--up", "The mesh's axis that points up."),
        _direction("--front", "The mesh's axis that points to the front."),
        click.option(
            "-u",
            "--units",
            type=click.Choice(list(METRES)),
            default="m",
            show_default=True,
            help="The file's unit of length, and the answer's; glTF is always metres.",
        ),
        click.option(
            "--refine/--no-refine",
            default=True,
            help="Whether to improve the values by a fit to the mesh.",
        ),
    )


def name_option() -> Decorator:
    """--name."""
    return click.option(
        "--name",
        metavar="FILENAME",
        help="What the mesh from standard input is called; the suffix tells its format.",
    )


def _direction(option: str, text: str) -> Decorator:
    kind = click.Choice(DIRECTIONS)
    return click.option(option, type=kind, default="auto", show_default=True, help=text)


def writing_options(what: str) -> Decorator:
    """--output, --force.

    Args:
        what: is written, for the help: ``chair-<what>.glb``.
    """
    return _all(
        click.option(
            "-o",
            "--output",
            "out",
            metavar="OUT",
            type=click.Path(allow_dash=True),
            help="File to write, DIR/ for a folder, or - for standard output; by default "
            f"NAME-{what} beside the input.",
        ),
        click.option("-f", "--force", is_flag=True, help="Replace files that are there already."),
    )


def keep_option() -> Decorator:
    """--keep."""
    return click.option(
        "--keep",
        type=KeepPoint(),
        help="The point that stays in place, such as floor; see `shape-edit categories NAME`.",
    )


def editing_options() -> Decorator:
    """How an edit is carried out: mode, keep, format, strict."""
    return _all(
        keep_option(),
        click.option(
            "--mode",
            type=click.Choice(MODES),
            default="blend",
            show_default=True,
            help="How the mesh follows: blended transforms of its parts, or the paper's rule.",
        ),
        click.option(
            "--format",
            type=click.Choice(FORMATS),
            help="To write; by default what OUT ends in, or the file's own. Any other holds "
            "the bare geometry.",
        ),
        click.option(
            "--strict",
            is_flag=True,
            help="Refuse what can't be had to the letter, instead of making the nearest.",
        ),
    )


def offering_options() -> Decorator:
    """What a mesh with sliders offers: parameters, keep, paired, quantize, joint_names, rest."""
    return _all(
        click.option(
            "-p",
            "--parameters",
            type=ParameterNames(),
            help="The sliders to offer, with commas between; by default all.",
        ),
        keep_option(),
        click.option(
            "--paired",
            is_flag=True,
            help="Two targets a parameter, for viewers that clamp to 0..1.",
        ),
        click.option("--quantize", is_flag=True, help="16-bit displacements: a third smaller."),
        click.option(
            "--joint-names",
            type=click.Choice(["smpl", "mixamo", "vrm"]),
            default="smpl",
            show_default=True,
            help="What the joints of a body are called.",
        ),
        click.option(
            "--rest",
            type=click.Choice(["upload", "t_pose"]),
            default="upload",
            show_default=True,
            help="The pose that a body is bound in.",
        ),
    )


def picked(given: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Those options; they are taken out of ``given``."""
    return {name: given.pop(name) for name in names}
