"""The OpenAPI document: FastAPI's, with the problem schema; `python -m` this prints it as YAML."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import yaml
from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from service.api.context import Context
from service.api.schemas import ProblemDocument
from service.mesh.frame import AUTO

DESCRIPTION = """\
Upload your own mesh; get its named parameters in real units; edit them; get back *the same file*
with only its vertices moved.

    curl -F mesh=@chair.glb http://127.0.0.1:8000/infer
    curl -F mesh=@chair.glb -F 'edits={"seat_width": {"scale": 1.2}}' \\
         http://127.0.0.1:8000/edit -OJ

Formats: `.glb`, `.gltf`, `.obj`, `.ply`, `.stl`, `.off`, or a `.zip` with one of them and the files
that belong to it: a `.gltf` with its `.bin`, an `.obj` with its materials and textures. Form fields
are text: `true` may be `1` and `false` `0`, and an empty field is as good as none. Every error
is an `application/problem+json` with a stable `code`, a `detail` and a `suggestion`. Every answer
has a `Trace-Id`, an `X-Request-Id`, and in `Server-Timing` what its time went into.
"""

TAGS = [
    {"name": "shapes", "description": "Infer and edit."},
    {"name": "meshes", "description": "Meshes that are kept for a while, by content."},
    {"name": "categories", "description": "What can be uploaded."},
    {"name": "probes", "description": "For orchestrators."},
]


SECURITY_SCHEMES = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "An API key, as `Bearer <key>`."},
    "header": {
        "type": "apiKey",
        "in": "header",
        "name": "X-API-Key",
        "description": "The same key, where `Authorization` is taken.",
    },
}


def document(app: FastAPI) -> dict[str, Any]:
    """The app's OpenAPI document; while models are loaded it lists their categories."""
    spec = _contract(app)
    context: Context = app.state.context
    names = context.readiness.names
    return _with_categories(spec, names) if names else spec


def _with_categories(spec: dict[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """The document with the field `category` of each form bound to what is installed."""
    spec = deepcopy(spec)
    for schema in spec["components"]["schemas"].values():
        field = schema.get("properties", {}).get("category", {})
        if field.get("default") == AUTO:
            field["enum"] = [AUTO, *names]
    return spec


def _contract(app: FastAPI) -> dict[str, Any]:
    """The document but for what depends on the installed models, made once."""
    if app.openapi_schema is None:
        spec = get_openapi(
            title=app.title,
            version=app.version,
            summary=app.summary,
            description=DESCRIPTION,
            tags=TAGS,
            routes=app.routes,
        )
        _add_problems(spec["components"]["schemas"])
        _ask_for_keys(spec)
        _tidy_answers(spec)
        app.openapi_schema = spec
    return app.openapi_schema


def _add_problems(schemas: dict[str, Any]) -> None:
    """Add the schema of problems, and those that it refers to."""
    problem = ProblemDocument.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas.update(problem.pop("$defs"))
    schemas["ProblemDocument"] = problem


def _ask_for_keys(spec: dict[str, Any]) -> None:
    """Let each operation that may answer 401 take a key; the empty entry makes it optional."""
    spec["components"]["securitySchemes"] = SECURITY_SCHEMES
    for operations in spec["paths"].values():
        for operation in operations.values():
            if "401" in operation["responses"]:
                operation["security"] = [{}, *({scheme: []} for scheme in SECURITY_SCHEMES)]


def _tidy_answers(spec: dict[str, Any]) -> None:
    """Put answers in order, and leave out FastAPI's own 422, of a shape that is never sent."""
    for operations in spec["paths"].values():
        for operation in operations.values():
            operation["responses"] = dict(sorted(operation["responses"].items()))
            if "application/json" in operation["responses"].get("422", {}).get("content", {}):
                del operation["responses"]["422"]
    for name in ("HTTPValidationError", "ValidationError"):
        spec["components"]["schemas"].pop(name, None)


class _Dumper(yaml.SafeDumper):
    """Writes texts of several lines as blocks, and repeats what is shared."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = "|" if "\n" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _text)


def as_yaml(spec: dict[str, Any]) -> str:
    """The document as YAML, the same text every time."""
    text: str = yaml.dump(spec, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    return text


if __name__ == "__main__":
    from service.main import create_app

    print(as_yaml(create_app().openapi()), end="")
