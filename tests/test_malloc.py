from __future__ import annotations

import ctypes
from typing import Any

import pytest

from service import malloc


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """What the C library is asked for, in the test's stead."""
    asked: list[tuple[int, int]] = []

    class Library:
        def mallopt(self, parameter: int, value: int) -> None:
            asked.append((parameter, value))

    monkeypatch.setattr(ctypes, "CDLL", lambda name: Library())
    for name in ("MALLOC_ARENA_MAX", "MALLOC_MMAP_THRESHOLD_", "MALLOC_TRIM_THRESHOLD_"):
        monkeypatch.delenv(name, raising=False)
    return asked


def test_heaps_are_few_and_give_back(asked: list[Any]) -> None:
    malloc.settle()
    assert asked == [(-8, 2), (-3, 8 << 20), (-1, 32 << 20)]


def test_an_operator_who_knows_better_is_heeded(
    asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MALLOC_ARENA_MAX", "1")
    malloc.settle()
    assert asked == [(-3, 8 << 20), (-1, 32 << 20)]


def test_another_library_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    malloc.settle()


def test_free_memory_is_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[int] = []

    class Library:
        def malloc_trim(self, pad: int) -> None:
            kept.append(pad)

    monkeypatch.setattr(ctypes, "CDLL", lambda name: Library())
    malloc.trim()
    assert kept == [0]
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    malloc.trim()
