from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import trimesh

from service import pipeline
from service.edits import parse_edits
from service.encode.debugmodel import DebugModel, outermost
from service.encode.model import SHIPPED, Model, load_models
from service.errors import InvalidRequest
from service.mesh.frame import Orientation
from service.mesh.surface import Surface
from service.requests import EditOptions, InferOptions, SliderOptions, Upload


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return load_models(SHIPPED, names=["debug"])


def upload(mesh: trimesh.Trimesh, format: str = "glb") -> Upload:
    data: Any = mesh.export(file_type=format)
    return Upload(data.encode() if isinstance(data, str) else bytes(data), f"mesh.{format}")


def spindle() -> trimesh.Trimesh:
    """Two tips along x and a thin waist: samples of its surface hardly ever reach the tips."""
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    mesh.vertices[mesh.vertices[:, 0].argmax()] = [3.0, 0.0, 0.0]
    mesh.vertices[mesh.vertices[:, 0].argmin()] = [-1.0, 0.02, 0.01]
    mesh.apply_translation([7.0, -2.0, 0.5])
    return mesh


def test_it_verifies(models: Any) -> None:
    model = models["debug"]
    model.verify()
    assert isinstance(model, DebugModel)
    assert not model.recognised


@pytest.mark.parametrize("refine", [True, False])
@pytest.mark.parametrize("mesh", [trimesh.creation.box((0.5, 1.0, 2.0)), spindle()])
def test_its_parameters_are_the_meshs_own_extents(
    models: Any, mesh: trimesh.Trimesh, refine: bool
) -> None:
    options = InferOptions("debug", refine=refine)
    report = pipeline.infer(upload(mesh), models, options).report()
    values = [report["parameters"][name]["value"] for name in ("width", "height", "depth")]
    np.testing.assert_allclose(values, mesh.extents, rtol=1e-5)
    assert report["derived"]["total_depth"]["value"] == pytest.approx(mesh.extents[2], rel=1e-5)
    assert [entry["sigma"] for entry in report["parameters"].values()] == [0.0, 0.0, 0.0]
    assert (report["frame"]["up"], report["frame"]["front"]) == ("+y", "+z")
    assert report["fit"]["in_distribution"]
    assert report["warnings"] == []


def test_the_extents_are_those_of_the_named_orientation(models: Any) -> None:
    box = trimesh.creation.box((0.5, 1.0, 2.0))
    report = pipeline.infer(upload(box), models, InferOptions("debug", "+z", "-y")).report()
    values = [report["parameters"][name]["value"] for name in ("width", "height", "depth")]
    np.testing.assert_allclose(values, [0.5, 2.0, 1.0], rtol=1e-5)


def test_an_edit_scales_the_mesh(models: Any) -> None:
    mesh = spindle()
    edits = parse_edits(json.dumps({"width": {"scale": 2}, "depth": 0.7}))
    source = upload(mesh, "ply")
    edited = pipeline.edit(source, models, InferOptions(), edits, EditOptions(keep="center"))
    after = trimesh.load_mesh(trimesh.util.wrap_as_stream(edited.data), file_type="ply")
    width, height, depth = mesh.extents
    np.testing.assert_allclose(after.extents, [2 * width, height, 0.7], rtol=1e-5)
    np.testing.assert_allclose(after.bounds.mean(axis=0), mesh.bounds.mean(axis=0), atol=1e-5)
    assert edited.parameters["width"] == pytest.approx(2 * width, rel=1e-5)
    assert depth != pytest.approx(0.7)


def test_sliders_and_template_answer_too(models: Any) -> None:
    source = upload(trimesh.creation.box((0.5, 1.0, 2.0)))
    for make in (pipeline.sliders, pipeline.template):
        data = make(source, models, InferOptions(), SliderOptions())
        assert data[:4] == b"glTF"
        assert b'"height"' in data


def test_a_flat_mesh_is_answered(models: Any) -> None:
    square = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    report = pipeline.infer(upload(square), models, InferOptions()).report()
    assert 0 < report["parameters"]["depth"]["value"] < 0.002


def test_beside_other_categories_it_answers_only_by_name(models: Any) -> None:
    both = {**models, **load_models(SHIPPED, names=["chair"])}
    box = upload(trimesh.creation.box((0.5, 1.0, 2.0)))
    assert pipeline.infer(box, both, InferOptions()).report()["category"] == "chair"
    assert pipeline.infer(box, both, InferOptions("debug")).report()["category"] == "debug"
    with pytest.raises(InvalidRequest):
        pipeline.infer(box, both, InferOptions("debug@2"))


def test_only_the_corners_of_faces_count() -> None:
    vertices = np.array([[9.0, 9, 9], [0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]])
    faces = np.array([[1, 2, 3], [1, 3, 4]])
    found = outermost(Surface(vertices, faces), 10)
    assert found.shape == (10, 3)
    assert (found.min(axis=0).tolist(), found.max(axis=0).tolist()) == ([0, 0, 0], [1, 2, 3])
    turned = outermost(Surface(vertices, faces).turned(Orientation("+z", "-y")), 10)
    assert np.ptp(turned, axis=0).tolist() == [1, 3, 2]
