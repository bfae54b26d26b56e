from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from six_boxes import SIX_BOXES, rewrite

from service.encode.model import Model, load_models
from service.errors import ModelFault
from service.template.affine import AffineTemplate


def test_a_folder_of_models_is_loaded(folder: Path) -> None:
    models = load_models(folder)
    assert list(models) == ["chair"]
    model = models["chair"]
    assert (model.name, model.version, model.points) == ("chair", "1.2.3", 100)
    assert model.template.name == "chair"
    model.verify()


def test_an_empty_folder_holds_no_models(tmp_path: Path) -> None:
    assert load_models(tmp_path) == {}


def test_a_template_beside_the_card_is_the_categorys(folder: Path) -> None:
    text = SIX_BOXES.replace("label: Chair", "label: Throne")
    (folder / "chair.yaml").write_text(text, "utf-8")
    assert load_models(folder)["chair"].template.label == "Throne"


@pytest.mark.parametrize("fault", ["json", "array", "name", "digest", "template", "yaml"])
def test_a_card_that_cannot_be_used_is_refused(folder: Path, fault: str) -> None:
    if fault == "json":
        (folder / "chair.json").write_text("{", "utf-8")
    elif fault == "array":
        (folder / "chair.json").write_text("[]", "utf-8")
    elif fault == "template":
        rewrite(folder, name="sofa")
        (folder / "chair.yaml").unlink()
    elif fault == "yaml":
        (folder / "chair.yaml").write_text("name: chair", "utf-8")
    else:
        rewrite(folder, **{fault: None})
    with pytest.raises(ModelFault) as caught:
        load_models(folder)
    assert caught.value.code == "model_unreadable"
    assert caught.value.detail.startswith("chair.json can't be loaded")


@pytest.mark.parametrize("name", ["chair.onnx", "chair.discriminator.onnx"])
def test_a_card_without_its_networks_is_refused(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(ModelFault) as caught:
        load_models(folder)
    assert name in caught.value.detail


def test_the_installed_model_is_whole(chair_model: Model, chair: AffineTemplate) -> None:
    chair_model.verify()
    assert chair_model.points == chair.points == 2840
    assert 0.01 < chair_model.limit_distance < 0.04


def test_a_copied_model_is_as_good(folder: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(folder, tmp_path / "copy")
    load_models(copy)["chair"].verify()
