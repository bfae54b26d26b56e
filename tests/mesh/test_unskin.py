from __future__ import annotations

import numpy as np
from gltf_assets import unpack
from mesh_samples import asset, still
from test_skins import skinned

from service.mesh.glb import GlbFile
from service.mesh.unskin import unskinned

UP = np.array([0.0, 1.0, 0.0])


def test_vertices_stay_where_the_skin_had_them() -> None:
    file = GlbFile(skinned().glb())
    result = unskinned(file)
    assert np.abs(result.vertices - file.vertices).max() < 1e-4
    root = unpack(result.data)[0]
    node = root["nodes"][-1]
    assert "skin" not in node
    (primitive,) = root["meshes"][node["mesh"]]["primitives"]
    assert set(primitive["attributes"]) == {"POSITION", "NORMAL"}
    assert root["skins"] == skinned().root["skins"]


def test_normals_are_those_that_were_shown() -> None:
    file = GlbFile(skinned().glb())
    result = unskinned(file)
    (before, after) = (_world_normals(mesh) for mesh in (file, result))
    assert np.abs(before - after).max() < 1e-5


def _world_normals(file: GlbFile) -> np.ndarray:
    (use,) = (use for use in file.geometry.uses if use.attribute == "NORMAL")
    accessor = file.geometry.accessors[use.accessor]
    normals = accessor.decode(accessor.stored(file.buffers))
    placement = file.geometry.blocks[use.block].placement
    inverse = np.broadcast_to(placement.inverse, (len(normals), 3, 3))
    world = np.einsum("nji,nj->ni", inverse, normals)
    return world / np.linalg.norm(world, axis=1, keepdims=True)


def test_what_has_no_skin_is_itself() -> None:
    file = GlbFile(asset().glb())
    assert unskinned(file) is file


def test_the_result_can_be_moved() -> None:
    result = unskinned(GlbFile(skinned().glb()))
    moved = GlbFile(result.write(result.vertices + UP, still(len(result.vertices))))
    assert np.abs(moved.vertices - result.vertices - UP).max() < 1e-4
