"""A kept mesh as bytes: one line that says what the file was called, and the file.

The line is the SHA-256 of its JSON in hex, a space and the JSON; the file's own digest is the
`mesh_id` that it is asked for by.  So nothing altered is ever taken for what was stored.
"""

from __future__ import annotations

import hashlib
import json
from typing import BinaryIO

from service.requests import Upload

LONGEST_NAME = 1000
"""Characters of a name that are kept; the last, for its suffix tells the format."""
LONGEST_LINE = 65536


class Corrupted(Exception):
    """The bytes are not what was stored."""


def head(upload: Upload) -> bytes:
    """The line before the file."""
    facts = {"name": _short(upload.name), "content_type": _short(upload.content_type)}
    line = json.dumps(facts, separators=(",", ":")).encode()
    return hashlib.sha256(line).hexdigest().encode() + b" " + line + b"\n"


def read(file: BinaryIO, mesh_id: str) -> Upload:
    """The mesh of an entry.

    Raises:
        Corrupted: when any byte is not as it was written.
        OSError: when it can't be read.
    """
    digest, _, line = file.readline(LONGEST_LINE).rstrip(b"\n").partition(b" ")
    if digest != hashlib.sha256(line).hexdigest().encode():
        raise Corrupted
    facts = json.loads(line)
    upload = Upload(file.read(), facts["name"], facts["content_type"])
    if upload.mesh_id != mesh_id:
        raise Corrupted
    return upload


def _short(text: str | None) -> str | None:
    return text[-LONGEST_NAME:] if text is not None else None
