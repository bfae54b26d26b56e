from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from weighted import json_of, turned, weighted, with_json

from service import pipeline
from service.edits import Change
from service.encode.model import SHIPPED, Model, load_models
from service.errors import InvalidRequest
from service.mesh.convert import convert
from service.mesh.document import Document
from service.mesh.embedding import as_glb
from service.mesh.formats import read_mesh
from service.mesh.scene import read_scene
from service.requests import EditOptions, InferOptions, SliderOptions, Upload
from service.template.anatomy import JOINTS
from service.template.jointnames import JOINT_NAMES
from service.template.skinned import Body, SkinnedTemplate

OPTIONS = InferOptions(category="human")
POSE = {"left_elbow_y": -1.1, "right_hip_x": -0.8, "global_orient_z": 0.2}


@pytest.fixture(scope="module")
def models() -> Mapping[str, Model]:
    return {"human": load_models(SHIPPED)["human"]}


@pytest.fixture(scope="module")
def upload(human: SkinnedTemplate, strider: Body) -> Upload:
    mesh = trimesh.Trimesh(human.decode(strider), human.faces, process=False)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(1.2, [0, 1, 0]))
    return Upload(mesh.export(file_type="glb"), "body.glb")


@pytest.fixture(scope="module")
def found(models: Mapping[str, Model], upload: Upload) -> Any:
    return pipeline.infer(upload, models, OPTIONS)


@pytest.fixture(scope="module")
def rigged(models: Mapping[str, Model], upload: Upload) -> bytes:
    return pipeline.sliders(upload, models, OPTIONS, SliderOptions())


def vertices(data: bytes) -> np.ndarray:
    return read_mesh(data, "a.glb").vertices


def edited(models: Mapping[str, Model], upload: Upload, values: Mapping[str, float]) -> np.ndarray:
    changes = {name: Change("set", value) for name, value in values.items()}
    return vertices(pipeline.edit(upload, models, OPTIONS, changes, EditOptions()).data)


def test_at_rest_it_is_the_upload(upload: Upload, rigged: bytes) -> None:
    assert np.abs(vertices(rigged) - vertices(upload.data)).max() < 1e-6


def test_turned_joints_do_what_an_edit_does(
    models: Mapping[str, Model], upload: Upload, rigged: bytes
) -> None:
    gap = vertices(turned(rigged, POSE)) - edited(models, upload, POSE)
    assert np.abs(gap).max() < 2e-5


@pytest.mark.parametrize(
    # Which point of a body is its lowest is not linear in its shape.
    ("keep", "tolerance"),
    [("pelvis", 2e-5), ("floor", 2e-3)],
)
def test_shape_morphs_do_what_an_edit_does(
    models: Mapping[str, Model], upload: Upload, found: Any, keep: str, tolerance: float
) -> None:
    rigged = pipeline.sliders(upload, models, OPTIONS, SliderOptions(keep=keep))
    now = found.parameter_report()
    shape = {"shape_0": now["shape_0"]["value"] + 1, "shape_2": now["shape_2"]["value"] - 1}
    changes = {name: Change("set", value) for name, value in shape.items()}
    edit = pipeline.edit(upload, models, OPTIONS, changes, EditOptions(keep=keep))
    gap = vertices(weighted(rigged, shape)) - vertices(edit.data)
    assert np.abs(gap).max() < tolerance


def test_both_at_once_are_nearer_with_joints_that_move_apart(
    models: Mapping[str, Model], upload: Upload, rigged: bytes, found: Any
) -> None:
    shape = {"shape_0": found.parameter_report()["shape_0"]["value"] + 1}
    both = edited(models, upload, {**POSE, **shape})
    moved = np.linalg.norm(both - vertices(upload.data), axis=1).mean()
    alone = vertices(weighted(turned(rigged, POSE), shape))
    assert np.linalg.norm(alone - both, axis=1).mean() < 0.15 * moved
    apart = vertices(weighted(turned(spread(rigged, {"shape_0": 1.0}), POSE), shape))
    assert np.linalg.norm(apart - both, axis=1).mean() < 0.01 * moved


def spread(data: bytes, steps: Mapping[str, float]) -> bytes:
    """The GLB with its joints where a changed shape has them, and its mesh bound to them there."""
    root = json_of(data)
    (skin,) = root["skins"]
    worlds = []
    for apart in (False, True):
        if apart:
            for node in root["nodes"]:
                for name, offset in node.get("extras", {}).get("shape", {}).items():
                    step = steps.get(name, 0.0) * np.array(offset)
                    node["translation"] = (np.array(node["translation"]) + step).tolist()
        worlds.append(read_scene(Document("gltf", json.dumps(root).encode())).worlds)
    view = root["bufferViews"][root["accessors"][skin["inverseBindMatrices"]]["bufferView"]]
    content = bytearray(with_json(data, root))
    start = len(content) - len(data) + data.index(b"BIN\0") + 4 + view["byteOffset"]
    binds = np.ndarray((24, 4, 4), "<f4", content, start).swapaxes(1, 2)
    for bind, joint in zip(binds, skin["joints"], strict=True):
        bind[:] = np.linalg.inv(worlds[1][joint]) @ worlds[0][joint] @ bind
    return bytes(content)


@pytest.mark.parametrize("whose", ["smpl", "mixamo", "vrm"])
@pytest.mark.parametrize("rest", ["upload", "t_pose"])
def test_joints_are_named_and_say_what_they_are(
    models: Mapping[str, Model], upload: Upload, found: Any, whose: str, rest: str
) -> None:
    options = SliderOptions(joint_names=whose, rest=rest)
    root = json_of(pipeline.sliders(upload, models, OPTIONS, options))
    joints = [root["nodes"][index] for index in root["skins"][0]["joints"]]
    assert tuple(node["name"] for node in joints) == JOINT_NAMES[whose]
    assert [node["extras"]["joint"] for node in joints] == list(JOINTS)
    told = root["asset"]["extras"]["shape_parameters"]
    for node in joints:
        vector = Rotation.from_quat(node["rotation"]).as_rotvec()
        values = [told["parameters"][name]["value"] for name in node["extras"]["parameters"]]
        assert np.abs(vector - values).max() < 1e-6
    if rest == "upload":
        own = found.parameter_report()
        assert {n: p["value"] for n, p in told["parameters"].items()} == pytest.approx(
            {name: entry["value"] for name, entry in own.items()}, abs=1e-9
        )


def test_the_t_pose_has_its_arms_out_and_its_feet_on_the_floor(
    models: Mapping[str, Model], upload: Upload
) -> None:
    data = pipeline.sliders(upload, models, OPTIONS, SliderOptions(rest="t_pose"))
    before, after = vertices(upload.data), vertices(data)
    assert after[:, 1].min() == pytest.approx(before[:, 1].min(), abs=1e-3)
    span = np.ptp(after @ [np.cos(1.2), 0.0, -np.sin(1.2)])
    assert span > 0.8 * np.ptp(after[:, 1])
    root = json_of(data)
    joints = [root["nodes"][index] for index in root["skins"][0]["joints"]]
    assert all(np.allclose(np.abs(node["rotation"]), [0, 0, 0, 1]) for node in joints)


def test_the_t_pose_can_take_the_uploads_pose(
    models: Mapping[str, Model], upload: Upload, found: Any
) -> None:
    data = pipeline.sliders(upload, models, OPTIONS, SliderOptions(rest="t_pose"))
    pose = {name: entry["value"] for name, entry in found.parameter_report().items()}
    back, before = vertices(turned(data, pose)), vertices(upload.data)
    back += (before - back).mean(axis=0)
    assert np.linalg.norm(back - before, axis=1).mean() < 5e-3


def test_the_stature_can_be_followed(
    models: Mapping[str, Model], upload: Upload, rigged: bytes
) -> None:
    told = json_of(rigged)["asset"]["extras"]["shape_parameters"]
    stature = told["derived"]["stature"]
    values = {name: told["parameters"][name]["value"] + 0.5 for name in stature["coefficients"]}
    changes = {name: Change("set", value) for name, value in values.items()}
    after = pipeline.edit(upload, models, OPTIONS, changes, EditOptions()).parameters["stature"]
    terms = stature["coefficients"].items()
    assert stature["constant"] + sum(by * values[name] for name, by in terms) == pytest.approx(
        after, abs=1e-3
    )
    assert after != pytest.approx(stature["value"], abs=1e-2)


def test_named_parameters_alone(models: Mapping[str, Model], upload: Upload) -> None:
    options = SliderOptions(parameters=("shape_1", "left_elbow_y"))
    root = json_of(pipeline.sliders(upload, models, OPTIONS, options))
    assert root["meshes"][0]["extras"]["targetNames"] == ["shape_1"]
    named = [n for node in root["nodes"] for n in node.get("extras", {}).get("parameters", [])]
    assert named == ["left_elbow_y"]


def test_the_template_lies_over_the_mesh(models: Mapping[str, Model], upload: Upload) -> None:
    data = pipeline.template(upload, models, OPTIONS, SliderOptions())
    mesh, template = vertices(upload.data), vertices(data)
    assert np.abs(mesh.min(axis=0) - template.min(axis=0)).max() < 0.05
    raised = vertices(turned(data, {"left_shoulder_z": 1.2}))
    expected = edited(models, upload, {"left_shoulder_z": 1.2})
    assert np.abs(raised.max(axis=0) - expected.max(axis=0)).max() < 0.05


@pytest.mark.parametrize("option", [{"joint_names": "unreal"}, {"rest": "a_pose"}])
def test_unknown_rigs(models: Mapping[str, Model], upload: Upload, option: dict[str, str]) -> None:
    with pytest.raises(InvalidRequest) as error:
        pipeline.sliders(upload, models, OPTIONS, SliderOptions(**option))
    assert error.value.code == "unknown_rig"


@pytest.mark.parametrize("rest", ["upload", "t_pose"])
def test_vertices_that_looks_part_move_together(
    models: Mapping[str, Model], human: SkinnedTemplate, strider: Body, rest: str
) -> None:
    mesh = trimesh.Trimesh(human.decode(strider), human.faces, process=False)
    rows = ["v {} {} {}".format(*row) for row in mesh.vertices]
    rows += ["vn {} {} {}".format(*row) for row in mesh.vertex_normals]
    rows += ["vt 0 0", "vt 1 0", "vt 0 1"]
    for face in mesh.faces + 1:
        rows.append("f " + " ".join(f"{v}/{i}/{v}" for i, v in enumerate(face, 1)))
    painted = Upload("\n".join(rows).encode(), "body.obj")
    bare = Upload(convert(mesh.vertices, mesh.faces, "obj"), "body.obj")
    _, of = as_glb(read_mesh(painted.data, painted.name), 1.0)
    assert len(of) > len(mesh.vertices)
    options = SliderOptions(rest=rest)
    found, expected = (pipeline.sliders(file, models, OPTIONS, options) for file in (painted, bare))
    now = json_of(expected)["asset"]["extras"]["shape_parameters"]["parameters"]["shape_1"]
    shape = {"shape_1": now["value"] + 1}
    for posed in (POSE, {}):
        gap = vertices(weighted(turned(found, posed), shape))
        gap = gap - vertices(weighted(turned(expected, posed), shape))[of]
        assert np.abs(gap).max() < 1e-4
