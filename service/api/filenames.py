"""Names of files that are sent back: made from the client's, never trusted."""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from urllib.parse import quote

LONGEST = 100


def edited_name(name: str | None, suffix: str) -> str:
    """What an edited file is called: ``<stem>-edited.<suffix>``; the stem is cleaned."""
    return derived_name(name, "edited", suffix)


def derived_name(name: str | None, what: str, suffix: str) -> str:
    """What a file made from another is called: ``<stem>-<what>.<suffix>``."""
    stem = PurePosixPath(clean(name)).stem if name else "mesh"
    stem = stem.removesuffix(f"-{what}") or "mesh"
    return f"{stem}-{what}.{suffix}"


def clean(name: str | None) -> str:
    """The last part of a client's path, without what a file system or a header minds."""
    last = re.split(r"[/\\]", name or "")[-1]
    printable = "".join(c for c in last if c.isprintable() and c not in '<>:"|?*').strip(" .")
    path = PurePosixPath(printable or "mesh")
    return path.stem[:LONGEST] + path.suffix[:10]


def content_disposition(name: str) -> str:
    """An `attachment` header (RFC 6266) with a plain name, and the true one where it differs."""
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", name)
    header = f'attachment; filename="{plain}"'
    return header if plain == name else f"{header}; filename*=UTF-8''{quote(name, safe='')}"
