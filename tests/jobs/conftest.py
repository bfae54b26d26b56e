"""Orders and stores, without a mesh that is one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from service.jobs.order import Order
from service.requests import EditOptions, InferOptions, Upload


@dataclass
class Clock:
    """A clock that stands until it is moved."""

    now: float = 1_000_000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def order() -> Callable[..., Order]:
    """An order of so many edits of a file of so many bytes."""

    def make(count: int = 3, size: int = 10, first: float = 1.0) -> Order:
        edits = [{"seat_width": first + index} for index in range(count)]
        upload = Upload(b"x" * size, "chair.glb", "model/gltf-binary")
        return Order("edit", upload, InferOptions(), EditOptions(), edits)

    return make
