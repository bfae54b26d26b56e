from __future__ import annotations

import io
import struct

import numpy as np
import pytest
import trimesh
from mesh_samples import ball, bend, bend_some, ply, still

from service.errors import InvalidMesh, TooLarge, UnsupportedFormat
from service.mesh.formats import read_mesh
from service.mesh.meshfile import MeshFile
from service.mesh.plyheader import TYPES

VERTICES, FACES, NORMALS = ball()
COUNT = len(VERTICES)


def read(data: bytes | str) -> MeshFile:
    return read_mesh(data if isinstance(data, bytes) else data.encode(), "x.ply")


@pytest.mark.parametrize("coordinate", ["float", "double"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_changes_coordinates_and_normals_alone(order: str, coordinate: str) -> None:
    data = ply(order, coordinate)
    mesh = read(data)
    assert np.array_equal(mesh.vertices, VERTICES)
    assert np.array_equal(mesh.faces, FACES)
    new, linear, moved = bend_some(VERTICES)
    written = mesh.write(new, linear)
    kind, size = ("f", 4) if coordinate == "float" else ("d", 8)
    row = 6 * size + 5
    body = data.index(b"end_header\n") + 11
    normals = np.einsum("nji,nj->ni", np.linalg.inv(linear), NORMALS)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert written[:body] == data[:body]
    assert written[body + COUNT * row :] == data[body + COUNT * row :]
    for vertex in range(COUNT):
        before, after = (d[body + vertex * row :][:row] for d in (data, written))
        assert after[6 * size :] == before[6 * size :]
        if moved[vertex]:
            found = struct.unpack(order + 6 * kind, after[: 6 * size])
            assert np.allclose(found, [*new[vertex], *normals[vertex]], rtol=1e-6, atol=1e-7)
        else:
            assert after == before


def test_ascii_changes_tokens_alone() -> None:
    data = ply("").replace(b" 255 -7", b"\t\t255  -7 ")
    mesh = read(data)
    assert np.array_equal(mesh.faces, FACES)
    new = mesh.vertices.copy()
    new[5] = [0.5, -1.25, 1e-9]
    written = mesh.write(new, still(COUNT)).split(b"\n")
    before = data.split(b"\n")
    header = before.index(b"end_header") + 1
    different = [i for i, (a, b) in enumerate(zip(before, written, strict=True)) if a != b]
    assert different == [header + 5]
    assert written[header + 5].split()[:3] == [b"0.5", b"-1.25", b"1e-09"]
    assert written[header + 5].split()[3:] == before[header + 5].split()[3:]


@pytest.mark.parametrize("end", [b"\r\n", b"\r"])
def test_ascii_line_ends_of_other_systems(end: bytes) -> None:
    data = ply("").replace(b"\n", end)
    mesh = read(data)
    written = mesh.write(*bend(mesh.vertices))
    assert written.replace(end, b"\n") == read(ply("")).write(*bend(mesh.vertices))


@pytest.mark.parametrize("order", ["", "<", ">"])
def test_trimesh_reads_the_same(order: str) -> None:
    mesh = read(ply(order))
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    oracle = trimesh.load(io.BytesIO(written), file_type="ply", process=False)
    assert np.allclose(oracle.vertices, new, atol=1e-6)
    assert np.array_equal(oracle.faces, mesh.faces)


POLYGONS = """ply
format ascii 1.0
element face 3
property uchar red
property list uchar uint vertex_index
property list uchar float texcoord
element vertex 5
property float z
property float y
property float x
{extra}end_header
1 3 0 1 2 0
2 5 0 1 2 3 4 2 0.5 0.5
3 2 0 1 1 0.25
0 0 0
0 0 1
0 1 1
0 1.5 0.5
0 1 0
"""


def test_polygons_lists_and_orders_of_every_kind() -> None:
    mesh = read(POLYGONS.format(extra=""))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0.5, 1.5, 0], [0, 1, 0]]
    new = mesh.vertices.copy()
    new[3] = [7, 8, 9]
    expected = POLYGONS.format(extra="").replace("0 1.5 0.5\n", "9 8 7\n")
    assert mesh.write(new, still(5)).decode() == expected


def test_triangle_strips() -> None:
    header = POLYGONS.format(extra="").partition("end_header")[0]
    head = header.partition("element face")[0] + "element vertex" + header.partition(
        "element vertex")[2]  # fmt: skip
    vertices = "0 0 0\n0 0 1\n0 1 1\n0 1.5 0.5\n0 1 0\n"
    strips = "element tristrips 2\nproperty list int int vertex_indices\nend_header\n"
    mesh = read(head + strips + vertices + "7 0 1 2 3 -1 0 1\n3 2 3 4\n")
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2], [2, 3, 4]]


def test_binary_with_mixed_polygons() -> None:
    head = (
        "ply\nformat binary_little_endian 1.0\nelement face 3\n"
        "property list uchar int vertex_indices\nelement vertex 4\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n"
    )
    body = struct.pack("<B3iB4iB3i", 3, 0, 1, 2, 4, 0, 1, 2, 3, 3, 0, 2, 3)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4")
    data = head.encode() + body + square.tobytes()
    mesh = read(data)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 2, 3]]
    written = mesh.write(mesh.vertices + np.array([0, 0, 2]), still(4))
    assert written == head.encode() + body + (square + np.float32([0, 0, 2])).tobytes()


def integers(order: str, kind: str) -> bytes:
    """A tetrahedron whose coordinates are of an integer `kind`."""
    names = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}
    head = f"ply\nformat {names[order]} 1.0\nelement vertex 4\n"
    head += "".join(f"property {kind} {axis}\n" for axis in "xyz")
    head += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    corners = np.array([[0, 0, 0], [100, 0, 0], [0, 100, 0], [0, 0, 100]])
    if not order:
        return (head + "".join("{} {} {}\n".format(*row) for row in corners)
                + "3 0 1 2\n3 0 2 3\n").encode()  # fmt: skip
    rows = corners.astype(np.dtype(order + TYPES[kind])).tobytes()
    faces = b"".join(struct.pack(order + "B3i", 3, *face) for face in ((0, 1, 2), (0, 2, 3)))
    return head.encode() + rows + faces


@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize("kind", ["char", "ushort", "int"])
def test_integer_coordinates_take_integers_alone(order: str, kind: str) -> None:
    data = integers(order, kind)
    mesh = read(data)
    assert mesh.vertices[1].tolist() == [100, 0, 0]
    doubled = mesh.vertices.copy()
    doubled[2, 1] = 127
    written = mesh.write(doubled, still(4))
    assert np.array_equal(read(written).vertices, doubled)
    assert len(written) == len(data)
    limits = {"char": (-129, 128), "ushort": (-1, 65536), "int": (-(10**9), 10**9)}[kind]
    for value in (50.5, *limits):
        doubled[2, 1] = value
        with pytest.raises(UnsupportedFormat, match=r"integer_coordinates.*'y'"):
            mesh.write(doubled, still(4))


@pytest.mark.parametrize("name", ["vertex", "face", "edge"])
def test_counts_that_no_mesh_has_are_refused_before_anything_is_read(name: str) -> None:
    head = f"ply\nformat binary_little_endian 1.0\nelement {name} 4000001\n"
    head += "property list uchar int numbers\nend_header\n"
    with pytest.raises(TooLarge, match="too_many"):
        read(head.encode() + bytes(4_000_001))


FACE = "3 {} {} {}\n".format(*FACES[0]).encode()
NUMBER = b"%.9g " % VERTICES[0, 0]


@pytest.mark.parametrize(
    ("before", "after", "code"),
    [
        (b"float x", b"float w", "malformed_ply"),
        (b"element vertex", b"element vertices", "malformed_ply"),
        (b"element face", b"element faces", "empty_mesh"),
        (b"vertex_indices", b"something", "empty_mesh"),
        (FACE, b"3 0 11 42\n", "face_out_of_range"),
        (FACE, b"3 0 11 -1\n", "face_out_of_range"),
        (FACE, b"3 0 11 x\n", "malformed_ply"),
        (FACE, b"3 0 11\n", "malformed_ply"),
        (FACE, b"9 0 11 5\n", "malformed_ply"),
        (NUMBER, b"nan ", "non_finite_vertices"),
        (NUMBER, b"1e999 ", "non_finite_vertices"),
    ],
)
def test_unusable_files(before: bytes, after: bytes, code: str) -> None:
    data = ply("")
    assert before in data
    with pytest.raises(InvalidMesh) as caught:
        read(data.replace(before, after, 1))
    assert caught.value.code == code
