"""Which processes use a folder at present."""

from __future__ import annotations

import contextlib
import fcntl
import os
from pathlib import Path


class Holding:
    """A shared lock on a folder's lock file, held until it is closed or the process is gone.

    Attributes:
        alone: whether no other process held it when this one came: then whatever is half-done in
            the folder was left by one that died.
    """

    def __init__(self, path: Path) -> None:
        """Where the folder can't be written, or its file system knows no locks, never `alone`."""
        self.alone = False
        self._descriptor: int | None = None
        with contextlib.suppress(OSError):
            self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                self.alone = True
            except BlockingIOError:
                fcntl.flock(self._descriptor, fcntl.LOCK_SH)

    def share(self) -> None:
        """Let others come, once what only a lone process may do is done."""
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                fcntl.flock(self._descriptor, fcntl.LOCK_SH)

    def close(self) -> None:
        """Give it up."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
