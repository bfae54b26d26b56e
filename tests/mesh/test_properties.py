"""What holds of every format, for any numbers in any of its vertices."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import pytest
from gltf_assets import unpack
from hypothesis import given
from hypothesis import strategies as st
from mesh_samples import SAMPLES, examples, still
from numpy.typing import NDArray

from service.mesh.formats import read_mesh
from service.mesh.meshfile import MeshFile

TEXT = ("obj", "ply-ascii", "stl-ascii", "off", "off-normals", "off-colours")
numbers = st.floats(-1e6, 1e6, width=32) | st.sampled_from([0.0, -0.0, 1e-30, 16777216.0])


def of(sample: str, data: bytes | None = None) -> MeshFile:
    return read_mesh(data or SAMPLES[sample], "ball." + sample.partition("-")[0])


def moved(mesh: MeshFile, rows: NDArray[np.int64], places: NDArray[np.float64]) -> bytes:
    new = mesh.vertices.copy()
    new[rows] = places
    return mesh.write(new, still(len(new)))


def pieces(sample: str, data: bytes) -> list[Any]:
    """A file's content in the smallest parts that a vertex may change: lines, or bytes."""
    if sample in TEXT:
        return data.split(b"\n")
    if sample == "gltf":
        uri = json.loads(data)["buffers"][0]["uri"]
        return list(base64.b64decode(uri.partition(",")[2]))
    return list(unpack(data)[2] if sample == "glb" else data)


def changed(sample: str, before: bytes, after: bytes) -> dict[int, Any]:
    one, two = pieces(sample, before), pieces(sample, after)
    return {i: b for i, (a, b) in enumerate(zip(one, two, strict=True)) if a != b}


@st.composite
def moves(draw: st.DrawFn) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Some of the 42 vertices, and where they go."""
    rows = draw(st.lists(st.integers(0, 41), min_size=1, max_size=6, unique=True))
    places = [[draw(numbers) for _ in range(3)] for _ in rows]
    return np.array(rows), np.array(places, np.float32).astype(np.float64)


@pytest.mark.parametrize("sample", SAMPLES)
@examples(15)
@given(move=moves())
def test_every_float32_is_written_and_read_exactly(sample: str, move: Any) -> None:
    rows, places = move
    mesh = of(sample)
    again = of(sample, moved(mesh, rows, places))
    expected = mesh.vertices.copy()
    expected[rows] = places
    # By corners: in STL vertices that meet become one.  Texts hold nine digits.
    found = again.vertices[again.faces].astype(np.float32)
    assert np.array_equal(found, expected[mesh.faces].astype(np.float32))


@pytest.mark.parametrize("sample", [name for name in SAMPLES if not name.startswith("stl")])
@examples(10)
@given(one=moves(), two=moves())
def test_a_vertex_changes_its_own_bytes_alone(sample: str, one: Any, two: Any) -> None:
    other = ~np.isin(two[0], one[0])
    rows, places = two[0][other], two[1][other]
    mesh = of(sample)
    first = changed(sample, mesh.data, moved(mesh, *one))
    second = changed(sample, mesh.data, moved(mesh, rows, places))
    both = moved(mesh, np.append(one[0], rows), np.concatenate([one[1], places]))
    assert not first.keys() & second.keys()
    assert changed(sample, mesh.data, both) == first | second
    assert len(first) <= len(one[0]) * (1 if sample in TEXT else 24)
