from __future__ import annotations

import io
import struct
import zipfile
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from zip_samples import members, zipped

from service.errors import InvalidMesh, ShapeError, UnsupportedFormat
from service.mesh.archive import Archive
from service.mesh.zipdirectory import read_directory

CONTENTS = {"a.txt": b"one" * 50, "b/": b"", "b/c.obj": b"two" * 70, "d.png": bytes(range(256))}
KINDS = [(zipfile.ZIP_DEFLATED, False), (zipfile.ZIP_STORED, False), (zipfile.ZIP_DEFLATED, True)]


@pytest.mark.parametrize(("method", "streamed"), KINDS)
def test_members_are_read(method: int, streamed: bool) -> None:
    archive = Archive(zipped(CONTENTS, method, streamed=streamed))
    assert list(archive.members) == ["a.txt", "b/c.obj", "d.png"]
    assert {name: archive.read(name) for name in archive.members} == {
        name: content for name, content in CONTENTS.items() if content
    }


@pytest.mark.parametrize("prefix", [b"", b"#!/bin/sh\n"])
@pytest.mark.parametrize(("method", "streamed"), KINDS)
def test_all_but_the_replaced_member_keeps_its_bytes(
    method: int, streamed: bool, prefix: bytes
) -> None:
    data = prefix + zipped(CONTENTS, method, b"a comment", streamed)
    written = Archive(data).replaced({"b/c.obj": b"three" * 99, "d.png": CONTENTS["d.png"]})
    assert members(written) == {**CONTENTS, "b/c.obj": b"three" * 99}
    old, new = zipfile.ZipFile(io.BytesIO(data)), zipfile.ZipFile(io.BytesIO(written))
    assert new.comment == b"a comment"
    for before, after in zip(old.infolist(), new.infolist(), strict=True):
        for kept in ("filename", "date_time", "compress_type", "comment", "external_attr",
                     "create_system", "extract_version", "extra"):  # fmt: skip
            assert getattr(before, kept) == getattr(after, kept)
    before, after = read_directory(data), read_directory(written)
    for one, other in zip(before.entries, after.entries, strict=True):
        if one.name != "b/c.obj":
            assert data[one.start : one.end] == written[other.start : other.end]
    first = before.entries[2].start
    assert written[:first] == data[:first]


def test_the_same_contents_are_the_same_archive() -> None:
    archive = Archive(zipped(CONTENTS))
    assert archive.replaced({"a.txt": CONTENTS["a.txt"]}) is archive.data
    assert archive.replaced({}) is archive.data


def test_replacing_back_restores_what_the_same_packer_made() -> None:
    data = zipped(CONTENTS)
    there = Archive(data).replaced({"a.txt": b"other"})
    assert Archive(there).replaced({"a.txt": CONTENTS["a.txt"]}) == data


def test_sizes_of_a_zip64_member_go_into_its_header() -> None:
    target = io.BytesIO()
    with (
        zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("a.obj", "w", force_zip64=True) as member,
    ):
        member.write(b"one")
    written = Archive(target.getvalue()).replaced({"a.obj": b"three"})
    assert members(written) == {"a.obj": b"three"}


def test_a_member_longer_than_it_says_is_not_unpacked() -> None:
    data = bytearray(zipped({"a.obj": bytes(5_000_000)}))
    struct.pack_into("<L", data, read_directory(bytes(data)).start + 24, 1000)
    archive = Archive(bytes(data))
    with pytest.raises(InvalidMesh, match=r"malformed_zip.*damaged"):
        archive.read("a.obj")


@pytest.mark.parametrize("offset", [16, 24])
def test_sums_and_sizes_are_checked(offset: int) -> None:
    data = bytearray(zipped(CONTENTS))
    struct.pack_into("<L", data, read_directory(bytes(data)).start + offset, 149)
    with pytest.raises(InvalidMesh, match=r"'a\.txt' is damaged"):
        Archive(bytes(data)).read("a.txt")


def test_encrypted_members_are_refused_when_they_are_needed() -> None:
    data = bytearray(zipped(CONTENTS))
    struct.pack_into("<H", data, read_directory(bytes(data)).start + 8, 1)
    archive = Archive(bytes(data))
    assert archive.read("b/c.obj") == CONTENTS["b/c.obj"]
    with pytest.raises(UnsupportedFormat, match=r"encrypted_member.*a\.txt"):
        archive.read("a.txt")


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_compression_is_kept_but_not_read(method: int) -> None:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("a.obj", b"one")
        archive.writestr("wood.png", b"two" * 99, method)
    archive = Archive(target.getvalue())
    assert members(archive.replaced({"a.obj": b"three"})) == {
        "a.obj": b"three",
        "wood.png": b"two" * 99,
    }
    with pytest.raises(UnsupportedFormat, match=f"zip_compression.*method {method}"):
        archive.read("wood.png")


@settings(max_examples=200, deadline=None, database=None)
@given(data=st.data())
def test_damaged_archives_raise_shape_errors_alone(data: st.DataObject) -> None:
    content = bytearray(zipped(CONTENTS, streamed=data.draw(st.booleans())))
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    with suppress(ShapeError):
        archive = Archive(bytes(content))
        written = archive.replaced(dict.fromkeys(archive.members, b"new"))
        again = Archive(written)
        assert all(again.read(name) == b"new" for name in archive.members)
