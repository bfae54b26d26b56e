from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh
from mesh_samples import ball, bend, bend_some, obj, still

from service.errors import InvalidMesh, UnsupportedFormat
from service.mesh.formats import read_mesh
from service.mesh.meshfile import MeshFile

VERTICES, FACES, NORMALS = ball()


def read(text: str | bytes) -> MeshFile:
    return read_mesh(text if isinstance(text, bytes) else text.encode(), "x.obj")


ODD = """\
# made by hand, CRLF below
mtllib a b.mtl
v 0 0 0 1 0.5 0.25   # red
\tv  1.50  0   0
v 1 \\
  1 0 1.0
V 0 1 0
vt 0 0
vn 0 0 1
vn 0.000 0.60 0.8
g seat
usemtl wood
f 1/1/1 2/1/1 3/1/1 4/1/1
s off
f -4//2 -3//2 -2//2 # again
l 1 2
p 1
""".replace("s off\n", "s off\r\n")


def test_every_way_of_writing_is_read() -> None:
    mesh = read(ODD)
    assert mesh.vertices.tolist() == [[0, 0, 0], [1.5, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]


def test_only_numbers_that_change_are_rewritten() -> None:
    mesh = read(ODD)
    new = mesh.vertices.copy()
    new[0] += [0, 0.125, 0]
    new[2, 0] = 1.25
    written = mesh.write(new, still(4)).decode()
    expected = ODD.replace("v 0 0 0 1", "v 0 0.125 0 1").replace("v 1 \\", "v 1.25 \\")
    assert written == expected


def test_normals_follow_the_mean_of_their_vertices() -> None:
    mesh = read(ODD)
    linear = still(4)
    tilt = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    linear[:3] = tilt
    lines = mesh.write(mesh.vertices, linear).decode().splitlines()
    # Three vertices tip the first normal to -y, the fourth holds it at +z.
    mean = np.array([0, -3, 1]) / np.sqrt(10)
    first, second = (line.split()[1:] for line in lines if line.startswith("vn"))
    assert np.allclose(np.array(first, float), mean, atol=1e-9)
    assert np.allclose(np.array(second, float), [0, -0.8, 0.6], atol=1e-9)
    assert [line for line in lines if not line.startswith("vn")] == [
        line for line in ODD.splitlines() if not line.startswith("vn")
    ]


def test_normals_of_vertices_that_stay_keep_their_text() -> None:
    mesh = read(obj())
    new, linear, moved = bend_some(mesh.vertices)
    before = [line for line in obj().split(b"\n") if line.startswith(b"vn")]
    written = mesh.write(new, linear)
    after = [line for line in written.split(b"\n") if line.startswith(b"vn")]
    # The quad in the sample gives normals 1 to 4 to vertices 1 to 4, as the triangles do.
    assert [a for a, turned in zip(after, moved, strict=True) if not turned] == [
        b for b, turned in zip(before, moved, strict=True) if not turned
    ]
    exact = np.einsum("nji,nj->ni", np.linalg.inv(linear), NORMALS)
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    found = np.array([line.split()[1:] for line in after], float)
    assert np.allclose(found[moved], exact[moved], atol=1e-7)


def test_everything_but_positions_and_normals_is_kept() -> None:
    mesh = read(obj())
    written = mesh.write(*bend(mesh.vertices))
    for before, after in zip(obj().split(b"\n"), written.split(b"\n"), strict=True):
        if before.startswith(b"v "):
            assert after.split()[4:] == before.split()[4:]
        elif not before.startswith(b"vn"):
            assert after == before


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_line_ends_of_other_systems(end: str) -> None:
    data = obj().replace(b"\n", end.encode())
    mesh = read(data)
    assert np.array_equal(mesh.vertices, read(obj()).vertices)
    written = mesh.write(*bend(mesh.vertices))
    assert written.count(b"\r") == data.count(b"\r")
    assert written.replace(end.encode(), b"\n") == read(obj()).write(*bend(mesh.vertices))


def test_names_in_any_encoding_and_no_last_newline() -> None:
    text = "o стул\nv 0 0 0 1.0\nv 1e0 0 0 1.0\nv 0 .1e+1 0 1.0\ng Stühle\nf 1 2 3"
    for encoding in ("utf-8", "cp1251", "latin-1", "utf-16-le"):
        name = text.encode("utf-8").partition(b"\n")[0] + "ü".encode(encoding, "replace")
        data = name + b"\n" + text.partition("\n")[2].replace("ü", "u").encode()
        mesh = read(data)
        written = mesh.write(mesh.vertices * 2, still(3))
        assert written == data.replace(b"1e0", b"2").replace(b".1e+1", b"2")


@pytest.mark.parametrize("line", ["surf 0 1 0 1 1 2 3 4", "curv 0 1 1 2 3", "\tcurv2 1 2 3"])
def test_free_form_surfaces_are_refused(line: str) -> None:
    text = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvp 0.1 0.2\n{line}\nf 1 2 3\n"
    with pytest.raises(UnsupportedFormat) as caught:
        read(text)
    assert caught.value.code == "free_form"
    assert line.split()[0] in caught.value.detail
    assert len(read(text.replace(line, f"# {line}\no surf")).faces) == 1


def test_trimesh_reads_the_same() -> None:
    mesh = read(obj())
    written = mesh.write(*bend(mesh.vertices))
    oracle = trimesh.load(io.BytesIO(written), file_type="obj", process=False, maintain_order=True)
    ours = trimesh.Trimesh(read(written).vertices, mesh.faces, process=False)
    assert np.isclose(oracle.area, ours.area)
    assert np.allclose(oracle.bounds, ours.bounds)


def test_extreme_values_come_back_to_nine_digits() -> None:
    mesh = read("v 1e-30 0 0\nv 1e30 0 123456789.123\nv 0 1e29 0\nf 1 2 3\n")
    new = mesh.vertices * 1.1
    again = read(mesh.write(new, still(3)))
    assert np.allclose(again.vertices, new, rtol=1e-8, atol=0)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "empty_mesh"),
        ("f 1 2 3\n", "empty_mesh"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "empty_mesh"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "face_out_of_range"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 9\n", "face_out_of_range"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf /1 2\n", "face_out_of_range"),
        ("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "non_finite_vertices"),
        ("v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "malformed_obj"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//2\n", "malformed_obj"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3/4/x\n", "malformed_obj"),
    ],
)
def test_unusable_files(text: str, code: str) -> None:
    with pytest.raises(InvalidMesh) as caught:
        read(text)
    assert caught.value.code == code
