"""Which entries of a template file can't be compiled, and what to do about each."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from model_export.mistakes import Mistake
from model_export.new import NAME
from service.mesh.frame import AUTO
from service.template.loader import TemplateError, compile_template


def find_entry_mistakes(spec: Any) -> list[Mistake]:
    """Entries that can't be compiled, each compiled alone so that all are told at once.

    Args:
        spec: the parsed YAML.
    """
    if not isinstance(spec, Mapping):
        return [Mistake("the file", "holds no entries; `model_export.new` writes one that does")]
    lacking = [
        n for n in ("name", "label", "points", "parameters", "parts", "keep") if not spec.get(n)
    ]
    found = [Mistake(name, _LACKING.get(name, "is missing or empty: add it")) for name in lacking]
    name = str(spec.get("name"))
    if "name" not in lacking and (not NAME.fullmatch(name) or name == AUTO):
        found.append(Mistake("name", f"{name!r}: use small letters, digits and _, a letter first"))
    if "parameters" in lacking or not isinstance(spec["parameters"], Mapping):
        return found
    return found + [
        Mistake(f"{section} {entry}", _advised(re.sub("^part(ameter)? '[^']*': ", "", text)))
        for section in ("parameters", "parts", "relations", "derived", "keep")
        for entry, alone in _alone(spec, section)
        if (text := _fault(alone)) is not None
    ]


_LACKING = {
    "keep": "is missing or empty: name at least one point that an edit can hold in place, such as "
    "the floor",
    "points": "is missing: 2048 suits most objects",
}


def _alone(spec: Mapping[str, Any], section: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Templates of one entry of a section each, with as little as possible beside it."""
    entries = spec.get(section) or {}
    if not isinstance(entries, Mapping):
        entries = {f"{number} ({text})": text for number, text in enumerate(entries, 1)}
    for name, entry in entries.items():
        parameters = _sound(spec["parameters"])
        whole = {
            "name": "alone", "label": "", "points": 1, "parameters": parameters,
            "parts": {"probe": _probe(next(iter(parameters)))}, "keep": {"origin": [0, 0, 0]},
        }  # fmt: skip
        if section == "parameters":
            yield name, whole | {section: parameters | {str(name): entry}}
        elif section == "relations":
            yield name, whole | {section: [entry]}
        else:
            yield name, whole | {section: {name: entry}}


def _sound(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters, with stand-ins for those whose own entry is wrong."""
    good = {"label": "", "group": "", "range": [1.0, 2.0]}
    return dict.fromkeys(map(str, parameters), good)


def _probe(parameter: str) -> dict[str, Any]:
    return {"shape": "box", "cells": [1, 1, 1], "center": [0, 0, 0], "size": [parameter] * 3}


def _fault(spec: Mapping[str, Any]) -> str | None:
    try:
        compile_template(spec)
    except TemplateError as error:
        return str(error)
    return None


def _advised(text: str) -> str:
    for sign, advice in _ADVICE.items():
        if sign in text:
            return f"{text}; {advice}"
    return text


_ADVICE = {
    "no parameter is named": "list it under `parameters`, or correct the spelling",
    "product of parameters": "write it as a sum, or make the product a parameter of its own",
    "dividing by a parameter": "make the ratio a number, or the quotient a parameter of its own",
    "is not an expression": "use numbers, parameter names, + - * / and brackets",
    "is empty": "write [smallest, largest], the smaller first",
    "not in list": "`by` lists names of parameters",
    "the entry": "add it",
}
