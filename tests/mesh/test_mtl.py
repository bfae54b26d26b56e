from __future__ import annotations

import pytest

from service.mesh.mtl import Picture, colour, number, picture, read_materials


def test_materials_by_name() -> None:
    text = b"Kd 9 9 9\r\n# no\r\nnewmtl my wood\r\n\tKd\t0.1 0.2 0.3\r\n"
    text += b"newmtl\xc3\xa4\r\nnewmtl b\r\nd 1\r\n"
    found = read_materials(b"\xef\xbb\xbf" + text)
    assert found["my wood"] == {"kd": "0.1 0.2 0.3", "newmtl\xe4": ""}
    assert found["b"] == {"d": "1"}
    assert read_materials(b"newmtl \xff\nd 1") == {"\xff": {"d": "1"}}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.1 0.2 0.3", [0.1, 0.2, 0.3]),
        ("0.5", [0.5, 0.5, 0.5]),
        ("2 -1 0.5 7", [1, 0, 0.5]),
        ("spectral file.rfl", None),
        ("nan 0 0", None),
        ("", None),
    ],
)
def test_colours(text: str, expected: list[float] | None) -> None:
    assert colour({"kd": text}, "kd") == expected
    assert colour({}, "kd") is None


def test_the_first_number_there_is() -> None:
    assert number({"a": "x", "b": "2.5 1"}, "a", "b", "c") == 2.5
    assert number({"a": "1e999"}, "a") is None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a.png", Picture("a.png")),
        ("my wood.png", Picture("my wood.png")),
        ('"my wood.png"', Picture("my wood.png")),
        ("-clamp on -bm 0.5 -mm 0 1  a b.png", Picture("a b.png")),
        ("-s 2 3 1 -o 0.5 a.png", Picture("a.png", (0.5, 0.0), (2.0, 3.0))),
        ("-t 1 2 3 -blendu off -a.png", Picture("-a.png")),
    ],
)
def test_pictures(text: str, expected: Picture) -> None:
    assert picture({"map_kd": text}, "map_kd") == expected


@pytest.mark.parametrize("text", ["", "-s 1 1 1", "-s", "-mm", "-clamp on"])
def test_options_without_a_picture(text: str) -> None:
    assert picture({"map_kd": text, "map_ka": "b.png"}, "map_kd") is None
    assert picture({"map_kd": text, "map_ka": "b.png"}, "map_kd", "map_ka") == Picture("b.png")
