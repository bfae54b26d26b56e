from __future__ import annotations

from importlib import resources
from pathlib import Path

import pytest

from model_export.bodyconfig import BodyConfig, load_body_config


def test_settings_come_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "human.yaml"
    path.write_text("steps: 7\ngarments: {cloth: 0.01}\nweights: {sim: 2.0}\n")
    config = load_body_config(path)
    assert (config.steps, config.garments.cloth, config.weights.sim) == (7, 0.01, 2.0)
    assert load_body_config(None) == BodyConfig()
    path.write_text("stepz: 7\n")
    with pytest.raises(ValueError, match="stepz"):
        load_body_config(path)


def test_a_body_can_be_trained_on_a_cpu() -> None:
    with resources.as_file(resources.files("model_export.configs") / "human-cpu.yaml") as path:
        config = load_body_config(path)
    shipped = BodyConfig()
    assert config.steps * config.batch < 0.2 * shipped.steps * shipped.batch
    assert (config.width, config.depth) == (shipped.width, shipped.depth)
