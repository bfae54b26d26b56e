from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml

from service.api.openapi import as_yaml
from service.main import create_app

COMMITTED = Path(__file__).parent.parent / "openapi.yaml"


@pytest.fixture(scope="module")
def spec() -> dict[str, Any]:
    return create_app().openapi()


def test_the_committed_document_is_the_apps(spec: dict[str, Any]) -> None:
    assert COMMITTED.read_text("utf-8") == as_yaml(spec), (
        "openapi.yaml is out of date: python -m service.api.openapi > openapi.yaml"
    )


def test_the_service_hands_out_the_same_with_the_categories_that_it_has(
    client_of_docs: httpx.Client,
) -> None:
    installed = [entry["name"] for entry in client_of_docs.get("/categories").json()["categories"]]
    answer = client_of_docs.get("/openapi.json").json()
    for form in ("InferForm", "EditForm"):
        field = answer["components"]["schemas"][form]["properties"]["category"]
        assert field["enum"] == ["auto", *installed]
    for schema in answer["components"]["schemas"].values():
        schema.get("properties", {}).get("category", {}).pop("enum", None)
    assert answer == yaml.safe_load(COMMITTED.read_text("utf-8"))


@pytest.fixture
def client_of_docs(serve: Any) -> httpx.Client:
    return serve(create_app())


def test_every_operation_is_told_in_words_and_problems(spec: dict[str, Any]) -> None:
    for path, operations in spec["paths"].items():
        for operation in operations.values():
            assert operation["summary"], path
            assert operation["description"], path
            assert "200" in operation["responses"], path
            for status, response in operation["responses"].items():
                if int(status) >= 400:
                    assert list(response["content"]) == ["application/problem+json"], path


def test_every_reference_leads_somewhere(spec: dict[str, Any]) -> None:
    text = as_yaml(spec)
    schemas = spec["components"]["schemas"]
    used = set(re.findall(r"\$ref: '?([^'\n]+)", text))
    assert used <= {f"#/components/schemas/{name}" for name in schemas}
    assert "$defs" not in text
    assert "HTTPValidationError" not in schemas


def test_an_edit_is_documented_as_a_file_and_as_a_report(spec: dict[str, Any]) -> None:
    content = spec["paths"]["/edit"]["post"]["responses"]["200"]["content"]
    assert content["model/gltf-binary"]["schema"] == {"type": "string", "format": "binary"}
    assert content["application/json"]["schema"] == {"$ref": "#/components/schemas/EditReport"}
