"""What the readers raise, worded the same way in every format."""

from __future__ import annotations

from typing import Any

from service.errors import InvalidMesh, TooLarge, UnsupportedFormat


def malformed(format: str, detail: str) -> InvalidMesh:
    """The bytes are not what `format` says they should be; `detail` says where."""
    return InvalidMesh(
        f"malformed_{format}",
        f"The {format.upper()} file can't be read: {detail}.",
        "Export the mesh again and check that the upload is complete.",
    )


def unsupported(code: str, detail: str, suggestion: str) -> UnsupportedFormat:
    """A feature that would be lost or broken on the way back."""
    return UnsupportedFormat(code, f"{detail}.", f"{suggestion}.")


def too_many(what: str, count: int, limit: int) -> TooLarge:
    """More vertices or faces than one file may hold."""
    return TooLarge(
        f"too_many_{what}",
        f"The mesh has at least {count} {what}; the limit is {limit}.",
        "Simplify the mesh, or split it into parts; the operator may allow more by MAX_VERTICES."
        if what in ("vertices", "faces")
        else "Simplify the mesh, or split it into parts.",
    )


def face_out_of_range(index: int, count: int) -> InvalidMesh:
    """A face names a vertex that isn't there."""
    return InvalidMesh(
        "face_out_of_range",
        f"A face uses vertex {index} (counted from 0), but there are {count} vertices.",
        "Export the mesh again: its faces and vertices do not belong together.",
    )


def quoted(value: Any, limit: int = 40) -> str:
    """`value` from a file, printable and short enough for a message."""
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 3] + "..."
