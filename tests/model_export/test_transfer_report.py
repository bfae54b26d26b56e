from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from model_export import transfer_report
from model_export.detailed import detailed_chair
from model_export.transfer_report import RULES, score_chair, score_edit, told
from service.encode.distance import Cloud, surface_distance
from service.mesh.surface import sample_surface
from service.template.affine import AffineTemplate
from service.template.loader import load_template

RIGHT = np.ones(8)


@pytest.fixture(scope="module")
def category() -> AffineTemplate:
    return load_template("chair")


def square(width: float) -> tuple[np.ndarray, np.ndarray]:
    x = np.array([[0, 0, 0], [width, 0, 0], [width, 1, 0], [0, 1, 0]], float)
    return x, np.array([[0, 1, 2], [0, 2, 3]])


def test_the_truth_scores_nothing_and_doing_nothing_scores_one() -> None:
    (x, faces), (truth, _) = square(1.0), square(2.0)
    perfect = score_edit(x, truth, truth, faces, 0)
    assert (perfect.accuracy, perfect.tail, perfect.locality) == (0.0, 0.0, 0.0)
    assert perfect.edge == pytest.approx(1.0)
    idle = score_edit(x, x, truth, faces, 1)
    assert idle.accuracy == pytest.approx(1.0)
    assert idle.edge == pytest.approx(2.0)
    assert idle.flips == pytest.approx(500)


def test_locality_counts_only_what_should_stay() -> None:
    (x, faces), (truth, _) = square(1.0), square(2.0)
    y = truth.copy()
    y[0, 1] -= 0.1
    assert score_edit(x, y, truth, faces, 0).locality == pytest.approx(0.05 / np.sqrt(2))
    y = truth.copy()
    y[1, 1] -= 0.1
    assert score_edit(x, y, truth, faces, 0).locality == 0.0


@pytest.mark.parametrize("seed", [0, 2, 3, 7])
def test_the_truth_lays_the_template_over_the_chair(category: AffineTemplate, seed: int) -> None:
    chair = detailed_chair(seed)
    known = told(chair, category, RIGHT)
    assert known.template.variant == ("armchair" if chair.arms else "chair")
    vertices = known.normalization.apply(chair.mesh(chair.parameters))
    samples = sample_surface(vertices, chair.faces, 2000, np.random.default_rng(0))
    cloud = Cloud(samples.points, samples.normals)
    near = surface_distance(known.template, known.f, known.t, cloud)
    wrong = told(chair, category, 1.0 + 0.2 * np.array([1, -1] * 4))
    assert near < 0.02
    assert near < surface_distance(wrong.template, wrong.f, wrong.t, cloud)


def test_blending_beats_scaling_the_whole(category: AffineTemplate) -> None:
    chair = detailed_chair(1)
    known = told(chair, category, RIGHT)
    errors = {
        name: np.mean([score.accuracy for score in score_chair(chair, known, RULES[name])])
        for name in ("blend", "global scale")
    }
    assert errors["blend"] < 0.1
    assert errors["global scale"] > 1.0


def test_the_report_has_a_row_a_rule_and_a_source_of_parameters(
    category: AffineTemplate, monkeypatch: pytest.MonkeyPatch
) -> None:
    def exact(chair: Any, model: Any) -> Any:
        return told(chair, model.template, RIGHT)

    monkeypatch.setattr(transfer_report, "inferred", exact)
    model: Any = SimpleNamespace(template=category)
    head, _, *rows = transfer_report.report(1, {"blend": RULES["blend"]}, model).splitlines()
    assert head.count("|") == 9
    cells = [[cell.strip() for cell in row.split("|")] for row in rows]
    assert [row[2] for row in cells] == ["true", "off by 5 %", "inferred"]
    assert cells[0][3:] == cells[2][3:]
    assert float(cells[1][3]) > float(cells[0][3])
