"""The zip of an order's variants, written piece by piece: the same bytes for the same variants."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable, Iterator

MANIFEST, LABELS = "manifest.jsonl", "labels.json"
MEDIA_TYPE = "application/zip"

_LONG_AGO = (1980, 1, 1, 0, 0, 0)
_PLAIN_FILE = 0o100644 << 16


class _Sink:
    """What is written and not yet taken: zipfile goes back no further than to the last head."""

    def __init__(self) -> None:
        self._taken = 0
        self._at = 0
        self._held = bytearray()

    def write(self, data: bytes) -> int:
        self._held[self._at : self._at + len(data)] = data
        self._at += len(data)
        return len(data)

    def tell(self) -> int:
        return self._taken + self._at

    def seek(self, offset: int, whence: int = 0) -> int:
        assert whence == 0
        assert offset >= self._taken
        self._at = offset - self._taken
        return offset

    def flush(self) -> None:
        """Nothing lies further down."""

    def take(self) -> bytes:
        held, self._held = bytes(self._held), bytearray()
        self._taken += len(held)
        self._at = 0
        return held


def contents(
    parts: Iterable[tuple[str | None, str, bytes | None]], labels: Callable[[], bytes | None]
) -> Iterator[tuple[str, bytes]]:
    """The files of an archive by name: variants, `MANIFEST`, and `LABELS` where there are any.

    Args:
        parts: a variant's file name and bytes, if it has a file, and between them its line of the
            manifest.
        labels: asked for once all variants are there.
    """
    lines = []
    for name, line, data in parts:
        lines.append(f"{line}\n")
        if name is not None and data is not None:
            yield name, data
    yield MANIFEST, "".join(lines).encode()
    if (found := labels()) is not None:
        yield LABELS, found


def archive(files: Iterable[tuple[str, bytes]]) -> Iterator[bytes]:
    """The zip of some files, of which one at a time is held.

    They are stored as they are: coordinates hardly shrink, and deflate is not the same everywhere.
    """
    sink = _Sink()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_STORED) as written:  # type: ignore[call-overload]
        for name, data in files:
            entry = zipfile.ZipInfo(name, _LONG_AGO)
            entry.create_system = 3
            entry.external_attr = _PLAIN_FILE
            written.writestr(entry, data)
            yield sink.take()
    yield sink.take()
