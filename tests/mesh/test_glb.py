from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from gltf_assets import BIN, JSON, Asset, pack, unpack
from mesh_samples import ball, bend, glb, still

from service.errors import InvalidMesh, TooLarge, UnsupportedFormat
from service.mesh import limits
from service.mesh.formats import read_mesh
from service.mesh.glb import read_chunks

VERTICES, FACES, _ = ball()
GLB = glb()
ROOT, TEXT, CHUNK = unpack(GLB)


def raised(data: bytes) -> InvalidMesh:
    with pytest.raises(InvalidMesh) as caught:
        read_mesh(data, "x.glb")
    return caught.value


def test_chunks_are_found() -> None:
    chunks = read_chunks(pack(b"{}", b"abcd", (0x1234, b"later")))
    assert [chunk.kind for chunk in chunks] == [JSON, BIN, 0x1234]
    assert [chunk.end - chunk.start for chunk in chunks] == [4, 4, 5]


def test_length_fields_fit_after_the_json_changed() -> None:
    mesh = read_mesh(GLB)
    written = mesh.write(mesh.vertices * 1.0001, still(len(VERTICES)))
    length, size = struct.unpack_from("<I", written, 8)[0], struct.unpack_from("<I", written, 12)[0]
    assert length == len(written)
    assert size % 4 == 0
    assert len(unpack(written)[2]) == len(CHUNK)


def test_unknown_chunks_and_trailing_bytes_ride_along() -> None:
    data = pack(TEXT, CHUNK, (0x58585858, b"extra chunk!"), (0x59, b"")) + b"after the end"
    mesh = read_mesh(data)
    assert mesh.write(mesh.vertices, still(len(VERTICES))) is data
    written = mesh.write(mesh.vertices + 1, still(len(VERTICES)))
    assert written.endswith(
        struct.pack("<II", 12, 0x58585858)
        + b"extra chunk!"
        + struct.pack("<II", 0, 0x59)
        + b"after the end"
    )
    assert struct.unpack_from("<I", written, 8)[0] == len(written) - len(b"after the end")
    assert np.allclose(read_mesh(written).vertices, VERTICES + 1)


def test_json_padded_with_zeros_is_read() -> None:
    data = pack(TEXT.rstrip() + b"\0" * 5, CHUNK)
    assert np.array_equal(read_mesh(data).vertices, VERTICES)


def test_odd_padding_of_the_binary_chunk_stays() -> None:
    root = json.loads(TEXT)
    root["buffers"][0]["byteLength"] = len(CHUNK)
    data = pack(json.dumps(root).encode(), CHUNK + b"\xaa\xbb\xcc\xdd" * 2)
    mesh = read_mesh(data)
    new, linear = bend(mesh.vertices)
    assert mesh.write(new, linear).endswith(b"\xaa\xbb\xcc\xdd" * 2)


def test_buffer_may_be_a_data_uri_in_a_glb() -> None:
    asset = Asset()
    position = asset.accessor(VERTICES.astype("<f4"))
    indices = asset.accessor(FACES.reshape(-1).astype("u1"))
    asset.node(mesh=asset.mesh({"attributes": {"POSITION": position}, "indices": indices}))
    data = pack(asset.gltf(), None)
    mesh = read_mesh(data)
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    assert np.array_equal(read_mesh(written).vertices, new.astype("<f4"))
    assert len(read_chunks(written)) == 1


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"glTF",
        GLB[:-1],
        GLB[:40],
        b"GLTF" + GLB[4:],
        struct.pack("<4sII", b"glTF", 2, 12),
        GLB[:12] + struct.pack("<II", len(TEXT), BIN) + GLB[20:],
        GLB[:12] + struct.pack("<I", 1 << 31) + GLB[16:],
        pack(TEXT, None),
        pack(TEXT, CHUNK[:-4]),
        pack(b"{}", CHUNK).replace(b"{}", b"{ "),
    ],
)
def test_broken_containers_are_malformed(data: bytes) -> None:
    assert raised(data).code == "malformed_glb"


def test_a_document_of_nothing_is_empty() -> None:
    assert raised(pack(b"{}", CHUNK)).code == "empty_mesh"


def test_first_version_is_unsupported() -> None:
    with pytest.raises(UnsupportedFormat, match="gltf_version"):
        read_mesh(GLB[:4] + struct.pack("<I", 1) + GLB[8:])


def test_chunks_without_end_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    data = pack(TEXT, CHUNK, *[(0x59, b"")] * 3)
    monkeypatch.setattr(limits, "PARTS", 5)
    read_chunks(data)
    monkeypatch.setattr(limits, "PARTS", 4)
    with pytest.raises(TooLarge, match="too_many_parts"):
        read_chunks(data)
