from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import mesh_samples
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from mesh_samples import SAMPLES, bend, bend_some, examples, still
from zip_samples import zipped

from service.errors import InvalidMesh, ShapeError, UnsupportedFormat
from service.mesh.formats import READERS, detect, read_mesh
from service.mesh.meshfile import MeshFile

Result = TypeVar("Result")

# Real chairs, where a checkout has them beside it.
ORIGINALS = Path(__file__).resolve().parents[3] / "shared" / "data" / "chairs" / "originals"
REAL = [
    path
    for suffix in ("*.glb", "*.obj")
    for path in sorted(ORIGINALS.rglob(suffix))
    if path.stat().st_size < 400_000
]

fuzz = examples(200)


def attempt(call: Callable[..., Result], *arguments: Any) -> Result | ShapeError:
    """What a call gives or, if it is a ShapeError, raises."""
    try:
        return call(*arguments)
    except ShapeError as error:
        return error


def of(sample: str) -> MeshFile:
    return read_mesh(SAMPLES[sample], "ball." + sample.partition("-")[0])


@pytest.mark.parametrize("format", READERS)
def test_reader_knows_its_own_name(format: str) -> None:
    mesh = of(format)
    assert mesh.format == format
    assert mesh.media_type.partition("/")[0] in ("model", "application")


@pytest.mark.parametrize("sample", SAMPLES)
def test_first_bytes_tell_the_format(sample: str) -> None:
    assert detect(SAMPLES[sample], None, None) == sample.partition("-")[0]


@pytest.mark.parametrize(
    ("name", "content_type", "format"),
    [
        ("Chair.PLY", "model/obj", "ply"),
        ("a.b/chair.glb", None, "glb"),
        ("chair.upload", "model/gltf-binary; charset=x", "glb"),
        ("chair", "MODEL/STL", "stl"),
        ("chair", "application/octet-stream", "obj"),
        (None, None, "obj"),
        ("chair.Zip", None, "zip"),
        ("chair", "application/x-zip-compressed", "zip"),
    ],
)
def test_name_then_type_then_bytes(name: str | None, content_type: str | None, format: str) -> None:
    assert detect(SAMPLES["obj"], name, content_type) == format


@pytest.mark.parametrize("data", [b"", b"hello world\n", b"\0" * 200])
def test_unknown_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(UnsupportedFormat) as caught:
        read_mesh(data, "thing.bin", "application/octet-stream")
    assert caught.value.code == "unsupported_format"
    assert "'thing.bin'" in caught.value.detail
    assert ".glb" in caught.value.suggestion or "glb" in caught.value.suggestion


@pytest.mark.parametrize("data", [zipped({"a.obj": b"v 1 2 3"}), zipped({})])
def test_archives_are_known_by_their_first_bytes(data: bytes) -> None:
    assert detect(data, "chair.upload", None) == "zip"


def test_scenes_of_other_tools_are_refused_with_a_way_out() -> None:
    with pytest.raises(UnsupportedFormat) as caught:
        read_mesh(b'<?xml version="1.0"?><COLLADA/>', "chair.dae", "model/vnd.collada+xml")
    assert caught.value.code == "unsupported_format"
    assert "export GLB" in caught.value.suggestion


@pytest.mark.parametrize("sample", SAMPLES)
def test_samples_are_read_alike(sample: str) -> None:
    vertices, faces, _ = mesh_samples.ball()
    mesh = of(sample)
    assert (mesh.vertices.dtype, mesh.faces.dtype) == (np.float64, np.int64)
    assert np.allclose(mesh.vertices[mesh.faces[-80:]], vertices[faces], atol=1e-8)


@pytest.mark.parametrize("sample", SAMPLES)
def test_standing_still_answers_the_same_object(sample: str) -> None:
    mesh = of(sample)
    assert mesh.write(mesh.vertices.copy(), still(len(mesh.vertices))) is mesh.data


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_what_is_written_is_read(sample: str, precision: type) -> None:
    mesh = of(sample)
    new, linear = bend(mesh.vertices)
    again = read_mesh(mesh.write(new, linear.astype(precision)), "x." + mesh.format)
    assert np.array_equal(again.faces, mesh.faces)
    assert np.allclose(again.vertices, new, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("sample", SAMPLES)
def test_vertices_that_stay_keep_their_value_in_every_bit(sample: str) -> None:
    mesh = of(sample)
    new, linear, moved = bend_some(mesh.vertices)
    again = read_mesh(mesh.write(new, linear), "x." + mesh.format)
    assert np.array_equal(again.vertices[~moved], mesh.vertices[~moved])
    assert not np.isclose(again.vertices[moved], mesh.vertices[moved]).all(axis=1).any()


@pytest.mark.parametrize("sample", SAMPLES)
def test_moving_back_restores_the_positions(sample: str) -> None:
    mesh = of(sample)
    new, _ = bend(mesh.vertices)
    moved = read_mesh(mesh.write(new, still(len(new))), "x." + mesh.format)
    back = read_mesh(moved.write(mesh.vertices, still(len(new))), "x." + mesh.format)
    assert np.array_equal(back.vertices, mesh.vertices)


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e38])
def test_positions_that_no_file_holds_are_refused(sample: str, value: float) -> None:
    mesh = of(sample)
    new = mesh.vertices.copy()
    new[3, 1] = value
    with pytest.raises(ShapeError, match="overflow"):
        mesh.write(new, still(len(new)))


@pytest.mark.parametrize("sample", SAMPLES)
def test_truncated_files_are_told_apart_from_crashes(sample: str) -> None:
    data = SAMPLES[sample]
    for length in range(0, len(data), max(1, len(data) // 60)):
        mesh = attempt(read_mesh, data[:length], "x." + sample.partition("-")[0])
        if isinstance(mesh, ShapeError):
            assert mesh.detail
            assert mesh.suggestion
        else:
            # Text that ends early may still be a smaller mesh.
            assert sample.partition("-")[0] in ("obj", "ply", "stl", "off")
            assert b"\0" not in data
            assert 0 < len(mesh.faces) <= 82


@pytest.mark.parametrize("sample", SAMPLES)
@fuzz
@given(data=st.data())
def test_damaged_files_raise_shape_errors_alone(sample: str, data: st.DataObject) -> None:
    content = bytearray(SAMPLES[sample])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        piece = data.draw(st.one_of(st.binary(max_size=8), st.sampled_from(PIECES)))
        content[at : at + data.draw(st.integers(0, 12))] = piece
    mesh = attempt(read_mesh, bytes(content), "x." + sample.partition("-")[0])
    if isinstance(mesh, ShapeError):
        assert mesh.__cause__ is None, "a reader let damage through to the last resort"
        return
    written = attempt(mesh.write, *bend(mesh.vertices))
    if isinstance(written, ShapeError):
        assert written.code == "overflow"
        return
    # Damaged sizes may let a mesh fall into one point when it is stored.
    again = attempt(read_mesh, written, "x." + mesh.format)
    if isinstance(again, ShapeError):
        assert again.code in ("degenerate_mesh", "non_finite_vertices")
    else:
        assert len(again.faces) == len(mesh.faces)


# Text that a reader of one of the formats may take for something else than it is.
PIECES = [
    b"-1", b"0", b"999999999999", b"1e999", b"nan", b"-", b" ", b"\n", b"#", b"/", b"//", b"\\\n",
    b"null", b"[]", b"{}", b'""', b"true", b"1.5", b",", b"list uchar int", b"end_header\n",
    b"\0\0\0\0", b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\xef\xbb\xbf", b"v ", b"f ",
]  # fmt: skip


@pytest.mark.parametrize("format", READERS)
@fuzz
@given(content=st.binary(max_size=200))
def test_any_bytes_raise_shape_errors_alone(format: str, content: bytes) -> None:
    with pytest.raises(ShapeError) as caught:
        read_mesh(content, "x." + format)
    assert caught.value.__cause__ is None


@pytest.mark.parametrize("format", READERS)
def test_errors_name_the_format(format: str) -> None:
    with pytest.raises(InvalidMesh) as caught:
        read_mesh(b"v 1\nvertex 1\n", "x." + format)
    assert caught.value.code == f"malformed_{format}"
    assert format.upper() in caught.value.detail


def test_what_no_reader_foresees_is_malformed_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def reader(data: bytes) -> MeshFile:
        raise IndexError("index 7 is out of bounds")

    monkeypatch.setitem(READERS, "obj", reader)
    with pytest.raises(InvalidMesh, match=r"malformed_obj.*index 7") as caught:
        read_mesh(SAMPLES["obj"])
    assert isinstance(caught.value.__cause__, IndexError)


if REAL:

    @pytest.mark.parametrize("path", REAL, ids=lambda path: path.stem)
    def test_real_files_come_back_with_only_positions_moved(path: Path) -> None:
        data = path.read_bytes()
        mesh = read_mesh(data, path.name)
        area = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).area
        assert np.isclose(area, trimesh.load(path, force="mesh", process=False).area)
        new, linear, moved = bend_some(mesh.vertices)
        again = read_mesh(mesh.write(new, linear), path.name)
        size = np.ptp(new, axis=0).max()
        assert np.array_equal(again.faces, mesh.faces)
        assert np.abs(again.vertices - new).max() < 1e-6 * size
        assert np.array_equal(again.vertices[~moved], mesh.vertices[~moved])
