from __future__ import annotations

import pytest

from service.api.accept import negotiate

MESH, JSON = "model/obj", "application/json"


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        ("", MESH),
        ("*/*", MESH),
        (JSON, JSON),
        ("Application/JSON; charset=utf-8", JSON),
        ("application/*", JSON),
        ("application/json, */*", JSON),
        ("application/json, text/plain, */*", JSON),
        ("application/json, application/problem+json", JSON),
        ("application/json;q=0.5, model/obj", MESH),
        ("application/json;q=0.5, */*;q=0.1", JSON),
        ("application/json;q=0.5, model/*;q=0.6", MESH),
        ("application/json;q=0", MESH),
        ("application/json;q=0, */*;q=0.1", MESH),
        ("model/obj;q=0.2, application/json;q=0.9", JSON),
        ("model/obj, application/json", MESH),
        ("application/json, model/obj", JSON),
        ("*/*;q=0.8, model/obj;q=0", JSON),
        ("text/html", MESH),
        ("application/json;q=banana, */*;q=0.1", MESH),
        ("application/json;q=7, model/obj;q=0.9", JSON),
    ],
)
def test_quality_then_specificity_then_order_decide(accept: str, expected: str) -> None:
    assert negotiate(accept, [MESH, JSON]) == expected
