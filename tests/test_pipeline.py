from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from plain_chair import PLAIN
from scipy.spatial.transform import Rotation
from trimesh.exchange.export import export_mesh

import service
from service.edited import Edited
from service.edits import Change, parse_edits
from service.encode.model import Model, load_models
from service.errors import InvalidRequest, ShapeError
from service.inference import Inference
from service.mesh.formats import READERS, read_mesh
from service.mesh.frame import CANONICAL, Orientation
from service.pipeline import edit, infer
from service.requests import UNITS, EditOptions, InferOptions, Upload
from service.template.loader import load_template

MODELS = Path(service.__file__).parent / "models"
NEAR = 0.01
"""How close an ordinary chair's parameters are found, in metres."""
Z_UP = Orientation(up="+z", front="-y")


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return load_models(MODELS)


@pytest.fixture(scope="module")
def found(chair_glb: bytes, models: dict[str, Model]) -> Inference:
    """The chair, recognised with no hint."""
    return infer(Upload(chair_glb, "chair.glb"), models, InferOptions())


def saved(
    chair: trimesh.Trimesh, format: str, size: float = 1.0, turn: np.ndarray | None = None
) -> Upload:
    """The chair as a file of another format, size or orientation."""
    vertices = chair.vertices * size if turn is None else chair.vertices @ turn * size
    mesh = trimesh.Trimesh(vertices, chair.faces, process=False)
    data: Any = export_mesh(mesh, None, file_type=format)
    return Upload(data.encode() if isinstance(data, str) else bytes(data), f"chair.{format}")


def change(
    upload: Upload,
    models: Mapping[str, Model],
    edits: str,
    options: InferOptions = InferOptions(),  # noqa: B008
    **edit_options: str,
) -> Edited:
    return edit(upload, models, options, parse_edits(edits), EditOptions(**edit_options))


def vertices_of(edited: Edited) -> np.ndarray:
    return read_mesh(edited.data, f"a.{edited.format}").vertices


def values_of(found: Inference) -> dict[str, float]:
    return {name: entry["value"] for name, entry in found.report()["parameters"].items()}


def test_a_chair_is_measured_in_metres(found: Inference) -> None:
    assert values_of(found) == pytest.approx(PLAIN, abs=NEAR)
    derived = found.report()["derived"]
    assert derived["seat_top_height"]["value"] == pytest.approx(0.46, abs=NEAR)
    sizes = {name: entry["value"] for name, entry in derived.items() if "total" in name}
    # These are measured on the mesh itself.
    assert sizes == pytest.approx(
        {"total_height": 0.88, "total_width": 0.48, "total_depth": 0.45}, abs=1e-6
    )


def test_the_report_is_whole_and_consistent(
    found: Inference, chair_glb: bytes, models: dict[str, Model]
) -> None:
    report = found.report()
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert report["mesh_id"] == f"sha256-{hashlib.sha256(chair_glb).hexdigest()}"
    assert report["category"] == "chair"
    assert list(report["parameters"]) == list(PLAIN)
    for entry in (*report["parameters"].values(), *report["derived"].values()):
        assert entry["unit"] == "m"
        assert entry["value"] > 0
    assert all(0 < entry["sigma"] < 0.1 for entry in report["parameters"].values())
    values = values_of(found)
    top = report["derived"]["seat_top_height"]["value"]
    assert top == pytest.approx(values["leg_height"] + values["seat_thickness"])
    fit, frame = report["fit"], report["frame"]
    first = fit["candidates"][0]
    assert (first["up"], first["front"]) == (frame["up"], frame["front"]) == ("+y", "+z")
    assert first["distance"] == fit["distance"] <= fit["encoder_distance"]
    assert fit["in_distribution"] == (fit["score"] >= 0.5)
    assert fit["in_distribution"]
    model = models["chair"]
    assert report["model"] == {
        "name": "chair", "version": model.version, "digest": model.digest
    }  # fmt: skip
    assert report["warnings"] == []


def test_the_frame_leads_to_the_normalised_one(found: Inference) -> None:
    frame = found.report()["frame"]
    normalised = (found.mesh.vertices - frame["center"]) * frame["scale"]
    np.testing.assert_allclose(normalised, found.vertices, atol=1e-12)
    assert np.linalg.norm(normalised, axis=1).max() == pytest.approx(0.6, rel=0.03)


def test_it_answers_the_same_each_time(
    found: Inference, chair_glb: bytes, models: dict[str, Model]
) -> None:
    again = infer(Upload(chair_glb, "chair.glb"), models, InferOptions())
    assert again.report() == found.report()


def test_refinement_can_be_left_out(
    found: Inference, chair_glb: bytes, models: dict[str, Model]
) -> None:
    plain = infer(Upload(chair_glb, "chair.glb"), models, InferOptions(refine=False))
    fit = plain.report()["fit"]
    assert fit["distance"] == fit["encoder_distance"]
    assert fit["distance"] > found.report()["fit"]["distance"]
    sigma = {name: e["sigma"] for name, e in plain.report()["parameters"].items()}
    assert all(sigma[n] > e["sigma"] for n, e in found.report()["parameters"].items())


@pytest.mark.parametrize("format", READERS)
def test_an_empty_edit_returns_the_very_bytes(
    box_chair: trimesh.Trimesh, models: dict[str, Model], format: str
) -> None:
    if format == "gltf":
        text = box_chair.export(file_type="gltf", embed_buffers=True)["model.gltf"]
        upload = Upload(text, "chair.gltf")
    else:
        upload = saved(box_chair, format)
    edited = change(upload, models, "{}")
    assert edited.data == upload.data
    assert edited.format == format
    assert edited.report["vertices"]["moved"] == 0
    assert edited.report["flipped_faces"] == 0


def test_an_empty_edit_of_a_chair_that_leans_returns_the_very_bytes(
    box_chair: trimesh.Trimesh, models: dict[str, Model]
) -> None:
    turn = Rotation.from_euler("xyz", [6.0, 9.0, 0.0], degrees=True).as_matrix()
    leaning = trimesh.Trimesh(box_chair.vertices @ turn, box_chair.faces, process=False)
    upload = Upload(bytes(leaning.export(file_type="glb", include_normals=True)), "chair.glb")
    edited = change(upload, models, "{}")
    assert any("leans" in warning for warning in edited.report["warnings"])
    assert edited.data == upload.data


@pytest.mark.parametrize("mode", ["blend", "paper"])
def test_an_edit_that_changes_no_value_returns_the_very_bytes(
    chair_glb: bytes, models: dict[str, Model], mode: str
) -> None:
    edits = '{"seat_width": {"scale": 1}, "leg_height": {"add": 0}, "total_height": {"add": 0}}'
    assert change(Upload(chair_glb, "a.glb"), models, edits, mode=mode).data == chair_glb


@pytest.mark.parametrize("mode", ["blend", "paper"])
def test_an_edit_moves_what_it_names_and_little_else(
    chair_glb: bytes, models: dict[str, Model], found: Inference, mode: str
) -> None:
    upload = Upload(chair_glb, "chair.glb")
    edited = change(upload, models, '{"leg_height": {"add": 0.1}}', mode=mode)
    again = values_of(infer(Upload(edited.data, "a.glb"), models, InferOptions()))
    before = values_of(found)
    expected = before | {"leg_height": before["leg_height"] + 0.1}
    assert again == pytest.approx(expected, abs=NEAR)
    assert edited.parameters["leg_height"] == pytest.approx(expected["leg_height"])
    before_mesh, after_mesh = found.mesh, read_mesh(edited.data, "a.glb")
    assert np.array_equal(before_mesh.faces, after_mesh.faces)
    moved = (before_mesh.vertices != after_mesh.vertices).any(axis=1)
    assert edited.report["vertices"] == {"total": 2840, "moved": int(moved.sum())}
    np.testing.assert_array_equal(before_mesh.vertices[:, 0], after_mesh.vertices[:, 0])


@pytest.mark.parametrize(
    ("name", "mode"), [*((name, "blend") for name in PLAIN), ("seat_width", "paper")]
)
def test_every_parameter_can_grow_by_a_fifth(
    chair_glb: bytes, models: dict[str, Model], found: Inference, name: str, mode: str
) -> None:
    edits = json.dumps({name: {"scale": 1.2}})
    edited = change(Upload(chair_glb, "chair.glb"), models, edits, mode=mode)
    moved = vertices_of(edited)
    template = load_template("paper_chair")
    before = values_of(found)
    f = np.array([before[n] for n in template.names])
    after = f.copy()
    after[template.names.index(name)] *= 1.2
    _, anchor = template.anchor("floor")
    # The uploaded chair is the template itself: the edit is known at each of its vertices.
    truth = template.decode(after) - template.decode(f) - anchor @ (after - f)
    error = np.linalg.norm(moved - found.mesh.vertices - truth, axis=1)
    size = np.linalg.norm(truth, axis=1).max()
    assert np.median(error) < 0.05 * size
    assert np.mean(error) < 0.2 * size
    assert edited.report["flipped_faces"] <= 0.02 * len(found.mesh.faces)


def test_dimensions_of_the_mesh_are_met_exactly(chair_glb: bytes, models: dict[str, Model]) -> None:
    edits = '{"total_height": 1.0, "total_width": {"scale": 1.25}, "total_depth": {"add": 0.1}}'
    edited = change(Upload(chair_glb, "chair.glb"), models, edits)
    extents = np.ptp(vertices_of(edited), axis=0)
    np.testing.assert_allclose(extents, [0.6, 1.0, 0.55], atol=2e-6)
    report = edited.report["derived"]
    assert report["total_height"]["before"] == pytest.approx(0.88, abs=1e-6)
    assert report["total_height"]["after"] == pytest.approx(1.0, abs=1e-6)
    assert edited.parameters["total_width"] == pytest.approx(0.6, abs=1e-6)


def test_the_report_of_an_edit_agrees_with_its_values(
    chair_glb: bytes, models: dict[str, Model], found: Inference
) -> None:
    edited = change(
        Upload(chair_glb, "chair.glb"), models, '{"seat_top_height": 0.5, "seat_width": 0.6}'
    )
    report = edited.report
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    before = values_of(found)
    for name, entry in report["parameters"].items():
        assert entry["before"] == before[name]
        assert entry["after"] == edited.parameters[name]
    assert report["parameters"]["seat_width"]["after"] == 0.6
    assert report["derived"]["seat_top_height"]["after"] == pytest.approx(0.5)
    assert edited.parameters["seat_top_height"] == pytest.approx(0.5)
    untouched = set(PLAIN) - {"seat_width", "leg_height"}
    assert all(edited.parameters[name] == before[name] for name in untouched)
    assert report["category"] == "chair"
    assert report["model"] == found.report()["model"]
    assert (edited.format, edited.media_type) == ("glb", "model/gltf-binary")


def test_what_is_kept_stays_where_it_was(
    box_chair: trimesh.Trimesh, chair_glb: bytes, models: dict[str, Model]
) -> None:
    y = box_chair.vertices[:, 1]
    seat = np.abs(y - 0.43) < 0.02
    upload = Upload(chair_glb, "chair.glb")
    edits = '{"leg_height": {"add": 0.12}}'
    moved = {
        keep: vertices_of(change(upload, models, edits, keep=keep))[:, 1]
        for keep in ("floor", "seat", "center")
    }
    assert moved["floor"].min() == pytest.approx(0.0, abs=2e-3)
    assert moved["floor"][seat].mean() == pytest.approx(0.43 + 0.12, abs=2e-3)
    assert moved["seat"].min() == pytest.approx(-0.12, abs=2e-3)
    assert moved["seat"][seat].mean() == pytest.approx(0.43, abs=2e-3)
    middle = (moved["center"].min() + moved["center"].max()) / 2
    assert middle == pytest.approx(0.44, abs=2e-3)
    assert moved["center"].min() == pytest.approx(-0.06, abs=2e-3)
    default = vertices_of(change(upload, models, edits))
    np.testing.assert_array_equal(default[:, 1], moved["floor"])


@pytest.mark.parametrize("unit", UNITS)
def test_lengths_are_in_the_unit_of_the_file(
    box_chair: trimesh.Trimesh, models: dict[str, Model], found: Inference, unit: str
) -> None:
    upload = saved(box_chair, "ply", 1 / UNITS[unit])
    answer = infer(upload, models, InferOptions(units=unit))
    expected = {name: value / UNITS[unit] for name, value in values_of(found).items()}
    assert values_of(answer) == pytest.approx(expected, rel=0.02, abs=0.002 / UNITS[unit])
    assert {entry["unit"] for entry in answer.report()["parameters"].values()} == {unit}
    assert answer.report()["warnings"] == []


def test_a_gltf_is_in_metres_whatever_the_clients_unit(
    chair_glb: bytes, models: dict[str, Model], found: Inference
) -> None:
    upload, options = Upload(chair_glb, "chair.glb"), InferOptions(units="cm")
    answer = infer(upload, models, options)
    expected = {name: 100 * value for name, value in values_of(found).items()}
    assert values_of(answer) == pytest.approx(expected)
    derived = answer.report()["derived"]["total_height"]
    assert (derived["value"], derived["unit"]) == (pytest.approx(88.0), "cm")
    edited = change(upload, models, '{"total_height": 100, "seat_width": {"add": 12}}', options)
    extents = np.ptp(vertices_of(edited), axis=0)
    assert extents[1] == pytest.approx(1.0, abs=1e-5)
    assert extents[0] == pytest.approx(0.60, abs=0.005)


def test_an_edit_of_a_file_in_centimetres_is_in_centimetres(
    box_chair: trimesh.Trimesh, models: dict[str, Model]
) -> None:
    upload, options = saved(box_chair, "obj", 100), InferOptions(units="cm")
    edited = change(upload, models, '{"total_width": 60}', options)
    assert np.ptp(vertices_of(edited), axis=0)[0] == pytest.approx(60, abs=1e-3)
    assert edited.report["parameters"]["seat_width"]["unit"] == "cm"


@pytest.mark.parametrize(
    ("units", "format", "extent"),
    [("m", "obj", 0.88), ("cm", "obj", 88.0), ("in", "stl", 0.88 / 0.0254), ("cm", "gltf", 0.88)],
)
def test_conversion_keeps_the_shape_and_writes_the_clients_unit(
    chair_glb: bytes, models: dict[str, Model], units: str, format: str, extent: float
) -> None:
    upload = Upload(chair_glb, "chair.glb")
    edited = change(upload, models, "{}", InferOptions(units=units), format=format)
    assert edited.format == format
    vertices = vertices_of(edited)
    assert np.ptp(vertices[:, 1]) == pytest.approx(extent, rel=1e-5)
    if format != "stl":
        assert len(vertices) == 2840


def test_a_file_in_centimetres_becomes_a_glb_in_metres(
    box_chair: trimesh.Trimesh, models: dict[str, Model]
) -> None:
    upload = saved(box_chair, "obj", 100)
    edited = change(upload, models, '{"total_width": 60}', InferOptions(units="cm"), format="glb")
    assert (edited.format, edited.media_type) == ("glb", "model/gltf-binary")
    np.testing.assert_allclose(np.ptp(vertices_of(edited), axis=0), [0.60, 0.88, 0.45], atol=1e-4)


def test_a_chair_with_z_up_is_found_and_comes_back_in_its_own_frame(
    box_chair: trimesh.Trimesh, models: dict[str, Model]
) -> None:
    upright = saved(box_chair, "ply")
    lying = saved(box_chair, "ply", turn=Z_UP.rotation)
    edits = '{"leg_height": {"add": 0.1}, "back_height": {"scale": 1.3}}'
    expected = change(upright, models, edits)
    for options in (InferOptions(), InferOptions(up="+z"), InferOptions(up="+z", front="-y")):
        answer = infer(lying, models, options)
        assert answer.best.orientation == Z_UP
        assert values_of(answer) == pytest.approx(
            {name: entry["before"] for name, entry in expected.report["parameters"].items()},
            abs=1e-3,
        )
    edited = change(lying, models, edits)
    np.testing.assert_allclose(
        vertices_of(edited) @ Z_UP.rotation.T, vertices_of(expected), atol=2e-3
    )


def test_the_frame_of_a_turned_file_is_in_its_own_axes(
    box_chair: trimesh.Trimesh, models: dict[str, Model]
) -> None:
    answer = infer(saved(box_chair, "ply", turn=Z_UP.rotation), models, InferOptions(up="+z"))
    frame = answer.report()["frame"]
    assert (frame["up"], frame["front"]) == ("+z", "-y")
    normalised = (answer.mesh.vertices - frame["center"]) * frame["scale"]
    np.testing.assert_allclose(normalised @ Z_UP.rotation.T, answer.vertices, atol=1e-12)


def test_normals_turn_in_the_files_own_frame(
    box_chair: trimesh.Trimesh, models: dict[str, Model]
) -> None:
    # Slanting normals, for those along an axis keep their direction in every edit.
    slant = np.asarray(box_chair.vertices - [0.1, 0.4, -0.2])
    slant /= np.linalg.norm(slant, axis=1, keepdims=True)
    edited = []
    for orientation in (CANONICAL, Z_UP):
        turn = orientation.rotation
        lines = ["v {:.9g} {:.9g} {:.9g}".format(*row) for row in box_chair.vertices @ turn]
        lines += ["vn {:.9g} {:.9g} {:.9g}".format(*row) for row in slant @ turn]
        lines += ["f " + " ".join(f"{i}//{i}" for i in row) for row in box_chair.faces + 1]
        options = InferOptions(up=orientation.up, front=orientation.front)
        upload = Upload("\n".join([*lines, ""]).encode(), "chair.obj")
        answer = change(upload, models, '{"leg_height": {"scale": 2}}', options)
        rows = [line.split()[1:] for line in answer.data.decode().splitlines() if line[:2] == "vn"]
        edited.append(np.array(rows, float) @ turn.T)
    assert np.abs(edited[0] - slant).max() > 0.1
    np.testing.assert_allclose(edited[1], edited[0], atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(edited[1], axis=1), 1.0, atol=1e-4)


def test_the_client_may_say_which_way_up(
    chair_glb: bytes, models: dict[str, Model], found: Inference
) -> None:
    told = infer(Upload(chair_glb, "chair.glb"), models, InferOptions(up="+y", front="+z"))
    assert values_of(told) == pytest.approx(values_of(found), abs=1e-6)
    wrong = infer(Upload(chair_glb, "chair.glb"), models, InferOptions(up="-y", front="+x"))
    assert (wrong.best.orientation.up, wrong.best.orientation.front) == ("-y", "+x")
    assert wrong.best.estimate.distance > 3 * found.best.estimate.distance


def test_an_edited_file_keeps_every_line_but_its_vertices(
    box_chair: trimesh.Trimesh, models: dict[str, Model]
) -> None:
    text = saved(box_chair, "obj").data.decode()
    upload = Upload(("# mine\no chair\n" + text).encode(), "chair.obj")
    edited = change(upload, models, '{"seat_width": {"scale": 1.1}}')

    def rest(data: bytes) -> list[str]:
        return [line for line in data.decode().splitlines() if not line.startswith("v ")]

    assert rest(edited.data) == rest(upload.data)
    assert edited.data != upload.data


def test_an_implausible_size_is_warned_of(
    box_chair: trimesh.Trimesh, models: dict[str, Model]
) -> None:
    (warning,) = infer(saved(box_chair, "obj", 1000), models, InferOptions()).report()["warnings"]
    assert "it seems to be in mm: say units=mm" in warning
    (warning,) = infer(saved(box_chair, "obj"), models, InferOptions(units="mm")).report()[
        "warnings"
    ]
    assert "say units" in warning


def test_what_fits_badly_scores_low_and_is_said_to_be_no_chair(found: Inference) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.4)
    upload = Upload(bytes(ball.export(file_type="ply")), "ball.ply")
    models = load_models(MODELS)
    report = infer(upload, models, InferOptions()).report()
    assert report["fit"]["score"] < found.report()["fit"]["score"]
    assert all(entry["value"] > 0 for entry in report["parameters"].values())
    strict = dict(models["chair"].card["calibration"], limit_distance=report["fit"]["distance"] / 2)
    models["chair"].card = dict(models["chair"].card, calibration=strict)
    report = infer(upload, models, InferOptions()).report()
    assert report["fit"]["score"] <= 1 / 17 + 1e-9
    assert not report["fit"]["in_distribution"]
    assert any("does not look like a chair" in warning for warning in report["warnings"])


def test_an_edit_that_makes_parts_collide_stops_at_the_nearest_and_says_so(
    chair_glb: bytes, models: dict[str, Model], found: Inference
) -> None:
    edited = change(Upload(chair_glb, "chair.glb"), models, '{"leg_width": 0.3}')
    (warning,) = edited.report["warnings"]
    width = values_of(found)["seat_width"]
    inset = found.parameters[found.model.template.names.index("leg_inset")]
    assert edited.parameters["leg_width"] == pytest.approx(0.4 * width - inset)
    assert "not 0.3: the nearest that keeps 0.8 * seat_width - 2 * leg_width - 2" in warning
    assert np.isfinite(vertices_of(edited)).all()


def test_an_edit_beyond_the_ranges_is_made_and_warned_of(
    chair_glb: bytes, models: dict[str, Model]
) -> None:
    edited = change(Upload(chair_glb, "chair.glb"), models, '{"back_height": 4.0}')
    assert edited.parameters["back_height"] == pytest.approx(4.0)
    (warning,) = edited.report["warnings"]
    assert warning.startswith("back_height is outside of what the model was trained on")
    # A larger chair of the same proportions is nothing out of the ordinary.
    twice = json.dumps({name: {"scale": 2.0} for name in PLAIN})
    assert change(Upload(chair_glb, "chair.glb"), models, twice).report["warnings"] == []


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_large_edits_are_carried_out(
    chair_glb: bytes, models: dict[str, Model], found: Inference, factor: float
) -> None:
    edits = json.dumps({name: {"scale": factor} for name in PLAIN})
    edited = change(Upload(chair_glb, "chair.glb"), models, edits)
    before = np.ptp(found.mesh.vertices, axis=0)
    np.testing.assert_allclose(np.ptp(vertices_of(edited), axis=0), factor * before, rtol=0.05)
    assert edited.report["flipped_faces"] <= 0.01 * len(found.mesh.faces)


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"category": "sofa"}, "unknown_category"),
        ({"units": "parsec"}, "unknown_units"),
        ({"units": "M"}, "unknown_units"),
        ({"up": "z"}, "unknown_up"),
        ({"front": "+q"}, "unknown_front"),
        ({"up": "+z", "front": "-z"}, "parallel_axes"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    chair_glb: bytes, models: dict[str, Model], options: dict[str, Any], code: str
) -> None:
    with pytest.raises(InvalidRequest) as caught:
        infer(Upload(chair_glb, "chair.glb"), models, InferOptions(**options))
    assert caught.value.code == code


@pytest.mark.parametrize(
    ("edits", "options", "code"),
    [
        ({}, {"mode": "magic"}, "unknown_mode"),
        ({}, {"keep": "ceiling"}, "unknown_keep"),
        ({}, {"format": "fbx"}, "unknown_format"),
        ({"wings": 1.0}, {}, "unknown_parameter"),
        ({"seat_width": -1.0}, {}, "size_not_positive"),
        ({"leg_width": 0.3}, {"strict": True}, "edit_out_of_bounds"),
        ({"seat_top_height": 0.5, "leg_height": 0.3}, {}, "dimension_fixed"),
    ],
)
def test_edits_that_make_no_sense_are_refused(
    chair_glb: bytes,
    models: dict[str, Model],
    edits: dict[str, float],
    options: dict[str, Any],
    code: str,
) -> None:
    changes = {name: Change("set", value) for name, value in edits.items()}
    with pytest.raises(InvalidRequest) as caught:
        edit(
            Upload(chair_glb, "chair.glb"), models, InferOptions(), changes, EditOptions(**options)
        )
    assert caught.value.code == code
    assert caught.value.suggestion


def test_a_named_category_is_taken(chair_glb: bytes, models: dict[str, Model]) -> None:
    answer = infer(Upload(chair_glb, "chair.glb"), models, InferOptions(category="chair"))
    assert answer.model is models["chair"]


@pytest.mark.parametrize("data", [b"", b"glTF", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"])
def test_a_file_without_a_surface_is_refused(data: bytes, models: dict[str, Model]) -> None:
    with pytest.raises(ShapeError):
        infer(Upload(data, "a.obj" if data.startswith(b"v") else "a.glb"), models, InferOptions())
