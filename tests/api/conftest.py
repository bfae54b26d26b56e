"""A pipeline and models that only pretend, for tests of what HTTP does around them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from service import main, pipeline
from service.errors import ModelFault
from service.requests import Upload
from service.settings import Settings

IDENTITY = {"name": "stool", "version": "1", "digest": "sha256-00"}


class PretendModel:
    """Has a name and a description, and passes its golden request unless told otherwise."""

    name = "stool"
    version = "1"
    digest = "sha256-00"
    fingerprint = "00"

    def __init__(self, fault: ModelFault | None = None) -> None:
        self.fault = fault

    def verify(self) -> None:
        if self.fault is not None:
            raise self.fault

    def describe(self) -> dict[str, Any]:
        return {
            "name": "stool",
            "label": "Stool",
            "points": 100,
            "model": IDENTITY,
            "keep": ["floor"],
            "parameters": [],
        }


@dataclass
class PretendPipeline:
    """Notes what it is asked; `work` runs within each call, to block or to fail."""

    work: Callable[[], None] = lambda: None
    calls: list[dict[str, Any]] = field(default_factory=list)

    def infer(self, upload: Upload, models: Any, options: Any, known: Any = None) -> Any:
        self.calls.append({"upload": upload, "models": models, "options": options})
        self.work()
        return SimpleNamespace(report=lambda: {"mesh_id": upload.mesh_id, "category": "stool"})

    def edit(
        self,
        upload: Upload,
        models: Any,
        options: Any,
        edits: Any,
        edit_options: Any,
        constraints: Any = None,
        known: Any = None,
    ) -> Any:
        self.calls.append({
            "upload": upload, "models": models, "options": options, "edits": edits,
            "edit_options": edit_options, "constraints": constraints,
        })  # fmt: skip
        self.work()
        return SimpleNamespace(
            data=upload.data + b" edited",
            format="obj",
            media_type="model/obj",
            parameters={"seat_width": 0.123456789, "leg_height": 0.4},
            report={
                "category": "stool",
                "model": IDENTITY,
                "parameters": {"seat_width": {"before": 0.1, "after": 0.12, "unit": "m"}},
                "derived": {},
                "dimensions": {},
                "vertices": {"total": 3, "moved": 2},
                "flipped_faces": 0,
                "warnings": ["a warning"],
            },
        )


@pytest.fixture
def pretend(monkeypatch: pytest.MonkeyPatch) -> PretendPipeline:
    """The pipeline that `pretend_app` calls."""
    double = PretendPipeline()
    monkeypatch.setattr(pipeline, "infer", double.infer)
    monkeypatch.setattr(pipeline, "edit", double.edit)
    return double


@pytest.fixture
def pretend_app(
    pretend: PretendPipeline, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., FastAPI]:
    """Makes the app, with the settings that are given, over pretended models."""
    monkeypatch.setattr(main, "load_models", lambda *_: {"stool": PretendModel()})
    return lambda **settings: main.create_app(Settings(**{"workers": 2, **settings}))


@pytest.fixture(scope="session")
def _pretend_client(serving: Any) -> Iterator[httpx.Client]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(main, "load_models", lambda *_: {"stool": PretendModel()})
        app = main.create_app(Settings(workers=2))
    with serving(app) as client:
        yield client


@pytest.fixture
def client(pretend: PretendPipeline, _pretend_client: httpx.Client) -> httpx.Client:
    """A client of the service over the pretended pipeline."""
    return _pretend_client
