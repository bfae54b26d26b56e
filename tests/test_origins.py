from __future__ import annotations

import pytest

from service.origins import origins


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ()),
        (" , ", ()),
        ("*", ("*",)),
        ("https://shapes.example", ("https://shapes.example",)),
        ("HTTPS://Shapes.Example/", ("https://shapes.example",)),
        ("https://a.example:443,http://a.example:80", ("https://a.example", "http://a.example")),
        ("http://localhost:5173, http://[::1]:80", ("http://localhost:5173", "http://[::1]")),
        ("https://a.example,https://a.example/", ("https://a.example",)),
        ("tauri://localhost", ("tauri://localhost",)),
    ],
)
def test_origins_are_read_as_browsers_write_them(text: str, expected: tuple[str, ...]) -> None:
    assert origins(text) == expected
    assert origins(expected) == expected


@pytest.mark.parametrize(
    "text",
    [
        "shapes.example",
        "https://shapes.example/app",
        "https://*.example",
        "https://me@shapes.example",
        "https://shapes.example:port",
        "https://",
        "null",
        "https://a.example https://b.example",
        "https://a.example\nX: y",
    ],
)
def test_what_is_no_origin(text: str) -> None:
    with pytest.raises(ValueError, match="is no origin"):
        origins(f"https://fine.example,{text}")


def test_all_is_all() -> None:
    with pytest.raises(ValueError, match="leave out the others"):
        origins("*,https://a.example")
