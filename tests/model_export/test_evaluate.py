from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from model_export import evaluate
from model_export.realistic import find_shapes, load_cloud
from service.encode.model import Encoding
from service.mesh.surface import Normalization
from service.template.affine import AffineTemplate


class MeanModel:
    """Stands for an encoder: answers the same for every stand."""

    points = 300
    answer = np.array([0.7, 0.1, 0.5])
    place = np.array([0.0, 0.2, 0.0])

    def __init__(self, template: AffineTemplate) -> None:
        self.template = template

    def encode(self, points: np.ndarray) -> Encoding:
        assert points.shape == (self.points, 3)
        assert np.linalg.norm(points, axis=1).max() == pytest.approx(0.6)
        return Encoding(self.answer, self.place, np.ones(1))


@pytest.fixture
def model(stand: AffineTemplate) -> Any:
    return MeanModel(stand)


def test_clouds_of_real_shapes_are_normalised(meshes: Path, tmp_path: Path) -> None:
    shapes = find_shapes(meshes)[:3]
    clouds = evaluate.clouds_of(shapes, tmp_path, 400)
    for shape, cloud in zip(shapes, clouds, strict=True):
        assert (cloud.shape, cloud.dtype) == ((400, 3), np.float32)
        np.testing.assert_allclose(np.linalg.norm(cloud, axis=1).max(), 0.6, rtol=1e-5)
        np.testing.assert_allclose(cloud.mean(axis=0), 0, atol=1e-5)
        # A part of the samples shows the whole of the shape, not its first faces only.
        whole = load_cloud(shape, tmp_path)
        normalization = Normalization.of(whole)
        np.testing.assert_allclose(
            np.ptp(cloud, axis=0), np.ptp(whole, axis=0) * normalization.scale, rtol=0.08
        )


def test_synthetic_samples_agree_with_their_labels(model: Any, stand: AffineTemplate) -> None:
    samples, labels, variant = evaluate.synthetic_samples(model, 6)
    assert labels.shape == (6, 6)
    assert variant.tolist() == [0] * 6
    for drawn, label in zip(samples, labels, strict=True):
        assert drawn.points.shape == (300, 3)
        normalised = Normalization.of(drawn.points).apply(drawn.points)
        vertices = stand.decode(label[:3]) + label[3:]
        visible = stand.faces[~stand.hidden]
        corners = vertices[visible[drawn.faces]]
        there = np.einsum("nk,nkc->nc", drawn.barycentric, corners)
        np.testing.assert_allclose(there, normalised, atol=1e-12)
    again = evaluate.synthetic_samples(model, 6)
    assert np.array_equal(again[1], labels)
    assert np.array_equal(again[0][2].points, samples[2].points)


def test_refinement_is_set_against_the_encoder_and_a_constant(model: Any) -> None:
    table = evaluate.synthetic_table(model, 8)
    assert (table["shapes"], table["thresholds"]) == (8, [0.01, 0.02, 0.03])
    for row in ("constant", "encoder", "refined"):
        within = table[row]["vertices_within_percent"]
        assert within == sorted(within)
        assert 0 <= within[0] <= within[-1] <= 100
        assert set(table[row]["mean_error_percent_of_range"]) == set(model.template.names)
    # The encoder knows nothing here: what is found is found by refinement.
    assert table["refined"]["vertices_within_percent"][1] > 60
    assert table["encoder"]["vertices_within_percent"][1] < 10
    error = table["constant"]["mean_error_percent_of_range"]["post_height"]
    assert 15 < error < 40


def test_real_shapes_are_measured_as_files(model: Any, meshes: Path) -> None:
    shape = find_shapes(meshes)[0]
    fit, samples = evaluate.infer_shape(model, shape)
    assert samples.points.shape == (300, 3)
    assert fit.distance <= fit.encoder_distance
    table = evaluate.real_fits(model, find_shapes(meshes))
    assert list(table) == ["all"]
    assert table["all"]["shapes"] == 10
    assert table["all"]["median_distance_refined"] < table["all"]["median_distance_encoder"]


def test_ordinary_shapes_are_measured_apart(model: Any, meshes: Path) -> None:
    shapes = find_shapes(meshes)
    kinds = [{"base": "4"}] * 3 + [{"base": "4", "kind": "stool"}] * 2 + [{"base": "sled"}] * 5
    for shape, info in zip(shapes, kinds, strict=True):
        shape.info.update(info)
    table = evaluate.real_fits(model, shapes)
    assert table["four_legs_and_back"]["shapes"] == 3
    assert table["all"]["shapes"] == 10
    distances = [evaluate.infer_shape(model, shape)[0].distance for shape in shapes]
    median = table["four_legs_and_back"]["median_distance_refined"]
    assert median == pytest.approx(float(np.median(distances[:3])), abs=1e-4)


# Measured by hand: a chair 2 m high, so that a centimetre is half a percent.
ROW: dict[str, Any] = {
    "bbox": {"extents": [1, 2.0, 1], "min": [0, -0.5, 0]},
    "template": {"back_depth": 0.1, "leg_height": 0.4, "seat_height": 0.05, "seat_width": 0.5},
    "template_confidence": {"back_depth": "high", "leg_height": "high", "seat_height": "low",
                            "seat_width": "undefined"},
    "measured": {"seat_top_y": -0.04},
    "alternatives": {"template": {"leg_height": [0.44, 0.3], "seat_height": 0.09},
                     "measured": {"seat_top_y": 0.02}},
}  # fmt: skip
VALUES = {"back_thickness": 0.12, "leg_height": 0.43, "seat_thickness": 0.08, "seat_width": 0.7}


def test_gaps_are_to_the_nearest_defensible_reading_in_percent_of_the_height() -> None:
    gaps = evaluate._gaps(VALUES, ROW)
    assert gaps == pytest.approx({
        "back_thickness": 1.0,
        "leg_height": 0.5,
        "seat_thickness": 0.5,
        "seat_top_height": 0.5,
    })  # fmt: skip
    only = {name: value for name, value in ROW.items() if name != "alternatives"}
    gaps = evaluate._gaps(VALUES, only)
    assert (gaps["leg_height"], gaps["seat_thickness"]) == pytest.approx((1.5, 1.5))
    assert gaps["seat_top_height"] == pytest.approx(100 * abs(0.51 - 0.46) / 2)


def test_errors_against_hand_measurements_are_listed_by_parameter(
    model: Any, meshes: Path, stand: AffineTemplate, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    shapes = find_shapes(meshes)
    rows = []
    for shape in shapes[:4]:
        row = {
            "id": shape.name,
            "bbox": {"extents": [1, 1.0, 1]},
            "template": dict.fromkeys(stand.names, 0.5),
            "template_confidence": {},
        }
        rows.append(json.dumps(row))
    truth = tmp_path / "truth.jsonl"
    truth.write_text("\n".join(rows), "utf-8")
    gaps = evaluate._gaps
    # Stands have no seat; all else is as for chairs.
    monkeypatch.setattr(
        evaluate,
        "_gaps",
        lambda values, row: {
            n: g
            for n, g in gaps(
                values | {"leg_height": 0, "seat_thickness": 0},
                row
                | {
                    "template": row["template"] | {"leg_height": 0, "seat_height": 0},
                    "measured": {"seat_top_y": 0},
                    "bbox": row["bbox"] | {"min": [0, 0, 0]},
                },
            ).items()
            if n in stand.names
        },
    )
    errors = evaluate.truth_errors(model, meshes, truth)
    assert set(errors) == {"encoder", "refined"}
    for table in errors.values():
        assert list(table) == list(stand.names)
        assert all(gap.shape == (4,) for gap in table.values())
    fit, _ = evaluate.infer_shape(model, shapes[0])
    scale = fit.normalization.scale
    assert errors["refined"]["post_height"][0] == pytest.approx(
        100 * abs(fit.parameters[2] / scale - 0.5)
    )
    assert errors["encoder"]["post_height"][0] == pytest.approx(100 * abs(0.5 / scale - 0.5))
    evaluate.print_truth({"encoder": {"a": np.array([1.0, 2.0, 3.0])}})
    assert capsys.readouterr().out.splitlines()[-1] == "| a | 2.0 / 2.5 / 2.8 |"


def test_the_command_line_measures_an_installed_model(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["evaluate", "chair", "--count", "2"])
    evaluate.main()
    table = json.loads(capsys.readouterr().out)
    assert table["shapes"] == 2
    assert table["refined"]["vertices_within_percent"][2] > 30
