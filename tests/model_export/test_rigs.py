from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from model_export.rigs import POSES, RigError, posed, read_rig
from service.template.anatomy import JOINTS

QUARTER = Rotation.from_rotvec([0.0, 0.0, np.pi / 2]).as_matrix()


def glb(names: list[str], normalized: bool = False) -> bytes:
    """Hips, a leg one below, its knee one below that, and a vertex at each joint; the last vertex
    is half the leg's and half the knee's."""
    points = np.array([[0, 0, 0], [0, -1, 0], [0, -2, 0], [0, -1.5, 0]], "<f4")
    faces = np.array([[0, 1, 2], [1, 2, 3]], "<u2")
    joints = np.array([[0, 0, 0, 0], [1, 0, 0, 0], [2, 0, 0, 0], [1, 2, 0, 0]], "u1")
    weights = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0.5, 0.5, 0, 0]])
    kind = 5121 if normalized else 5126
    stored = np.rint(weights * 255).astype("u1") if normalized else weights.astype("<f4")
    binds = np.tile(np.eye(4, dtype="<f4"), (3, 1, 1))
    binds[1:, 1, 3] = [1, 2]
    chunks = [a.tobytes() for a in (points, faces, joints, stored, binds.swapaxes(1, 2))]
    starts = np.cumsum([0, *map(len, chunks)]).tolist()
    form = (("VEC3", 5126, 4), ("SCALAR", 5123, 6), ("VEC4", 5121, 4), ("VEC4", kind, 4),
            ("MAT4", 5126, 3))  # fmt: skip
    document = {
        "asset": {"version": "2.0"},
        "nodes": [
            {"name": names[0], "children": [1]},
            {"name": names[1], "children": [2], "translation": [0, -1, 0]},
            {"name": names[2], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1]},
            # A skinned mesh doesn't care where its node is.
            {"mesh": 0, "skin": 0, "translation": [5, 5, 5]},
        ],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3},
                             "indices": 1}]}
        ],
        "skins": [{"joints": [0, 1, 2], "inverseBindMatrices": 4}],
        "accessors": [
            {"bufferView": i, "type": t, "componentType": c, "count": n,
             "normalized": normalized and i == 3}
            for i, (t, c, n) in enumerate(form)
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": starts[i], "byteLength": len(chunk)}
            for i, chunk in enumerate(chunks)
        ],
    }  # fmt: skip
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(chunks)
    total = 28 + len(text) + len(binary)
    header = struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON")
    return header + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary


MIXAMO = ["mixamorig:Hips", "mixamorig:LeftUpLeg", "mixamorig:LeftLeg"]


@pytest.fixture
def rig():
    return read_rig(glb(MIXAMO))


@pytest.mark.parametrize("normalized", [False, True])
def test_the_rest_pose_is_as_stored(normalized):
    rig = read_rig(glb(MIXAMO, normalized))
    expected = [[0, 0, 0], [0, -1, 0], [0, -2, 0], [0, -1.5, 0]]
    np.testing.assert_allclose(rig.vertices, expected, atol=1e-7)
    np.testing.assert_array_equal(rig.faces, [[0, 1, 2], [1, 2, 3]])
    np.testing.assert_allclose(rig.weights.sum(axis=1), 1.0)


@pytest.mark.parametrize(
    ("names", "convention"),
    [(MIXAMO, "Mixamo"), (["pelvis", "thigh_l", "calf_l"], "Unreal")],
)
def test_joints_are_known_by_name(names, convention):
    rig = read_rig(glb(names))
    assert rig.convention == convention
    found = {JOINTS[i] for i in np.flatnonzero(rig.joints >= 0)}
    assert found == {"pelvis", "left_hip", "left_knee"}
    np.testing.assert_allclose(rig.positions[JOINTS.index("left_knee")], [0, -2, 0])
    assert np.isnan(rig.positions[JOINTS.index("head")]).all()


def test_a_turned_joint_takes_all_below_it_along(rig):
    turned = rig.turned("left_hip", QUARTER)
    np.testing.assert_allclose(
        turned.vertices, [[0, 0, 0], [0, -1, 0], [1, -1, 0], [0.5, -1, 0]], atol=1e-7
    )
    np.testing.assert_allclose(turned.positions[JOINTS.index("left_knee")], [1, -1, 0], atol=1e-7)


def test_weights_blend_what_bones_do(rig):
    bent = rig.turned("left_knee", QUARTER).vertices
    # The knee alone would have the vertex half above it at (-0.5, -2); the leg leaves it.
    np.testing.assert_allclose(bent[3], [-0.25, -1.75, 0.0], atol=1e-7)


@pytest.mark.parametrize("joint", ["left_hip", "left_knee"])
def test_turns_from_sums_are_the_turns(rig, joint):
    before = rig.turned("left_knee", QUARTER)
    weight, total = before.moved_by(joint)
    pivot = before.positions[JOINTS.index(joint)]
    expected = before.turned(joint, QUARTER).vertices
    moved = before.vertices + (total - weight[:, None] * pivot) @ (QUARTER - np.eye(3)).T
    np.testing.assert_allclose(moved, expected, atol=1e-7)


def test_poses_compose_down_the_tree(rig):
    half = Rotation.from_matrix(QUARTER).as_rotvec()
    pose = {"left_hip": tuple(half), "left_knee": tuple(half)}
    np.testing.assert_allclose(posed(rig, pose).vertices[2], [1, -1, 0], atol=1e-7)
    worlds = posed(rig, pose).worlds[rig.joints[JOINTS.index("left_knee")], :3, :3]
    np.testing.assert_allclose(worlds, QUARTER @ QUARTER, atol=1e-7)
    np.testing.assert_array_equal(posed(rig, POSES["rest"]).vertices, rig.vertices)


def test_a_joint_that_is_missing_is_named(rig):
    with pytest.raises(RigError, match="right_wrist"):
        rig.turned("right_wrist", QUARTER)


@pytest.mark.parametrize("data", [b"solid", glb(["a", "b", "c"])])
def test_what_is_no_rig_is_refused(data):
    with pytest.raises(RigError):
        read_rig(data)
