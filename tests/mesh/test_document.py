from __future__ import annotations

import json
from typing import Any

import pytest

from service.errors import InvalidMesh, TooLarge, UnsupportedFormat
from service.mesh import limits
from service.mesh.document import DEEPEST, Document


def document(**members: Any) -> Document:
    return Document("glb", json.dumps({"asset": {"version": "2.0"}, **members}).encode())


@pytest.mark.parametrize(
    "encoded",
    [b"", b"{", b"[]", b"7", b"\xff{}", b'{"a":' + b"[" * 100_000, b'{"asset":3}', b"nan"],
)
def test_text_that_is_no_document_is_malformed(encoded: bytes) -> None:
    with pytest.raises(InvalidMesh, match="malformed_glb"):
        Document("glb", encoded)


def test_byte_order_mark_is_no_part_of_the_json() -> None:
    assert Document("gltf", b'\xef\xbb\xbf{"x": 1}').root == {"x": 1}


def nested(depth: int) -> Any:
    value: Any = {}
    for _ in range(depth):
        value = {"a": value, "b": [1]}
    return value


def test_nesting_has_an_end() -> None:
    assert document(extras=nested(DEEPEST - 2)).root["asset"]
    for depth in (DEEPEST - 1, 800):
        with pytest.raises(InvalidMesh, match=r"malformed_glb.*nested"):
            document(extras=nested(depth))


@pytest.mark.parametrize("values", ["[]", "{}", "0", '{"a":0}', "[0,[]]"])
def test_values_are_counted_before_they_are_parsed(
    values: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "VALUES", 1000)
    monkeypatch.setattr(json, "loads", None)
    text = '{"asset":{"version":"2.0"},"extras":[' + ",".join([values] * 1000) + "]}"
    with pytest.raises(TooLarge, match="too_many_json_values"):
        Document("gltf", text.encode())


def test_long_strings_are_one_value(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "VALUES", 10)
    assert document(extras="x" * 10_000).root["extras"]


@pytest.mark.parametrize("version", ["1.0", 1, "3.1"])
def test_other_versions_are_unsupported(version: object) -> None:
    with pytest.raises(UnsupportedFormat, match="gltf_version"):
        document(asset={"version": version})


@pytest.mark.parametrize(
    ("extension", "code"),
    [
        ("KHR_draco_mesh_compression", "compressed_geometry"),
        ("EXT_meshopt_compression", "compressed_geometry"),
        ("KHR_meshopt_compression", "compressed_geometry"),
        ("ACME_curved_space", "required_extension"),
        (7, "required_extension"),
    ],
)
def test_required_extensions_that_may_touch_geometry_are_refused(
    extension: object, code: str
) -> None:
    with pytest.raises(UnsupportedFormat) as caught:
        document(extensionsRequired=[extension])
    assert caught.value.code == code
    assert str(extension) in caught.value.detail
    assert "without" in caught.value.suggestion


def test_required_extensions_of_looks_are_fine() -> None:
    names = ["KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"]
    assert document(extensionsRequired=names).array({"x": names}, "x") == names


@pytest.mark.parametrize("value", [-1, 1.5, "1", None, True, [], 1 << 60])
def test_natural_numbers_are_checked(value: object) -> None:
    with pytest.raises(InvalidMesh, match="'count'"):
        document().natural({"count": value}, "count")


def test_members_that_are_missing_take_defaults() -> None:
    empty = document()
    assert empty.natural({}, "n", 3) == 3
    assert empty.array({}, "a") == []
    assert empty.object({}, "o") == {}
    assert empty.numbers({}, "v", [1.0, 2.0]) == [1.0, 2.0]
    with pytest.raises(InvalidMesh):
        empty.natural({}, "n")


@pytest.mark.parametrize("value", [[1], [1, "2"], 3, {"0": 1, "1": 2}, None])
def test_vectors_are_checked(value: object) -> None:
    with pytest.raises(InvalidMesh, match="2 numbers"):
        document().numbers({"v": value}, "v", [0.0, 0.0])


@pytest.mark.parametrize("index", [-1, 1, "0", None, False, 0.0])
def test_references_are_checked(index: object) -> None:
    with pytest.raises(InvalidMesh, match=r"meshes\["):
        document(meshes=[{}]).entry("meshes", index)


@pytest.mark.parametrize(("kind", "call"), [("array", "array"), ("object", "object")])
def test_containers_are_checked(kind: str, call: str) -> None:
    with pytest.raises(InvalidMesh, match=kind):
        getattr(document(), call)({"x": 5}, "x")


def test_entries_must_be_objects() -> None:
    with pytest.raises(InvalidMesh, match="not an object"):
        document(meshes=[3]).entry("meshes", 0)


def test_a_name_that_stands_twice_is_refused() -> None:
    with pytest.raises(InvalidMesh, match="twice"):
        Document("gltf", b'{"asset":{},"meshes":[{"a":1,"b":2,"a":3}]}')


@pytest.mark.parametrize("value", [10**400, -(10**400), float("inf")])
def test_numbers_beyond_floats_are_refused(value: float) -> None:
    with pytest.raises(InvalidMesh, match="2 numbers"):
        document().numbers({"v": [0, value]}, "v", [0.0, 0.0])
