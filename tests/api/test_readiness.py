from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import anyio
import pytest

from service.api.readiness import Readiness
from service.api.workers import Workers
from service.errors import ModelFault


def model(verify: Any = lambda: None) -> Any:
    return SimpleNamespace(name="stool", version="1", verify=verify)


def fault_of(readiness: Readiness) -> ModelFault:
    with pytest.raises(ModelFault) as caught:
        readiness.loaded()
    return caught.value


def test_before_the_start_it_is_starting() -> None:
    assert fault_of(Readiness(lambda: {"stool": model()}, Workers(1))).code == "starting"


def test_models_that_verify_are_handed_out() -> None:
    stool = model()

    async def start_and_ask() -> Any:
        readiness = Readiness(lambda: {"stool": stool}, Workers(1))
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(readiness.start)
            return await readiness.models()

    assert anyio.run(start_and_ask) == {"stool": stool}


def raise_golden() -> None:
    raise ModelFault("model_golden", "stool answers off by 0.2", "Export it again.")


def raise_unforeseen() -> Any:
    raise MemoryError("a secret of the inside")


@pytest.mark.parametrize(
    ("load", "detail"),
    [
        (lambda: {"stool": model(), "bench": model(raise_golden)}, "stool answers off by 0.2"),
        (lambda: {}, "No model is installed."),
        (raise_unforeseen, "The models could not be loaded."),
    ],
)
def test_one_bad_model_is_a_fault_with_its_reason(load: Any, detail: str) -> None:
    readiness = Readiness(load, Workers(1))
    anyio.run(readiness.start)
    fault = fault_of(readiness)
    assert fault.code == "model_fault"
    assert fault.detail == detail


def test_a_request_waits_for_the_start_only_so_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.api.readiness.PATIENCE_S", 0.01)
    release = threading.Event()

    def load() -> Any:
        release.wait(20)
        return {"stool": model()}

    async def ask_twice() -> Any:
        readiness = Readiness(load, Workers(1))
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(readiness.start)
            await anyio.sleep(0)
            try:
                with pytest.raises(ModelFault) as caught:
                    await readiness.models()
            finally:
                release.set()
        assert caught.value.code == "starting"
        return await readiness.models()

    assert list(anyio.run(ask_twice)) == ["stool"]


def test_without_a_lifespan_the_first_request_is_the_start() -> None:
    loads: list[int] = []

    def load() -> Any:
        loads.append(1)
        return {"stool": model()}

    async def ask_twice() -> Any:
        readiness = Readiness(load, Workers(1))
        return [list(await readiness.models()), list(await readiness.models())]

    assert anyio.run(ask_twice) == [["stool"], ["stool"]]
    assert loads == [1]
