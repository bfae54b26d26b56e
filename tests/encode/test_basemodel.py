from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from six_boxes import ANSWER, rewrite

from service.encode.model import load_models
from service.errors import ModelFault


def test_an_altered_file_is_noticed(folder: Path, write_network: Any) -> None:
    write_network(folder / "chair.onnx", [*ANSWER[:-1], 0.1], (1, 100, 3))
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_digest"
    assert "chair.onnx is sha256-" in caught.value.detail


def test_an_altered_discriminator_is_noticed(folder: Path) -> None:
    rewrite(folder, discriminator={"digest": "sha256-00"})
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_digest"
    assert "chair.discriminator.onnx is sha256-" in caught.value.detail


@pytest.mark.parametrize("index", [0, 3, 10])
def test_an_altered_golden_answer_is_noticed(folder: Path, index: int) -> None:
    golden = json.loads((folder / "chair.json").read_text("utf-8"))["golden"]
    golden[index] += 0.002
    rewrite(folder, golden=golden)
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_golden"
    assert "0.002" in caught.value.detail


def test_a_golden_answer_that_is_not_a_number_is_noticed(folder: Path) -> None:
    rewrite(folder, golden=[float("nan")] * 11)
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_golden"


@pytest.mark.parametrize("golden", [[0.1] * 9, [], None])
def test_a_golden_answer_of_another_size_is_noticed(
    folder: Path, golden: list[float] | None
) -> None:
    rewrite(folder, golden=golden)
    with pytest.raises(ModelFault) as caught:
        load_models(folder)["chair"].verify()
    assert caught.value.code == "model_golden"


def test_the_score_falls_with_the_distance_past_a_half_at_the_limit(folder: Path) -> None:
    score = load_models(folder)["chair"].score
    assert score(0.0, 50.0) == 1.0
    assert score(0.03, 50.0) == pytest.approx(0.5)
    distances = np.linspace(0, 0.2, 50)
    assert (np.diff([score(d, 50.0) for d in distances]) < 0).all()
    assert score(0.2, 50.0) < 0.01


def test_the_score_falls_with_the_odds_past_a_half_at_the_limit(folder: Path) -> None:
    score = load_models(folder)["chair"].score
    assert score(0.0, 1.0) == pytest.approx(0.5)
    assert score(0.0, -8.0) < 0.001
    assert score(0.03, 1.5) == pytest.approx(0.5)
    assert score(0.1, -8.0) == pytest.approx(score(0.0, -8.0))
