from __future__ import annotations

from pathlib import Path

import pytest

from model_export.config import Config, config_of, load_config
from model_export.losses import Weights
from model_export.synthetic import Augmentation
from service.template.loader import load_template


def test_the_defaults_are_the_papers() -> None:
    config = load_config("paper-chair")
    assert config == Config()
    assert config.template == "paper_chair"
    assert (config.batch, config.real_share, config.learning_rate) == (16, 0.5, 1e-3)
    assert (config.weights.alpha, config.weights.beta, config.weights.gamma) == (0.3, 30.0, 50.0)
    assert (config.shared, config.head) == ((64, 128, 128, 256), None)
    assert config.keypoints is None
    assert config.editing
    assert (config.edit, config.norm) == ("multiply", "l2")
    assert not config.cosine


def test_the_shipped_chair_has_a_configuration() -> None:
    config = load_config("chair")
    assert config.template == "chair"
    assert config.final_points == 2840
    assert config.weights == Weights()
    low, high = config.points
    assert 0 < low <= high


def test_airplanes_are_trained_with_the_papers_weights_for_them() -> None:
    config = load_config("airplane")
    assert config.template == "airplane"
    assert config.weights == Weights(alpha=0.3, beta=200, gamma=10)
    assert config.final_points == load_template("airplane").points


def test_a_file_overrides_the_defaults_and_the_caller_overrides_the_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(
        "steps: 7\nseed: 3\npoints: [10, 20]\nhead: [8]\nshared: [4, 5]\n"
        "weights: {gamma: 0}\naugmentation: {clutter: 0.2}\n",
        "utf-8",
    )
    config = load_config(str(path), seed=0, steps=None, batch=2)
    assert (config.steps, config.seed, config.batch) == (7, 0, 2)
    assert (config.points, config.head, config.shared) == ((10, 20), (8,), (4, 5))
    assert config.weights == Weights(alpha=0.3, beta=30.0, gamma=0)
    assert config.augmentation == Augmentation(clutter=0.2)


def test_an_empty_file_is_all_defaults(tmp_path: Path) -> None:
    path = tmp_path / "empty.yml"
    path.write_text("# nothing\n", "utf-8")
    assert load_config(str(path)) == Config()


def test_a_setting_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("stepps: 7\n", "utf-8")
    with pytest.raises(ValueError, match="no setting is named 'stepps'"):
        load_config(str(path))
    with pytest.raises(ValueError, match="no setting is named 'rate'"):
        load_config("chair", rate=1.0)


def test_a_law_of_edits_or_a_norm_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("edit: add\n", "utf-8")
    with pytest.raises(ValueError, match="edit is one of multiply, set, cycle, not 'add'"):
        load_config(str(path))
    with pytest.raises(ValueError, match="norm is one of l2, l1, not 'l3'"):
        load_config("chair", norm="l3")


def test_a_configuration_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValueError, match="no configuration named 'sofa'"):
        load_config("sofa")


def test_a_template_file_is_trained_with_shipped_settings(stand_file: Path) -> None:
    full, quick = config_of(str(stand_file)), config_of(str(stand_file), quick=True, steps=5)
    assert full.template == quick.template == str(stand_file)
    assert full.final_points == quick.final_points == 64
    assert full.batch == load_config("chair").batch
    assert (quick.batch, quick.steps) == (load_config("quick").batch, 5)
    assert load_config("quick").steps * load_config("quick").batch < full.steps * full.batch / 10


def test_a_configuration_has_its_own_settings(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("steps: 7\n", "utf-8")
    assert config_of(str(path)) == Config(steps=7)
    assert config_of("chair") == load_config("chair")
    with pytest.raises(ValueError, match="--quick is for template files"):
        config_of("chair", quick=True)
