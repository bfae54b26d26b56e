from __future__ import annotations

from service.errors import InvalidMesh, UnsupportedFormat
from service.mesh.faults import face_out_of_range, malformed, quoted, unsupported


def test_faults_say_what_and_where() -> None:
    fault = malformed("ply", "its header has the line 'x'")
    assert isinstance(fault, InvalidMesh)
    assert fault.code == "malformed_ply"
    assert fault.detail == "The PLY file can't be read: its header has the line 'x'."
    fault = face_out_of_range(8, 8)
    assert fault.code == "face_out_of_range"
    assert "vertex 8" in fault.detail
    assert isinstance(unsupported("a", "b", "c"), UnsupportedFormat)


def test_quotes_are_short_and_printable() -> None:
    assert quoted("a\x1b\n") == "'a\\x1b\\n'"
    assert len(quoted("x" * 1000)) == 40
