"""API keys: whose they are, known by their digests alone."""

from __future__ import annotations

import hashlib
import hmac
import logging
import re
import secrets
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

logger = logging.getLogger(__name__)

# The prefix lets scanners of repositories and logs know a key when they see one.
PREFIX = "sp_"
BYTES = 32
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")

_DIGEST = re.compile(r"[0-9a-fA-F]{64}")


class KeysFault(ValueError):
    """The settings of the keys make no sense; the text names no part of a key."""


@dataclass(frozen=True)
class Entry:
    """A key that is let in.

    Attributes:
        owner: the name of who holds it; several keys of one name are one owner's.
        digest: SHA-256 of the key, in lower-case hexadecimal.
    """

    owner: str
    digest: str

    def __str__(self) -> str:
        return f"{self.owner}:{self.digest}"


def new_key() -> str:
    """A fresh key of 256 random bits: what lets a plain digest of it be kept without salt."""
    return PREFIX + secrets.token_urlsafe(BYTES)


def digest_of(key: str) -> str:
    """SHA-256 of a key, in hexadecimal."""
    return hashlib.sha256(key.encode()).hexdigest()


class Keys:
    """Those of the settings and of a file, which can be read anew.

    Safe to use from several threads: a reload replaces all entries at once.
    """

    def __init__(self, text: str = "", file: Path | None = None) -> None:
        """
        Args:
            text: entries, with commas or newlines between.
            file: one entry a line; what follows a ``#`` is left out.

        Raises:
            KeysFault: when an entry is malformed, or the file can't be read or holds none.
        """
        self._text = text
        self._file = file
        self._entries = self._read()

    @property
    def wanted(self) -> bool:
        """Whether requests need a key."""
        return bool(self._entries)

    @property
    def owners(self) -> list[str]:
        """Whose keys there are, by name."""
        return sorted({entry.owner for entry in self._entries})

    def owner(self, key: str) -> str | None:
        """Whose key it is; None for one that nobody holds.

        All entries are compared, each in constant time: how long it takes tells nothing of them.
        """
        digest = digest_of(key)
        found = None
        for entry in self._entries:
            if hmac.compare_digest(entry.digest, digest):
                found = entry.owner
        return found

    def reload(self) -> None:
        """Read the file again; when that fails the keys stay as they are, and the log says why."""
        try:
            self._entries = self._read()
        except KeysFault as fault:
            logger.error("The API keys stay as they were: %s", fault)
        else:
            self.announce()

    def announce(self) -> None:
        """Log who is served."""
        if self.wanted:
            logger.info("Whoever has an API key of %s is served", ", ".join(self.owners))
        else:
            logger.info("Everyone is served: no API keys are configured")

    def _read(self) -> tuple[Entry, ...]:
        lines = list(enumerate(re.split(r"[,\n]", self._text), 1))
        entries = [*_entries(lines, "API_KEYS", "entry")]
        if self._file is not None:
            held = _entries(_lines(self._file), f"API_KEYS_FILE {self._file}", "line")
            if not held:
                # An empty file is a slip, and must not open the service to everyone.
                raise KeysFault(f"API_KEYS_FILE {self._file} holds no key")
            entries += held
        owners: dict[str, str] = {}
        for entry in entries:
            if owners.setdefault(entry.digest, entry.owner) != entry.owner:
                raise KeysFault(f"{owners[entry.digest]} and {entry.owner} have the same key")
        return tuple(entries)


def _lines(file: Path) -> list[tuple[int, str]]:
    try:
        text = file.read_text("utf-8")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise KeysFault(f"API_KEYS_FILE {file} can't be read: {reason}") from error
    return [(number, line.partition("#")[0]) for number, line in enumerate(text.splitlines(), 1)]


def _entries(lines: Iterable[tuple[int, str]], source: str, unit: str) -> list[Entry]:
    return [
        _entry(line.strip(), f"{source}, {unit} {number}") for number, line in lines if line.strip()
    ]


def _entry(text: str, place: str) -> Entry:
    """One entry; what is wrong with it is told without its text, which may be a key itself."""
    owner, colon, digest = (part.strip() for part in text.partition(":"))
    if not colon:
        raise KeysFault(f"{place}: is not NAME:SHA256; `python -m service.newkey NAME` makes one")
    if not NAME.fullmatch(owner):
        raise KeysFault(f"{place}: the name must be 1 to 64 letters, digits, `.`, `_` or `-`")
    if not _DIGEST.fullmatch(digest):
        raise KeysFault(f"{place}: what follows the name must be 64 hexadecimal digits")
    return Entry(owner, digest.lower())
