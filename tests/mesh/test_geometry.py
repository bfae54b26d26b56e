from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
import trimesh
from gltf_assets import Asset, unpack
from mesh_samples import ball

from service.errors import InvalidMesh, ShapeError, TooLarge, UnsupportedFormat
from service.mesh import limits
from service.mesh.document import Document
from service.mesh.formats import read_mesh
from service.mesh.geometry import read_geometry, triangles

VERTICES, FACES, NORMALS = ball()
POINTS = VERTICES.astype("<f4")
CORNERS = FACES.reshape(-1).astype("<u2")


def turned(seed: int) -> list[float]:
    """A rotation as a glTF quaternion."""
    w, x, y, z = trimesh.transformations.random_quaternion(
        np.random.default_rng(seed).uniform(size=3)
    )
    return [float(x), float(y), float(z), float(w)]


def primitive(asset: Asset, **members: Any) -> dict[str, Any]:
    attributes = {"POSITION": asset.accessor(POINTS)}
    return {"attributes": attributes, "indices": asset.accessor(CORNERS), **members}


def test_a_scene_is_what_trimesh_shows() -> None:
    asset = Asset()
    mesh = asset.mesh(primitive(asset), primitive(asset))
    other = asset.mesh(primitive(asset))
    leaf = asset.node(root=False, mesh=other, scale=[1, 2, 3], translation=[5, 0, 0])
    asset.node(mesh=mesh, rotation=turned(1), children=[leaf], translation=[0, 1, 2])
    asset.node(mesh=mesh, matrix=[0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 7, 8, 9, 1])
    data = asset.glb()
    found = read_mesh(data)
    oracle = trimesh.load(io.BytesIO(data), file_type="glb", process=False, force="mesh")
    assert len(found.vertices) == 5 * 42
    assert len(found.faces) == 5 * 80
    ours = trimesh.Trimesh(found.vertices, found.faces, process=False)
    assert np.isclose(ours.area, oracle.area)
    assert np.isclose(ours.volume, oracle.volume)
    assert np.allclose(ours.bounds, oracle.bounds)
    assert np.allclose(ours.moment_inertia, oracle.moment_inertia)


def test_helpers_move_but_are_not_seen() -> None:
    asset = Asset()
    mesh = asset.mesh(primitive(asset))
    asset.node(mesh=mesh, name="chair_collider", scale=[2, 2, 2])
    asset.node(mesh=mesh, name="chair")
    found = read_mesh(asset.glb())
    assert len(found.faces) == 160
    assert np.array_equal(found.visible, found.faces[80:])


@pytest.mark.parametrize("name", ["chair", "chair_collider"])
def test_what_is_alone_is_seen(name: str) -> None:
    asset = Asset()
    asset.node(mesh=asset.mesh(primitive(asset)), name=name)
    lines = {**primitive(asset), "mode": 1}
    asset.node(mesh=asset.mesh(lines), name="wire")
    found = read_mesh(asset.glb())
    assert np.array_equal(found.visible, found.faces)
    assert len(found.visible) == 80


def test_vertices_come_by_node_then_primitive() -> None:
    asset = Asset()
    first, second = primitive(asset), primitive(asset)
    first["attributes"]["POSITION"] = asset.accessor(POINTS + np.float32(8))
    mesh = asset.mesh(first, second)
    asset.node(mesh=mesh)
    asset.node(mesh=mesh, translation=[100, 0, 0])
    found = read_mesh(asset.glb()).vertices.reshape(4, 42, 3)
    shift = np.array([100, 0, 0])
    for part, expected in zip(
        found, [POINTS + np.float32(8), POINTS, POINTS + np.float32(8) + shift, POINTS + shift],
        strict=True,
    ):  # fmt: skip
        assert np.array_equal(part, expected)


def test_primitives_that_share_positions_share_vertices() -> None:
    asset = Asset()
    position = asset.accessor(POINTS)
    halves = [
        {"attributes": {"POSITION": position}, "indices": asset.accessor(half)}
        for half in (CORNERS[:120], CORNERS[120:])
    ]
    asset.node(mesh=asset.mesh(*halves))
    found = read_mesh(asset.glb())
    assert np.array_equal(found.vertices, VERTICES)
    assert np.array_equal(found.faces, FACES)


@pytest.mark.parametrize("dtype", ["u1", "<u2", "<u4"])
def test_indices_of_every_size(dtype: str) -> None:
    asset = Asset()
    asset.node(mesh=asset.mesh(primitive(asset, indices=asset.accessor(CORNERS.astype(dtype)))))
    assert np.array_equal(read_mesh(asset.glb()).faces, FACES)


def test_primitives_without_indices() -> None:
    asset = Asset()
    soup = asset.accessor(POINTS[FACES].reshape(-1, 3))
    asset.node(mesh=asset.mesh({"attributes": {"POSITION": soup}}))
    found = read_mesh(asset.glb())
    assert np.array_equal(found.faces, np.arange(240).reshape(80, 3))
    assert np.array_equal(found.vertices[found.faces], VERTICES[FACES])


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (0, []),
        (1, []),
        (2, []),
        (3, []),
        (4, [[0, 1, 2]]),
        (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
        (7, []),
    ],
)
def test_modes(mode: int, expected: list[list[int]]) -> None:
    faces = triangles(np.arange(5), mode)
    assert faces.shape == (len(expected), 3)
    assert faces.tolist() == expected
    assert triangles(np.arange(2), mode).shape == (0, 3)


def test_points_and_lines_ride_along() -> None:
    asset = Asset()
    line = {"attributes": {"POSITION": asset.accessor(POINTS[:5])}, "mode": 3}
    asset.node(mesh=asset.mesh(line, primitive(asset)))
    found = read_mesh(asset.glb())
    assert len(found.vertices) == 47
    assert np.array_equal(found.faces, FACES + 5)


def test_mirrored_nodes_turn_their_triangles_round() -> None:
    asset = Asset()
    asset.node(mesh=asset.mesh(primitive(asset)), scale=[-1, 1, 1])
    found = read_mesh(asset.glb())
    assert trimesh.Trimesh(found.vertices, found.faces, process=False).volume > 0


def test_quantised_positions() -> None:
    asset = Asset()
    steps = np.rint(VERTICES * 1000).astype("<i2")
    entry = {"attributes": {"POSITION": asset.accessor(steps)}, "indices": asset.accessor(CORNERS)}
    asset.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    asset.node(mesh=asset.mesh(entry), scale=[1e-3, 1e-3, 1e-3])
    assert np.allclose(read_mesh(asset.glb()).vertices, VERTICES, atol=5.1e-4)


def test_primitives_without_positions_are_passed_over() -> None:
    asset = Asset()
    asset.node(mesh=asset.mesh({"attributes": {}}, primitive(asset)))
    assert np.array_equal(read_mesh(asset.glb()).faces, FACES)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"indices": 99}, "malformed_glb"),
        ({"indices": 0}, "malformed_glb"),
        ({"mode": "4"}, "malformed_glb"),
        ({"attributes": {"POSITION": 1}}, "malformed_glb"),
        ({"attributes": {"POSITION": 0, "NORMAL": 2}}, "malformed_glb"),
        ({"attributes": {"POSITION": 0, "TANGENT": 0}}, "malformed_glb"),
        ({"attributes": []}, "malformed_glb"),
        ({"extensions": {"KHR_draco_mesh_compression": {}}}, "compressed_geometry"),
    ],
)
def test_broken_primitives_are_told(change: dict[str, Any], code: str) -> None:
    asset = Asset()
    entry = primitive(asset)
    asset.accessor(POINTS[:3])
    asset.node(mesh=asset.mesh({**entry, **change}))
    with pytest.raises((InvalidMesh, UnsupportedFormat)) as caught:
        read_mesh(asset.glb())
    assert caught.value.code == code


def test_primitives_must_be_objects() -> None:
    asset = Asset()
    asset.node(mesh=asset.mesh(primitive(asset), 5))
    with pytest.raises(InvalidMesh, match="malformed_glb"):
        read_mesh(asset.glb())


def test_indices_must_stay_within_their_own_positions() -> None:
    asset = Asset()
    broken = CORNERS.copy()
    broken[7] = 42
    asset.node(mesh=asset.mesh(primitive(asset, indices=asset.accessor(broken)), primitive(asset)))
    with pytest.raises(InvalidMesh, match="vertex 42") as caught:
        read_mesh(asset.glb())
    assert caught.value.code == "face_out_of_range"


def test_few_bytes_cannot_unfold_into_a_huge_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    asset = Asset()
    mesh = asset.mesh(primitive(asset))
    for _ in range(10):
        asset.node(mesh=mesh)
    data = asset.glb()
    for name, most in (("VERTICES", 419), ("FACES", 799), ("PARTS", 8)):
        with monkeypatch.context() as patch:
            patch.setattr(limits, name, most)
            with pytest.raises(TooLarge):
                read_mesh(data)
    assert len(read_mesh(data).faces) == 800


def test_a_scene_that_shows_nothing_is_empty() -> None:
    asset = Asset()
    asset.mesh(primitive(asset))
    asset.node()
    with pytest.raises(ShapeError, match="empty_mesh"):
        read_mesh(asset.glb())


def unfolding(primitives: int, nodes: int, entry: dict[str, object], **members: object) -> bytes:
    """Primitives of three positions, each with an accessor of its own without any bytes."""
    asset = Asset()
    position = asset.accessor(np.eye(3, dtype="<f4"))
    listed = []
    for _ in range(primitives):
        attributes = {"POSITION": position}
        own = asset._add("accessors", {"componentType": 5125, "count": 3, **entry})
        if entry["type"] == "VEC3":
            attributes["NORMAL"] = own
        listed.append({"attributes": attributes, **members})
        if entry["type"] == "SCALAR":
            listed[-1]["indices"] = own
    mesh = asset.mesh(*listed)
    for _ in range(nodes):
        asset.node(mesh=mesh)
    return asset.glb()


@pytest.mark.parametrize(
    ("name", "most", "data"),
    [
        # Points add neither vertices nor faces.
        ("PARTS", 23, unfolding(6, 4, {"type": "VEC2"}, mode=0)),
        # Strips of one vertex over and over add no faces.
        ("FACES", 9, unfolding(10, 1, {"type": "SCALAR"}, mode=5)),
        ("VERTICES", 7, unfolding(10, 1, {"type": "VEC3", "componentType": 5126})),
    ],
)
def test_what_adds_nothing_is_counted_too(
    monkeypatch: pytest.MonkeyPatch, name: str, most: int, data: bytes
) -> None:
    monkeypatch.setattr(limits, name, most)
    with pytest.raises(TooLarge, match=f"too_many_{name.lower()}"):
        read_mesh(data)
    monkeypatch.setattr(limits, name, most + 1)
    attempt = Document("glb", unpack(data)[1].rstrip())
    read_geometry(attempt, [memoryview(unpack(data)[2])])
