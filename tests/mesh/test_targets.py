from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from gltf_assets import Asset, unpack
from mesh_samples import ball
from test_skins import skinned
from trimesh.transformations import rotation_matrix, scale_and_translate
from weighted import with_json

from service.errors import InvalidMesh, UnsupportedFormat
from service.mesh.accessors import read_accessor
from service.mesh.glb import GlbFile
from service.mesh.moves import turn_normals
from service.mesh.stretch import Cell, Stretch
from service.mesh.targets import Target, add_targets

VERTICES, FACES, NORMALS = ball()
COUNT = len(VERTICES)
TURNED = rotation_matrix(0.4, [0, 0, 1]) @ scale_and_translate([0.5, 2.0, 1.0], [1, 2, 3])


def target(name: str, shift: np.ndarray, cells: Mapping[Cell, np.ndarray] | None = None) -> Target:
    return Target(name, {"parameter": name}, shift, Stretch(cells or {}))


def stretched(vertices: np.ndarray, axis: int, by: float) -> Target:
    """Along a world axis, about the origin."""
    shift = np.zeros_like(vertices)
    shift[:, axis] = by * vertices[:, axis]
    return target("xyz"[axis], shift, {(axis, axis): np.full(len(vertices), by)})


def plain(**node: Any) -> Asset:
    asset = Asset()
    attributes = {
        "POSITION": asset.accessor(VERTICES.astype("<f4")),
        "NORMAL": asset.accessor(NORMALS.astype("<f4")),
    }
    mesh = asset.mesh(
        {"attributes": attributes, "indices": asset.accessor(FACES.reshape(-1).astype("<u2"))}
    )
    asset.node(mesh=mesh, **node)
    return asset


def shown(data: bytes, weights: Sequence[float], mesh: int = 0) -> GlbFile:
    """The asset with a mesh's last weights set."""
    root = unpack(data)[0]
    kept = root["meshes"][mesh]["weights"][: -len(weights)]
    root["meshes"][mesh]["weights"] = [*kept, *weights]
    return GlbFile(with_json(data, root))


@pytest.mark.parametrize("node", [{}, {"matrix": TURNED.T.ravel().tolist()}])
@pytest.mark.parametrize("weights", [(0, 0), (1, 0), (0.3, -0.6)])
def test_weights_displace_in_world_space(node: Any, weights: tuple[float, float]) -> None:
    file = GlbFile(plain(**node).glb())
    targets = [stretched(file.vertices, 0, 0.5), stretched(file.vertices, 1, -0.25)]
    data = add_targets(file, targets, {})
    expected = file.vertices * [1 + 0.5 * weights[0], 1 - 0.25 * weights[1], 1]
    assert np.abs(shown(data, weights).vertices - expected).max() < 1e-6 * np.ptp(expected)


def test_everything_else_stays() -> None:
    asset = plain(name="seat", extras={"mine": 1})
    asset.root["asset"]["extras"] = {"kept": True}
    before = asset.root
    data = add_targets(GlbFile(asset.glb()), [stretched(VERTICES, 2, 1.0)], {"told": 2})
    root, _, chunk = unpack(data)
    assert root["nodes"] == before["nodes"]
    assert chunk.startswith(bytes(asset.chunk))
    assert root["accessors"][: len(before["accessors"])] == before["accessors"]
    assert root["asset"]["extras"] == {"kept": True, "told": 2}
    mesh = root["meshes"][0]
    assert mesh["extras"] == {"targetNames": ["z"], "targets": [{"parameter": "z"}]}
    assert mesh["weights"] == [0.0]


@pytest.mark.parametrize("weight", [1.0, 0.4, -0.3])
@pytest.mark.parametrize("node", [{}, {"matrix": TURNED.T.ravel().tolist()}])
def test_a_stretch_turns_normals_exactly_at_any_weight(weight: float, node: Any) -> None:
    file = GlbFile(plain(**node).glb())
    data = add_targets(file, [stretched(file.vertices, 0, 1.5)], {})
    root = unpack(data)[0]
    accessor = root["meshes"][0]["primitives"][0]["targets"][0]["NORMAL"]
    morphed = GlbFile(data)
    entry = _accessor(morphed, accessor)
    turned = NORMALS + weight * entry
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    world = np.linalg.inv(TURNED[:3, :3]).T if node else np.eye(3)
    map_ = np.tile(np.diag([1 + 1.5 * weight, 1, 1]), (COUNT, 1, 1))
    expected = turn_normals(NORMALS @ world.T, map_)
    back = turned @ world.T
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    # What hardly turns is left out.
    assert np.abs(back - expected).max() < 4e-3


def _accessor(file: GlbFile, index: int) -> np.ndarray:
    accessor = read_accessor(file.document, file.buffers, index)
    return accessor.decode(accessor.stored(file.buffers))


def test_targets_come_behind_those_that_are_there() -> None:
    asset = plain()
    wider = (VERTICES * [0.5, 0, 0]).astype("<f4")
    asset.root["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": asset.accessor(wider)}]
    asset.root["meshes"][0]["weights"] = [0.5]
    asset.root["nodes"][0]["weights"] = [0.25]
    file = GlbFile(asset.glb())
    data = add_targets(file, [target("up", np.tile([0.0, 1.0, 0.0], (COUNT, 1)))], {})
    root = unpack(data)[0]
    assert root["meshes"][0]["weights"] == [0.5, 0.0]
    assert root["nodes"][0]["weights"] == [0.25, 0.0]
    assert root["meshes"][0]["extras"]["targetNames"] == ["target_0", "up"]
    root["nodes"][0]["weights"] = [0.25, 2.0]
    moved = GlbFile(with_json(data, root)).vertices
    assert np.abs(moved - file.vertices - [0, 2, 0]).max() < 1e-6


def test_skinned_meshes_morph_ahead_of_their_skin() -> None:
    file = GlbFile(skinned().glb())
    shift = 0.1 * np.sin(np.arange(3 * COUNT).reshape(COUNT, 3))
    moved = shown(add_targets(file, [target("wave", shift)], {}), [1.0]).vertices
    assert np.abs(moved - file.vertices - shift).max() < 1e-5


def test_nodes_that_show_one_mesh_get_their_own_targets() -> None:
    asset = plain()
    asset.node(mesh=0, matrix=TURNED.T.ravel().tolist())
    file = GlbFile(asset.glb())
    data = add_targets(file, [stretched(file.vertices, 0, 0.5)], {})
    root = unpack(data)[0]
    assert [node["mesh"] for node in root["nodes"]] == [0, 1]
    for mesh in root["meshes"]:
        mesh["weights"] = [1.0]
    moved = GlbFile(with_json(data, root)).vertices
    assert np.abs(moved - file.vertices * [1.5, 1, 1]).max() < 1e-5


def test_instances_that_move_alike_share_their_mesh() -> None:
    asset = plain()
    asset.node(mesh=0, translation=[0, 3, 0])
    file = GlbFile(asset.glb())
    data = add_targets(file, [target("up", np.tile([0.0, 1.0, 0.0], (2 * COUNT, 1)))], {})
    root = unpack(data)[0]
    assert [node["mesh"] for node in root["nodes"]] == [0, 0]


def test_meshes_that_nothing_moves_are_left_alone() -> None:
    asset = plain()
    attributes = {"POSITION": asset.accessor(VERTICES.astype("<f4"))}
    asset.node(mesh=asset.mesh({"attributes": attributes}))
    file = GlbFile(asset.glb())
    shift = np.zeros((2 * COUNT, 3))
    shift[:COUNT, 1] = 1.0
    root = unpack(add_targets(file, [target("up", shift)], {}))[0]
    assert "targets" in root["meshes"][0]["primitives"][0]
    assert root["meshes"][1] == asset.root["meshes"][1]


def test_animated_weights_leave_no_room_for_more() -> None:
    asset = plain()
    times = asset.accessor(np.array([0, 1], "<f4"))
    animation = {
        "samplers": [{"input": times, "output": times}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
    }
    asset.root["animations"] = [animation]
    with pytest.raises(UnsupportedFormat, match="morph targets") as error:
        add_targets(GlbFile(asset.glb()), [stretched(VERTICES, 0, 1.0)], {})
    assert error.value.code == "animated_weights"


def test_primitives_with_different_numbers_of_targets_are_broken() -> None:
    asset = plain()
    position = asset.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    other = {"attributes": {"POSITION": position}, "targets": [{"POSITION": position}]}
    asset.root["meshes"][0]["primitives"].append(other)
    with pytest.raises(InvalidMesh, match="morph targets"):
        add_targets(GlbFile(asset.glb()), [stretched(VERTICES, 0, 1.0)], {})
