from __future__ import annotations

from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.requests import Upload
from service.store import entry

TEXTS = st.none() | st.text()


@given(st.binary(), TEXTS, TEXTS)
def test_what_is_written_is_read(data: bytes, name: str | None, content_type: str | None) -> None:
    upload = Upload(data, name, content_type)
    assert entry.read(BytesIO(entry.head(upload) + data), upload.mesh_id) == upload


def test_a_long_name_keeps_its_suffix() -> None:
    upload = Upload(b"abc", "x" * 100_000 + ".obj")
    read = entry.read(BytesIO(entry.head(upload) + b"abc"), upload.mesh_id)
    assert read.name is not None
    assert read.name.endswith("x.obj")
    assert len(read.name) == entry.LONGEST_NAME


def test_no_byte_can_be_altered_or_lost() -> None:
    upload = Upload(b"v 0 0 0\nv 1 0 0\n", "стул.obj", "model/obj")
    whole = entry.head(upload) + upload.data
    for place in range(len(whole)):
        altered = bytearray(whole)
        altered[place] ^= 0x10
        for damaged in (altered, whole[:place]):
            with pytest.raises(entry.Corrupted):
                entry.read(BytesIO(damaged), upload.mesh_id)
    with pytest.raises(entry.Corrupted):
        entry.read(BytesIO(whole + b"\n"), upload.mesh_id)
    with pytest.raises(entry.Corrupted):
        entry.read(BytesIO(whole), Upload(b"other").mesh_id)
