from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event
from typing import Any

import pytest

from service import deadline
from service.errors import InvalidMesh, ModelFault, Overloaded, TooComplex
from service.inferences import Inferences
from service.jobs import runner as module
from service.jobs.job import Failure, Job
from service.jobs.making import Part
from service.jobs.order import Order
from service.jobs.runner import Runner, Surroundings
from service.jobs.store import Bounds, JobStore
from service.mesh import limits

MakeOrder = Callable[..., Order]


class PretendModel:
    """Is told apart by its fingerprint."""

    name, version, recognised = "stool", "1", True

    def __init__(self, fingerprint: str = "one") -> None:
        self.fingerprint = fingerprint


class Pretence:
    """Makes variants of nothing; `work` runs within each."""

    def __init__(self) -> None:
        self.begun: list[int] = []
        self.work: Callable[[int], None] = lambda index: None
        self.opening: Callable[[], None] = lambda: None

    @contextmanager
    def making(self, order: Order, models: Any, known: Any) -> Iterator[Pretence]:
        self.opening()
        yield self

    def part(self, index: int) -> Part:
        self.begun.append(index)
        self.work(index)
        name = f"variants/{index:03d}.glb"
        return Part(name, b"data", {"index": index, "file": name})

    def labels(self) -> bytes | None:
        return None


class World:
    """A store and runners over it."""

    def __init__(self) -> None:
        self.store = JobStore(None, Bounds(10, 1 << 20, 100.0))
        self.models = {"stool": PretendModel()}
        self.draining = False
        self.busy = False
        self.runners: list[Runner] = []

    def start(self) -> Runner:
        around = Surroundings(
            self.found, Inferences(0), 5.0, 77, lambda: self.busy, lambda: self.draining
        )
        runner = Runner(self.store, around)
        self.runners.append(runner)
        runner.start()
        return runner

    def found(self) -> Any:
        if not self.models:
            raise ModelFault("starting", "d", "s")
        return self.models

    def until(self, job: Job, *statuses: str, done: int = 0) -> Job:
        end = time.monotonic() + 20
        while True:
            now = self.store.get(job.id, "")
            if now.status in statuses and now.done >= done:
                return now
            assert time.monotonic() < end, now
            time.sleep(0.005)


@pytest.fixture
def world() -> Iterator[World]:
    world = World()
    yield world
    for runner in world.runners:
        runner.stop()


@pytest.fixture
def pretence(monkeypatch: pytest.MonkeyPatch) -> Pretence:
    double = Pretence()
    monkeypatch.setattr(module, "making", double.making)
    return double


def raising(error: Exception, at: int = 1) -> Callable[[int], None]:
    def work(index: int) -> None:
        if index == at:
            raise error

    return work


def block(index: int) -> None:
    """Until it is abandoned."""
    while True:
        deadline.check()
        time.sleep(0.005)


def problems(world: World, job: Job) -> list[str | None]:
    *_, (name, manifest) = world.store.files(job.id, job.total)
    assert name == "manifest.jsonl"
    rows = [json.loads(line) for line in manifest.splitlines()]
    return [(row.get("problem") or {}).get("code") for row in rows]


def test_a_job_is_carried_out(world: World, pretence: Pretence, order: MakeOrder) -> None:
    seen = []
    pretence.work = lambda index: seen.append(limits.most_vertices())
    runner = world.start()
    job = world.store.submit(order(3), "", "trace")
    runner.wake()
    ended = world.until(job, "succeeded")
    assert (ended.done, pretence.begun) == (3, [0, 1, 2])
    assert seen == [77] * 3
    assert runner.made == {("edit", "ok"): 3}


@pytest.mark.parametrize(
    ("error", "code", "tries"),
    [
        (TooComplex("too_complex", "d", "s"), "too_complex", 1),
        (Overloaded("deadline_exceeded", "d", "s"), "deadline_exceeded", 3),
        (RuntimeError("inside"), "internal_error", 1),
    ],
)
def test_a_variant_that_fails_spoils_no_other(
    world: World,
    pretence: Pretence,
    order: MakeOrder,
    error: Exception,
    code: str,
    tries: int,
) -> None:
    pretence.work = raising(error)
    job = world.store.submit(order(3), "", "trace")
    world.start()
    world.until(job, "succeeded")
    assert problems(world, job) == [None, code, None]
    assert pretence.begun == [0, *[1] * tries, 2]


@pytest.mark.parametrize(
    ("error", "kind", "code"),
    [
        (InvalidMesh("empty_mesh", "d", "s"), "InvalidMesh", "empty_mesh"),
        (RuntimeError("inside"), "Exception", "internal_error"),
    ],
)
def test_a_job_of_which_nothing_can_be_made_fails(
    world: World, pretence: Pretence, order: MakeOrder, error: Exception, kind: str, code: str
) -> None:
    def fail() -> None:
        raise error

    pretence.opening = fail
    job = world.store.submit(order(3), "", "trace")
    world.start()
    failure = Failure.read(world.until(job, "failed").problem or "")
    assert (failure.kind, failure.code) == (kind, code)
    assert "inside" not in failure.text()


def test_cancelling_ends_the_work_within_a_variant(
    world: World, pretence: Pretence, order: MakeOrder
) -> None:
    pretence.work = block
    job = world.store.submit(order(2), "", "trace")
    world.start()
    world.until(job, "running")
    world.store.end(job.id, "")
    pretence.work = lambda index: None
    other = world.store.submit(order(1), "", "trace")
    world.until(other, "succeeded")
    assert world.store.get(job.id, "").status == "cancelled"


@pytest.mark.parametrize("drains", [False, True])
def test_who_stops_leaves_the_job_to_another(
    world: World, pretence: Pretence, order: MakeOrder, drains: bool
) -> None:
    pretence.work = lambda index: block(index) if index == 1 else None
    job = world.store.submit(order(3), "", "trace")
    runner = world.start()
    world.until(job, "running", done=1)
    if drains:
        world.draining = True
        assert runner._thread is not None
        runner._thread.join(20)
        world.draining = False
    else:
        runner.stop(20)
    assert world.store.waiting()
    pretence.work = lambda index: None
    world.start()
    world.until(job, "succeeded")
    assert pretence.begun.count(0) == 1


def test_variants_of_other_models_are_made_anew(
    world: World, pretence: Pretence, order: MakeOrder
) -> None:
    pretence.work = lambda index: block(index) if index == 1 else None
    job = world.store.submit(order(2), "", "trace")
    runner = world.start()
    world.until(job, "running", done=1)
    runner.stop(20)
    world.models = {"stool": PretendModel("two")}
    pretence.work, pretence.begun = (lambda index: None), []
    world.start()
    world.until(job, "succeeded")
    assert pretence.begun == [0, 1]


def test_a_job_that_takes_the_service_down_is_given_up(
    world: World, pretence: Pretence, order: MakeOrder
) -> None:
    job = world.store.submit(order(2), "", "trace")
    for lease in "abc":
        # As if the process were killed each time.
        assert world.store.claim(lease)
        world.store.release(job.id, lease, failed=True)
    world.start()
    failure = Failure.read(world.until(job, "failed").problem or "")
    assert failure.code == "job_interrupted"
    assert pretence.begun == []


def test_it_waits_for_models(world: World, pretence: Pretence, order: MakeOrder) -> None:
    models, world.models = world.models, {}
    job = world.store.submit(order(1), "", "trace")
    runner = world.start()
    world.models = models
    runner.wake()
    world.until(job, "succeeded")


def test_requests_go_first_for_a_while(
    world: World, pretence: Pretence, order: MakeOrder, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = Event()

    def busy() -> bool:
        asked.set()
        return world.busy

    world.busy = True
    monkeypatch.setattr(module, "PATIENCE_S", 60.0)
    around = Surroundings(world.found, Inferences(0), 5.0, 77, busy, lambda: False)
    runner = Runner(world.store, around)
    world.runners.append(runner)
    job = world.store.submit(order(1), "", "trace")
    runner.start()
    assert asked.wait(20)
    assert pretence.begun == []
    world.busy = False
    world.until(job, "succeeded")
