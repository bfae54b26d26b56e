"""Labels of vertices."""

from __future__ import annotations

import numpy as np
import trimesh

from service.augment.labels import category_parts
from service.augment.variants import Source
from service.deform.blend import part_weights
from service.template.loader import load_template


def test_a_chair_of_boxes_is_labelled_box_by_box(
    chair_source: Source, box_chair: trimesh.Trimesh
) -> None:
    found = chair_source.labels
    assert found.parts == category_parts(chair_source.found.model)
    assert found.labels.dtype == np.int16
    assert len(found.labels) == len(chair_source.found.mesh.vertices)
    truth = load_template("paper_chair")
    names = np.array(found.parts)[found.labels]
    for index, part in enumerate(truth.parts):
        own = names[truth.part == index]
        kind = "leg" if "leg" in part else part
        assert (np.char.find(own, kind) >= 0).mean() > 0.7, part


def test_legs_are_told_apart(chair_source: Source) -> None:
    found = chair_source.labels
    x = chair_source.found.vertices[:, 0]
    for name, sign in (("front_left_leg", 1.0), ("front_right_leg", -1.0)):
        own = found.labels == found.parts.index(name)
        assert own.any()
        assert (sign * x[own] > 0).all()


def test_weights_are_shares(chair_source: Source) -> None:
    found, fit = chair_source.found, chair_source.found.fit
    at = fit.template, fit.parameters, fit.translation
    weights = part_weights(found.vertices, found.mesh.faces, *at)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-4)
    assert weights.min() >= -1e-6
