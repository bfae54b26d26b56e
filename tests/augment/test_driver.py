"""Whole folders."""

from __future__ import annotations

import hashlib
import json
import os
import signal
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from service.augment import driver, local_engine, manifest
from service.augment.driver import Summary, augment
from service.augment.plan import Models, Outcome, Plan, Task
from service.augment.work import Work, part_path
from service.errors import InvalidRequest, ModelFault, ShapeError
from service.requests import InferOptions

CHAIR = InferOptions(category="chair")


@pytest.fixture
def folder(tmp_path: Path, chair_glb: bytes) -> Path:
    """A chair, the same again, and a file that is none."""
    meshes = tmp_path / "meshes"
    (meshes / "more").mkdir(parents=True)
    (meshes / "chair.glb").write_bytes(chair_glb)
    (meshes / "more" / "same.glb").write_bytes(chair_glb)
    (meshes / "broken.obj").write_text("v 0 0 0\n")
    return meshes


def in_process(plan: Plan, tasks: Sequence[Task], workers: int) -> Iterator[Outcome]:
    work = Work(plan)
    for task in tasks:
        yield work(task)


def run(folder: Path, **options: Any) -> Summary:
    options = {"count": 2, "infer": CHAIR} | options
    return augment(folder, folder.parent / "out", **options)


def files(out: Path) -> dict[str, bytes]:
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file()
    }


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work is done in this process."""
    monkeypatch.setattr(driver, "run_local", in_process)


@pytest.mark.usefixtures("here")
def test_a_folder_becomes_meshes_and_a_manifest(folder: Path) -> None:
    seen: list[tuple[int, int, str, int]] = []
    summary = run(folder, progress=lambda *state: seen.append(state))
    assert (summary.sources, summary.copies, summary.done, summary.failed) == (2, 1, 2, 1)
    assert summary.ok + summary.rejected == 2
    assert summary.failures[0][:2] == ("broken.obj", "empty_mesh")
    assert seen[-1] == (2, 2, "broken.obj", 1) or seen[-1] == (2, 2, "chair.glb", 1)
    out = folder.parent / "out"
    rows = pq.read_table(out / "manifest").to_pylist()
    made = [row for row in rows if row["status"] == "ok"]
    for row in made:
        data = (out / row["file"]).read_bytes()
        assert row["sha256"] == hashlib.sha256(data).hexdigest()
        assert row["copies"] == ["more/same.glb"]
        assert row["category"] == "chair"
        assert row["parameter.seat_width"] > 0
        assert json.loads(row["edits"])
        assert len(row["labels"]) == row["vertices"]
    (bad,) = (row for row in rows if row["status"] == "failed")
    assert (bad["source"], bad["problem_code"], bad["index"]) == ("broken.obj", "empty_mesh", None)


@pytest.mark.usefixtures("here")
def test_columns_say_their_units_and_labels_their_parts(folder: Path) -> None:
    run(folder, infer=InferOptions(category="chair", units="cm"))
    (part, *_) = (folder.parent / "out" / "manifest").glob("chair*.parquet")
    schema = pq.read_schema(part)
    assert schema.field("parameter.seat_width").metadata[b"unit"] == b"cm"
    parts = json.loads(schema.metadata[b"parts"])
    assert "seat" in parts["chair"]


@pytest.mark.usefixtures("here")
def test_a_second_run_does_nothing_and_an_ended_one_goes_on(folder: Path) -> None:
    run(folder)
    out = folder.parent / "out"
    before = files(out)
    again = run(folder)
    assert (again.kept, again.done) == (2, 0)
    assert files(out) == before
    (part,) = (out / "manifest").glob("chair*.parquet")
    part.unlink()
    (out / "meshes" / f".{part.stem}.tmp").mkdir()
    (out / "meshes" / f".{part.stem}.tmp" / "000.glb").write_bytes(b"half")
    assert (run(folder).kept, files(out)) == (1, before)


@pytest.mark.usefixtures("here")
def test_other_options_are_refused_unless_forced(folder: Path) -> None:
    run(folder)
    with pytest.raises(InvalidRequest) as caught:
        run(folder, count=3)
    assert caught.value.code == "options_differ"
    assert "count" in caught.value.detail
    assert run(folder, count=1, force=True).done == 2
    assert len(list((folder.parent / "out" / "meshes").rglob("*.glb"))) <= 1
    assert run(folder, count=1).kept == 2


@pytest.mark.usefixtures("here")
def test_a_file_that_goes_meanwhile_is_recorded(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = driver.find_tasks

    def and_gone(*arguments: Any) -> list[Task]:
        tasks = found(*arguments)
        (folder / "broken.obj").unlink()
        return tasks

    monkeypatch.setattr(driver, "find_tasks", and_gone)
    assert ("broken.obj", "unreadable") in [failure[:2] for failure in run(folder).failures]


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"engine": "spark"}, "unknown_engine"),
        ({"shard": "3"}, "shard_malformed"),
        ({"count": 0}, "count_out_of_range"),
        ({"workers": 0}, "workers_out_of_range"),
        ({"infer": InferOptions(category="table")}, "unknown_category"),
        ({"infer": InferOptions(units="mile")}, "unknown_units"),
    ],
)
def test_options_that_make_no_sense_are_told_of(
    folder: Path, options: dict[str, Any], code: str
) -> None:
    with pytest.raises(ShapeError) as caught:
        run(folder, **options)
    assert caught.value.code == code


def test_without_pyarrow_it_is_said_how_to_get_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(manifest, "pa", None)
    with pytest.raises(InvalidRequest) as caught:
        run(folder)
    assert caught.value.code == "pyarrow_missing"
    assert "pip install" in caught.value.suggestion


def test_worker_processes_make_the_same(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(folder, workers=2)
    out = folder.parent / "out"
    spawned = files(out)
    monkeypatch.setattr(driver, "run_local", in_process)
    run(folder, force=True)
    assert files(out) == spawned


class Stubborn:
    """Work that kills its process, hangs, or can't go on, by the source's name."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    def __call__(self, task: Task) -> Outcome:
        if task.source == "dies":
            os.kill(os.getpid(), signal.SIGKILL)
        if task.source == "hangs":
            signal.pause()
        if task.source == "full":
            raise OSError("no space left")
        return Outcome(task.source, ok=1)

    def failed(self, task: Task, code: str, detail: str) -> Outcome:
        return Outcome(task.source, code=code, detail=detail)


def stubborn(plan: Plan, *names: str) -> list[Outcome]:
    tasks = [Task(Path(name), name, "00") for name in names]
    return list(local_engine.run_local(plan, tasks, 2, Stubborn))


@pytest.fixture
def plan(tmp_path: Path) -> Plan:
    return Plan(tmp_path, None, None, None, Models(), 0.5)  # type: ignore[arg-type]


def test_a_file_that_kills_or_hangs_its_worker_is_left_out(
    plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local_engine, "GRACE_S", 0.5)
    found = stubborn(plan, "dies", "a", "hangs", "b")
    codes = {outcome.source: outcome.code for outcome in found}
    assert codes == {"dies": "worker_died", "hangs": "worker_hung", "a": None, "b": None}


def test_what_no_worker_can_go_on_after_is_raised(plan: Plan) -> None:
    with pytest.raises(OSError, match="no space"):
        stubborn(plan, "a", "full")


class Unable:
    def __init__(self, plan: Plan) -> None:
        os._exit(3)


def test_workers_that_can_not_begin_end_the_run(plan: Plan) -> None:
    with pytest.raises(ModelFault, match="status 3"):
        list(local_engine.run_local(plan, [Task(Path("a"), "a", "00")], 1, Unable))


def test_labels_are_told_as_small_numbers(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver, "run_local", in_process)
    run(folder)
    (part, *_) = (folder.parent / "out" / "manifest").glob("chair*.parquet")
    labels = pq.read_table(part).column("labels")
    assert str(labels.type.value_type) == "int16"
    assert part_path(folder.parent / "out", Task(Path(), "chair.glb", part.stem[-16:])) == part
    assert np.ptp(labels.to_pylist()[0]) > 0
