from __future__ import annotations

from email.message import Message

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.api.filenames import LONGEST, clean, content_disposition, edited_name


@pytest.mark.parametrize(
    ("name", "suffix", "expected"),
    [
        ("chair.glb", "glb", "chair-edited.glb"),
        ("chair.glb", "obj", "chair-edited.obj"),
        ("my chair.v2.stl", "stl", "my chair.v2-edited.stl"),
        ("chair-edited.glb", "glb", "chair-edited.glb"),
        ("../../etc/passwd", "obj", "passwd-edited.obj"),
        ("C:\\Users\\me\\chair.obj", "obj", "chair-edited.obj"),
        ("...", "ply", "mesh-edited.ply"),
        ("", "ply", "mesh-edited.ply"),
        (None, "off", "mesh-edited.off"),
        ("стул.glb", "glb", "стул-edited.glb"),
    ],
)
def test_an_edited_file_is_named_after_its_source(
    name: str | None, suffix: str, expected: str
) -> None:
    assert edited_name(name, suffix) == expected


def test_a_plain_name_needs_no_second_form() -> None:
    assert content_disposition("chair-edited.glb") == 'attachment; filename="chair-edited.glb"'


def test_a_name_beyond_ascii_comes_in_both_forms() -> None:
    header = content_disposition("стул.glb")
    plain = '; filename="____.glb"'
    assert plain in header
    message = Message()
    message["Content-Disposition"] = header.replace(plain, "")
    assert message.get_filename() == "стул.glb"


@given(st.text())
def test_no_name_can_leave_its_header_or_its_folder(name: str) -> None:
    header = content_disposition(clean(name))
    assert header.isascii()
    assert header.isprintable()
    assert header.count('"') == 2
    assert "/" not in header.replace("UTF-8''", "")
    assert "\\" not in header
    assert 0 < len(clean(name)) <= LONGEST + 10
