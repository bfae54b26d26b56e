"""Kept meshes in a store that replicas share, through fsspec."""

from __future__ import annotations

import importlib.util
import os
import time
from collections import OrderedDict
from io import BytesIO
from threading import Lock
from typing import Any

from service.requests import Upload
from service.store import entry
from service.store.address import Address
from service.store.fault import StoreFault
from service.store.patience import Patience
from service.store.tally import Complaints, Tally

SECONDS = 5.0
"""Longest wait for the store in one request."""
AT_ONCE = 8
"""Calls of it under way, hanging ones included."""
PAUSE_S = 5.0
"""How long a store that failed is left alone at first."""
FRESH_S = 600.0
"""How long an entry that was just written is not written again."""
REMEMBERED = 4096
"""Entries of which that is known."""


class Shared:
    """A tier in a bucket or folder, named by a URL that fsspec knows.

    Nothing is ever deleted there: how long entries stay is a rule of the bucket, by their age since
    they were last written, and what is used is written again now and then.  A store that is slow,
    gone or denied is counted and complained of, never raised.

    Attributes:
        tally: what happened so far.
    """

    name = "shared"

    def __init__(self, url: str) -> None:
        """Open it, without a call to it: it may be away for now.

        Raises:
            StoreFault: when fsspec or what it needs for the URL is not installed, or it knows no
                such URL.
        """
        self.tally = Tally()
        self._complaints = Complaints(self.name)
        self._patience = Patience(SECONDS, AT_ONCE, PAUSE_S)
        self._files, self._root = _opened(url)
        self._local = _is_local(self._files)
        self._written: OrderedDict[tuple[Address, bytes], float] = OrderedDict()
        self._lock = Lock()

    def put(self, address: Address, upload: Upload) -> bool:
        """Keep a mesh where every replica finds it; False when that can't be."""
        head = entry.head(upload)
        if self._fresh(address, head):
            return True
        try:
            self._patience.run(self._write, self._path(address), head + upload.data)
        except Exception as error:
            self.tally.add("write_failures")
            self._complaints.say("can't write", error)
            return False
        self._remember(address, head)
        return True

    def get(self, address: Address) -> Upload | None:
        """The mesh; None when it is not there, or not whole: another replica may be writing it."""
        try:
            data = self._patience.run(self._files.cat_file, self._path(address))
            upload = entry.read(BytesIO(data), address.mesh_id)
        except FileNotFoundError:
            self.tally.add("misses")
            return None
        except entry.Corrupted:
            self.tally.add("corrupted")
            self.tally.add("misses")
            self._complaints.say(f"holds {address.name} altered")
            return None
        except Exception as error:
            self.tally.add("read_failures")
            self.tally.add("misses")
            self._complaints.say("can't read", error)
            return None
        self.tally.add("hits")
        return upload

    def close(self) -> None:
        """Nothing is held open."""

    def _path(self, address: Address) -> str:
        return f"{self._root}/{address.name}.mesh"

    def _write(self, path: str, data: bytes) -> None:
        """Object stores write in one step; a folder needs a rename for that."""
        if not self._local:
            self._files.pipe_file(path, data)
            return
        partial = f"{path}.{os.urandom(8).hex()}.partial"
        try:
            self._files.pipe_file(partial, data)
            self._files.mv(partial, path)
        except OSError:
            if self._files.exists(partial):
                self._files.rm_file(partial)
            raise

    def _fresh(self, address: Address, head: bytes) -> bool:
        with self._lock:
            written = self._written.get((address, head), -float("inf"))
        return time.monotonic() - written < FRESH_S

    def _remember(self, address: Address, head: bytes) -> None:
        with self._lock:
            self._written[address, head] = time.monotonic()
            self._written.move_to_end((address, head))
            if len(self._written) > REMEMBERED:
                self._written.popitem(last=False)


def _opened(url: str) -> tuple[Any, str]:
    """fsspec's file system of a URL, and the path in it.

    The URL itself is never told: it may hold a password.
    """
    scheme, separator, _ = url.partition("://")
    if not separator:
        raise StoreFault("STORE_URL is no URL: write s3://bucket/prefix or file:///folder, say.")
    setting = f"STORE_URL={scheme}://... can't be used"
    if importlib.util.find_spec("fsspec") is None:
        raise StoreFault(
            f"{setting}: fsspec is not installed. Run pip install 'shape-parameters[shared]', and "
            "install what fsspec needs for the URL: s3fs for s3://, gcsfs for gs://."
        )
    import fsspec

    try:
        files, root = fsspec.core.url_to_fs(url)
        if _is_local(files):
            files.makedirs(root, exist_ok=True)
    except (ImportError, ValueError) as error:
        raise StoreFault(f"{setting}: {error}") from error
    except OSError as error:
        raise StoreFault(f"{setting}: {error.strerror}") from error
    return files, root.rstrip("/")


def _is_local(files: Any) -> bool:
    """Whether entries are files of a folder, that others might see half-written."""
    return not {"file", "local"}.isdisjoint(
        [files.protocol] if isinstance(files.protocol, str) else files.protocol
    )
