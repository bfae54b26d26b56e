"""Edits and constraints as people type them: ``seat_width*=1.2``, ``total_width=..60cm``.

name=45cm      sets            name=120%  name*=1.2  name/=2   scale
name+=5cm      adds            name+=10%  name-=10%            scale by 1.1, by 0.9
name=40cm..50cm  name=..60cm  name=40cm..  'name<=60cm'  'name>=40cm'   are constraints
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import click

from service.cli.quantities import Kind, Quantity, read_quantity

_ASSIGNMENT = re.compile(r"(?P<name>[^\W\d]\w*)\s*(?P<sign>[-+*/<>]?=)(?P<value>.*)", re.DOTALL)
_FORMS = "Write name=0.45, name=45cm, name+=5cm, name*=1.2, name=120% or name=40cm..50cm."


@dataclass
class Wishes:
    """What is to become of a shape, as the service takes it.

    Attributes:
        edits: by name, ``{"set": v}``, ``{"add": v}`` or ``{"scale": s}``.
        constraints: by name, ``min``, ``max``, both, or ``set``.
        kinds: of the names that were given a unit, what it was of.
    """

    edits: dict[str, Any] = field(default_factory=dict)
    constraints: dict[str, Any] = field(default_factory=dict)
    kinds: dict[str, Kind] = field(default_factory=dict)


def is_assignment(text: str) -> bool:
    """Whether an argument reads like an edit or a constraint, rather than a file's name."""
    return _ASSIGNMENT.fullmatch(text) is not None


def read_wishes(
    arguments: Iterable[str], units: str, edits: str | None = None, constraints: str | None = None
) -> Wishes:
    """All that a command line asks for.

    Args:
        arguments: those that `is_assignment`.
        units: of the plain numbers among them, and of what comes out.
        edits, constraints: the service's own JSON, or ``@file`` with it; checked by the service.

    Raises:
        click.UsageError: for what can't be read, or a name that is given twice.
    """
    wishes = Wishes(_object(edits, "--edits"), _object(constraints, "--constraints"))
    for text in arguments:
        _add(wishes, text, units)
    return wishes


def _add(wishes: Wishes, text: str, units: str) -> None:
    found = _ASSIGNMENT.fullmatch(text)
    assert found is not None
    name, sign, value = found["name"], found["sign"], found["value"]
    if sign in ("<=", ">=") or (sign == "=" and ".." in value):
        low, _, high = value.partition("..") if sign == "=" else (value, "", value)
        ends = {"min": low if sign != "<=" else "", "max": high if sign != ">=" else ""}
        quantities = {end: _quantity(text, part) for end, part in ends.items() if part.strip()}
        if not quantities or any(found.kind == "percent" for found in quantities.values()):
            raise click.UsageError(f"{text!r} is no constraint. {_FORMS}")
        _note(wishes, name, text, quantities.values())
        numbers = {end: found.number(units) for end, found in quantities.items()}
        if name in wishes.edits or set(numbers) & set(wishes.constraints.setdefault(name, {})):
            raise _twice(name)
        wishes.constraints[name] |= numbers
        return
    quantity = _quantity(text, value)
    if name in wishes.edits or name in wishes.constraints:
        raise _twice(name)
    _note(wishes, name, text, [quantity])
    wishes.edits[name] = _change(text, sign, quantity, units)


def _change(text: str, sign: str, quantity: Quantity, units: str) -> dict[str, float]:
    value, percent = quantity.number(units), quantity.kind == "percent"
    match sign:
        case "=":
            return {"scale": value} if percent else {"set": value}
        case "+=":
            return {"scale": 1.0 + value} if percent else {"add": value}
        case "-=":
            return {"scale": 1.0 - value} if percent else {"add": -value}
    if quantity.kind not in ("plain", "percent"):
        raise click.UsageError(f"{text!r}: a factor has no unit. {_FORMS}")
    if sign == "*=":
        return {"scale": value}
    if value == 0.0:
        raise click.UsageError(f"{text!r} divides by nothing.")
    return {"scale": 1.0 / value}


def _quantity(text: str, value: str) -> Quantity:
    try:
        return read_quantity(value)
    except ValueError as error:
        raise click.UsageError(f"{text!r}: {value!r} {error}. {_FORMS}") from error


def _note(wishes: Wishes, name: str, text: str, quantities: Iterable[Quantity]) -> None:
    for quantity in quantities:
        measures = quantity.kind in ("length", "angle")
        if measures and wishes.kinds.setdefault(name, quantity.kind) != quantity.kind:
            raise click.UsageError(f"{text!r} is of a length and of an angle at once.")


def _twice(name: str) -> click.UsageError:
    return click.UsageError(f"{name} is asked for twice.")


def _object(text: str | None, option: str) -> dict[str, Any]:
    """An option's JSON object, its entries unread."""
    if text is None:
        return {}
    try:
        if text.startswith("@"):
            with click.open_file(text[1:], encoding="utf-8") as file:
                text = file.read()
        found = json.loads(text)
    except OSError as error:
        raise click.UsageError(f"{option} {text}: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise click.UsageError(f"{option} is no JSON: {error}.") from error
    if not isinstance(found, dict):
        raise click.UsageError(f'{option} is no JSON object such as {{"seat_width": 0.5}}.')
    return found


def require_kinds(kinds: Mapping[str, Kind], units: Mapping[str, str]) -> str | None:
    """A name whose value was given in a unit of something else than it measures; None if there is
    none.

    Args:
        kinds: as `Wishes` has them.
        units: of the parameters that there are, ``rad``, ``1`` or one of length.
    """
    of = {"rad": "angle", "1": "plain"}
    return next(
        (
            name
            for name, kind in kinds.items()
            if name in units and of.get(units[name], "length") != kind
        ),
        None,
    )
