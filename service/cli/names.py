"""Names of categories, parameters and points for completion, without loading a model.

They are read off the templates beside the models: shipped ones, and those of MODELS_DIR.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from service.shipped import SHIPPED, usual_categories

BUILT_IN = SHIPPED.parent / "template"
BODY_KEEPS = ("floor", "pelvis")


@dataclass(frozen=True)
class Vocabulary:
    """The names that a category has.

    Attributes:
        parameters: and derived dimensions, with their labels.
        keeps: points that can be held in place.
    """

    parameters: dict[str, str]
    keeps: tuple[str, ...]


def categories() -> list[str]:
    """Those that are likely to be there: the usual ones and the operator's own."""
    return sorted({*usual_categories(), *(card.stem for card in _own_cards())})


def vocabulary(category: str | None) -> Vocabulary:
    """The names of a category; of all for None or ``auto``."""
    chosen = (category or "auto").partition("@")[0]
    names = categories() if chosen == "auto" else [chosen]
    found = [_of_category(name) for name in names]
    parameters = {name: label for one in found for name, label in one.parameters.items()}
    return Vocabulary(parameters, tuple(dict.fromkeys(keep for one in found for keep in one.keeps)))


def _own_cards() -> Iterator[Path]:
    folder = os.environ.get("MODELS_DIR")
    if folder:
        yield from Path(folder).glob("*.json")
        yield from Path(folder).glob("*/*.json")


def _of_category(name: str) -> Vocabulary:
    card = next((own for own in _own_cards() if own.stem == name), SHIPPED / f"{name}.json")
    try:
        if json.loads(card.read_text("utf-8")).get("kind") == "skinned":
            return _body()
        own = card.with_suffix(".yaml")
        return _template(own if own.is_file() else BUILT_IN / f"{name}.yaml")
    except (OSError, ValueError):
        return Vocabulary({}, ())


def _body() -> Vocabulary:
    from service.template.anatomy import JOINTS

    joints = ("global_orient", *JOINTS[1:])
    angles = {
        f"{joint}_{axis}": f"{joint.replace('_', ' ')}, about {axis}"
        for joint in joints
        for axis in "xyz"
    }
    shapes = {f"shape_{index}": "shape" for index in range(3)}
    return Vocabulary({**angles, **shapes, "stature": "body height, standing"}, BODY_KEEPS)


def _template(path: Path) -> Vocabulary:
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        spec: dict[str, Any] = yaml.load(path.read_text("utf-8"), loader)
        entries = {**spec["parameters"], **(spec.get("derived") or {})}
        parameters = {
            name: str(entry["label"])
            for name, entry in entries.items()
            if not entry.get("nuisance")
        }
        return Vocabulary(parameters, tuple(spec["keep"]))
    except (yaml.YAMLError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{path} is no template") from error


def _matching(names: dict[str, str], incomplete: str, ending: str = "") -> list[CompletionItem]:
    return [
        CompletionItem(name + ending, help=label)
        for name, label in names.items()
        if name.startswith(incomplete)
    ]


def _category_of(ctx: click.Context) -> str | None:
    return ctx.params.get("category")


class CategoryName(click.ParamType[str]):
    """A category's name; what is none is told by whoever knows the models."""

    name = "category"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Those that are likely to be there."""
        return _matching(dict.fromkeys(["auto", *categories()], ""), incomplete)


class KeepPoint(click.ParamType[str]):
    """A point that an edit can hold in place."""

    name = "point"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Those of the category."""
        points = vocabulary(_category_of(ctx)).keeps
        return _matching(dict.fromkeys(points, ""), incomplete)


class ParameterNames(click.ParamType[tuple[str, ...]]):
    """Names with commas between."""

    name = "names"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, ...]:
        """The names, in order."""
        if isinstance(value, tuple):
            return value
        return tuple(name.strip() for name in value.split(",") if name.strip())

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """The last of the names."""
        before, comma, last = incomplete.rpartition(",")
        given = before.split(",")
        names = vocabulary(_category_of(ctx)).parameters
        rest = {name: label for name, label in names.items() if name not in given}
        return [
            CompletionItem(f"{before}{comma}{item.value}", help=item.help)
            for item in _matching(rest, last)
        ]


class FileOrEdit(click.ParamType[str]):
    """A file, or an edit such as ``seat_width*=1.2``."""

    name = "file or edit"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Names of parameters where the text begins like one, else files."""
        if incomplete and not set(incomplete) & set("/.-"):
            found = _matching(vocabulary(_category_of(ctx)).parameters, incomplete, "=")
            if found:
                return found
        return [CompletionItem(incomplete, type="file")]


class MeshFile(click.ParamType[str]):
    """A mesh file; whether it is there shows when it is read."""

    name = "file"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Files."""
        return [CompletionItem(incomplete, type="file")]
