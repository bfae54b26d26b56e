"""What holds of every file, however broken."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from service.errors import ShapeError
from service.mesh.formats import read_mesh
from service.mesh.meshfile import MeshFile

SLOW = 2.0
"""Seconds of processor time that a small file may take to be read and written."""
LONGEST_MESSAGE = 1000
# What moved vertices can come to when they are stored: rounding, and sizes out of all proportion.
EXTREME = ("degenerate_mesh", "non_finite_vertices", "overflow")


class Broken(AssertionError):
    """A file did what none may do."""


@dataclass(frozen=True)
class Verdict:
    """What became of a file: `code` of the refusal, empty if it was read; `seconds` of work."""

    code: str
    seconds: float


def examine(data: bytes, format: str, slow: float = SLOW) -> Verdict:
    """Read a file, write it back unmoved and moved, and read that again.

    Raises:
        Broken: when it takes too long, or anything but what the readers and writers promise
            comes of it.
    """
    start = time.thread_time()
    try:
        mesh = read_mesh(data, "x." + format)
    except ShapeError as error:
        code = _refused(error)
    else:
        code = ""
        _unmoved(mesh)
        _moved(mesh, format)
    seconds = time.thread_time() - start
    if seconds > slow:
        raise Broken(f"{len(data)} bytes took {seconds:.1f} s ({code or 'read'})")
    return Verdict(code, seconds)


def _refused(error: ShapeError) -> str:
    if error.__cause__ is not None:
        raise Broken("a reader let damage through to the last resort") from error.__cause__
    if not error.detail or not error.suggestion or len(error.detail) > LONGEST_MESSAGE:
        raise Broken(f"{error.code} is told in {len(error.detail)} characters")
    return error.code


def _unmoved(mesh: MeshFile) -> None:
    count = len(mesh.vertices)
    written = mesh.write(mesh.vertices.copy(), np.broadcast_to(np.eye(3), (count, 3, 3)))
    if written is not mesh.data:
        raise Broken("standing still changed the file")


def _moved(mesh: MeshFile, format: str) -> None:
    """Move and turn every other vertex."""
    chosen = np.arange(len(mesh.vertices)) % 2 == 0
    new = np.where(chosen[:, None], mesh.vertices * [1.25, 0.75, 1.5] + 0.125, mesh.vertices)
    linear = np.tile(np.eye(3), (len(new), 1, 1))
    linear[chosen] = np.diag([1.25, 0.75, 1.5])
    try:
        written = mesh.write(new, linear)
    except ShapeError as error:
        # A glTF may be broken in places that only writing looks at.
        _refused(error)
        return
    try:
        again = read_mesh(written, "x." + format)
    except ShapeError as error:
        if error.code not in EXTREME:
            raise Broken(f"what was written is refused: {error}") from error
        return
    if len(again.faces) != len(mesh.faces):
        raise Broken(f"{len(mesh.faces)} faces became {len(again.faces)}")
    if mesh.format != "stl" and len(again.vertices) != len(mesh.vertices):
        raise Broken(f"{len(mesh.vertices)} vertices became {len(again.vertices)}")
