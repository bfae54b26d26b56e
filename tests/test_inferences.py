from __future__ import annotations

import gc
import threading
import tracemalloc
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import service
from service import finding, pipeline
from service.edited import Edited
from service.edits import parse_edits
from service.encode.model import Model, load_models
from service.errors import InvalidRequest, ShapeError
from service.inferences import Inferences
from service.mesh.convert import convert
from service.requests import EditOptions, InferOptions, SliderOptions, Upload
from service.stages import STAGES, Record, recording
from service.template.loader import load_template
from service.template.skinned import Body, SkinnedTemplate

KIB = 1024


@dataclass
class Found:
    """An inference that takes so many bytes, and a little more."""

    size: int
    model: str = "stool"
    more: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.data = bytes(self.size)
        self.candidates = [SimpleNamespace(model=self.model)]

    @property
    def parts(self) -> int:
        return len(self.more)


def held(known: Inferences, key: Any, size: int = 0) -> AbstractContextManager[Any]:
    make: Any = partial(Found, size)
    return known.held(key, make)


def have(known: Inferences, key: str, size: int = 100 * KIB, model: str = "stool") -> Any:
    make: Any = partial(Found, size, model)
    with known.held(key, make) as found:
        return found


def test_what_was_inferred_is_found_again() -> None:
    known = Inferences(KIB * KIB)
    first = have(known, "a")
    assert have(known, "a") is first
    assert have(known, "b") is not first
    assert (known.hits, known.misses, len(known)) == (1, 2, 2)
    assert 200 * KIB < known.size < 210 * KIB


def test_the_least_recently_used_goes_first() -> None:
    known = Inferences(350 * KIB)
    first, second, third = (have(known, key) for key in "abc")
    have(known, "a")
    have(known, "d")
    assert have(known, "a") is first
    assert have(known, "c") is third
    assert known.size <= known.capacity
    assert have(known, "b") is not second


def test_what_is_too_large_alone_makes_no_room_for_itself() -> None:
    known = Inferences(350 * KIB)
    small = have(known, "a")
    have(known, "b", 400 * KIB)
    assert len(known) == 1
    assert have(known, "a") is small


def test_nothing_is_kept_where_nothing_may_be() -> None:
    known = Inferences(0)
    assert have(known, "a") is not have(known, "a")
    assert (known.size, len(known)) == (0, 0)


def test_what_grows_is_measured_again() -> None:
    known = Inferences(350 * KIB)
    have(known, "a")
    have(known, "b")
    for expected in (2, 1, 0):
        with held(known, "a") as found:
            found.more.append(bytes(100 * KIB))
        assert known.size <= known.capacity
        assert len(known) == expected


def test_what_an_error_leaves_behind_is_measured_too() -> None:
    known = Inferences(KIB * KIB)

    def fail() -> None:
        with held(known, "a") as found:
            found.more.append(bytes(100 * KIB))
            raise ValueError("bad")

    with pytest.raises(ValueError, match="bad"):
        fail()
    assert known.size > 100 * KIB


def test_an_upload_that_fails_is_looked_at_again() -> None:
    known = Inferences(KIB * KIB)

    def fail() -> Any:
        raise InvalidRequest("bad", "It is bad.", "Mend it.")

    with pytest.raises(InvalidRequest), known.held("a", fail):
        pass
    assert (known.size, len(known)) == (0, 0)
    assert have(known, "a").size == 100 * KIB


def test_models_that_are_served_no_more_are_forgotten_with_what_they_found() -> None:
    known = Inferences(KIB * KIB)
    have(known, "a", model="old")
    kept = have(known, "b", model="new")
    known.retain(["new", "other"])  # type: ignore[list-item]
    assert len(known) == 1
    assert have(known, "b") is kept
    assert known.size < 110 * KIB


def test_many_threads_keep_the_account() -> None:
    known = Inferences(450 * KIB)

    def ask(number: int) -> None:
        with held(known, number % 7, 20 * KIB * (1 + number % 7)) as found:
            found.more.append(b"")

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(ask, range(400)))
    assert known.hits + known.misses == 400
    assert 0 < known.size <= known.capacity
    known.retain([])
    assert (known.size, len(known)) == (0, 0)


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return load_models(Path(service.__file__).parent / "models")


@pytest.fixture(scope="module")
def uploads(chair_glb: bytes, human: SkinnedTemplate, strider: Body) -> dict[str, Upload]:
    plane = load_template("airplane")
    wings = plane.decode((plane.low + plane.high) / 2)
    body = human.decode(strider)
    return {
        "chair": Upload(chair_glb, "chair.glb"),
        "airplane": Upload(convert(wings, plane.faces, "obj"), "airplane.obj"),
        "human": Upload(convert(body, human.faces, "ply"), "human.ply"),
    }


EDITS = {
    "chair": [
        '{"seat_width": {"scale": 1.3}}',
        '{"leg_height": {"scale": 0.7}, "back_height": {"scale": 1.4}}',
        '{"seat_top_height": 0.5, "total_width": {"add": 0.1}}',
    ],
    "airplane": [
        '{"wing_length": {"scale": 1.3}}',
        '{"fuselage_width": {"scale": 1.4}}',
        '{"wing_span": {"scale": 0.8}, "total_length": {"scale": 1.2}}',
    ],
    "human": [
        '{"left_elbow_y": {"add": -0.5}}',
        '{"stature": {"scale": 1.1}}',
        '{"shape_1": {"add": 1.0}, "right_knee_x": {"add": 0.4}}',
    ],
}


def edit(
    upload: Upload,
    models: dict[str, Model],
    edits: str,
    known: Inferences | None,
    mode: str = "blend",
    category: str = "auto",
) -> Edited:
    options, how = InferOptions(category=category), EditOptions(mode=mode)
    return pipeline.edit(upload, models, options, parse_edits(edits), how, known=known)


@pytest.mark.parametrize("category", EDITS)
def test_answers_are_the_same_to_the_bit_in_whatever_order_edits_come(
    uploads: dict[str, Upload], models: dict[str, Model], category: str
) -> None:
    upload = uploads[category]
    asked = [*((edits, "blend") for edits in EDITS[category]), (EDITS[category][2], "paper")]
    expected = {case: edit(upload, models, case[0], None, case[1], category) for case in asked}
    for order in (asked, asked[::-1], asked[2:] + asked[:2]):
        known = Inferences(1 << 28)
        for case in order:
            assert edit(upload, models, case[0], known, case[1], category) == expected[case]
        assert (known.hits, known.misses) == (len(asked) - 1, 1)
    report = pipeline.infer(upload, models, InferOptions(category), known).report()
    assert report == pipeline.infer(upload, models, InferOptions(category)).report()
    for make in (pipeline.sliders, pipeline.template):
        options = InferOptions(category), SliderOptions()
        assert make(upload, models, *options, known) == make(upload, models, *options)


def test_an_edit_of_a_kept_mesh_neither_reads_nor_infers_nor_binds(
    uploads: dict[str, Upload], models: dict[str, Model]
) -> None:
    known = Inferences(1 << 28)
    for category in ("chair", "human"):
        seen = []
        for upload in (uploads[category], Upload(uploads[category].data, uploads[category].name)):
            record = Record()
            with recording(record):
                edit(upload, models, EDITS[category][0], known)
            seen.append(list(record.seconds))
        assert seen == [list(STAGES[1:]), ["transfer", "write"]]


def test_what_is_said_of_an_upload_tells_entries_apart(
    uploads: dict[str, Upload], models: dict[str, Model]
) -> None:
    known, upload = Inferences(1 << 28), uploads["chair"]

    def infer(**options: Any) -> Any:
        asked = InferOptions(**{"category": "chair", "up": "+y", "front": "+z"} | options)
        return pipeline.infer(upload, models, asked, known)

    first = infer()
    assert infer() is first
    for options in ({"refine": False}, {"units": "cm"}, {"front": "-z"}, {"category": "auto"}):
        assert infer(**options) is not first
    others = load_models(Path(service.__file__).parent / "models")
    asked = InferOptions("chair", "+y", "+z")
    assert pipeline.infer(upload, others, asked, known) is not first
    renamed = Upload(upload.data, "a.stl", "model/stl")
    with pytest.raises(ShapeError, match="stl"):
        pipeline.infer(renamed, models, asked, known)


def test_an_answer_is_the_client_s_own(
    uploads: dict[str, Upload], models: dict[str, Model]
) -> None:
    known, upload = Inferences(1 << 28), uploads["chair"]
    for _ in range(2):
        report = pipeline.infer(upload, models, InferOptions(), known).report()
        assert report["warnings"] == []
        report["warnings"].append("mine")
        report["parameters"].clear()
        edited = edit(upload, models, "{}", known)
        assert edited.report["warnings"] == []
        edited.report["warnings"].append("mine")
        edited.report["parameters"].clear()
    assert pipeline.infer(upload, models, InferOptions(), known).report()["parameters"]


def test_its_size_is_what_is_freed_with_it(
    uploads: dict[str, Upload], models: dict[str, Model]
) -> None:
    edit(uploads["airplane"], models, EDITS["airplane"][0], None)
    tracemalloc.start()
    try:
        known = Inferences(1 << 28)
        edit(uploads["airplane"], models, EDITS["airplane"][0], known)
        gc.collect()
        full = tracemalloc.get_traced_memory()[0]
        size = known.size
        known.retain([])
        gc.collect()
        freed = full - tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert size == pytest.approx(freed + len(uploads["airplane"].data), rel=0.1)


def test_two_requests_for_one_mesh_infer_once(
    uploads: dict[str, Upload], models: dict[str, Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    known, both, read = Inferences(1 << 28), threading.Barrier(2), finding.read_mesh
    reads: Iterator[int] = iter(range(10))

    def count(*given: Any) -> Any:
        next(reads)
        return read(*given)

    monkeypatch.setattr(finding, "read_mesh", count)

    def ask(edits: str) -> Edited:
        both.wait(10)
        return edit(uploads["chair"], models, edits, known)

    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(ask, EDITS["chair"][:2]))
    assert next(reads) == 1
    assert [edit(uploads["chair"], models, e, None) for e in EDITS["chair"][:2]] == found
