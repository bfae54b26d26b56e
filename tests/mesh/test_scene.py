from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import trimesh

from service.errors import InvalidMesh, TooLarge, UnsupportedFormat
from service.mesh import limits
from service.mesh.document import Document
from service.mesh.scene import read_scene

QUATERNION = [0.1, -0.5, 0.3, 0.8]


def document(**members: Any) -> Document:
    return Document("gltf", json.dumps(members).encode())


def test_transforms_multiply_down_the_hierarchy() -> None:
    matrix = np.arange(16.0).reshape(4, 4)
    matrix[3] = [0, 0, 0, 1]
    nodes = [
        {"children": [2, 1], "matrix": matrix.T.reshape(-1).tolist()},
        {"mesh": 0, "skin": 3},
        {
            "mesh": 1,
            "translation": [1, 2, 3],
            "rotation": QUATERNION,
            "scale": [2, -3, 0.5],
        },
    ]
    scene = read_scene(document(scene=0, scenes=[{"nodes": [0]}], nodes=nodes))
    x, y, z, w = QUATERNION
    local = (
        trimesh.transformations.translation_matrix([1, 2, 3])
        @ trimesh.transformations.quaternion_matrix([w, x, y, z])
        @ np.diag([2, -3, 0.5, 1])
    )
    first, second = scene.instances
    assert (first.node, first.mesh, first.skin) == (2, 1, None)
    assert (second.node, second.mesh, second.skin) == (1, 0, 3)
    assert np.allclose(first.world, matrix @ local)
    assert np.array_equal(second.world, matrix)
    assert set(scene.worlds) == {0, 1, 2}


@pytest.mark.parametrize(
    ("members", "nodes"),
    [
        ({"scene": 1, "scenes": [{"nodes": [0]}, {"nodes": [1, 3]}]}, [1, 3]),
        ({"scenes": [{"nodes": [2]}, {"nodes": [1]}]}, [2]),
        ({}, [0, 1, 3, 2]),
        ({"scenes": [{}]}, []),
    ],
)
def test_active_scene_then_first_then_everything(members: Any, nodes: list[int]) -> None:
    listed = [{"mesh": 0}, {"mesh": 0, "children": [3]}, {"mesh": 0}, {"mesh": 0}]
    if members:
        listed[1].pop("children")
    scene = read_scene(document(nodes=listed, **members))
    assert [instance.node for instance in scene.instances] == nodes


@pytest.mark.parametrize(
    "nodes",
    [
        [{"children": [0]}],
        [{"children": [1]}, {"children": [0]}],
        [{"children": [1, 1]}, {}],
        [{"children": [9]}],
        [{"children": "1"}],
        [{"mesh": -1}],
        [{"matrix": [1, 2]}],
        [{"translation": [0, 0, "0"]}],
    ],
)
def test_broken_hierarchies_are_malformed(nodes: list[Any]) -> None:
    with pytest.raises(InvalidMesh, match="malformed_gltf"):
        read_scene(document(nodes=nodes, scenes=[{"nodes": [0]}]))


def test_rotation_of_length_zero_is_none() -> None:
    scene = read_scene(document(nodes=[{"mesh": 0, "rotation": [0, 0, 0, 0]}]))
    assert np.array_equal(scene.instances[0].world, np.eye(4))


@pytest.mark.parametrize(
    ("name", "hidden"),
    [
        ("Chair_collider", True),
        ("Chair_COLLIDER.001", True),
        ("seat_collision", True),
        ("leg-colonly", True),
        ("leg-convcolonly2", True),
        ("UCX_Chair_01", True),
        ("ubx_seat", True),
        ("UCP_\n", True),
        ("collider_of_ideas", False),
        ("Chair", False),
        ("USPTO", False),
        ("leg-col", False),
        (7, False),
    ],
)
def test_nodes_named_as_helpers_are_hidden(name: object, hidden: bool) -> None:
    nodes = [{"mesh": 0, "name": name, "children": [1]}, {"mesh": 1}, {"mesh": 2}]
    scene = read_scene(document(nodes=nodes))
    assert [instance.hidden for instance in scene.instances] == [hidden, hidden, False]


def test_nodes_that_say_so_are_hidden() -> None:
    extension = {"KHR_node_visibility": {"visible": False}}
    nodes = [{"mesh": 0, "extensions": extension}, {"mesh": 0}]
    root = document(nodes=nodes, extensionsRequired=["KHR_node_visibility"])
    assert [instance.hidden for instance in read_scene(root).instances] == [True, False]


def test_gpu_instancing_is_refused() -> None:
    nodes = [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}}}]
    with pytest.raises(UnsupportedFormat, match="gpu_instancing"):
        read_scene(document(nodes=nodes))


def test_scenes_have_a_largest_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "PARTS", 3)
    assert len(read_scene(document(nodes=[{"mesh": 0}] * 3)).instances) == 3
    with pytest.raises(TooLarge, match="too_many_parts"):
        read_scene(document(nodes=[{"mesh": 0}] * 4))
