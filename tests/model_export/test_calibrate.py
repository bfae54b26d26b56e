from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from plain_chair import PLAIN

from model_export.calibrate import (
    DRAWN_FARTHER,
    DRAWN_ODDS,
    FEWEST,
    LEAST_SCALE,
    calibrate,
    sigma_scales,
)
from model_export.realistic import RealisticShape, find_shapes
from model_export.truth import Judged, Measured
from service.encode.model import SIGMA_FLOOR, Model, load_models
from service.mesh.frame import CANONICAL
from service.mesh.surface import Samples, sample_surface
from service.template.loader import load_template

MODELS = Path(__file__).parents[2] / "service" / "models"


@pytest.fixture(scope="module")
def model() -> Model:
    return load_models(MODELS)["chair"]


def drawn(model: Model, count: int, noise: float = 0.0) -> list[Samples]:
    """Box chairs of growing seats."""
    rng = np.random.default_rng(0)
    template = load_template("paper_chair")
    f = np.array(list(PLAIN.values()))
    found = []
    for index in range(count):
        vertices = template.decode(f + np.eye(8)[4] * 0.02 * index)
        vertices = vertices + noise * rng.standard_normal(vertices.shape)
        found.append(sample_surface(vertices, template.faces, model.points, rng))
    return found


def test_without_real_shapes_the_limits_of_drawn_ones_are_loosened(model: Model) -> None:
    shapes = drawn(model, 3)
    card = calibrate(model, [], shapes)
    assert card["shapes"] == 0
    assert 0 < card["limit_distance"] < DRAWN_FARTHER * 0.02
    least = min(model.discriminator.odds(s.points, [CANONICAL])[0] for s in shapes)
    assert least - DRAWN_ODDS <= card["limit_odds"] < least - DRAWN_ODDS + 1.0


def test_worse_shapes_give_looser_limits(model: Model) -> None:
    clean, rough = (calibrate(model, [], drawn(model, 3, noise)) for noise in (0.0, 0.02))
    assert rough["limit_distance"] > 1.5 * clean["limit_distance"]


def test_real_shapes_come_before_drawn_ones(
    model: Model, tmp_path: Path, box_chair: trimesh.Trimesh
) -> None:
    for name, width in (("a", 1.0), ("b", 1.1)):
        wider = box_chair.copy()
        wider.apply_scale([width, 1.0, 1.0])
        wider.export(tmp_path / f"{name}.ply")
    card = calibrate(model, find_shapes(tmp_path), drawn(model, 2, 0.05))
    assert card["shapes"] == 2
    assert card["limit_distance"] < 0.02
    assert card["limit_odds"] > 0


def test_sigma_covers_two_thirds_of_the_errors() -> None:
    rng = np.random.default_rng(0)
    shape, measured = RealisticShape("a", Path("a.ply"), False, {}), Measured("a", "all", 1.0, {})

    def answer(error: float, fitted: float) -> Judged:
        name = {"width": error}
        return Judged(shape, measured, name, name, {"width": 1.0}, {"width": fitted}, 0.02)

    errors, fitted = np.abs(rng.normal(0, 2.0, 400)), rng.uniform(0.01, 0.03, 400)
    judged = [answer(e, f) for e, f in zip(errors, fitted, strict=True)]
    scale = sigma_scales(judged)["width"]
    within = errors * 0.02 <= np.hypot(scale * fitted, SIGMA_FLOOR)
    assert within.mean() == pytest.approx(0.68, abs=0.01)
    assert sigma_scales(judged[: FEWEST - 1]) == {}
    assert sigma_scales([answer(0.01, 1.0)] * FEWEST) == {"width": LEAST_SCALE}
