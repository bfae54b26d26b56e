from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import anyio
import httpx
import pytest
from fastapi import Request

from service import __main__, main
from service.api.workers import Workers
from service.encode.model import SHIPPED
from service.mesh import limits
from service.settings import Settings


def test_making_an_app_loads_no_model(monkeypatch: pytest.MonkeyPatch) -> None:
    loads: list[Any] = []
    monkeypatch.setattr(main, "load_models", lambda *arguments: loads.append(arguments))
    main.create_app(Settings())
    assert loads == []


def test_workers_share_the_cpus(monkeypatch: pytest.MonkeyPatch, serve: Any) -> None:
    asked: list[Any] = []

    def load(directory: Any, threads: int, body: Any, names: Any) -> Any:
        asked.append((directory, threads, body, names))
        return {}

    monkeypatch.setattr(main, "cpu_count", lambda: 8)
    monkeypatch.setattr(main, "load_models", load)
    settings = Settings(workers=3, body_model=Path("mine.npz"), categories=("chair",))
    app = main.create_app(settings)
    serve(app).get("/categories")
    assert asked == [(SHIPPED, 2, Path("mine.npz"), ("chair",))]
    assert app.state.context.workers.count == 3
    assert main.create_app(Settings(workers=None)).state.context.workers.count == 8


def test_the_app_stops_while_models_load(serve: Any) -> None:
    assert serve(main.create_app(Settings())).get("/livez").status_code == 200


def test_a_setting_that_makes_no_sense_ends_the_command(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert __main__.main(["--port", "99999"]) == 2
    assert "PORT='99999'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("CATEGORIES", "chair,sofa", "'sofa' does not come with the service; name some of"),
        ("DEFAULT_MODELS", "chair@1.0.0", "is not of the form CATEGORY=VERSION"),
    ],
)
def test_models_that_there_are_none_of_end_it_too(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    value: str,
    told: str,
) -> None:
    monkeypatch.setenv(name, value)
    assert __main__.main([]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"python -m service: {name}={value!r}: ")
    assert told in error


def test_the_command_serves_on_the_port_that_it_is_told() -> None:
    environment = {**os.environ, "PORT": "1", "HOST": "203.0.113.1"}
    process = subprocess.Popen(
        [sys.executable, "-m", "service", "--host", "127.0.0.1", "--port", "0"],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        for line in process.stderr:
            if match := re.search(r"running on (http://127\.0\.0\.1:\d+)", line):
                break
        else:
            pytest.fail("the command ended before it served")
        response = httpx.get(f"{match[1]}/livez", trust_env=False)
        assert response.json() == {"status": "alive"}
        assert "server" not in response.headers
    finally:
        process.terminate()
        process.communicate(timeout=30)


def test_each_cache_takes_an_eighth_of_a_small_containers_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def capacities(memory: int, **settings: Any) -> tuple[int, int]:
        """Of meshes and of inferences."""
        monkeypatch.setattr(main, "memory_bytes", lambda: memory)
        context = main.create_app(Settings(**settings)).state.context
        return context.store.memory.capacity, context.inferences.capacity

    assert capacities(512 << 20) == (64 << 20, 64 << 20)
    assert capacities(64 << 30) == (256 << 20, 256 << 20)
    assert capacities(512 << 20, mesh_cache_bytes=5) == (5, 64 << 20)
    assert capacities(512 << 20, inference_cache_bytes=0) == (64 << 20, 0)


def test_the_largest_mesh_is_set_or_goes_by_the_memory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(main, "memory_bytes", lambda: 512 << 20)

    def most(**settings: Any) -> int:
        pool = main.create_app(Settings(workers=1, **settings)).state.context.workers
        request = Request({"type": "http"}, anyio.sleep_forever)
        return int(anyio.run(pool.run, request, limits.most_vertices))

    assert 120_000 < most() < 130_000
    assert 130_000 < most(jobs_dir=tmp_path) < 140_000
    assert most(mesh_cache_bytes=0) > 180_000
    assert most(max_vertices=7) == 7


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("STORE_DIR", "/dev/null/store", "STORE_DIR='/dev/null/store' can't be used"),
        ("STORE_URL", "nowhere://bucket", "STORE_URL=nowhere://... can't be used"),
    ],
)
def test_a_store_that_can_not_be_ends_the_command(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    value: str,
    words: str,
) -> None:
    monkeypatch.setenv(name, value)
    assert __main__.main([]) == 2
    assert words in capsys.readouterr().err


def test_memory_is_given_back_after_work_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    trims: list[int] = []
    monkeypatch.setattr(main, "TRIM_EVERY_S", 0.005)
    monkeypatch.setattr(main.malloc, "trim", lambda: trims.append(1))
    workers = Workers(1)

    async def work_once() -> None:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(main._trim_after_work, workers)
            await anyio.sleep(0.05)
            assert trims == []
            workers.pace = 0.5
            with anyio.fail_after(20):
                while not trims:
                    await anyio.sleep(0.005)
            await anyio.sleep(0.05)
            tasks.cancel_scope.cancel()

    anyio.run(work_once)
    assert trims == [1]
