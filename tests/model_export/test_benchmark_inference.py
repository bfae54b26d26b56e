from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from model_export.benchmark import inference
from model_export.benchmark.inference import (
    Guess,
    Labelled,
    detailed_shapes,
    inference_section,
    predictions,
    recovery_table,
    template_shapes,
)
from service.encode.affineoutputs import Encoding
from service.encode.distance import Cloud, surface_distance
from service.mesh.surface import Normalization
from service.template.affine import AffineTemplate
from service.template.loader import load_template


class Teacher:
    """An encoder that is told the labels, and off by a factor."""

    def __init__(self, template: AffineTemplate, name: str, off: float = 1.0) -> None:
        self.template, self.name, self.points, self.off = template, name, 400, off
        self.sigma_scale = np.ones(len(template.parameters))
        self.answers: dict[bytes, Encoding] = {}

    def learn(self, known: Labelled) -> None:
        size, kinds = len(self.template.parameters), len(self.template.present)
        for drawn, label, variant in zip(
            known.samples, known.labels, known.variant.tolist(), strict=True
        ):
            key = Normalization.of(drawn.points).apply(drawn.points).tobytes()
            shares = np.eye(max(kinds, 1))[variant]
            self.answers[key] = Encoding(self.off * label[:size], label[size:], shares)

    def encode(self, points: np.ndarray) -> Encoding:
        return self.answers[points.tobytes()]


@pytest.fixture
def stand_shapes(stand: AffineTemplate) -> tuple[Any, Labelled]:
    model: Any = Teacher(stand, "stand", off=1.1)
    known = template_shapes(model, 6)
    model.learn(known)
    return model, known


def test_guesses_are_means_of_the_labels(stand_shapes: tuple[Any, Labelled]) -> None:
    model, known = stand_shapes
    guess = Guess.of(model.template, known)
    np.testing.assert_allclose(guess.mean, known.labels.mean(axis=0))
    assert guess.axes.tolist() == [0, 1, 1]
    boxed = guess.boxed(known.samples)
    # The slab's width is the stand's: its share of the box is the same for every stand.
    np.testing.assert_allclose(boxed[:, 0], known.labels[:, 0], rtol=0.05)


def test_rivals_end_in_the_order_of_what_they_know(stand_shapes: tuple[Any, Labelled]) -> None:
    model, known = stand_shapes
    found = predictions(model, known, Guess.of(model.template, known))
    error = {rival: float(np.abs(own[:, :6] - known.labels).mean()) for rival, own in found.items()}
    assert list(error) == ["constant", "bounding box", "refinement from the mean",
                           "encoder alone", "encoder and refinement"]  # fmt: skip
    assert error["encoder and refinement"] < 0.2 * error["encoder alone"]
    assert error["refinement from the mean"] < error["constant"]
    assert error["bounding box"] < error["constant"]


@pytest.mark.parametrize("name", ["chair", "airplane"])
def test_detailed_shapes_have_the_labels_of_their_generator(name: str) -> None:
    template = load_template(name)
    model: Any = SimpleNamespace(template=template, name=name, points=800)
    known = detailed_shapes(model, 3, 1)
    size = len(template.parameters)
    for drawn, label, variant in zip(
        known.samples, known.labels, known.variant.tolist(), strict=True
    ):
        cloud = Cloud(Normalization.of(drawn.points).apply(drawn.points), drawn.normals)
        own = template.variants[variant]
        assert surface_distance(own, label[:size], label[size:], cloud) < 0.025


def test_a_table_has_a_line_for_each_source_and_rival(
    stand_shapes: tuple[Any, Labelled], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, known = stand_shapes
    other = Labelled("D", known.samples[:3], known.labels[:3], known.variant[:3])
    monkeypatch.setattr(
        inference, "predictions",
        lambda model, known, guess: {"perfect": known.labels, "off": known.labels + 0.02},
    )  # fmt: skip
    lines = recovery_table(model, [known, other]).splitlines()
    assert lines[0] == (
        "| S, 6 stands | perfect | 100.0 / 100.0 / 100.0 | 100.0 / 100.0 / 100.0 | 0.0 | 100 |"
    )
    assert [line.split("|")[1].strip() for line in lines] == ["S, 6 stands"] * 2 + [
        "D, 3 stands"
    ] * 2
    # The error is the same, and both are over the range of S.
    assert lines[1].split("|")[5] == lines[3].split("|")[5] != lines[0].split("|")[5]
    page = inference_section(lines)
    assert page.count("\n| ") == 5
