from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import anyio
import pytest
from fastapi import FastAPI

from service.api.readiness import Readiness
from service.encode.catalog import Installed
from service.errors import ModelFault


def model() -> Any:
    return SimpleNamespace(name="stool", version="1")


def fault_of(readiness: Readiness) -> ModelFault:
    with pytest.raises(ModelFault) as caught:
        _ = readiness.installed
    return caught.value


def test_before_the_start_it_is_starting() -> None:
    assert fault_of(Readiness(lambda: Installed({"stool": model()}))).code == "starting"


def test_models_that_verify_are_handed_out() -> None:
    stool = model()

    async def start_and_ask() -> Any:
        readiness = Readiness(lambda: Installed({"stool": stool}))
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(readiness.start)
            return await readiness.models()

    assert anyio.run(start_and_ask) == {"stool": stool}


def raise_golden() -> Any:
    raise ModelFault("model_golden", "stool answers off by 0.2", "Export it again.")


def raise_unforeseen() -> Any:
    raise MemoryError("a secret of the inside")


@pytest.mark.parametrize(
    ("load", "detail"),
    [
        (raise_golden, "stool answers off by 0.2"),
        (lambda: Installed({}), "No model is installed."),
        (
            lambda: Installed({}, (ModelFault("model_digest", "a.onnx is altered", "Copy it."),)),
            "No model can be served: a.onnx is altered.",
        ),
        (raise_unforeseen, "The models could not be loaded."),
    ],
)
def test_one_bad_model_is_a_fault_with_its_reason(load: Any, detail: str) -> None:
    readiness = Readiness(load)
    anyio.run(readiness.start)
    fault = fault_of(readiness)
    assert fault.code == "model_fault"
    assert fault.detail == detail


def test_a_request_waits_for_the_start_only_so_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.api.readiness.PATIENCE_S", 0.01)
    release = threading.Event()

    def load() -> Any:
        release.wait(20)
        return Installed({"stool": model()})

    async def ask_twice() -> Any:
        readiness = Readiness(load)
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
        return Installed({"stool": model()})

    async def ask_twice() -> Any:
        readiness = Readiness(load)
        return [list(await readiness.models()), list(await readiness.models())]

    assert anyio.run(ask_twice) == [["stool"], ["stool"]]
    assert loads == [1]


def reloaded(*looks: Any) -> Readiness:
    """Started at the first look, then reloaded for each further one."""
    finds = iter(looks)
    readiness = Readiness(lambda: next(finds)())

    async def start_and_reload() -> None:
        await readiness.start()
        for _ in looks[1:]:
            await readiness.reload()

    anyio.run(start_and_reload)
    return readiness


def test_a_reload_hands_out_what_is_there_now() -> None:
    old, new = model(), model()
    bad = ModelFault("model_digest", "bench.onnx is altered", "Export it again.")
    readiness = reloaded(
        lambda: Installed({"stool": old}), lambda: Installed({"stool": new, "bench": old}, (bad,))
    )
    assert readiness.installed.models == {"stool": new, "bench": old}
    assert readiness.names == ["bench", "stool"]
    assert readiness.installed.faults == (bad,)


@pytest.mark.parametrize("look", [raise_golden, raise_unforeseen, lambda: Installed({})])
def test_a_reload_that_fails_keeps_what_was_there(look: Any) -> None:
    stool = model()
    readiness = reloaded(lambda: Installed({"stool": stool}), look)
    assert readiness.installed.models == {"stool": stool}


def test_a_reload_can_make_good_a_failed_start() -> None:
    assert reloaded(raise_golden, lambda: Installed({"stool": model()})).names == ["stool"]
    assert Readiness(lambda: Installed({})).names == []


def test_requests_keep_the_models_that_they_began_with() -> None:
    old, new = model(), model()
    finds = iter([Installed({"stool": old}), Installed({"stool": new})])
    readiness = Readiness(lambda: next(finds))

    async def reload_within_a_request() -> Any:
        await readiness.start()
        models = await readiness.models()
        await readiness.reload()
        return models, await readiness.models()

    assert anyio.run(reload_within_a_request) == ({"stool": old}, {"stool": new})


def test_a_reload_waits_for_no_worker(
    pretend: Any, pretend_app: Callable[..., FastAPI], serve: Any
) -> None:
    begun, release = threading.Event(), threading.Event()

    def work() -> None:
        begun.set()
        release.wait(20)

    pretend.work = work
    app = pretend_app(workers=1)
    client = serve(app)
    with ThreadPoolExecutor() as pool:
        answer = pool.submit(client.post, "/infer", files={"mesh": ("a.obj", b"abc")})
        try:
            assert begun.wait(20)
            anyio.run(app.state.context.readiness.reload)
            assert app.state.context.readiness.reloads == {"success": 1, "failure": 0}
            assert not answer.done()
        finally:
            release.set()
        assert answer.result().status_code == 200
