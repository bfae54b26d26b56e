from __future__ import annotations

import io
import struct

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mesh_samples import ball, bend, bend_some, still, stl

from service.errors import InvalidMesh
from service.mesh.formats import read_mesh
from service.mesh.meshfile import MeshFile
from service.mesh.stl import is_ascii, is_binary, merged

VERTICES, FACES, _ = ball()
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read(data: bytes) -> MeshFile:
    return read_mesh(data, "x.stl")


def facets(data: bytes) -> np.ndarray:
    return np.frombuffer(data, FACET, len(FACES), 84)


@pytest.mark.parametrize("text", [False, True])
def test_corners_at_one_place_are_one_vertex(text: bool) -> None:
    mesh = read(stl(text))
    assert len(mesh.vertices) == len(VERTICES)
    assert np.allclose(mesh.vertices[mesh.faces], VERTICES[FACES])
    # Vertices come in the order in which the file first names them.
    assert np.array_equal(np.unique(mesh.faces, return_index=True)[1],
                          np.sort(np.unique(mesh.faces, return_index=True)[1]))  # fmt: skip


def test_facets_with_a_moved_corner_change_alone() -> None:
    data = stl()
    mesh = read(data)
    new, linear, moved = bend_some(mesh.vertices)
    written = mesh.write(new, linear)
    assert written[:84] == data[:84]
    assert len(written) == len(data)
    before, after = facets(data), facets(written)
    assert np.array_equal(after["attribute"], before["attribute"])
    assert np.array_equal(after["corners"], new.astype("<f4")[mesh.faces])
    still_there = ~moved[mesh.faces].any(axis=1)
    assert still_there.any()
    assert (before[still_there] == after[still_there]).all()
    turned = trimesh.Trimesh(new, mesh.faces, process=False).face_normals
    assert np.allclose(after["normal"][~still_there], turned[~still_there], atol=1e-5)


def test_normals_of_zero_stay_zero() -> None:
    content = bytearray(stl())
    np.frombuffer(content, FACET, len(FACES), 84)["normal"][:] = 0
    mesh = read(bytes(content))
    assert not facets(mesh.write(*bend(mesh.vertices)))["normal"].any()


def test_turning_alone_changes_nothing() -> None:
    mesh = read(stl())
    assert mesh.write(mesh.vertices, 2 * still(len(mesh.vertices))) is mesh.data


def test_text_around_the_numbers_stays() -> None:
    data = stl(text=True).replace(b"facet normal", b"FACET\tNormal").replace(b"\n", b"\r\n")
    mesh = read(data)
    new, linear, moved = bend_some(mesh.vertices)
    before, after = data.split(b"\n"), mesh.write(new, linear).split(b"\n")
    assert len(after) == len(before)
    corner = iter(mesh.faces.reshape(-1))
    for one, two in zip(before, after, strict=True):
        if one.split()[:1] == [b"vertex"]:
            vertex = next(corner)
            assert (one == two) is not moved[vertex]
            assert np.allclose(np.array(two.split()[1:], float), new[vertex], atol=1e-8)
        elif b"Normal" not in one:
            assert one == two


@pytest.mark.parametrize("text", [False, True])
def test_trimesh_reads_the_same(text: bool) -> None:
    mesh = read(stl(text))
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    kind = "stl_ascii" if text else "stl"
    oracle = trimesh.load(io.BytesIO(written), file_type=kind, process=False)
    assert np.allclose(oracle.triangles, new[mesh.faces], atol=1e-6)


def test_bytes_behind_the_last_facet_stay() -> None:
    data = stl() + b"colour table"
    mesh = read(data)
    assert mesh.write(*bend(mesh.vertices)).endswith(b"colour table")


def test_the_length_tells_binary_from_text() -> None:
    data = stl()
    assert data.startswith(b"solid")
    assert (is_binary(data), is_ascii(stl(text=True))) == (True, True)
    assert not is_binary(data + b"x")
    assert not is_ascii(b"solid\0 and more")
    assert not is_binary(b"short")


@settings(deadline=None, database=None)
@given(arrays(np.float32, (30, 3), elements=st.sampled_from([0.0, -0.0, 1.0, 2.5, 1e-30])))
def test_merging_is_by_value_in_order(corners: np.ndarray) -> None:
    first, vertex = merged(corners)
    seen: list[tuple[float, ...]] = []
    expected = []
    for corner in corners.tolist():
        if tuple(corner) not in seen:
            seen.append(tuple(corner))
        expected.append(seen.index(tuple(corner)))
    assert vertex.tolist() == expected
    assert corners[first].tolist() == [list(corner) for corner in seen]


def test_keys_that_collide_do_not_merge(monkeypatch: pytest.MonkeyPatch) -> None:
    """With every key the same, the places themselves must be compared."""
    corners = np.array([[0, 0, 1], [0, 1, 0], [0, 0, 1], [5, 0, 0]], np.float32)
    expected = merged(corners)
    monkeypatch.setattr("service.mesh.stl.KEY", np.uint64(0))
    found = merged(corners)
    assert found[0].tolist() == expected[0].tolist() == [0, 1, 3]
    assert found[1].tolist() == expected[1].tolist() == [0, 1, 0, 2]


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", "malformed_stl"),
        (stl()[:-1], "malformed_stl"),
        (b"\0" * 84, "empty_mesh"),
        (b"solid\nendsolid\n", "empty_mesh"),
        (stl(text=True).replace(b"      vertex", b"      wertex", 1), "malformed_stl"),
        (stl(text=True).replace(b"endfacet", b"", 1), "malformed_stl"),
        (stl(text=True).replace(b"vertex ", b"vertex x", 1), "malformed_stl"),
        (stl()[:96] + struct.pack("<f", np.nan) + stl()[100:], "non_finite_vertices"),
    ],
)
def test_unusable_files(data: bytes, code: str) -> None:
    with pytest.raises(InvalidMesh) as caught:
        read(data)
    assert caught.value.code == code
