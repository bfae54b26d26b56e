"""What pydantic finds wrong with a form, told in words of the form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from starlette.datastructures import UploadFile

from service.api.keeping import PARTS

Explanation = tuple[str, str, str]


def explain(errors: Sequence[Mapping[str, Any]]) -> Explanation:
    """Code, detail and suggestion for a form's errors: an unknown field first, else all of them."""
    unknown = [error for error in errors if error["type"] == "extra_forbidden"]
    if unknown:
        return _unknown_field(unknown[0])
    # An optional field fails once for its type and once more for not being absent.
    by_field = {_field(error): error for error in reversed(errors)}
    explanations = [_explain(name, by_field[name]) for name in reversed(by_field)]
    code = explanations[0][0]
    return code, " ".join(e[1] for e in explanations), " ".join(e[2] for e in explanations)


def _field(error: Mapping[str, Any]) -> str:
    return str(error["loc"][1])[:80]


def _unknown_field(error: Mapping[str, Any]) -> Explanation:
    name = _field(error)
    known = list(error["ctx"]["known"])
    near = get_close_matches(name, known, n=1)
    guess = f"Did you mean {near[0]!r}? " if near else ""
    return (
        "unknown_field",
        f"There is no form field {name!r} here.",
        f"{guess}The fields are {', '.join(known)}.",
    )


def _explain(name: str, error: Mapping[str, Any]) -> Explanation:
    value = error.get("input")
    if error["type"] == "missing":
        return "field_missing", f"The form field {name!r} is missing.", f"Add -F {name}=..."
    if name in PARTS:
        return (
            "field_invalid",
            f"The part {name!r} came as text, not as a file.",
            f"Send the file itself, with its name: curl -F {name}=@chair.glb (mind the @).",
        )
    if isinstance(value, UploadFile):
        return (
            "field_invalid",
            f"The form field {name!r} came as a file.",
            f"Send it as plain text: curl -F {name}=...",
        )
    return "field_invalid", f"{name}: {str(value)[:80]!r} is not allowed.", _allowed(name, error)


def _allowed(name: str, error: Mapping[str, Any]) -> str:
    match error["type"]:
        case "literal_error":
            return f"{name} is one of {error['ctx']['expected'].replace(' or ', ', ')}."
        case "bool_parsing" | "bool_type":
            return f"{name} is one of true, false, 1, 0."
        case "int_parsing" | "int_parsing_size" | "int_from_float":
            return f"{name} is a whole number."
        case "float_parsing":
            return f"{name} is a number."
        case "greater_than_equal":
            return f"{name} is at least {error['ctx']['ge']}."
        case "less_than_equal":
            return f"{name} is at most {error['ctx']['le']}."
        case "too_short" | "string_too_short":
            return f"{name} is not empty."
        case "too_long" | "string_too_long":
            return f"{name} has at most {error['ctx']['max_length']} characters."
        case _:
            return f"{name}: {error['msg']}."
