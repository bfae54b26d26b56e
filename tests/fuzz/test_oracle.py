from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from service.errors import InvalidMesh
from service.mesh.faults import malformed
from service.mesh.off import OffFile

from .corpus import chair
from .oracle import Broken, examine

OFF = chair("off")


def test_sound_and_broken_files_pass() -> None:
    assert examine(OFF, "off").code == ""
    assert examine(OFF[:-5], "off").code == "malformed_off"
    assert examine(b"", "stl").code == "malformed_stl"


def crash(*_: Any) -> bytes:
    raise IndexError("7")


def wordy(*_: Any) -> bytes:
    raise malformed("off", "x" * 5000)


def bare(*_: Any) -> bytes:
    raise InvalidMesh("code", "", "")


def dawdle(*_: Any) -> bytes:
    start = time.thread_time()
    while time.thread_time() - start < 0.05:
        pass
    raise malformed("off", "late")


@pytest.mark.parametrize(
    ("fault", "message"),
    [(crash, "last resort"), (wordy, "characters"), (bare, "characters"), (dawdle, "took")],
)
def test_faults_of_reading(
    monkeypatch: pytest.MonkeyPatch, fault: Callable[..., bytes], message: str
) -> None:
    monkeypatch.setattr("service.mesh.off.TextLines", fault)
    with pytest.raises(Broken, match=message):
        examine(OFF, "off", slow=0.02)


def copied(mesh: OffFile, vertices: np.ndarray, linear: np.ndarray) -> bytes:
    return bytes(bytearray(mesh.data))


def shortened(mesh: OffFile, vertices: np.ndarray, linear: np.ndarray) -> bytes:
    return mesh.data if np.array_equal(vertices, mesh.vertices) else mesh.data[:-8]


def replaced(mesh: OffFile, vertices: np.ndarray, linear: np.ndarray) -> bytes:
    still = np.array_equal(vertices, mesh.vertices)
    return mesh.data if still else b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


@pytest.mark.parametrize(
    ("write", "message"),
    [(copied, "standing still"), (shortened, "is refused"), (replaced, "became 1")],
)
def test_faults_of_writing(
    monkeypatch: pytest.MonkeyPatch, write: Callable[..., bytes], message: str
) -> None:
    monkeypatch.setattr(OffFile, "write", write)
    with pytest.raises(Broken, match=message):
        examine(OFF, "off")


def test_crashes_of_writing_pass_through(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OffFile, "write", crash)
    with pytest.raises(IndexError):
        examine(OFF, "off")
