from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from model_export.body_sheet import EDITS, chosen, edit_panels, fit_panel
from model_export.realistic import RealisticShape, find_shapes
from service.encode.model import SHIPPED, Model, load_model
from service.template.skinned import NAMES, Body, SkinnedTemplate


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model(SHIPPED / "human.json")


@pytest.fixture
def shape(human: SkinnedTemplate, strider: Body, tmp_path: Path) -> RealisticShape:
    mesh = trimesh.Trimesh(human.decode(strider), human.faces, process=False)
    mesh.export(tmp_path / "strider.ply")
    return find_shapes(tmp_path)[0]


def test_edits_are_of_parameters_that_there_are() -> None:
    assert len(EDITS) == 24
    assert {name for change in EDITS for name in change} <= {*NAMES, "stature"}


def test_a_fit_is_drawn_over_the_body(model: Model, shape: RealisticShape) -> None:
    (own, fitted) = fit_panel(model, shape).meshes
    assert np.abs(own[0] - fitted[0]).max() < 0.01
    assert (own[1] == fitted[1]).all()


def test_an_edit_is_drawn_beside_the_body(model: Model, shape: RealisticShape) -> None:
    before, after = edit_panels(model, shape, {"left_knee_x": 0.8})
    assert after.title == "left_knee_x +0.8"
    moved = (before.meshes[0][0] != after.meshes[0][0]).any(axis=1)
    assert 0.02 < moved.mean() < 0.3


def test_shapes_that_were_trained_on_are_not_drawn(shape: RealisticShape) -> None:
    shapes = [replace(shape, name=str(i), held_out=i % 3 == 0) for i in range(9)]
    names = [own.name for own in chosen(shapes, 5)]
    assert set(names) == {"0", "3", "6"}
    assert len(set(names[:3])) == 3
