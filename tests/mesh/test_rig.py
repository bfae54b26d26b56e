from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gltf_assets import unpack
from mesh_samples import asset, ball
from scipy.spatial.transform import Rotation
from test_skins import skinned
from trimesh.transformations import rotation_matrix, scale_and_translate
from weighted import with_json

from service.mesh.accessors import read_accessor
from service.mesh.glb import GlbFile
from service.mesh.rig import ARMATURE, Joint, Rig, add_rig
from service.mesh.unskin import unskinned

COUNT = len(ball()[0])
TURNED = rotation_matrix(0.4, [0, 0, 1]) @ scale_and_translate([0.5, 2.0, 1.0], [1, 2, 3])
FRAME = Rotation.from_euler("xyz", [0.2, 1.0, -0.4]).as_matrix()
BEND = Rotation.from_euler("xyz", [0.5, 0.1, 0.3]).as_matrix()


def rig(vertices: np.ndarray) -> Rig:
    """Two joints, the second above the first; vertices follow it the more the higher they are."""
    offsets = np.array([[0.1, 0.2, 0.3], [0.0, 0.5, 0.0]])
    joints = [
        Joint("root", -1, BEND, offsets[0], {"joint": "a"}),
        Joint("tip", 0, BEND.T, offsets[1], {"joint": "b"}),
    ]
    worlds = np.tile(np.eye(4), (2, 1, 1))
    worlds[0, :3, :3], worlds[0, :3, 3] = FRAME @ BEND, FRAME @ offsets[0]
    local = np.eye(4)
    local[:3, :3], local[:3, 3] = BEND.T, offsets[1]
    worlds[1] = worlds[0] @ local
    share = np.linspace(0.0, 1.0, len(vertices))
    weights = np.stack([share, 1 - share, 0 * share, 0 * share], axis=1)
    indices = np.tile([1, 0, 1, 1], (len(vertices), 1))
    return Rig(joints, FRAME, np.linalg.inv(worlds), indices, weights)


@pytest.mark.parametrize("matrices", [[np.eye(4)], [TURNED], [np.eye(4), TURNED]])
def test_at_rest_nothing_moves(matrices: list[np.ndarray]) -> None:
    made = asset()
    made.root["nodes"] = [{"mesh": 0, "matrix": m.T.ravel().tolist()} for m in matrices]
    made.root["scenes"][0]["nodes"] = list(range(len(matrices)))
    file = GlbFile(made.glb())
    result = GlbFile(add_rig(file, rig(file.vertices)))
    assert np.abs(result.vertices - file.vertices).max() < 1e-5
    root = unpack(result.data)[0]
    assert len({node["mesh"] for node in root["nodes"] if "mesh" in node}) == len(matrices)
    assert len(root["skins"]) == len(matrices)


def test_joints_turn_what_hangs_on_them() -> None:
    file = GlbFile(asset().glb())
    made = rig(file.vertices)
    data = add_rig(file, made)
    root = unpack(data)[0]
    tip = next(node for node in root["nodes"] if node.get("name") == "tip")
    assert tip["extras"] == {"joint": "b"}
    turn = Rotation.from_rotvec([0.0, 0.0, 0.7])
    tip["rotation"] = (Rotation.from_quat(tip["rotation"]) * turn).as_quat().tolist()
    moved = GlbFile(with_json(data, root)).vertices
    world = np.linalg.inv(made.inverse_bind[1])
    spin = np.eye(4)
    spin[:3, :3] = turn.as_matrix()
    whole = world @ spin @ made.inverse_bind[1]
    turned = file.vertices @ whole[:3, :3].T + whole[:3, 3]
    share = made.weights[:, :1]
    assert np.abs(moved - (share * turned + (1 - share) * file.vertices)).max() < 1e-5


def test_what_is_there_stays() -> None:
    before: Any = asset().root
    file = GlbFile(asset().glb())
    root = unpack(add_rig(file, rig(file.vertices)))[0]
    assert root["nodes"][0] == {**before["nodes"][0], "skin": 0}
    attributes = root["meshes"][0]["primitives"][0]["attributes"]
    assert attributes.items() >= before["meshes"][0]["primitives"][0]["attributes"].items()
    assert root["nodes"][-1]["name"] == ARMATURE
    assert root["scenes"][0]["nodes"] == [0, len(root["nodes"]) - 1]


def test_joints_without_weight_are_the_first() -> None:
    file = GlbFile(asset().glb())
    result = GlbFile(add_rig(file, rig(file.vertices)))
    attributes = result.document.entry("meshes", 0)["primitives"][0]["attributes"]
    joints, weights = (
        accessor.stored(result.buffers)
        for accessor in (
            read_accessor(result.document, result.buffers, attributes[name])
            for name in ("JOINTS_0", "WEIGHTS_0")
        )
    )
    assert (joints[weights == 0] == 0).all()
    assert np.abs(weights.sum(axis=1) - 1).max() < 1e-6


def test_a_skinned_mesh_gets_the_new_skin() -> None:
    file = unskinned(GlbFile(skinned().glb()))
    result = GlbFile(add_rig(file, rig(file.vertices)))
    assert np.abs(result.vertices - file.vertices).max() < 1e-4
    root = unpack(result.data)[0]
    assert len(root["skins"]) == 2
    shown = next(node for node in root["nodes"] if "mesh" in node)
    assert shown["skin"] == 1


def test_an_asset_without_scenes_shows_the_skeleton_too() -> None:
    made = asset()
    del made.root["scenes"], made.root["scene"]
    file = GlbFile(made.glb())
    result = GlbFile(add_rig(file, rig(file.vertices)))
    assert np.abs(result.vertices - file.vertices).max() < 1e-5
