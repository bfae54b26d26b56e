from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import trimesh
from weighted import json_of, weighted

from service import pipeline
from service.edits import Change
from service.encode.model import SHIPPED, Model, load_models
from service.errors import InvalidRequest
from service.mesh.convert import convert
from service.mesh.embedding import as_glb
from service.mesh.formats import read_mesh
from service.requests import EditOptions, InferOptions, SliderOptions, Upload

CHAIR = InferOptions(category="chair")


@pytest.fixture(scope="module")
def models() -> Mapping[str, Model]:
    return load_models(SHIPPED)


@pytest.fixture(scope="module")
def upload(box_chair: trimesh.Trimesh) -> Upload:
    return Upload(box_chair.subdivide().export(file_type="glb"), "chair.glb")


def told(data: bytes) -> dict[str, Any]:
    found: dict[str, Any] = json_of(data)["asset"]["extras"]["shape_parameters"]
    return found


def edited(
    models: Mapping[str, Model], upload: Upload, values: Mapping[str, float], options: InferOptions
) -> np.ndarray:
    changes = {name: Change("set", value) for name, value in values.items()}
    result = pipeline.edit(upload, models, options, changes, EditOptions())
    return read_mesh(result.data, upload.name).vertices


def somewhere(data: bytes, share: float) -> dict[str, float]:
    """Every parameter some way towards one of its ends, by turns."""
    ranges = {name: (p["value"], p["range"]) for name, p in told(data)["parameters"].items()}
    return {
        name: value + share * (ends[index % 2] - value)
        for index, (name, (value, ends)) in enumerate(ranges.items())
    }


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5])
@pytest.mark.parametrize(
    ("options", "tolerance"),
    [
        (SliderOptions(), 1e-5),
        (SliderOptions(paired=True), 1e-5),
        (SliderOptions(quantize=True), 1e-4),
    ],
)
def test_any_combination_is_what_an_edit_makes(
    models: Mapping[str, Model],
    upload: Upload,
    share: float,
    options: SliderOptions,
    tolerance: float,
) -> None:
    data = pipeline.sliders(upload, models, CHAIR, options)
    values = somewhere(data, share)
    expected = edited(models, upload, values, CHAIR)
    size = np.linalg.norm(np.ptp(expected, axis=0))
    found = read_mesh(weighted(data, values), "a.glb").vertices
    assert np.abs(found - expected).max() < tolerance * size


def test_other_formats_and_units_come_in_metres(
    models: Mapping[str, Model], box_chair: trimesh.Trimesh
) -> None:
    # Lying on its back, in centimetres.
    lying = 100 * box_chair.vertices[:, [0, 2, 1]] * [1, 1, -1]
    upload = Upload(convert(lying, box_chair.faces, "obj"), "chair.obj")
    options = InferOptions(category="chair", units="cm")
    data = pipeline.sliders(upload, models, options, SliderOptions())
    notes = told(data)
    assert (notes["unit"], notes["metres_per_unit"]) == ("cm", 0.01)
    assert 30 < notes["parameters"]["seat_width"]["value"] < 70
    values = somewhere(data, 0.3)
    expected = 0.01 * edited(models, upload, values, options)
    found = read_mesh(weighted(data, values), "a.glb").vertices
    assert np.abs(found - expected).max() < 1e-5


def painted(chair: trimesh.Trimesh) -> bytes:
    """The chair, in centimetres, as an OBJ in a zip: flat quarters of texture, two materials."""
    rows = ["mtllib chair.mtl", "vt 0 0", "vt 1 0", "vt 0 1"]
    rows += ["v {:.6f} {:.6f} {:.6f}".format(*row) for row in 100 * chair.vertices]
    rows += ["vn {} {} {}".format(*row) for row in chair.vertex_normals]
    for number, face in enumerate(chair.faces + 1):
        rows += [f"usemtl {'wood' if number % 40 else 'red'}"] if number % 20 == 0 else []
        rows.append("f " + " ".join(f"{v}/{i}/{v}" for i, v in enumerate(face, 1)))
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("chair.obj", "\n".join(rows))
        file.writestr("chair.mtl", "newmtl wood\nKd 0.5 0.3 0.1\nnewmtl red\nKd 1 0 0\n")
    return archive.getvalue()


@pytest.mark.parametrize("share", [0.2, 0.5])
@pytest.mark.parametrize("paired", [False, True])
def test_a_mesh_with_looks_does_what_an_edit_makes(
    models: Mapping[str, Model], box_chair: trimesh.Trimesh, share: float, paired: bool
) -> None:
    upload = Upload(painted(box_chair.subdivide()), "chair.zip")
    options = InferOptions(category="chair", units="cm")
    data = pipeline.sliders(upload, models, options, SliderOptions(paired=paired))
    assert [m["name"] for m in json_of(data)["materials"]] == ["red", "wood"]
    mesh = read_mesh(upload.data, upload.name)
    _, of = as_glb(mesh, 0.01)
    assert len(of) > len(mesh.vertices)
    values = somewhere(data, share)
    expected = 0.01 * edited(models, upload, values, options)
    found = read_mesh(weighted(data, values), "a.glb").vertices
    assert np.abs(found - expected[of]).max() < 1e-5


def test_what_is_told_is_what_is_inferred(models: Mapping[str, Model], upload: Upload) -> None:
    notes = told(pipeline.sliders(upload, models, InferOptions(), SliderOptions()))
    report = pipeline.infer(upload, models, InferOptions()).report()
    for name in ("mesh_id", "category", "frame", "fit", "model", "warnings"):
        assert notes[name] == report[name]
    for name, parameter in report["parameters"].items():
        told_of = notes["parameters"][name]
        assert told_of.items() >= parameter.items()
        assert told_of["range"][0] <= parameter["value"] <= told_of["range"][1]
    assert {n: d["value"] for n, d in notes["derived"].items()} == {
        name: derived["value"] for name, derived in report["derived"].items()
    }


def test_derived_dimensions_can_be_followed(models: Mapping[str, Model], upload: Upload) -> None:
    data = pipeline.sliders(upload, models, CHAIR, SliderOptions())
    values = somewhere(data, 0.4)
    changes = {name: Change("set", value) for name, value in values.items()}
    report = pipeline.edit(upload, models, CHAIR, changes, EditOptions()).report
    after = {name: entry["after"] for name, entry in report["dimensions"].items()}
    assert set(after) == set(told(data)["derived"])
    vertices = read_mesh(weighted(data, values), "a.glb").vertices
    for name, derived in told(data)["derived"].items():
        if "axis" in derived:
            value = float(np.ptp(vertices @ derived["axis"]))
        else:
            terms = derived["coefficients"].items()
            value = derived["constant"] + sum(by * values[other] for other, by in terms)
        assert value == pytest.approx(after[name], abs=1e-5)


def test_each_slider_alone_keeps_every_limit(models: Mapping[str, Model], upload: Upload) -> None:
    notes = told(pipeline.sliders(upload, models, CHAIR, SliderOptions()))
    now = {name: parameter["value"] for name, parameter in notes["parameters"].items()}
    assert len(notes["limits"]) >= len(now)
    for name, parameter in notes["parameters"].items():
        for end in parameter["range"]:
            values = {**now, name: end}
            for limit in notes["limits"]:
                terms = limit["coefficients"].items()
                gap = limit["constant"] + sum(by * values[other] for other, by in terms)
                assert gap > -1e-9, (name, limit["text"])


def test_named_parameters_alone(models: Mapping[str, Model], upload: Upload) -> None:
    options = SliderOptions(parameters=("leg_height", "seat_width"))
    data = pipeline.sliders(upload, models, CHAIR, options)
    (mesh,) = json_of(data)["meshes"]
    assert mesh["extras"]["targetNames"] == ["seat_width", "leg_height"]
    assert list(told(data)["parameters"]) == ["seat_width", "leg_height"]
    seat = told(data)["derived"]["seat_top_height"]
    # What is not offered counts at its value.
    assert seat["coefficients"]["leg_height"] == pytest.approx(1.0, abs=0.1)
    leg = told(data)["parameters"]["leg_height"]["value"]
    now = seat["constant"] + seat["coefficients"]["leg_height"] * leg
    assert now == pytest.approx(seat["value"], rel=0.02)


def test_the_point_that_stays_can_be_chosen(models: Mapping[str, Model], upload: Upload) -> None:
    data = pipeline.sliders(upload, models, CHAIR, SliderOptions(keep="seat"))
    taller = {"leg_height": 1.2 * told(data)["parameters"]["leg_height"]["value"]}
    changes = {"leg_height": Change("set", taller["leg_height"])}
    expected = pipeline.edit(upload, models, CHAIR, changes, EditOptions(keep="seat"))
    found = read_mesh(weighted(data, taller), "a.glb").vertices
    assert np.abs(found - read_mesh(expected.data, "a.glb").vertices).max() < 1e-5
    assert told(data)["keep"] == "seat"


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (SliderOptions(parameters=("arm_height",)), "unknown_parameter"),
        (SliderOptions(parameters=()), "parameters_empty"),
        (SliderOptions(keep="ceiling"), "unknown_keep"),
    ],
)
def test_options_that_make_no_sense(
    models: Mapping[str, Model], upload: Upload, options: SliderOptions, code: str
) -> None:
    with pytest.raises(InvalidRequest) as error:
        pipeline.sliders(upload, models, CHAIR, options)
    assert error.value.code == code


def test_the_template_lies_over_the_mesh(models: Mapping[str, Model], upload: Upload) -> None:
    data = pipeline.template(upload, models, CHAIR, SliderOptions())
    mesh, template = read_mesh(upload.data, "a.glb"), read_mesh(data, "a.glb")
    gap = np.abs(mesh.vertices.min(axis=0) - template.vertices.min(axis=0))
    assert gap.max() < 0.02
    wider = {"seat_width": 1.3 * told(data)["parameters"]["seat_width"]["value"]}
    after = read_mesh(weighted(data, wider), "a.glb").vertices
    expected = edited(models, upload, wider, CHAIR)
    assert np.abs(np.ptp(after, axis=0) - np.ptp(expected, axis=0)).max() < 0.02
