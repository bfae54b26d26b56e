from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event

import numpy as np
import pytest
import trimesh

import service
from service import deadline, pipeline
from service.edits import Change
from service.encode.model import Model, load_models
from service.errors import Overloaded, TooComplex
from service.mesh.convert import convert
from service.mesh.formats import read_mesh
from service.requests import EditOptions, InferOptions, Upload


def work(seconds: float) -> None:
    start = time.thread_time()
    while time.thread_time() - start < seconds:
        pass


def test_without_a_limit_there_is_no_end() -> None:
    deadline.check()


def test_in_time_nothing_happens() -> None:
    with deadline.limit(60):
        deadline.check()


def test_work_that_takes_too_long_is_too_complex() -> None:
    with deadline.limit(0.02):
        work(0.04)
        with pytest.raises(TooComplex, match=r"too_complex.*0\.02 s") as caught:
            deadline.check()
    assert "DEADLINE_SECONDS" in caught.value.suggestion


def test_time_that_others_took_is_overload() -> None:
    with deadline.limit(0.02):
        time.sleep(0.04)
        with pytest.raises(Overloaded, match=r"deadline_exceeded.*0\.02 s"):
            deadline.check()


def test_work_that_nobody_waits_for_ends() -> None:
    abandoned = Event()
    with deadline.limit(60, abandoned):
        deadline.check()
        abandoned.set()
        with pytest.raises(deadline.Abandoned):
            deadline.check()


def test_a_limit_ends_with_its_block() -> None:
    with deadline.limit(60):
        with deadline.limit(0.01):
            time.sleep(0.02)
            with pytest.raises(Overloaded):
                deadline.check()
        deadline.check()
    deadline.check()


class Over(TooComplex):
    """Stands for the end of the time."""

    def __init__(self) -> None:
        super().__init__("over", "it is over", "be quicker")


@pytest.fixture
def over(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], list[str]]:
    """Lets the time be over at the check of that number; gives back who checked."""

    def at(number: int) -> list[str]:
        callers: list[str] = []

        def check() -> None:
            code = sys._getframe(1).f_code
            callers.append(f"{Path(code.co_filename).stem}.{code.co_name}")
            if len(callers) == number:
                raise Over

        monkeypatch.setattr(deadline, "check", check)
        return callers

    return at


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return load_models(Path(service.__file__).parent / "models")


def test_every_stage_looks_at_the_clock(
    over: Callable[[int], list[str]], models: dict[str, Model], box_chair: trimesh.Trimesh
) -> None:
    data = convert(np.asarray(box_chair.vertices), np.asarray(box_chair.faces), "glb")
    upload, upright = Upload(data, "a.glb"), InferOptions(up="+y", front="+z")
    change = {"seat_width": Change("scale", 1.2)}
    callers = over(0)
    pipeline.edit(upload, models, upright, change, EditOptions())
    stages = {caller: callers.count(caller) for caller in callers}
    assert stages["geometry.add"] == 1
    assert stages["refine.refine"] >= 20
    # At least one for each stage behind the queue, and another for the report.
    assert stages["stages.stage"] >= 7
    assert stages["gltfpatch.apply"] >= 1
    for number in (1, 2, len(callers) // 2, len(callers)):
        over(number)
        with pytest.raises(Over):
            pipeline.edit(upload, models, upright, change, EditOptions())


MIXED = b"""ply
format binary_little_endian 1.0
element vertex 4
property float x
property float y
property float z
element face 2
property list ushort uchar vertex_indices
end_header
"""
ROWS = bytes([4, 0, 0, 1, 2, 3, 3, 0, 0, 1, 2])


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("a.ply", MIXED + np.eye(4, 3, dtype="<f4").tobytes() + ROWS),
    ],
)
def test_readers_look_at_the_clock(
    over: Callable[[int], list[str]], name: str, data: bytes
) -> None:
    over(1)
    with pytest.raises(Over):
        read_mesh(data, name)
