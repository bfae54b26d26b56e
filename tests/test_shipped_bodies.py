"""The shipped model of bodies, on bodies that are made here, and on real ones where they lie beside
the checkout."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pretend_body import saved
from scipy.spatial.transform import Rotation

import service
from service.edits import Change
from service.encode.model import Model, load_models
from service.mesh.formats import read_mesh
from service.mesh.frame import Orientation
from service.pipeline import edit, infer
from service.requests import EditOptions, InferOptions, Upload
from service.template.anatomy import JOINTS, descendants
from service.template.skinned import Body, SkinnedTemplate

FOLDER = Path(__file__).parents[2] / "shared" / "data" / "humans"
ROWS = (
    [json.loads(line) for line in (FOLDER / "manifest.jsonl").read_text("utf-8").splitlines()]
    if FOLDER.is_dir()
    else []
)
SOME = ROWS[::11]

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return load_models(Path(service.__file__).parent / "models")


def joints_of(answer: dict[str, object]) -> Array:
    joints = answer["joints"]
    assert isinstance(joints, dict)
    return np.array([joints[name] for name in JOINTS])


def without_a_foot(human: SkinnedTemplate, body: Body, turn: Array | None = None) -> Upload:
    """A body in other connectivity than the template's, which only the point encoder can read."""
    upload = saved(human, body, "ply", turn)
    mesh = read_mesh(upload.data, upload.name)
    kept = (human.weights[:, JOINTS.index("left_foot")] < 0.5)[mesh.faces].all(axis=1)
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces[kept].tolist()]
    return Upload("\n".join(lines).encode(), "body.obj")


@pytest.mark.parametrize(
    "turn",
    [
        None,
        Orientation("+z", "-y").rotation,
        Orientation("+x", "+y").rotation,
        Rotation.from_euler("xyz", (25, 40, 160), degrees=True).as_matrix(),
    ],
    ids=["upright", "z up", "lying", "askew"],
)
def test_a_body_is_found_however_it_is_turned(
    human: SkinnedTemplate, strider: Body, models: dict[str, Model], turn: Array | None
) -> None:
    answer = infer(without_a_foot(human, strider, turn), models, InferOptions()).report()
    assert answer["category"] == "human"
    assert answer["fit"]["encoder"] == "point"
    truth = human.posed_joints(strider) @ (np.eye(3) if turn is None else turn)
    assert np.linalg.norm(joints_of(answer) - truth, axis=1).mean() < 0.015
    assert answer["derived"]["stature"]["value"] == pytest.approx(1.77, abs=0.04)


def test_the_templates_own_connectivity_is_read_exactly(
    human: SkinnedTemplate, strider: Body, models: dict[str, Model]
) -> None:
    turn = Rotation.from_euler("xyz", (70, -30, 10), degrees=True).as_matrix()
    answer = infer(saved(human, strider, "glb", turn), models, InferOptions()).report()
    assert answer["fit"]["encoder"] == "mesh"
    truth = human.posed_joints(strider) @ turn
    assert np.linalg.norm(joints_of(answer) - truth, axis=1).max() < 0.002
    values = {name: entry["value"] for name, entry in answer["parameters"].items()}
    assert values["left_elbow_y"] == pytest.approx(-0.9, abs=0.02)
    assert values["shape_0"] == pytest.approx(strider.shape[0], abs=0.05)


@pytest.mark.parametrize("reader", ["point", "mesh"])
def test_the_encoders_are_near_by_themselves(
    human: SkinnedTemplate, strider: Body, models: dict[str, Model], reader: str
) -> None:
    own = saved(human, strider, "glb") if reader == "mesh" else without_a_foot(human, strider)
    answer = infer(own, models, InferOptions(category="human", refine=False)).report()
    assert answer["fit"]["encoder"] == reader
    gaps = np.linalg.norm(joints_of(answer) - human.posed_joints(strider), axis=1)
    assert gaps.mean() < 0.05


def test_a_bent_elbow_moves_the_forearm_alone(
    human: SkinnedTemplate, strider: Body, models: dict[str, Model]
) -> None:
    sent = without_a_foot(human, strider)
    change = {"left_elbow_y": Change("add", -0.5)}
    edited = edit(sent, models, InferOptions(), change, EditOptions())
    before, after = (read_mesh(data, "body.obj").vertices for data in (sent.data, edited.data))
    moved = np.linalg.norm(after - before, axis=1)
    forearm, arm = (
        human.weights[:, descendants()[JOINTS.index(f"left_{joint}")]].sum(axis=1)
        for joint in ("elbow", "shoulder")
    )
    assert (moved[forearm > 0.9] > 0.0).all()
    assert moved[forearm > 0.99].mean() > 0.08
    assert moved[forearm < 0.01].max() < 0.002
    assert (moved[arm < 0.01] == 0.0).all()
    assert edited.parameters["left_elbow_y"] < -1.2


@pytest.mark.parametrize("row", SOME, ids=lambda row: str(row["id"]))
def test_real_bodies_are_found_where_their_rigs_have_them(
    models: dict[str, Model], row: dict[str, object]
) -> None:
    path = FOLDER / str(row["file"])
    sent = Upload(path.read_bytes(), path.name)
    answer = infer(sent, models, InferOptions()).report()
    assert answer["category"] == "human"
    gaps = joints_of(answer) - np.array(row["joints_smpl24"])
    assert np.linalg.norm(gaps, axis=1).mean() < 0.07
    change = {"right_elbow_y": Change("add", 0.5), "stature": Change("scale", 1.05)}
    edited = edit(sent, models, InferOptions(category="human"), change, EditOptions())
    after = read_mesh(edited.data, path.name)
    assert np.isfinite(after.vertices).all()
    assert edited.report["flipped_faces"] <= 0.02 * len(after.faces)
