"""What a model of one's own may suffer, and how it is told; the others are served."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from own_models import change, cut, flip, rewrite_network, swap_template, write_throne

from service.encode import catalog as module
from service.encode.catalog import Catalog
from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.installed import Installed

DISCRIMINATOR = f"throne{DISCRIMINATOR_SUFFIX}"
Spoil = Callable[[Path], Any]


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A folder with a sound model in it."""
    write_throne(tmp_path / "models")
    return tmp_path / "models"


def catalog(own: Path) -> Catalog:
    stool: Any = SimpleNamespace(name="stool", version="1", verify=lambda: None)
    return Catalog(lambda: {"stool": stool}, own, 1)


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (lambda own: change(own, digest="sha256-00"), "model_digest"),
        (lambda own: change(own, discriminator={"digest": "sha256-00"}), "model_digest"),
        (lambda own: change(own, golden=[0.0]), "model_golden"),
        (lambda own: change(own, golden=None), "model_golden"),
        (lambda own: change(own, golden=[0.0] * 34), "model_golden"),
        (lambda own: change(own, name="bench"), "model_name"),
        (lambda own: change(own, version=None), "model_unreadable"),
        (lambda own: change(own, kind="magic"), "model_unreadable"),
        (lambda own: change(own, kind="skinned"), "model_shape"),
        (lambda own: change(own, calibration={}), "model_unreadable"),
        (lambda own: change(own, golden=[[1], "x"]), "model_unreadable"),
        (lambda own: (own / "throne.json").write_text("{"), "model_unreadable"),
        (lambda own: (own / "throne.json").write_text("[]"), "model_unreadable"),
        (lambda own: (own / "throne.json").write_bytes(b"\xff\xfe"), "model_unreadable"),
        (lambda own: cut(own / "throne.json"), "model_unreadable"),
        (lambda own: cut(own / "throne.yaml"), "template_digest"),
        (lambda own: (own / "throne.yaml").unlink(), "model_unreadable"),
        (swap_template, "model_shape"),
        (lambda own: (own / "throne.onnx").unlink(), "model_file_missing"),
        (lambda own: (own / DISCRIMINATOR).unlink(), "model_file_missing"),
        (lambda own: (own / "throne.onnx").write_bytes(b""), "model_digest"),
        (lambda own: cut(own / "throne.onnx"), "model_digest"),
        (lambda own: flip(own / "throne.onnx"), "model_digest"),
        (lambda own: flip(own / DISCRIMINATOR), "model_digest"),
        (lambda own: rewrite_network(own, b"no network"), "model_unreadable"),
        (lambda own: rewrite_network(own, (own / DISCRIMINATOR).read_bytes()), "model_shape"),
    ],
)
def test_a_bad_own_model_takes_no_other_down(own: Path, spoil: Spoil, code: str) -> None:
    looks = catalog(own)
    good = looks.load().models["throne"]
    spoil(own)
    # At the start it is missing; later what was there before is served on.
    at_start, later = catalog(own).load(), looks.load()
    assert list(at_start.models) == ["stool"]
    assert later.models["throne"] is good
    for installed in (at_start, later):
        (fault,) = installed.faults
        assert fault.code == code, fault
        assert "throne" in fault.detail
        assert fault.suggestion


def test_what_was_put_right_is_served_again(own: Path) -> None:
    looks = catalog(own)
    first = looks.load().models["throne"]
    flip(own / "throne.onnx")
    assert [fault.code for fault in looks.load().faults] == ["model_digest"]
    flip(own / "throne.onnx")
    installed = looks.load()
    assert installed.faults == ()
    assert installed.models["throne"] is first


def while_loading(monkeypatch: pytest.MonkeyPatch, happens: Callable[[], Any]) -> None:
    """Let something happen to the files once the model has been read from them."""
    load = module.load_model

    def load_then(*arguments: Any) -> Any:
        model = load(*arguments)
        happens()
        return model

    monkeypatch.setattr(module, "load_model", load_then)


@pytest.mark.parametrize(
    "happens",
    [
        lambda own: change(own, label="Seat of power"),
        lambda own: flip(own / "throne.onnx"),
        lambda own: (own / "throne.yaml").unlink(),
    ],
)
def test_a_file_that_changes_meanwhile_is_noticed(
    own: Path, monkeypatch: pytest.MonkeyPatch, happens: Spoil
) -> None:
    with monkeypatch.context() as patch:
        while_loading(patch, lambda: happens(own))
        (fault,) = catalog(own).load().faults
    assert fault.code == "model_changing"
    assert "throne.json" in fault.detail


def test_a_model_that_goes_meanwhile_is_no_reason_to_fail(
    own: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (own / "throne.json").rename(own / "was.json")
    monkeypatch.setattr(module, "_visible", lambda *_: iter([own / "throne.json"]))
    installed: Installed = catalog(own).load()
    assert list(installed.models) == ["stool"]
    assert {fault.code for fault in installed.faults} == {"model_unreadable"}
