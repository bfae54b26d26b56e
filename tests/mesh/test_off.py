from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh
from mesh_samples import ball, bend, off, still

from service.errors import InvalidMesh, UnsupportedFormat
from service.mesh.formats import read_mesh
from service.mesh.meshfile import MeshFile

VERTICES, FACES, NORMALS = ball()
SQUARE = "0 0 0\n1 0 0 # corner\n\n1 1 0\n  0 1 0\n4 0 1 2 3\n3 0 1 2  255 0 0\n"


def read(data: bytes | str) -> MeshFile:
    return read_mesh(data if isinstance(data, bytes) else data.encode(), "x.off")


@pytest.mark.parametrize(
    "header",
    [
        "OFF\n4 2 0\n",
        "OFF 4 2 0\n",
        "OFF4 2 0\n",
        "# made\n\nOFF # kind\n# counts\n4 2 0 # here\n",
        "4 2 0\n",
        "OFF\r\n4 2\r\n",
        "COFF\n4 2 0\n",
        "STOFF\n4 2 0\n",
    ],
)
def test_headers_of_every_kind(header: str) -> None:
    mesh = read(header + SQUARE)
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]


def test_only_coordinates_that_change_are_rewritten() -> None:
    text = "COFF # x\n4 2 0\n" + SQUARE.replace("1 1 0", "1.0\t1.0 0 0.5 0.5 0.5 1")
    mesh = read(text)
    new = mesh.vertices.copy()
    new[2, 1] = 0.75
    expected = text.replace("1.0\t1.0 0", "1.0\t0.75 0")
    assert mesh.write(new, still(4)).decode() == expected


def test_normals_turn_with_their_vertices() -> None:
    mesh = read(off("NOFF"))
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    rows = np.array([line.split() for line in written.decode().splitlines()[4:46]], float)
    normals = np.einsum("nji,nj->ni", np.linalg.inv(linear), NORMALS)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.allclose(rows, np.concatenate([new, normals], axis=1), atol=1e-7)
    assert written.splitlines()[46:] == off("NOFF").splitlines()[46:]
    assert written.splitlines()[:4] == off("NOFF").splitlines()[:4]


@pytest.mark.parametrize("keyword", ["OFF", "COFF"])
def test_numbers_behind_the_coordinates_are_no_normals(keyword: str) -> None:
    mesh = read(off(keyword))
    written = mesh.write(mesh.vertices, 3 * still(len(VERTICES)) + 0.1)
    assert written == mesh.data


def test_trimesh_reads_the_same() -> None:
    mesh = read(off())
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    oracle = trimesh.load(io.BytesIO(written), file_type="off", process=False)
    assert np.allclose(oracle.vertices, new, atol=1e-6)
    assert np.array_equal(oracle.faces, FACES)


@pytest.mark.parametrize("keyword", ["4OFF", "nOFF", "OFF BINARY", "STC4OFF"])
def test_other_variants_are_refused(keyword: str) -> None:
    with pytest.raises(UnsupportedFormat, match="off_variant"):
        read(f"{keyword}\n4 2 0\n{SQUARE}")


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "malformed_off"),
        ("OFF", "malformed_off"),
        ("OFF\nx 2 0\n" + SQUARE, "malformed_off"),
        ("OFF\n4\n" + SQUARE, "malformed_off"),
        ("OFF\n-4 2 0\n" + SQUARE, "malformed_off"),
        ("OFF\n4 3 0\n" + SQUARE, "malformed_off"),
        ("OFF\n999999999999 999999999999 0\n" + SQUARE, "malformed_off"),
        ("OFF\n4 2 0\n" + SQUARE.replace("1 1 0", "1 1"), "malformed_off"),
        ("NOFF\n4 2 0\n" + SQUARE, "malformed_off"),
        ("OFF\n4 2 0\n" + SQUARE.replace("1 1 0", "1 1 zero"), "malformed_off"),
        ("OFF\n4 2 0\n" + SQUARE.replace("4 0 1 2 3", "5 0 1 2 3"), "malformed_off"),
        ("OFF\n4 2 0\n" + SQUARE.replace("4 0 1 2 3", "-1 0 1 2 3"), "malformed_off"),
        ("OFF\n4 2 0\n" + SQUARE.replace("4 0 1 2 3", "4 0 1 2 4"), "face_out_of_range"),
        ("OFF\n4 2 0\n" + SQUARE.replace("4 0 1 2 3", "4 0 1 2 -1"), "face_out_of_range"),
        ("OFF\n4 0 0\n" + SQUARE, "empty_mesh"),
        ("OFF\n0 0 0\n", "empty_mesh"),
        ("OFF\n4 2 0\n" + SQUARE.replace("1 1 0", "1 inf 0"), "non_finite_vertices"),
    ],
)
def test_unusable_files(text: str, code: str) -> None:
    with pytest.raises(InvalidMesh) as caught:
        read(text)
    assert caught.value.code == code
