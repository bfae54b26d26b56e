from __future__ import annotations

from typing import Any

import httpx
import pytest

MESH = {"mesh": ("a.obj", b"abc")}


def test_a_mistyped_field_is_told_with_the_right_one(client: httpx.Client, problem: Any) -> None:
    response = client.post("/edit", files=MESH, data={"edit": "{}"})
    document = problem(response, 422, "unknown_field")
    assert "'edit'" in document.detail
    assert "Did you mean 'edits'?" in document.suggestion
    for known in ("mesh", "mesh_id", "category", "up", "front", "units", "refine", "mode", "keep"):
        assert known in document.suggestion


def test_a_field_of_another_call_is_unknown(client: httpx.Client, problem: Any) -> None:
    document = problem(
        client.post("/infer", files=MESH, data={"edits": "{}"}), 422, "unknown_field"
    )
    assert "edits" not in document.suggestion


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("up", "sideways", "'auto', '+x', '-x', '+y', '-y', '+z', '-z'"),
        ("front", "+w", "'auto', '+x', '-x', '+y', '-y', '+z', '-z'"),
        ("units", "furlong", "'m', 'cm', 'mm', 'in', 'ft'"),
        ("refine", "maybe", "true, false, 1, 0"),
        ("mode", "magic", "'blend', 'paper'"),
        ("format", "step", "'glb', 'gltf', 'obj', 'ply', 'stl', 'off'"),
    ],
)
def test_a_wrong_option_is_told_with_what_is_allowed(
    client: httpx.Client, problem: Any, field: str, value: str, allowed: str
) -> None:
    response = client.post("/edit", files=MESH, data={"edits": "{}", field: value})
    document = problem(response, 422, "field_invalid")
    assert document.detail == f"{field}: '{value}' is not allowed."
    assert allowed in document.suggestion


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("count", "0", "count is at least 1."),
        ("count", "1001", "count is at most 1000."),
        ("count", "2.5", "count is a whole number."),
        ("count", "ten", "count is a whole number."),
        ("count", "9" * 5000, "count is a whole number."),
        ("seed", "-1", "seed is at least 0."),
        ("seed", str(2**53), f"seed is at most {2**53 - 1}."),
        ("strength", "1.5", "strength is at most 1.0."),
        ("strength", "some", "strength is a number."),
        ("strength", "nan", "strength is at most 1.0."),
    ],
)
def test_a_wrong_number_is_told_with_its_bounds(
    client: httpx.Client, problem: Any, field: str, value: str, allowed: str
) -> None:
    response = client.post("/augment", files=MESH, data={field: value})
    document = problem(response, 422, "field_invalid")
    assert document.detail == f"{field}: '{value[:80]}' is not allowed."
    assert document.suggestion == allowed


@pytest.mark.parametrize(
    ("key", "allowed"), [("", "is not empty."), ("x" * 256, "has at most 255 characters.")]
)
def test_a_wrong_header_is_told_likewise(
    client: httpx.Client, problem: Any, key: str, allowed: str
) -> None:
    headers = {"Prefer": "respond-async", "Idempotency-Key": key}
    response = client.post("/augment", files=MESH, headers=headers)
    document = problem(response, 422, "field_invalid")
    assert document.suggestion == f"idempotency-key {allowed}"


def test_several_wrong_options_are_told_together(client: httpx.Client, problem: Any) -> None:
    response = client.post("/infer", files=MESH, data={"up": "no", "units": "parsec"})
    detail = problem(response, 422, "field_invalid").detail
    assert "up:" in detail
    assert "units:" in detail


def test_a_missing_field_is_named(client: httpx.Client, problem: Any) -> None:
    assert "'edits'" in problem(client.post("/edit", files=MESH), 422, "field_missing").detail


def test_a_mesh_that_came_as_text(client: httpx.Client, problem: Any) -> None:
    response = client.post("/infer", files={"mesh": (None, "chair.glb")})
    assert "@" in problem(response, 422, "field_invalid").suggestion


def test_an_option_that_came_as_a_file(client: httpx.Client, problem: Any) -> None:
    response = client.post("/infer", files={**MESH, "up": ("up.txt", b"+y")})
    assert "came as a file" in problem(response, 422, "field_invalid").detail
