from __future__ import annotations

import json
from typing import Any

import pytest

from service.errors import InvalidMesh, UnsupportedFormat
from service.mesh.buffers import Buffers, Draft, data_uri
from service.mesh.document import Document

CHUNK = memoryview(b"0123456789")


def buffers(*entries: dict[str, Any], chunk: memoryview | None = None) -> Buffers:
    return Buffers(Document("gltf", json.dumps({"buffers": entries}).encode()), chunk)


def test_first_buffer_without_uri_is_the_chunk() -> None:
    found = buffers({"byteLength": 8}, {"byteLength": 2, "uri": "data:;base64,aGk="}, chunk=CHUNK)
    assert bytes(found[0]) == b"01234567"
    assert bytes(found[1]) == b"hi"
    assert (found.in_chunk(0), found.in_chunk(1)) == (True, False)


@pytest.mark.parametrize("uri", ["scene.bin", "http://localhost/a.bin", "file:///etc/passwd", ""])
def test_other_files_are_never_opened(uri: str) -> None:
    with pytest.raises(UnsupportedFormat) as caught:
        buffers({"byteLength": 2, "uri": uri})[0]
    assert caught.value.code == "external_buffers"
    assert "GLB" in caught.value.suggestion


@pytest.mark.parametrize(
    "entry",
    [
        {"byteLength": 2},
        {"byteLength": 3, "uri": "data:;base64,aGk="},
        {"uri": "data:;base64,aGk="},
        {"byteLength": 2, "uri": "data:text/plain,hi"},
        {"byteLength": 2, "uri": "data:;base64,a*k="},
        {"byteLength": 2, "uri": "data:;base64,aGk"},
        {"byteLength": 2, "uri": "data:;base64,ü"},
        {"byteLength": 2, "uri": 5},
    ],
)
def test_broken_buffers_are_malformed(entry: dict[str, Any]) -> None:
    with pytest.raises(InvalidMesh, match=r"buffers\[0\]|byteLength"):
        buffers(entry)[0]


def test_draft_copies_only_what_changes() -> None:
    original = buffers({"byteLength": 10}, {"byteLength": 2, "uri": "data:;base64,aGk="},
                       chunk=CHUNK)  # fmt: skip
    draft = Draft(original)
    assert draft.changed() == {}
    draft.writable(0)[3:5] = b"xy"
    assert bytes(draft[0]) == b"012xy56789"
    assert bytes(original[0]) == b"0123456789"
    assert {index: bytes(content) for index, content in draft.changed().items()} == {
        0: b"012xy56789"
    }


def test_additions_are_aligned_and_follow_the_buffer() -> None:
    draft = Draft(buffers({"byteLength": 10}, chunk=CHUNK))
    assert draft.append(0, b"abcde") == 12
    assert draft.append(0, b"fg") == 20
    assert bytes(draft.changed()[0]) == b"0123456789\0\0abcde\0\0\0fg"


def test_data_uri_keeps_its_head() -> None:
    assert data_uri("data:model/x;base64,AAAA", b"hi") == "data:model/x;base64,aGk="
