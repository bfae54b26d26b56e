from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from service import main
from service.api.schemas import Alive, Ready
from service.errors import ModelFault


def test_alive_and_ready(client: httpx.Client) -> None:
    assert client.post("/infer", files={"mesh": ("a.obj", b"abc")}).status_code == 200
    Alive.model_validate_json(client.get("/livez").content, extra="forbid")
    ready = Ready.model_validate_json(client.get("/readyz").content, extra="forbid")
    assert ready.models["stool"].digest == "sha256-00"
    assert ready.faults == []


def test_while_models_load_it_is_alive_but_not_ready(
    pretend_app: Callable[..., FastAPI],
    serve: Any,
    problem: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    release = threading.Event()
    load = main.load_models

    def slowly(*arguments: Any) -> Any:
        release.wait(30)
        return load(*arguments)

    monkeypatch.setattr(main, "load_models", slowly)
    client = serve(pretend_app())
    try:
        response = client.get("/readyz")
        problem(response, 503, "starting")
        assert response.headers["retry-after"] == "1"
        assert client.get("/livez").status_code == 200
    finally:
        release.set()
    # A request for work waits for the models instead of failing.
    assert client.get("/categories").status_code == 200
    assert client.get("/readyz").status_code == 200


def test_a_bad_model_keeps_it_from_being_ready(
    pretend_app: Callable[..., FastAPI],
    serve: Any,
    problem: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def load(*_: Any) -> Any:
        raise ModelFault("model_unreadable", "stool.json can't be loaded", "Export it again.")

    app = pretend_app
    monkeypatch.setattr(main, "load_models", load)
    client = serve(app())
    problem(client.post("/infer", files={"mesh": ("a.obj", b"abc")}), 503, "model_fault")
    assert "stool.json" in problem(client.get("/readyz"), 503, "model_fault").detail
    assert client.get("/livez").status_code == 200
