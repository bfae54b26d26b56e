from __future__ import annotations

import numpy as np
import pytest
from gltf_assets import Asset
from mesh_samples import ball, bend, bend_some, still
from trimesh.transformations import rotation_matrix, scale_and_translate

from service.errors import InvalidMesh, UnsupportedFormat
from service.mesh.formats import read_mesh

VERTICES, FACES, NORMALS = ball()
COUNT = len(VERTICES)
generator = np.random.default_rng(11)
JOINTS = generator.integers(0, 2, (COUNT, 4)).astype("u1")
WEIGHTS = generator.uniform(0.1, 1, (COUNT, 4)).astype("<f4")
BINDS = np.stack(
    [
        rotation_matrix(0.3, [1, 0, 0], [0, 1, 0]),
        scale_and_translate(1.5, [0.2, 0.1, 0]),
    ]
)
WORLDS = np.stack(
    [
        scale_and_translate(0.01, [1, 2, 3]),
        scale_and_translate(0.01, [1, 2, 3]) @ rotation_matrix(-0.5, [0, 0, 1], [0, 1, 0]),
    ]
)


def columns(matrix: np.ndarray) -> list[float]:
    """glTF lists matrices by column."""
    return [float(value) for value in matrix.T.reshape(-1)]


def skinned(
    joints: np.ndarray = JOINTS, weights: np.ndarray = WEIGHTS, binds: bool = True
) -> Asset:
    asset = Asset()
    attributes = {
        "POSITION": asset.accessor(VERTICES.astype("<f4")),
        "NORMAL": asset.accessor(NORMALS.astype("<f4")),
        "JOINTS_0": asset.accessor(joints),
        "WEIGHTS_0": asset.accessor(weights),
    }
    indices = asset.accessor(FACES.reshape(-1).astype("<u2"))
    mesh = asset.mesh({"attributes": attributes, "indices": indices})
    child = asset.node(root=False, matrix=columns(np.linalg.inv(WORLDS[0]) @ WORLDS[1]))
    parent = asset.node(matrix=columns(WORLDS[0]), children=[child])
    asset.root["skins"] = [{"joints": [parent, child]}]
    if binds:
        matrices = np.stack([bind.T.reshape(-1) for bind in BINDS]).astype("<f4")
        asset.root["skins"][0]["inverseBindMatrices"] = asset.accessor(matrices)
    # The node's own transform counts for nothing under a skin.
    asset.node(mesh=mesh, skin=0, translation=[50, 50, 50])
    return asset


def posed(weights: np.ndarray, binds: bool = True) -> np.ndarray:
    """What the glTF specification says a viewer shows."""
    result = np.zeros((COUNT, 3))
    for vertex in range(COUNT):
        for joint, weight in zip(JOINTS[vertex], weights[vertex], strict=True):
            matrix = WORLDS[joint] @ (BINDS[joint] if binds else np.eye(4))
            result[vertex] += weight * (matrix @ [*VERTICES[vertex], 1])[:3]
    return result


@pytest.mark.parametrize("binds", [True, False])
def test_the_rest_pose_is_the_geometry(binds: bool) -> None:
    weights = WEIGHTS / WEIGHTS.sum(axis=1, keepdims=True, dtype=np.float64)
    found = read_mesh(skinned(binds=binds).glb())
    assert np.allclose(found.vertices, posed(weights, binds), atol=1e-7)


def test_integer_weights_and_two_sets() -> None:
    asset = skinned(weights=np.rint(WEIGHTS * 200).astype("u1"))
    attributes = asset.root["meshes"][0]["primitives"][0]["attributes"]
    asset.root["accessors"][attributes["WEIGHTS_0"]]["normalized"] = True
    attributes |= {"JOINTS_1": attributes["JOINTS_0"], "WEIGHTS_1": attributes["WEIGHTS_0"]}
    whole = np.rint(WEIGHTS * 200).astype(np.float64)
    found = read_mesh(asset.glb())
    assert np.allclose(found.vertices, posed(whole / whole.sum(axis=1, keepdims=True)), atol=1e-7)


def test_vertices_without_weights_follow_the_first_joint() -> None:
    weights = WEIGHTS.copy()
    weights[5] = 0
    found = read_mesh(skinned(weights=weights).glb()).vertices[5]
    assert np.allclose(found, (WORLDS[0] @ BINDS[0] @ [*VERTICES[5], 1])[:3], atol=1e-7)


def test_moved_vertices_go_back_through_their_joints() -> None:
    mesh = read_mesh(skinned().glb())
    new, linear, moved = bend_some(mesh.vertices)
    again = read_mesh(mesh.write(new, linear))
    assert np.allclose(again.vertices, new, atol=1e-7)
    assert np.array_equal(again.vertices[~moved], mesh.vertices[~moved])


def test_scaling_in_the_world_leaves_normals_alone() -> None:
    data = skinned().glb()
    mesh = read_mesh(data)
    asset = skinned()
    index = asset.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]
    view = asset.root["bufferViews"][asset.root["accessors"][index]["bufferView"]]
    written = mesh.write(mesh.vertices * 2, 2 * still(COUNT))
    start = written.index(b"BIN\0") + 4 + view["byteOffset"]
    found = np.frombuffer(written, "<f4", COUNT * 3, start).reshape(-1, 3)
    assert np.allclose(found, NORMALS, atol=1e-6)


def test_skin_without_joints_on_the_mesh_places_by_node() -> None:
    asset = skinned()
    attributes = asset.root["meshes"][0]["primitives"][0]["attributes"]
    del attributes["JOINTS_0"], attributes["WEIGHTS_0"]
    assert np.array_equal(read_mesh(asset.glb()).vertices, VERTICES + 50)


def test_joints_that_collapse_vertices_are_refused() -> None:
    asset = skinned()
    asset.root["nodes"][1] = {"scale": [0, 0, 0], "children": [0]}
    with pytest.raises(UnsupportedFormat, match="skinned_mesh"):
        read_mesh(asset.glb())


def test_too_many_joints_a_vertex_are_refused() -> None:
    asset = skinned()
    attributes = asset.root["meshes"][0]["primitives"][0]["attributes"]
    for number in range(1, 5):
        attributes[f"JOINTS_{number}"] = attributes["JOINTS_0"]
    with pytest.raises(UnsupportedFormat, match="skinned_mesh"):
        read_mesh(asset.glb())


@pytest.mark.parametrize(
    "change",
    [
        {"joints": []},
        {"joints": [0]},
        {"joints": [0, 9]},
        {"joints": [0, 1, 0]},
        {"joints": [0, 3]},
        {"joints": "01"},
        {"inverseBindMatrices": 0},
        {"inverseBindMatrices": 77},
    ],
)
def test_broken_skins_are_malformed(change: dict[str, object]) -> None:
    asset = skinned()
    asset.node(root=False)
    asset.root["skins"][0].update(change)
    with pytest.raises(InvalidMesh, match="malformed_glb"):
        read_mesh(asset.glb())


@pytest.mark.parametrize("weights", [None, "NORMAL"])
def test_missing_or_other_weights_are_malformed(weights: str | None) -> None:
    asset = skinned()
    attributes = asset.root["meshes"][0]["primitives"][0]["attributes"]
    attributes["WEIGHTS_0"] = attributes.get(weights)
    with pytest.raises(InvalidMesh, match="malformed_glb"):
        read_mesh(asset.glb())


def test_primitives_of_different_joints_are_apart() -> None:
    asset = skinned()
    first = asset.root["meshes"][0]["primitives"][0]
    other = {**first, "attributes": dict(first["attributes"])}
    other["attributes"]["JOINTS_0"] = asset.accessor(1 - JOINTS)
    asset.root["meshes"][0]["primitives"].append(other)
    mesh = read_mesh(asset.glb())
    assert len(mesh.vertices) == 2 * COUNT
    new, linear = bend(mesh.vertices)
    assert np.allclose(read_mesh(mesh.write(new, linear)).vertices, new, atol=1e-6)
