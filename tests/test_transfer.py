from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from plain_chair import PLAIN
from trimesh.exchange.export import export_mesh

import service
from service.edited import Edited
from service.edits import Change
from service.encode.model import Model, load_models
from service.errors import InvalidMesh, InvalidRequest
from service.inferences import Inferences
from service.mesh.formats import read_mesh
from service.mesh.frame import Orientation
from service.pipeline import edit, infer, transfer
from service.requests import EditOptions, InferOptions, TransferOptions, Upload
from service.template.loader import load_template
from service.transfer import set_to

OTHER = PLAIN | {
    "back_height": 0.55, "seat_thickness": 0.07, "seat_depth": 0.5, "seat_width": 0.6,
    "leg_height": 0.34, "leg_width": 0.05,
}  # fmt: skip
NEAR = 0.01
"""How close an ordinary chair's parameters are found, in metres."""
UPRIGHT = InferOptions("chair", "+y", "+z")
ANY = InferOptions(up="+y", front="+z")
Z_UP = Orientation(up="+z", front="-y")


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return load_models(Path(service.__file__).parent / "models")


@pytest.fixture(scope="module")
def known() -> Inferences:
    """What is known of the meshes, so that each is inferred once."""
    return Inferences(1 << 28)


def chair(
    values: dict[str, float],
    format: str = "glb",
    size: float = 1.0,
    turn: np.ndarray | None = None,
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Upload:
    """A chair of boxes, standing at a point of the floor."""
    template = load_template("paper_chair")
    vertices = template.decode([values[name] for name in template.names])
    vertices = vertices - [0.0, vertices[:, 1].min(), 0.0] + np.array(at)
    if turn is not None:
        vertices = vertices @ turn
    mesh = trimesh.Trimesh(vertices * size, template.faces, process=False)
    data: Any = export_mesh(mesh, None, file_type=format)
    return Upload(data.encode() if isinstance(data, str) else bytes(data), f"chair.{format}")


@pytest.fixture(scope="module")
def source() -> Upload:
    return chair(PLAIN)


@pytest.fixture(scope="module")
def target() -> Upload:
    return chair(OTHER)


def extents(edited: Edited) -> np.ndarray:
    return np.asarray(np.ptp(vertices(edited), axis=0))


def vertices(edited: Edited) -> np.ndarray:
    return read_mesh(edited.data, f"a.{edited.format}").vertices


def after(edited: Edited) -> dict[str, float]:
    return {name: entry["after"] for name, entry in edited.report["parameters"].items()}


SIZES = ("seat_width", "total_height", "seat_depth")
"""What a box chair's extents are."""


def test_a_chair_gets_all_of_anothers_parameters(
    source: Upload, target: Upload, models: dict[str, Model], known: Inferences
) -> None:
    options = UPRIGHT, UPRIGHT, TransferOptions()
    edited = transfer(source, target, models, *options, known)
    assert after(edited) == pytest.approx(OTHER, abs=NEAR)
    np.testing.assert_allclose(extents(edited), [0.6, 0.34 + 0.07 + 0.55, 0.5], atol=2 * NEAR)
    values = {
        n: e["value"] for n, e in infer(target, models, UPRIGHT).report()["parameters"].items()
    }
    account = edited.report["transfer"]
    assert account["parameters"] == list(OTHER)
    assert (account["size"], account["position"], account["scale"]) == ("target", "source", 1.0)
    assert {n: e["value"] for n, e in account["target"].items()} == pytest.approx(values)
    assert {e["unit"] for e in account["target"].values()} == {"m"}
    assert json.loads(json.dumps(edited.report, allow_nan=False)) == edited.report
    assert transfer(source, target, models, *options).data == edited.data


def test_it_is_the_edit_that_sets_these_values(
    source: Upload, target: Upload, models: dict[str, Model], known: Inferences
) -> None:
    edited = transfer(source, target, models, UPRIGHT, UPRIGHT, TransferOptions(), known)
    wanted = edited.report["transfer"]["target"]
    edits = {name: Change("set", entry["value"]) for name, entry in wanted.items()}
    assert edit(source, models, UPRIGHT, edits, EditOptions(), known=known).data == edited.data


def test_only_positions_and_normals_change(
    target: Upload, models: dict[str, Model], known: Inferences
) -> None:
    plain = chair(PLAIN, "obj")
    lines = [*plain.data.decode().splitlines(), "# by hand", "usemtl oak", "s off", ""]
    noted = replace(plain, data="\n".join(lines).encode())
    edited = transfer(noted, target, models, UPRIGHT, UPRIGHT, TransferOptions(), known)
    now = edited.data.decode().splitlines()
    before = noted.data.decode().splitlines()
    changed = [
        index for index, pair in enumerate(zip(before, now, strict=True)) if len(set(pair)) > 1
    ]
    assert changed
    assert {before[index].split()[0] for index in changed} <= {"v", "vn"}


@pytest.mark.parametrize("format", ["glb", "obj", "ply"])
@pytest.mark.parametrize(
    "options",
    [
        TransferOptions(),
        TransferOptions(size="source"),
        TransferOptions(position="target"),
        TransferOptions(mode="paper", parameters=("total_height", "seat_width")),
    ],
)
def test_a_file_with_its_own_parameters_is_its_own_bytes(
    models: dict[str, Model], known: Inferences, format: str, options: TransferOptions
) -> None:
    upload = chair(PLAIN, format)
    edited = transfer(upload, upload, models, UPRIGHT, UPRIGHT, options, known)
    assert edited.data == upload.data
    assert edited.report["vertices"]["moved"] == 0
    assert edited.report["transfer"]["scale"] == 1.0


def test_the_same_shape_elsewhere_and_in_another_unit_changes_nothing(
    source: Upload, models: dict[str, Model], known: Inferences
) -> None:
    data = read_mesh(source.data, source.name)
    assert data.format == "glb"
    same = replace(source, name="other.glb")
    options = replace(UPRIGHT, units="cm"), replace(UPRIGHT, units="mm")
    edited = transfer(source, same, models, *options, TransferOptions(), known)
    assert edited.data == source.data


def test_units_and_axes_of_both_are_their_own(
    source: Upload, target: Upload, models: dict[str, Model], known: Inferences
) -> None:
    plain = transfer(source, target, models, UPRIGHT, UPRIGHT, TransferOptions(), known)
    turned = chair(PLAIN, "obj", size=100.0, turn=Z_UP.rotation)
    large = chair(OTHER, "ply", size=1000.0)
    options = InferOptions("chair", "+z", "-y", "cm"), replace(UPRIGHT, units="mm")
    edited = transfer(turned, large, models, *options, TransferOptions(), known)
    values = {name: 100.0 * value for name, value in after(plain).items()}
    assert after(edited) == pytest.approx(values, rel=0.02)
    assert edited.report["transfer"]["target"]["seat_width"]["unit"] == "cm"
    np.testing.assert_allclose(
        vertices(edited) @ Z_UP.rotation.T / 100.0, vertices(plain), atol=NEAR
    )


def test_some_parameters_and_derived_dimensions_are_taken(
    source: Upload, target: Upload, models: dict[str, Model], known: Inferences
) -> None:
    options = TransferOptions(parameters=("total_height", "seat_width"))
    edited = transfer(source, target, models, UPRIGHT, UPRIGHT, options, known)
    assert edited.report["transfer"]["parameters"] == ["seat_width", "total_height"]
    assert extents(edited)[1] == pytest.approx(0.34 + 0.07 + 0.55, rel=1e-4)
    assert after(edited)["seat_width"] == pytest.approx(0.6, abs=NEAR)
    assert after(edited)["seat_depth"] == pytest.approx(PLAIN["seat_depth"], abs=NEAR)


def test_the_source_keeps_its_size_and_gets_the_proportions(
    source: Upload, models: dict[str, Model], known: Inferences
) -> None:
    large = chair({name: 30.0 * value for name, value in OTHER.items()})
    options = TransferOptions(size="source")
    edited = transfer(source, large, models, UPRIGHT, UPRIGHT, options, known)
    own, box = extents(edited), np.array([0.6, 0.34 + 0.07 + 0.55, 0.5])
    before = np.ptp(read_mesh(source.data, "a.glb").vertices, axis=0)
    assert np.linalg.norm(own) == pytest.approx(np.linalg.norm(before), rel=0.02)
    np.testing.assert_allclose(own / np.linalg.norm(own), box / np.linalg.norm(box), atol=0.02)
    scale = np.linalg.norm(before) / np.linalg.norm(30.0 * box)
    assert edited.report["transfer"]["scale"] == pytest.approx(scale, rel=0.01)
    (large_one,) = [w for w in edited.report["warnings"] if "times" in w]
    assert large_one.startswith("target: a chair of this size would be ")


def test_it_is_put_where_the_target_stands(
    source: Upload, models: dict[str, Model], known: Inferences
) -> None:
    away = chair(OTHER, "ply", 100.0, Z_UP.rotation, at=(2.0, 0.5, -1.0))
    options = UPRIGHT, InferOptions("chair", "+z", "-y", "cm")
    here = transfer(source, away, models, *options, TransferOptions(), known)
    there = transfer(source, away, models, *options, TransferOptions(position="target"), known)
    shift = vertices(there) - vertices(here)
    np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-6)
    assert vertices(there)[:, 1].min() == pytest.approx(0.5, abs=1e-5)
    middle = (vertices(there).min(axis=0) + vertices(there).max(axis=0)) / 2
    np.testing.assert_allclose(middle[[0, 2]], [2.0, -1.0], atol=NEAR)
    assert after(here) == after(there)


def test_the_options_are_checked(source: Upload, models: dict[str, Model]) -> None:
    for options, code in (
        (TransferOptions(size="huge"), "unknown_size"),
        (TransferOptions(position="moon"), "unknown_position"),
        (TransferOptions(mode="magic"), "unknown_mode"),
    ):
        with pytest.raises(InvalidRequest) as error:
            transfer(source, source, models, UPRIGHT, UPRIGHT, options)
        assert error.value.code == code


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (TransferOptions(parameters=("seat_wdith",)), "unknown_parameter"),
        (TransferOptions(parameters=()), "parameters_empty"),
        (TransferOptions(keep="nose"), "unknown_keep"),
    ],
)
def test_names_are_those_of_the_category(
    source: Upload, models: dict[str, Model], known: Inferences, options: Any, code: str
) -> None:
    with pytest.raises(InvalidRequest) as error:
        transfer(source, source, models, UPRIGHT, UPRIGHT, options, known)
    assert error.value.code == code


def test_which_of_the_two_is_at_fault_is_told(source: Upload, models: dict[str, Model]) -> None:
    broken = Upload(b"ply\nformat ascii", "broken.ply")
    for pair, which in (((broken, source), "source: "), ((source, broken), "target: ")):
        with pytest.raises(InvalidMesh) as error:
            transfer(*pair, models, UPRIGHT, UPRIGHT, TransferOptions())
        assert error.value.detail.startswith(which)
    options = UPRIGHT, replace(UPRIGHT, units="ell")
    with pytest.raises(InvalidRequest, match=r"unknown_units: target: units='ell'"):
        transfer(source, source, models, *options, TransferOptions())


def ball() -> Upload:
    mesh = trimesh.creation.icosphere(subdivisions=3)
    return Upload(bytes(mesh.export(file_type="glb")), "ball.glb")


def airplane() -> Upload:
    template = load_template("airplane")
    middle = np.sqrt([p.low * p.high if p.low > 0 else 0.0 for p in template.parameters])
    mesh = trimesh.Trimesh(template.decode(middle), template.faces, process=False)
    return Upload(bytes(mesh.export(file_type="glb")), "plane.glb")


def test_shapes_of_two_categories_do_not_go_together(
    source: Upload, models: dict[str, Model], known: Inferences
) -> None:
    with pytest.raises(InvalidRequest) as error:
        transfer(source, airplane(), models, ANY, ANY, TransferOptions(), known)
    assert error.value.code == "categories_differ"
    assert "the source is of the category chair (score " in error.value.detail
    assert "the target of airplane (score " in error.value.detail
    assert "category=chair" in error.value.suggestion
    both = replace(ANY, category="chair")
    edited = transfer(source, airplane(), models, both, both, TransferOptions(), known)
    warnings = edited.report["warnings"]
    assert any(w.startswith("target: this does not look like a chair") for w in warnings)


def test_what_is_not_recognised_is_not_transferred(
    source: Upload, models: dict[str, Model], known: Inferences
) -> None:
    strange = infer(ball(), models, ANY, known)
    assert not strange.in_distribution
    only = {strange.model.name: strange.model}
    with pytest.raises(InvalidRequest) as error:
        transfer(ball(), ball(), only, ANY, ANY, TransferOptions(), known)
    assert error.value.code == "not_recognised"
    told = f"the mesh is most like the category {strange.model.name}, but"
    assert error.value.detail.startswith(f"source: {told}")
    named = replace(ANY, category=strange.model.name)
    with pytest.raises(InvalidRequest) as error:
        transfer(ball(), ball(), only, named, ANY, TransferOptions(), known)
    assert error.value.detail.startswith(f"target: {told}")


def test_a_strict_transfer_refuses_what_the_source_can_not_be(
    source: Upload, models: dict[str, Model], known: Inferences
) -> None:
    thick = chair(OTHER | {"leg_width": 0.2, "seat_width": 0.5})
    only = TransferOptions(parameters=("leg_width",))
    edited = transfer(source, thick, models, UPRIGHT, UPRIGHT, only, known)
    assert any(w.startswith("leg_width is 0.1") for w in edited.report["warnings"])
    with pytest.raises(InvalidRequest, match="edit_out_of_bounds"):
        transfer(source, thick, models, UPRIGHT, UPRIGHT, replace(only, strict=True), known)


def test_another_format_may_be_asked_for(
    source: Upload, target: Upload, models: dict[str, Model], known: Inferences
) -> None:
    options = TransferOptions(format="ply", parameters=("seat_width",))
    edited = transfer(source, target, models, UPRIGHT, UPRIGHT, options, known)
    assert (edited.format, edited.media_type) == ("ply", "application/x-ply")
    assert extents(edited)[0] == pytest.approx(0.6, abs=NEAR)


def test_values_that_are_equal_but_for_rounding_are_no_change() -> None:
    present = {"a": 0.1 + 0.2, "b": 0.5, "c": 0.0}
    edits = set_to({"a": 0.3, "b": 0.5 + 1e-6, "c": 1e-14}, present)
    assert {name: change.amount for name, change in edits.items()} == {
        "a": present["a"], "b": 0.5 + 1e-6, "c": 0.0
    }  # fmt: skip


@pytest.mark.parametrize("capacity", [0, 1 << 28])
def test_transfers_both_ways_at_once_wait_for_no_end(
    source: Upload, target: Upload, models: dict[str, Model], capacity: int
) -> None:
    known, quick = Inferences(capacity), replace(UPRIGHT, refine=False)

    def work(pair: tuple[Upload, Upload]) -> bytes:
        return transfer(*pair, models, quick, quick, TransferOptions(), known).data

    pairs = [(source, target), (target, source), (source, source), (target, target)]
    with ThreadPoolExecutor(len(pairs)) as pool:
        answers = [pool.submit(work, pair) for pair in pairs]
        there, back, one, two = (answer.result(timeout=60) for answer in answers)
    assert (one, two) == (source.data, target.data)
    assert there != source.data
    assert back != target.data
