from __future__ import annotations

from itertools import compress
from typing import Any

import httpx

from service.api.schemas import Categories, Category
from service.template.loader import load_template


def test_every_installed_category_is_listed(client: httpx.Client) -> None:
    answer = Categories.model_validate_json(client.get("/categories").content, extra="forbid")
    assert [category.name for category in answer.categories] == ["stool"]
    one = Category.model_validate_json(client.get("/categories/stool").content, extra="forbid")
    assert answer.categories == [one]


def test_a_category_that_is_not_there(client: httpx.Client, problem: Any) -> None:
    document = problem(client.get("/categories/teapot"), 404, "unknown_category")
    assert "teapot" in document.detail
    assert "stool" in document.suggestion


def test_the_chair_describes_all_its_parameters(service_client: httpx.Client) -> None:
    answer = Category.model_validate_json(
        service_client.get("/categories/chair").content, extra="forbid"
    )
    template = load_template("chair")
    assert [p.name for p in answer.parameters if not p.derived] == list(
        compress(template.names, template.public)
    )
    assert {p.name for p in answer.parameters if p.derived} == set(template.derived)
    assert answer.keep == list(template.anchors)
    for parameter in answer.parameters:
        assert parameter.typical[0] < parameter.typical[1]
        assert 0 < parameter.step < parameter.typical[1] - parameter.typical[0]
