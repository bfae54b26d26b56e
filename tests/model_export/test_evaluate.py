from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from model_export import evaluate
from model_export.realistic import find_shapes
from model_export.samples import infer_shape


def test_refinement_is_set_against_the_encoder_and_a_constant(mean_model: Any) -> None:
    table = evaluate.synthetic_table(mean_model, 8)
    assert (table["shapes"], table["thresholds"]) == (8, [0.01, 0.02, 0.03])
    for row in ("constant", "encoder", "refined"):
        within = table[row]["vertices_within_percent"]
        assert within == sorted(within)
        assert 0 <= within[0] <= within[-1] <= 100
        assert set(table[row]["mean_error_percent_of_range"]) == set(mean_model.template.names)
    # The encoder knows nothing here: what is found is found by refinement.
    assert table["refined"]["vertices_within_percent"][1] > 60
    assert table["encoder"]["vertices_within_percent"][1] < 10
    error = table["constant"]["mean_error_percent_of_range"]["post_height"]
    assert 15 < error < 40


def test_real_shapes_are_measured_as_files(mean_model: Any, meshes: Path) -> None:
    table = evaluate.real_fits(mean_model, find_shapes(meshes))
    assert list(table) == ["all"]
    assert table["all"]["shapes"] == 10
    assert table["all"]["median_distance_refined"] < table["all"]["median_distance_encoder"]


def test_ordinary_shapes_are_measured_apart(mean_model: Any, meshes: Path) -> None:
    shapes = find_shapes(meshes)
    kinds = [{"base": "4"}] * 3 + [{"base": "4", "kind": "stool"}] * 2 + [{"base": "sled"}] * 5
    for shape, info in zip(shapes, kinds, strict=True):
        shape.info.update(info)
    table = evaluate.real_fits(mean_model, shapes)
    assert list(table) == ["all", "four legs and a back", "kind stool"]
    assert table["four legs and a back"]["shapes"] == 3
    assert table["kind stool"]["shapes"] == 2
    assert table["all"]["shapes"] == 10
    distances = [infer_shape(mean_model, shape).fit.distance for shape in shapes]
    median = table["four legs and a back"]["median_distance_refined"]
    assert median == pytest.approx(float(np.median(distances[:3])), abs=1e-4)
    score = table["four legs and a back"]["median_score"]
    assert score == pytest.approx(1 / (1 + np.median(distances[:3])), abs=1e-4)


def test_the_command_line_measures_an_installed_model(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["evaluate", "chair", "--count", "2"])
    evaluate.main()
    table = json.loads(capsys.readouterr().out)
    assert table["shapes"] == 2
    assert table["refined"]["vertices_within_percent"][2] > 30
