"""Bodies over HTTP: the contract's own names and shapes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from pretend_body import saved

from service import main
from service.api.schemas import Category, EditReport, InferReport
from service.mesh.formats import read_mesh
from service.settings import Settings
from service.template.anatomy import JOINTS
from service.template.skinned import NAMES, Body, SkinnedTemplate


@pytest.fixture(scope="module")
def client(serving: Any, body_folder: Path) -> Iterator[httpx.Client]:
    with serving(main.create_app(Settings(workers=2, models_dir=body_folder))) as client:
        yield client


@pytest.fixture(scope="module")
def glb(human: SkinnedTemplate, strider: Body) -> bytes:
    return saved(human, strider, "glb").data


def test_a_body_is_inferred(client: httpx.Client, glb: bytes) -> None:
    response = client.post("/infer", files={"mesh": ("me.glb", glb)})
    assert response.status_code == 200, response.text
    report = InferReport.model_validate_json(response.content, extra="forbid")
    assert report.category == "human"
    assert list(report.parameters) == list(NAMES)
    assert {estimate.unit for estimate in report.parameters.values()} == {"rad", "1"}
    assert list(report.derived) == ["stature"]
    assert report.derived["stature"].unit == "m"
    assert report.joints is not None
    assert list(report.joints) == list(JOINTS)
    assert report.fit.encoder == "point"


def test_a_body_is_edited(client: httpx.Client, glb: bytes) -> None:
    edits = json.dumps({"left_elbow_y": {"add": -0.5}, "stature": 1.9})
    response = client.post("/edit", files={"mesh": ("me.glb", glb)}, data={"edits": edits})
    assert response.status_code == 200, response.text
    values = json.loads(response.headers["shape-parameters"])
    assert list(values) == [*NAMES, "stature"]
    assert values["stature"] == pytest.approx(1.9)
    before, after = (read_mesh(data, "me.glb") for data in (glb, response.content))
    assert np.array_equal(after.faces, before.faces)
    assert 0.05 < np.abs(after.vertices - before.vertices).max() < 1.0
    again = client.post("/edit", files={"mesh": ("me.glb", glb)}, data={"edits": "{}"})
    assert again.content == glb


def test_an_edits_report_has_the_units(client: httpx.Client, glb: bytes) -> None:
    response = client.post(
        "/edit",
        files={"mesh": ("me.glb", glb)},
        data={"edits": '{"stature": {"scale": 1.05}}', "keep": "pelvis", "mode": "paper"},
        headers={"Accept": "application/json"},
    )
    report = EditReport.model_validate_json(response.content, extra="forbid")
    tall = report.derived["stature"]
    assert tall.after == pytest.approx(1.05 * tall.before)
    assert (tall.unit, report.parameters["neck_x"].unit) == ("m", "rad")
    assert report.parameters["shape_0"].after > report.parameters["shape_0"].before


def test_a_name_that_no_body_has(client: httpx.Client, glb: bytes, problem: Any) -> None:
    response = client.post(
        "/edit", files={"mesh": ("me.glb", glb)}, data={"edits": '{"left_elbow": 1}'}
    )
    document = problem(response, 422, "unknown_parameter")
    assert "left_elbow_y" in document.suggestion


def test_the_category_is_described(client: httpx.Client) -> None:
    answer = Category.model_validate_json(client.get("/categories/human").content, extra="forbid")
    assert [p.name for p in answer.parameters] == [*NAMES, "stature"]
    assert answer.keep == ["floor", "pelvis"]
    for parameter in answer.parameters:
        assert parameter.range[0] <= parameter.typical[0] < parameter.typical[1]
        assert parameter.typical[1] <= parameter.range[1]
        assert 0 < parameter.step < parameter.typical[1] - parameter.typical[0]


def test_a_body_file_that_can_not_be_read_is_told_at_the_start(
    serve: Any,
    body_folder: Path,
    tmp_path: Path,
    problem: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    broken = tmp_path / "SMPL.npz"
    broken.write_bytes(b"PK no archive")
    monkeypatch.setattr(main, "SHIPPED", body_folder)
    client = serve(main.create_app(Settings(body_model=broken)))
    document = problem(client.get("/categories"), 503, "model_fault")
    assert "BODY_MODEL=" in document.detail
    assert "SMPL.npz' can't be used: the file is no archive of arrays" in document.detail
    assert "SMPL's format" in document.suggestion
