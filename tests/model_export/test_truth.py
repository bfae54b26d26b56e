from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from model_export import truth
from model_export.realistic import RealisticShape, find_shapes
from model_export.samples import infer_shape
from model_export.truth import Judged, Measured
from service.encode.model import SIGMA_FLOOR

# A chair 2 m high, so that a centimetre is half a percent.
CHAIR: dict[str, Any] = {
    "id": "a", "kind": "dining",
    "bbox": {"extents": [1, 2.0, 1], "min": [0, -0.5, 0]},
    "template": {"back_depth": 0.1, "leg_height": 0.4, "seat_height": 0.05, "seat_width": 0.5},
    "template_confidence": {"back_depth": "sure", "leg_height": "sure", "seat_height": "approx",
                            "seat_width": "undefined"},
    "measured": {"seat_top_y": -0.04},
    "alternatives": {"template": {"leg_height": [0.44, 0.3], "seat_height": 0.09},
                     "measured": {"seat_top_y": 0.02}},
}  # fmt: skip


def read(rows: list[dict[str, Any]], folder: Path) -> dict[str, Measured]:
    path = folder / "truth.jsonl"
    path.write_text("\n".join(map(json.dumps, rows)) + "\n", "utf-8")
    return truth.read_truth(path)


def test_chairs_are_read_with_their_alternatives_under_the_names_of_the_api(
    tmp_path: Path,
) -> None:
    chair = read([CHAIR], tmp_path)["a"]
    assert (chair.kind, chair.size) == ("dining", 2.0)
    assert chair.readings == {
        "back_thickness": [0.1],
        "leg_height": [0.4, 0.44, 0.3],
        "seat_thickness": [0.05, 0.09],
        "seat_top_height": [pytest.approx(0.46), pytest.approx(0.52)],
        "total_height": [2.0],
    }


def test_other_shapes_say_their_size_and_values(tmp_path: Path) -> None:
    row = {"id": "b", "size": 4, "values": {"wing_length": [2.0, 2.2]}}
    plane = read([CHAIR, row], tmp_path)["b"]
    assert (plane.kind, plane.size, plane.readings) == ("all", 4.0, {"wing_length": [2.0, 2.2]})


def test_a_gap_is_to_the_nearest_reading_in_percent_of_the_size() -> None:
    measured = Measured("a", "dining", 2.0, {"leg_height": [0.4, 0.44]})
    assert measured.gap("leg_height", 0.43) == pytest.approx(0.5)
    assert measured.gap("leg_height", 0.3) == pytest.approx(5.0)


def test_answers_are_judged_encoder_and_refined(
    mean_model: Any, meshes: Path, tmp_path: Path
) -> None:
    shapes = find_shapes(meshes)[:3]
    rows = [
        {"id": s.name, "size": 0.5, "values": {"post_height": [0.5], "total_height": [1.0]}}
        for s in shapes
    ]
    judged = truth.judge(mean_model, meshes, read(rows, tmp_path))
    assert [entry.shape.name for entry in judged] == [shape.name for shape in shapes]
    for shape, entry in zip(shapes, judged, strict=True):
        found = infer_shape(mean_model, shape)
        scale = found.fit.normalization.scale
        assert entry.encoder["post_height"] == pytest.approx(200 * abs(0.5 / scale - 0.5))
        refined = found.fit.parameters[2] / scale
        assert entry.refined["post_height"] == pytest.approx(200 * abs(refined - 0.5))
        assert entry.sigma["post_height"] == pytest.approx(200 * found.fit.sigma[2] / scale)
        # An extent is the mesh's own, whatever the model says.
        height = np.ptp(found.mesh.vertices[:, 1])
        for errors in (entry.encoder, entry.refined):
            assert errors["total_height"] == pytest.approx(200 * abs(height - 1.0), abs=1e-6)
        assert entry.unit == pytest.approx(0.005 * scale)
        assert entry.worst == max(entry.refined.values())


def judged(kind: str, refined: dict[str, float], sigma: float = 1.0) -> Judged:
    shape = RealisticShape("a", Path("a.ply"), False, {})
    encoder = {name: 2 * value for name, value in refined.items()}
    claims = dict.fromkeys(refined, sigma)
    return Judged(shape, Measured("a", kind, 1.0, {}), encoder, refined, claims, claims, 0.01)


def test_the_tables_give_percentiles_and_how_often_sigma_holds() -> None:
    entries = [judged("bar", {"w": value}) for value in (0.5, 0.9, 1.5, 3.0)]
    entries.append(judged("dining", {"w": 7.0, "h": 0.1}))
    head, rule, *rows = truth.errors_table(entries).splitlines()
    assert head.count("|") == rule.count("|") == 5
    assert rows == [
        "| w | 3.0 / 6.0 / 10.8 | 1.5 / 3.0 / 5.4 | 40 % |",
        "| h | 0.2 / 0.2 / 0.2 | 0.1 / 0.1 / 0.1 | 100 % |",
    ]
    assert truth.kinds_table(entries).splitlines() == [
        "| dimension | bar (4) | dining (1) |",
        "|---|---|---|",
        "| w | 1.2 | 7.0 |",
        "| h | - | 0.1 |",
    ]


def test_the_worst_are_drawn(mean_model: Any, meshes: Path, tmp_path: Path,
                             monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    titles: list[str] = []
    monkeypatch.setattr(
        truth, "save_sheet", lambda panels, path: titles.extend(p.title for p in panels)
    )
    monkeypatch.setattr(truth, "fit_panel", lambda model, shape: truth.Panel(shape.name, []))
    entries = [judged("bar", {"w": value, "h": 0.2}) for value in (0.5, 4.0, 1.5)]
    truth.save_worst(mean_model, entries, tmp_path / "worst.png", count=2)
    assert [title.splitlines()[1] for title in titles] == ["w off by 4.0 %", "w off by 1.5 %"]


def test_claims_follow_from_the_fits_and_a_cards_scales() -> None:
    shape, measured = RealisticShape("a", Path("a.ply"), False, {}), Measured("a", "all", 1.0, {})
    sigma, fitted = {"width": 9.0, "height": 9.0}, {"width": 0.01, "height": 0.02}
    (entry,) = truth.rescaled([Judged(shape, measured, {}, {}, sigma, fitted, 0.01)], {"width": 3})
    assert entry.sigma["width"] == pytest.approx(np.hypot(3.0, 100 * SIGMA_FLOOR))
    assert entry.sigma["height"] == pytest.approx(np.hypot(2.0, 100 * SIGMA_FLOOR))
    assert entry.fitted_sigma == fitted
