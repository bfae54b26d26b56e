"""What the client takes answers for is what the service says that they are."""

from __future__ import annotations

from typing import Any, Literal

import pytest
from pydantic import BaseModel

from service.api import schemas
from service.client import models

WORDS = {"title", "description", "examples", "default", "format"}

NAMES = sorted(
    name
    for name, kind in vars(schemas).items()
    if isinstance(kind, type) and issubclass(kind, schemas.Schema) and kind is not schemas.Schema
)


def types(kind: type[BaseModel]) -> dict[str, Any]:
    """The types of a model's fields, and which are required: what is said about them, and closed
    sets of texts, which are any texts to a client, are left out."""
    found = plain(kind.model_json_schema())
    assert isinstance(found, dict)
    found.pop("$defs", None)
    return found


def plain(schema: Any) -> Any:
    if isinstance(schema, list):
        return [plain(inner) for inner in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {name: plain(inner) for name, inner in schema.items() if name not in WORDS}
    if "properties" in schema:
        kept["properties"] = {name: plain(inner) for name, inner in schema["properties"].items()}
    if "required" in schema:
        kept["required"] = sorted(schema["required"])
    if kept.get("additionalProperties") is True:
        del kept["additionalProperties"]
    if kept.get("type") == "string":
        kept.pop("enum", None)
        kept.pop("const", None)
    return kept


@pytest.mark.parametrize("name", NAMES)
def test_types_are_the_schemas(name: str) -> None:
    theirs, own = types(getattr(schemas, name)), types(getattr(models, name))
    if name == "ProblemDocument":  # a proxy's may lack some
        assert set(own.pop("required")) <= set(theirs.pop("required"))
    if name == "Job":  # the document as it came, with all that a problem may have
        problem = own["properties"].pop("problem")
        assert problem == {"anyOf": [{"type": "object"}, {"type": "null"}]}
        assert theirs["properties"].pop("problem")["anyOf"][0] == {
            "$ref": "#/$defs/ProblemDocument"
        }
    assert own == theirs


def test_another_type_is_noticed() -> None:
    def model(kind: Any, **more: Any) -> dict[str, Any]:
        return types(type("A", (BaseModel,), {"__annotations__": {"a": kind}, **more}))

    assert model(Literal["m", "cm"]) == model(str) == model(Literal["m"])
    others = [int, float, str | None, list[str], dict[str, str], models.Change]
    found = [model(kind) for kind in [str, *others]] + [model(str, a="")]
    assert all(found.count(one) == 1 for one in found)


def test_answers_may_gain_fields() -> None:
    told = models.Alive.model_validate({"status": "alive", "since": 3})
    assert told.model_extra == {"since": 3}
