from __future__ import annotations

import struct
import zipfile

import pytest
from zip_samples import zipped

from service.errors import InvalidMesh, ShapeError, TooLarge, UnsupportedFormat
from service.mesh import limits
from service.mesh.zipdirectory import END, read_directory

DATA = zipped({"a.txt": b"one" * 50, "b/": b"", "b/ü.txt": b"two"}, comment=b"PK\5\6 is a mark")
END_AT = len(DATA) - END.size - len(b"PK\5\6 is a mark")


def test_members_are_found_where_they_are() -> None:
    directory = read_directory(DATA)
    assert [entry.name for entry in directory.entries] == ["a.txt", "b/", "b/ü.txt"]
    assert [entry.size for entry in directory.entries] == [150, 0, 3]
    assert (directory.end, directory.base) == (END_AT, 0)
    last = directory.entries[-1]
    assert last.end == directory.start
    assert DATA[last.start : last.start + 4] == b"PK\3\4"


def test_what_stands_before_an_archive_does_not_shift_it() -> None:
    directory = read_directory(b"#!/bin/sh\n" + DATA)
    assert directory.base == 10
    assert [entry.start - 10 for entry in directory.entries] == [
        entry.start for entry in read_directory(DATA).entries
    ]


def test_names_of_windows_get_forward_slashes() -> None:
    data = zipped({"folder/file.obj": b"v"}).replace(b"folder/file.obj", b"folder\\file.obj")
    assert read_directory(data).entries[0].name == "folder/file.obj"


def test_every_truncation_is_malformed() -> None:
    for length in range(0, len(DATA), 7):
        with pytest.raises(InvalidMesh, match="malformed_zip"):
            read_directory(DATA[:length])


@pytest.mark.parametrize(
    ("at", "form", "value", "code"),
    [
        (4, "<H", 1, "malformed_zip"),
        (8, "<H", 2, "malformed_zip"),
        (12, "<L", 40, "malformed_zip"),
        (12, "<L", 0x7FFFFFFF, "malformed_zip"),
        (16, "<L", 0x7FFFFFFF, "malformed_zip"),
        (16, "<L", 0xFFFFFFFF, "zip64_archive"),
    ],
)
def test_ends_that_lie_are_told(at: int, form: str, value: int, code: str) -> None:
    data = bytearray(DATA)
    struct.pack_into(form, data, END_AT + at, value)
    with pytest.raises(ShapeError) as caught:
        read_directory(bytes(data))
    assert caught.value.code == code


@pytest.mark.parametrize(
    ("at", "value", "code"),
    [
        (0, 0, "malformed_zip"),
        (20, 0x7FFFFFFF, "malformed_zip"),
        (24, 0xFFFFFFFF, "zip64_archive"),
        (24, 0x7FFFFFFF, "archive_too_large"),
        (28, 0x00FF, "malformed_zip"),
        (42, 7, "malformed_zip"),
        (42, 0x7FFFFFFF, "malformed_zip"),
    ],
)
def test_records_that_lie_are_told(at: int, value: int, code: str) -> None:
    data = bytearray(DATA)
    struct.pack_into("<L", data, read_directory(DATA).start + at, value)
    with pytest.raises(ShapeError) as caught:
        read_directory(bytes(data))
    assert caught.value.code == code


def test_zip64_is_refused() -> None:
    locator = b"PK\6\7" + bytes(16)
    with pytest.raises(UnsupportedFormat, match="zip64_archive"):
        read_directory(DATA[:END_AT] + locator + DATA[END_AT:])


def test_two_members_of_one_name_are_refused() -> None:
    data = zipped({"a.obj": b"v", "b.obj": b"v"}).replace(b"b.obj", b"a.obj")
    with pytest.raises(InvalidMesh, match=r"two members 'a\.obj'"):
        read_directory(data)


def test_members_that_share_bytes_are_refused() -> None:
    # Both records point at one member, the way that bombs multiply it.
    data = bytearray(zipped({"a.obj": b"v", "b.obj": b"w"}, zipfile.ZIP_STORED))
    one, other = read_directory(bytes(data)).entries
    # The first claims the second's header and body as its own.
    packed = other.end - one.body
    struct.pack_into("<2L", data, read_directory(bytes(data)).start + 20, packed, packed)
    with pytest.raises(InvalidMesh, match="overlap"):
        read_directory(bytes(data))


def test_members_are_counted_before_they_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "MEMBERS", 2)
    with pytest.raises(TooLarge, match="3 members"):
        read_directory(DATA)


def test_bombs_are_refused_by_what_they_claim(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "SMALL", 1000)
    read_directory(zipped({"a.obj": bytes(1000)}))
    with pytest.raises(TooLarge, match="times its size"):
        read_directory(zipped({"a.obj": bytes(100_000)}))
    monkeypatch.setattr(limits, "INFLATED", 5000)
    with pytest.raises(TooLarge, match="6000 bytes"):
        read_directory(zipped({"a.obj": bytes(3000), "b.obj": bytes(3000)}))
