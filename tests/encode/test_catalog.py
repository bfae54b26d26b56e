from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import service.template
from service.encode.catalog import SUFFIXES, Catalog
from service.encode.model import SHIPPED, Model, file_digest, load_models
from service.errors import ModelFault
from service.template.loader import load_template


class Pretend:
    """A shipped model."""

    def __init__(self, name: str, fault: ModelFault | None = None) -> None:
        self.name = name
        self.fault = fault

    def verify(self) -> None:
        if self.fault is not None:
            raise self.fault


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A models folder of one's own, with the chair in it under the name of throne."""
    folder = tmp_path / "models"
    folder.mkdir()
    template = (Path(load_template.__code__.co_filename).parent / "chair.yaml").read_text("utf-8")
    (folder / "throne.yaml").write_text(template.replace("name: chair", "name: throne"), "utf-8")
    for suffix in SUFFIXES:
        if (SHIPPED / f"chair{suffix}").is_file():
            shutil.copy(SHIPPED / f"chair{suffix}", folder / f"throne{suffix}")
    change(folder, name="throne", template_digest=file_digest(folder / "throne.yaml"))
    return folder


def change(folder: Path, card: str = "throne", **entries: Any) -> None:
    path = folder / f"{card}.json"
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | entries), "utf-8")


def catalog(own: Path | None, shipped: Any = None) -> Catalog:
    return Catalog(lambda: shipped or {"stool": Pretend("stool")}, own, 1)


def test_without_a_folder_the_shipped_models_are_all() -> None:
    installed = catalog(None).load()
    assert list(installed.models) == ["stool"]
    assert installed.faults == ()


def test_own_models_stand_beside_the_shipped_ones(own: Path) -> None:
    installed = catalog(own).load()
    assert list(installed.models) == ["stool", "throne"]
    assert installed.faults == ()
    assert isinstance(installed.models["throne"], Model)


def test_an_own_model_replaces_a_shipped_one_of_its_name(own: Path) -> None:
    pretend = Pretend("throne")
    assert catalog(own, {"throne": pretend}).load().models["throne"] is not pretend


def test_a_bad_shipped_model_is_an_error(own: Path) -> None:
    fault = ModelFault("model_golden", "stool is off", "Export it again.")
    with pytest.raises(ModelFault) as caught:
        catalog(own, {"stool": Pretend("stool", fault)}).load()
    assert caught.value is fault


def spoil_template(folder: Path) -> None:
    with (folder / "throne.yaml").open("a") as file:
        file.write("# another day\n")


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (lambda folder: change(folder, digest="sha256-00"), "model_digest"),
        (spoil_template, "template_digest"),
        (lambda folder: change(folder, golden=[0.0]), "model_golden"),
        (lambda folder: change(folder, name="bench"), "model_name"),
        (lambda folder: (folder / "throne.json").write_text("{"), "model_unreadable"),
        (lambda folder: (folder / "throne.json").write_text("[]"), "model_unreadable"),
        (lambda folder: (folder / "throne.onnx").unlink(), "model_unreadable"),
        (lambda folder: (folder / "throne.onnx").write_bytes(b"no network"), "model_unreadable"),
        (lambda folder: change(folder, golden=[[1], "x"]), "model_unreadable"),
    ],
)
def test_a_bad_own_model_takes_no_other_down(own: Path, spoil: Any, code: str) -> None:
    looks = catalog(own)
    good = looks.load().models["throne"]
    spoil(own)
    # At the start it is missing; later what was there before is served on.
    at_start, later = catalog(own).load(), looks.load()
    assert list(at_start.models) == ["stool"]
    assert later.models["throne"] is good
    for installed in (at_start, later):
        (fault,) = installed.faults
        assert fault.code == code
        assert "throne" in fault.detail
        assert fault.suggestion


def test_a_look_loads_what_is_new_and_only_that(own: Path) -> None:
    looks = catalog(own)
    first = looks.load().models
    assert looks.load().models["throne"] is first["throne"]
    change(own, version="2.0.0")
    second = looks.load().models
    assert (first["throne"].version, second["throne"].version) != ("2.0.0", "2.0.0")
    assert second["throne"].version == "2.0.0"
    (own / "throne.json").unlink()
    assert list(looks.load().models) == ["stool"]


def test_a_folder_that_is_not_there_is_said(tmp_path: Path) -> None:
    looks = catalog(tmp_path / "models")
    (fault,) = looks.load().faults
    assert fault.code == "models_dir_missing"
    (tmp_path / "models").mkdir()
    assert looks.load().faults == ()


def test_the_shipped_models_all_verify() -> None:
    assert Catalog(lambda: load_models(SHIPPED), None, 1).load().faults == ()


def test_own_bodies_work_with_the_operators_body_file(body_folder: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.npz"
    shutil.copy(Path(service.template.__file__).parent / "human.npz", mine)
    looks = Catalog(lambda: {}, body_folder, 1, mine)
    first = looks.load()
    assert list(first.models) == ["human"]
    mine.write_bytes(b"no body")
    second = looks.load()
    assert [fault.code for fault in second.faults] == ["body_model"]
    assert second.models["human"] is first.models["human"]
