"""Which build of the service this is."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parent.parent
SUFFIXES = {".py", ".yaml", ".npz"}
NUMERIC = ("numpy", "onnxruntime", "scipy", "trimesh")


@cache
def build() -> str:
    """Digest, in hex, of the code and the templates and of the versions of what computes.

    Models are not in it: they come and go while the service runs.  Takes some milliseconds once.
    """
    digest = hashlib.sha256(" ".join(version(name) for name in NUMERIC).encode())
    for path in sorted(path for path in ROOT.rglob("*") if path.suffix in SUFFIXES):
        digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0")
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()
