from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest
from gltf_assets import Asset, unpack, values
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_samples import ball, bend, bend_some, still

from service.mesh.formats import read_mesh

VERTICES, FACES, NORMALS = ball()
COUNT = len(VERTICES)
POINTS, DIRECTIONS = VERTICES.astype("<f4"), NORMALS.astype("<f4")
TANGENTS = np.column_stack(
    [np.cross(NORMALS, [0.3, 0.5, 0.8]), np.where(VERTICES[:, 0] > 0, 1, -1)]
).astype("<f4")
TANGENTS[:, :3] /= np.linalg.norm(TANGENTS[:, :3], axis=1, keepdims=True)
TEXTURE = VERTICES[:, :2].astype("<f4")
SHIFT = np.array([10.0, 0, 0])


def full(asset: Asset, **attributes: int) -> dict[str, Any]:
    """A primitive of the ball, with normals and tangents."""
    return {
        "attributes": {
            "POSITION": asset.accessor(POINTS),
            "NORMAL": asset.accessor(DIRECTIONS),
            "TANGENT": asset.accessor(TANGENTS),
            **attributes,
        },
        "indices": asset.accessor(FACES.reshape(-1).astype("<u2")),
    }


def bounds_hold(data: bytes) -> bool:
    """Whether min and max of every accessor that has them are those of its values."""
    root = unpack(data)[0]
    return all(
        np.array_equal(np.float32(entry["min"]), values(data, index).min(axis=0))
        and np.array_equal(np.float32(entry["max"]), values(data, index).max(axis=0))
        for index, entry in enumerate(root["accessors"])
        if "min" in entry and "sparse" not in entry
    )


def changed_bytes(one: bytes, two: bytes) -> set[int]:
    """Offsets at which two byte strings of one length differ."""
    assert len(one) == len(two)
    return {i for i, (a, b) in enumerate(zip(one, two, strict=True)) if a != b}


def test_positions_normals_and_tangents_are_patched_in_place() -> None:
    asset = Asset()
    entry = full(asset)
    entry["attributes"]["TEXCOORD_0"] = asset.accessor(TEXTURE)
    asset.node(mesh=asset.mesh(entry))
    data = asset.glb()
    mesh = read_mesh(data)
    new, linear, moved = bend_some(mesh.vertices)
    written = mesh.write(new, linear)
    assert np.array_equal(values(written, 0), new.astype("<f4"))
    normals = np.einsum("nji,nj->ni", np.linalg.inv(linear), NORMALS)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.allclose(values(written, 1), normals, atol=1e-6)
    tangents = np.einsum("nij,nj->ni", linear, TANGENTS[:, :3])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    assert np.allclose(values(written, 2)[:, :3], tangents, atol=1e-6)
    assert np.array_equal(values(written, 2)[:, 3], TANGENTS[:, 3])
    # Nothing else differs: neither other vertices' bytes nor any other accessor's.
    allowed = {
        view * COUNT * size + vertex * size + byte
        for view, size in ((0, 12), (1, 12))
        for vertex in np.flatnonzero(moved)
        for byte in range(size)
    } | {COUNT * 24 + vertex * 16 + byte for vertex in np.flatnonzero(moved) for byte in range(16)}
    chunk, after = unpack(data)[2], unpack(written)[2]
    assert changed_bytes(chunk, after) <= allowed
    assert bounds_hold(written)


def test_json_changes_only_in_its_bounds() -> None:
    asset = Asset()
    asset.root["extras"] = {"z": 1.0, "a": [1e3, -0.0], "ü": "\u2603"}
    asset.node(mesh=asset.mesh(full(asset)), name="chair", extras={"price": 3.50})
    asset.root["materials"] = [{"name": "wood"}]
    data = asset.glb(indent=1, ensure_ascii=False)
    mesh = read_mesh(data)
    before, text = unpack(data)[:2]
    after, new_text = unpack(mesh.write(*bend(mesh.vertices)))[:2]
    for name in ("min", "max"):
        assert before["accessors"][0].pop(name) != after["accessors"][0].pop(name)
    # Tangents have four components, and no bounds here; normals' bounds moved too.
    for name in ("min", "max"):
        before["accessors"][1].pop(name)
        after["accessors"][1].pop(name)
    assert json.dumps(before) == json.dumps(after)
    head = text.index(b'"accessors"')
    tail = text.index(b'"bufferViews"')
    assert new_text[:head] == text[:head]
    assert new_text[new_text.index(b'"bufferViews"') :].rstrip() == text[tail:].rstrip()


def test_json_stays_when_the_bounds_do() -> None:
    asset = Asset()
    asset.node(mesh=asset.mesh(full(asset)))
    data = asset.glb(indent=3)
    mesh = read_mesh(data)
    new = mesh.vertices.copy()
    middle = int(np.argmin(np.abs(new - new.mean(axis=0)).max(axis=1)))
    new[middle] += 0.001
    written = mesh.write(new, still(COUNT))
    assert unpack(written)[1] == unpack(data)[1]
    assert len(changed_bytes(data, written)) <= 12


def test_only_turned_normals_change_when_nothing_moves() -> None:
    asset = Asset()
    asset.node(mesh=asset.mesh(full(asset)))
    mesh = read_mesh(asset.glb())
    linear = still(COUNT)
    linear[4] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    written = mesh.write(mesh.vertices, linear)
    assert np.array_equal(values(written, 0), POINTS)
    others = np.arange(COUNT) != 4
    assert np.array_equal(values(written, 1)[others], DIRECTIONS[others])
    x, y, z = DIRECTIONS[4]
    assert np.allclose(values(written, 1)[4], [-y, x, z], atol=1e-6)


def test_interleaved_and_offset_arrays() -> None:
    asset = Asset()
    asset.view(b"odd")
    position, normal, texture = asset.interleaved(POINTS, DIRECTIONS, TEXTURE)
    attributes = {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": texture}
    indices = asset.accessor(FACES.reshape(-1).astype("u1"))
    asset.node(mesh=asset.mesh({"attributes": attributes, "indices": indices}))
    mesh = read_mesh(asset.glb())
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    assert np.array_equal(values(written, position), new.astype("<f4"))
    assert np.array_equal(values(written, texture), TEXTURE)
    assert len(unpack(written)[2]) == len(asset.chunk)


@pytest.mark.parametrize("scale", [[2, 3, -0.5], [1e-3, 1e-3, 1e-3]])
def test_nodes_take_the_way_back(scale: list[float]) -> None:
    asset = Asset()
    leaf = asset.node(root=False, mesh=asset.mesh(full(asset)), scale=scale)
    asset.node(rotation=[0.5, 0.5, -0.5, 0.5], translation=[5, 6, 7], children=[leaf])
    data = asset.glb()
    mesh = read_mesh(data)
    new, linear = bend(mesh.vertices)
    again = read_mesh(mesh.write(new, linear))
    assert np.allclose(again.vertices, new, rtol=1e-6, atol=1e-6 * np.ptp(new))
    assert bounds_hold(again.data)


def quantised(dtype: str, normalized: bool) -> tuple[Asset, float]:
    """The ball in steps of half the type's range, and the size of a step."""
    info = np.iinfo(dtype)
    size = np.abs(VERTICES).max() * 2
    steps = np.rint((VERTICES - VERTICES.min()) / size * info.max * 0.8).astype(dtype)
    asset = Asset()
    step = size / info.max / 0.8
    scale = size / 0.8 if normalized else step
    padded = np.zeros((COUNT, 4), dtype)
    padded[:, :3] = steps
    view = asset.view(padded.tobytes(), byteStride=4 * padded.itemsize)
    position = asset.accessor(steps, view, normalized=normalized)
    indices = asset.accessor(FACES.reshape(-1).astype("<u2"))
    asset.node(
        mesh=asset.mesh({"attributes": {"POSITION": position}, "indices": indices}),
        scale=[scale] * 3,
        translation=[VERTICES.min()] * 3,
    )
    asset.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    return asset, step


@pytest.mark.parametrize("dtype", ["i1", "u1", "<i2", "<u2"])
@pytest.mark.parametrize("normalized", [False, True])
def test_quantised_positions_stay_quantised_within_their_range(
    dtype: str, normalized: bool
) -> None:
    asset, step = quantised(dtype, normalized)
    data = asset.glb()
    mesh = read_mesh(data)
    new = VERTICES.min() + (mesh.vertices - VERTICES.min()) * 1.1
    written = mesh.write(new, still(COUNT))
    assert values(written, 0).dtype == np.dtype(dtype)
    assert np.abs(read_mesh(written).vertices - new).max() <= 0.51 * step
    assert len(unpack(written)[2]) == len(unpack(data)[2])
    root = unpack(written)[0]
    assert root["accessors"][0]["max"] == values(written, 0).max(axis=0).tolist()


@pytest.mark.parametrize("dtype", ["i1", "u1", "<i2", "<u2"])
@pytest.mark.parametrize("normalized", [False, True])
def test_quantised_positions_become_floats_out_of_it(dtype: str, normalized: bool) -> None:
    asset, _ = quantised(dtype, normalized)
    data = asset.glb()
    mesh = read_mesh(data)
    new = VERTICES.min() + (mesh.vertices - VERTICES.min()) * 3
    written = mesh.write(new, still(COUNT))
    assert np.allclose(read_mesh(written).vertices, new, atol=1e-5)
    before, after = unpack(data)[0], unpack(written)[0]
    assert after["accessors"][0]["componentType"] == 5126
    assert "normalized" not in after["accessors"][0]
    assert after["meshes"] == before["meshes"]
    assert after["bufferViews"][:-1] == before["bufferViews"]
    assert unpack(written)[2].startswith(bytes(asset.chunk))
    assert after["buffers"][0]["byteLength"] == len(unpack(written)[2])
    assert bounds_hold(written)


def test_quantised_normals_stay_quantised() -> None:
    asset = Asset()
    stored = np.rint(NORMALS * 127).astype("i1")
    padded = np.zeros((COUNT, 4), "i1")
    padded[:, :3] = stored
    view = asset.view(padded.tobytes(), byteStride=4)
    entry = full(asset, NORMAL=asset.accessor(stored, view, normalized=True))
    asset.node(mesh=asset.mesh(entry))
    mesh = read_mesh(asset.glb())
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    expected = np.einsum("nji,nj->ni", np.linalg.inv(linear), stored / 127)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    found = values(written, entry["attributes"]["NORMAL"])
    assert found.dtype == np.int8
    assert np.abs(found / 127 - expected).max() < 0.51 / 127


SPARSE = np.array([3, 8, 9, 30], "<u2")


@pytest.mark.parametrize("base", ["zeros", "points"])
def test_sparse_elements_are_patched_where_they_are(base: str) -> None:
    asset = Asset()
    entry = full(asset)
    start = POINTS if base == "points" else COUNT
    entry["attributes"]["POSITION"] = asset.sparse(SPARSE, POINTS[SPARSE] * 2, base=start)
    asset.node(mesh=asset.mesh(entry, full(asset)))
    data = asset.glb()
    mesh = read_mesh(data)
    new = mesh.vertices.copy()
    new[SPARSE[1:3]] += 0.25
    written = mesh.write(new, still(len(new)))
    assert np.array_equal(read_mesh(written).vertices, new)
    assert unpack(written)[1] == unpack(data)[1]


def test_sparse_accessors_become_dense_when_others_move() -> None:
    asset = Asset()
    entry = full(asset)
    index = asset.sparse(SPARSE, POINTS[SPARSE] * 2, base=POINTS, min=[-9] * 3, max=[9] * 3)
    entry["attributes"]["POSITION"] = index
    asset.node(mesh=asset.mesh(entry))
    data = asset.glb()
    mesh = read_mesh(data)
    new, linear, _ = bend_some(mesh.vertices)
    written = mesh.write(new, linear)
    assert np.array_equal(read_mesh(written).vertices, new.astype("<f4"))
    assert "sparse" not in unpack(written)[0]["accessors"][index]
    assert bounds_hold(written)


def test_positions_that_are_not_stored_get_storage() -> None:
    asset = Asset()
    entry = full(asset)
    index = asset.accessor(POINTS * 0)
    asset.root["accessors"][index].pop("bufferView")
    asset.node(mesh=asset.mesh({"attributes": {"POSITION": index}, "mode": 0}, entry))
    mesh = read_mesh(asset.glb())
    new = mesh.vertices + 1.0
    written = mesh.write(new, still(len(new)))
    assert np.allclose(read_mesh(written).vertices, new, atol=1e-6)
    assert bounds_hold(written)


def instances(placed: list[dict[str, Any]]) -> Asset:
    asset = Asset()
    mesh = asset.mesh(full(asset), name="leg")
    for members in placed:
        asset.node(mesh=mesh, **members)
    return asset


PLACED: list[dict[str, Any]] = [
    {"translation": [3, 0, 0]},
    {"rotation": [0, 0.6, 0, 0.8], "translation": [0, 40, 0]},
    {"scale": [0.5, 2, 1]},
]


def placements(mesh: Any) -> list[np.ndarray]:
    return [mesh.vertices[i * COUNT : (i + 1) * COUNT] for i in range(len(mesh.vertices) // COUNT)]


def test_instances_that_agree_are_patched_once() -> None:
    """Each instance is moved by the same map as seen from its own node."""
    asset = instances(PLACED)
    data = asset.glb()
    mesh = read_mesh(data)
    moved = copy.deepcopy(asset)
    new_local, _ = bend(VERTICES)
    moved.chunk[: POINTS.nbytes] = new_local.astype("<f4").tobytes()
    target = read_mesh(moved.glb())
    written = mesh.write(target.vertices, still(3 * COUNT))
    assert len(unpack(written)[2]) == len(asset.chunk)
    assert np.allclose(values(written, 0), new_local, atol=1e-6)
    root = unpack(written)[0]
    assert [node["mesh"] for node in root["nodes"]] == [0, 0, 0]
    assert len(root["meshes"]) == 1


def test_instance_that_differs_gets_its_own_copy() -> None:
    asset = instances([*PLACED, PLACED[1]])
    data = asset.glb()
    mesh = read_mesh(data)
    new, linear = mesh.vertices.copy(), still(4 * COUNT)
    part = slice(COUNT, 2 * COUNT)
    new[part], linear[part] = bend(new[part])
    written = mesh.write(new, linear)
    again = read_mesh(written)
    assert np.allclose(again.vertices, new, atol=1e-5)
    assert np.array_equal(again.faces, mesh.faces)
    others = np.ones(4 * COUNT, bool)
    others[part] = False
    assert np.array_equal(again.vertices[others], mesh.vertices[others])
    before, after = unpack(data)[0], unpack(written)[0]
    assert [node["mesh"] for node in after["nodes"]] == [0, 1, 0, 0]
    assert after["meshes"][0] == before["meshes"][0]
    assert after["meshes"][1]["name"] == "leg"
    assert after["meshes"][1]["primitives"][0]["indices"] == 3
    # Positions, normals and tangents; faces are shared.
    assert len(after["accessors"]) == len(before["accessors"]) + 3
    assert unpack(written)[2].startswith(bytes(asset.chunk))
    assert bounds_hold(written)


def test_copies_of_quantised_positions_stay_quantised() -> None:
    asset, step = quantised("<i2", True)
    node = asset.root["nodes"][0]
    asset.node(**{**node, "translation": [9, 9, 9]})
    mesh = read_mesh(asset.glb())
    new = mesh.vertices.copy()
    new[COUNT:] += (new[COUNT:] - 9) * 0.1
    written = mesh.write(new, still(2 * COUNT))
    root = unpack(written)[0]
    assert root["accessors"][2]["componentType"] == 5122
    assert root["bufferViews"][2]["byteStride"] == 8
    again = read_mesh(written)
    assert np.array_equal(again.vertices[:COUNT], mesh.vertices[:COUNT])
    assert np.abs(again.vertices - new).max() <= 0.51 * step
    assert bounds_hold(written)


def test_groups_of_instances_share_their_copies() -> None:
    asset = instances(PLACED[:1] * 6)
    mesh = read_mesh(asset.glb())
    steps = np.array([0.0, 1, 2, 1, 0, 2])
    new = mesh.vertices + np.repeat(steps, COUNT)[:, None]
    written = mesh.write(new, still(6 * COUNT))
    assert np.allclose(read_mesh(written).vertices, new, atol=1e-6)
    root = unpack(written)[0]
    used = [node["mesh"] for node in root["nodes"]]
    assert used[0] == used[4] == 0
    assert used[1] == used[3] != used[2] == used[5]
    assert len(root["meshes"]) == 3


def test_two_meshes_of_one_accessor_can_part() -> None:
    asset = Asset()
    entry = full(asset)
    asset.node(mesh=asset.mesh(entry))
    asset.node(mesh=asset.mesh(copy.deepcopy(entry)), translation=[10, 0, 0])
    mesh = read_mesh(asset.glb())
    new = mesh.vertices.copy()
    new[COUNT:] += 0.5
    written = mesh.write(new, still(2 * COUNT))
    assert np.allclose(read_mesh(written).vertices, new, atol=1e-6)
    root = unpack(written)[0]
    assert len(root["meshes"]) == 2
    attributes = [mesh["primitives"][0]["attributes"] for mesh in root["meshes"]]
    assert attributes[0] == entry["attributes"]
    assert attributes[1]["POSITION"] != attributes[0]["POSITION"]
    assert attributes[1]["NORMAL"] == attributes[0]["NORMAL"]


def test_normals_shared_by_two_positions_can_part() -> None:
    asset = Asset()
    one, two = full(asset), full(asset)
    two["attributes"]["NORMAL"] = one["attributes"]["NORMAL"]
    asset.node(mesh=asset.mesh(one, two))
    mesh = read_mesh(asset.glb())
    new, linear = mesh.vertices.copy(), still(2 * COUNT)
    new[COUNT:], linear[COUNT:] = bend(new[COUNT:])
    written = mesh.write(new, linear)
    primitives = unpack(written)[0]["meshes"][0]["primitives"]
    kept, own = (entry["attributes"]["NORMAL"] for entry in primitives)
    assert np.array_equal(values(written, kept), DIRECTIONS)
    expected = np.einsum("nji,nj->ni", np.linalg.inv(linear[COUNT:]), NORMALS)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.allclose(values(written, own), expected, atol=1e-6)


@pytest.mark.parametrize("member", ["targets", "custom"])
def test_what_else_uses_the_positions_keeps_them(member: str) -> None:
    asset = Asset()
    entry = full(asset)
    position = entry["attributes"]["POSITION"]
    if member == "targets":
        entry["targets"] = [{"POSITION": position}]
    else:
        entry["attributes"]["_REST"] = position
    asset.node(mesh=asset.mesh(entry))
    mesh = read_mesh(asset.glb())
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    assert np.array_equal(values(written, position), POINTS)
    assert np.array_equal(read_mesh(written).vertices, new.astype("<f4"))


def test_accessors_over_the_same_bytes_part_when_they_must() -> None:
    asset = Asset()
    one, two = full(asset), full(asset)
    view = asset.root["accessors"][one["attributes"]["POSITION"]]["bufferView"]
    two["attributes"]["POSITION"] = asset.accessor(POINTS[2:], view, byteOffset=24)
    corners = np.arange(39).astype("<u2")
    two["indices"] = asset.accessor(corners)
    del two["attributes"]["NORMAL"], two["attributes"]["TANGENT"]
    asset.node(mesh=asset.mesh(one, two))
    mesh = read_mesh(asset.glb())
    assert len(mesh.vertices) == 2 * COUNT - 2
    together = mesh.vertices * 1.5
    written = mesh.write(together, still(len(together)))
    assert unpack(written)[0]["buffers"] == asset.root["buffers"]
    assert np.allclose(read_mesh(written).vertices, together)
    for part in (slice(0, COUNT), slice(COUNT, None)):
        apart = mesh.vertices.copy()
        apart[part] += 1.0
        written = mesh.write(apart, still(len(apart)))
        assert np.allclose(read_mesh(written).vertices, apart)
        assert bounds_hold(written)


def test_morph_targets_keep_their_deltas() -> None:
    asset = Asset()
    entry = full(asset)
    target = asset.accessor(POINTS * np.float32(0.1))
    entry["targets"] = [{"POSITION": target}]
    asset.node(mesh=asset.mesh(entry, weights=[0.5]))
    mesh = read_mesh(asset.glb())
    written = mesh.write(*bend(mesh.vertices))
    assert np.array_equal(values(written, target), POINTS * np.float32(0.1))


def test_bounds_that_are_missing_stay_missing() -> None:
    asset = Asset()
    entry = full(asset)
    position = asset.root["accessors"][entry["attributes"]["POSITION"]]
    del position["min"], position["max"]
    asset.node(mesh=asset.mesh(entry))
    mesh = read_mesh(asset.glb())
    written = mesh.write(mesh.vertices + SHIFT, still(COUNT))
    assert "min" not in unpack(written)[0]["accessors"][entry["attributes"]["POSITION"]]


finite = st.floats(-2, 2, width=32)


@settings(max_examples=60, deadline=None, database=None)
@given(data=st.data())
def test_any_moves_of_any_scene_come_back(data: st.DataObject) -> None:
    asset = Asset()
    shared = full(asset)
    meshes = [asset.mesh(shared), asset.mesh(copy.deepcopy(shared), full(asset))]
    count = data.draw(st.integers(1, 4))
    parent: list[int] = []
    for _ in range(count):
        scale = [data.draw(st.sampled_from([-2.0, 0.5, 1.0])) for _ in range(3)]
        members: dict[str, Any] = {"mesh": data.draw(st.sampled_from(meshes)), "scale": scale}
        if parent and data.draw(st.booleans()):
            members["children"] = [parent.pop()]
        parent.append(asset.node(root=False, **members))
    asset.root["scenes"][0]["nodes"] = parent
    mesh = read_mesh(asset.glb())
    blocks = len(mesh.vertices) // COUNT
    steps = np.array(data.draw(st.lists(finite, min_size=3 * blocks, max_size=3 * blocks)))
    new = mesh.vertices + np.repeat(steps.reshape(-1, 3), COUNT, axis=0)
    written = mesh.write(new, still(len(new)))
    again = read_mesh(written)
    assert np.allclose(again.vertices, new, atol=2e-5)
    assert np.array_equal(again.faces, mesh.faces)
    assert bounds_hold(written)


def test_bounds_are_not_written_of_normals_that_are_no_numbers() -> None:
    asset = Asset()
    broken = DIRECTIONS.copy()
    broken[5] = np.nan
    entry = full(asset, NORMAL=asset.accessor(broken, min=[-1, -1, -1], max=[1, 1, 1]))
    asset.node(mesh=asset.mesh(entry))
    mesh = read_mesh(asset.glb())
    text = unpack(mesh.write(*bend(mesh.vertices)))[1]
    assert b"NaN" not in text


def test_names_of_half_a_surrogate_pair_are_copied() -> None:
    """Two nodes part, and the copy of their mesh takes its odd name along."""
    asset = Asset()
    shared = asset.mesh(full(asset))
    asset.root["meshes"][shared]["name"] = "\ud800"
    for x in (0.0, 10.0):
        asset.node(mesh=shared, translation=[x, 0, 0])
    mesh = read_mesh(asset.glb())
    new, linear, _ = bend_some(mesh.vertices)
    again = read_mesh(mesh.write(new, linear))
    assert np.allclose(again.vertices, new, atol=1e-5)
    names = [mesh["name"] for mesh in unpack(again.data)[0]["meshes"]]
    assert names == ["\ud800", "\ud800"]
