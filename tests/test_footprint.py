from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from service.footprint import footprint

ROW = np.zeros(1000)


@dataclass
class Thing:
    part: Any


@dataclass(slots=True)
class Slotted:
    part: Any


class Other(Thing):
    pass


def test_an_array_counts_by_its_memory() -> None:
    assert footprint(ROW) == 8000


@pytest.mark.parametrize(
    "holder", [Thing(ROW), Slotted(ROW), [ROW], (ROW,), {"a": ROW}, {ROW.tobytes(): ROW}]
)
def test_what_holds_it_counts_too(holder: Any) -> None:
    keys = 2 * 8000 if isinstance(holder, dict) and bytes in map(type, holder) else 8000
    assert keys <= footprint(holder) < keys + 1000


def test_a_view_counts_as_all_that_it_keeps() -> None:
    assert footprint(ROW[:10].reshape(2, 5)) == 8000
    data = bytes(5000)
    assert footprint(np.frombuffer(memoryview(data)[:800], np.uint8)) > 5000


def test_what_is_reached_twice_counts_once() -> None:
    ring = Thing([ROW, ROW[:5], ROW])
    ring.part.append(ring)
    assert 8000 <= footprint(ring) < 9000


def test_what_is_another_s_or_the_program_s_does_not_count() -> None:
    held = Thing([Other(ROW), sys, Thing, len, footprint])
    assert footprint(held, (Other,)) < 1000
    assert footprint(held) > 8000


def test_objects_in_arrays_count() -> None:
    assert footprint(np.array([Thing(ROW), None], object)) > 8000
