"""Where an answer's body goes: to memory, or to a file that appears once it is whole."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import IO

from service.client.multipart import Progress


class Sink:
    """Takes a body by chunks.

    Args:
        to: the file to write; None for memory.
        progress: is told what has come, and of how much.
        total: bytes, None where that is not known.

    Attributes:
        content: the body; None where it goes to a file.

    Raises:
        OSError: when the file can't be written.
    """

    def __init__(
        self, to: Path | None = None, progress: Progress | None = None, total: int | None = None
    ) -> None:
        self._to, self._progress, self._total = to, progress, total
        self._chunks: list[bytes] = []
        self._done = 0
        self._file: IO[bytes] | None = None
        self.content: bytes | None = None
        if to is not None:
            # Beside it, so that it can be put in its place in one step.
            self._file = tempfile.NamedTemporaryFile(  # noqa: SIM115
                dir=to.parent, prefix=f".{to.name}.", suffix=".part", delete=False
            )

    def write(self, chunk: bytes) -> None:
        """Take the next chunk."""
        if self._file is None:
            self._chunks.append(chunk)
        else:
            self._file.write(chunk)
        self._done += len(chunk)
        if self._progress is not None:
            self._progress(self._done, self._total)

    def finish(self) -> None:
        """The body is whole."""
        if self._file is None:
            self.content = b"".join(self._chunks)
            return
        self._file.close()
        assert self._to is not None
        # Made for its owner alone; it gets the rights that any new file has.
        os.chmod(self._file.name, 0o666 & ~_umask())
        os.replace(self._file.name, self._to)
        self._file = None

    def abort(self) -> None:
        """The body broke off; leaves nothing behind."""
        if self._file is not None:
            self._file.close()
            os.unlink(self._file.name)
            self._file = None


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
