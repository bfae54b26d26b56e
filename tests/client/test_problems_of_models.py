"""Models that can't be trusted, as clients see them: in `/readyz`, and where none is left."""

from __future__ import annotations

import json
import shutil
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from provoke import BOX, client_of, provokes, refused

from model_export.debug_model import write_model
from service import main
from service.encode import catalog
from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.model import file_digest
from service.main import create_app
from service.settings import Settings
from service.template.loader import template_path

Spoil = Callable[[Path], Any]


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def change(card: Path, **entries: Any) -> None:
    card.write_text(json.dumps({**json.loads(card.read_text("utf-8")), **entries}), "utf-8")


def rename(folder: Path) -> None:
    for path in list(folder.iterdir()):
        path.rename(folder / path.name.replace("debug", "bench", 1))


def swap_network(folder: Path) -> None:
    shutil.copy(folder / f"debug{DISCRIMINATOR_SUFFIX}", folder / "debug.onnx")
    change(folder / "debug.json", digest=file_digest(folder / "debug.onnx"))


def change_template(folder: Path) -> None:
    text = template_path("debug").read_text("utf-8")
    (folder / "debug.yaml").write_text(text + "# changed\n", "utf-8")


def twin(folder: Path) -> None:
    shutil.copytree(folder, folder / "twin")
    change(folder / "twin" / "debug.json", label="Another")


SPOILT: dict[str, Spoil] = {
    "model_digest": lambda folder: flip(folder / "debug.onnx"),
    "model_duplicate": twin,
    "model_file_missing": lambda folder: (folder / "debug.onnx").unlink(),
    "model_golden": lambda folder: change(folder / "debug.json", golden=[0.0]),
    "model_name": rename,
    "model_shape": swap_network,
    "model_unreadable": lambda folder: (folder / "debug.json").write_text("{"),
    "models_dir_missing": shutil.rmtree,
    "template_digest": change_template,
}


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """An operator's folder with a sound model in it."""
    (tmp_path / "models").mkdir()
    write_model(tmp_path / "models", "2.0.0")
    return tmp_path / "models"


@pytest.fixture
def fault(own: Path, serve: Any) -> Callable[..., Any]:
    """The only fault of a service with that folder, which serves all the same."""

    def found(**settings: Any) -> Any:
        app = create_app(Settings(**{"categories": ("debug",), "models_dir": own, **settings}))
        client = client_of(serve(app))
        assert client.infer(BOX).category == "debug"
        (fault,) = client.ready().faults
        return fault

    return found


@provokes(**dict.fromkeys(SPOILT, 200))
def test_a_fault_of_ones_own_model_is_listed(own: Path, fault: Any, code: str) -> Any:
    SPOILT[code](own)
    return fault()


@provokes(model_changing=200)
def test_files_that_change_while_they_are_read(
    own: Path, fault: Any, monkeypatch: pytest.MonkeyPatch
) -> Any:
    load = catalog.load_model

    def load_then_change(*arguments: Any) -> Any:
        model = load(*arguments)
        change(own / "debug.json", label="Another")
        return model

    monkeypatch.setattr(catalog, "load_model", load_then_change)
    return fault()


@provokes(models_dir_unreadable=200)
def test_a_folder_that_may_not_be_read(
    own: Path, fault: Any, monkeypatch: pytest.MonkeyPatch
) -> Any:
    read = Path.iterdir

    def iterdir(path: Path) -> Any:
        if path == own:
            raise PermissionError(13, "Permission denied")
        return read(path)

    monkeypatch.setattr(Path, "iterdir", iterdir)
    return fault()


@provokes(default_missing=200)
def test_a_default_that_is_not_there(fault: Any) -> Any:
    return fault(default_models={"debug": "7.0.0"})


@provokes(body_model=200)
def test_a_body_of_ones_own_that_can_not_be_read(
    body_folder: Path, tmp_path: Path, fault: Any
) -> Any:
    broken = tmp_path / "SMPL.npz"
    broken.write_bytes(b"PK no archive")
    return fault(models_dir=body_folder, body_model=broken)


@provokes(model_fault=503)
def test_nothing_to_serve(serve: Any) -> Any:
    client = client_of(serve(create_app(Settings(categories=()))))
    assert refused(client.ready).code == "model_fault"
    return refused(lambda: client.infer(BOX))


@provokes(starting=503)
def test_models_that_still_load(serve: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    release, load = threading.Event(), main.load_models

    def slowly(*arguments: Any) -> Any:
        release.wait(20)
        return load(*arguments)

    monkeypatch.setattr(main, "load_models", slowly)
    client = client_of(serve(create_app(Settings(categories=("debug",)))))
    try:
        return refused(client.ready)
    finally:
        release.set()


@provokes(draining=503)
def test_a_service_that_is_about_to_stop(serve: Any) -> Any:
    app = create_app(Settings(categories=("debug",)))
    client = client_of(serve(app))
    assert client.infer(BOX).category == "debug"
    app.state.context.readiness.drain()
    return refused(client.ready)
